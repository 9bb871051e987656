"""The noise of a stream from its rests: standard deviation and correlation in time, each rest's mean unknown."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from physid_drake.recording.values import Array

# Of the correlation from one sample to the next: its logit, and that one's prior, which is weak; a short rest cannot
# tell slow noise from none.
LOGITS = np.linspace(-5.0, 5.5, 43)
LOGIT_PRIOR = -0.5 * ((LOGITS + 1.5) / 2.0) ** 2
LONGEST = 60  # samples of a rest that are looked at together
CLOSEST = 0.5  # intervals: samples that are stamped closer together come from bursts, or from two clocks
UNCORRELATED = 0.02  # from sample to sample
FEWEST = 10  # samples of a rest that tells a noise, if with much doubt
MOST_RESTS = 2000  # more tell nothing more
SILENT = 0.1  # of the finest: a rest that is quieter than that tells no noise


@dataclass(frozen=True, kw_only=True)
class SeenNoise:
    """What rests tell of a stream's noise.

    Attributes:
        std: standard deviation [m or rad].
        correlation_time: of a first-order autoregressive process [s]; 0 is white.
        doubt: standard deviation of the logarithm of the variance [-].
    """

    std: float
    correlation_time: float
    doubt: float


def seen_noise(pieces: Sequence[tuple[Array, Array]], finest: float) -> SeenNoise | None:
    """The noise of rests (times, values), each with its mean.

    Posterior means of the logarithm of the variance and of the logit of the correlation, over a grid of the latter,
    for each point of which the variance has an inverse gamma distribution. The restricted likelihood is that with the
    means integrated out (Harville 1974).

    Args:
        pieces: rests.
        finest: the least standard deviation.

    Returns:
        None where the rests are too few, or silent: a coarse or filtered stream that stands still tells no noise.
    """
    rests = [(t[:LONGEST], v[:LONGEST]) for t, v in pieces if len(t) >= FEWEST]
    rests = rests[:: max(1, -(-len(rests) // MOST_RESTS))]
    if not rests:
        return None
    interval = float(np.median([usual_interval(t) for t, _ in rests]))
    spread = math.sqrt(float(np.mean([np.var(v) for _, v in rests])))
    if spread < SILENT * finest:
        return None
    correlations = special.expit(LOGITS)
    told = np.array([_restricted(rests, interval, rho) for rho in correlations])  # (grid, 2)
    half = 0.5 * sum(len(t) - 1 for t, _ in rests)
    log_squares = np.log(0.5 * told[:, 0])
    weights = special.softmax(LOGIT_PRIOR - 0.5 * told[:, 1] - half * log_squares)
    log_variance = log_squares - float(special.digamma(half))
    mean = float(weights @ log_variance)
    doubt = math.sqrt(float(weights @ (log_variance - mean) ** 2) + float(special.polygamma(1, half)))
    rho = float(special.expit(weights @ LOGITS))
    constant = -interval / math.log(rho) if rho > UNCORRELATED else 0.0
    return SeenNoise(std=max(math.exp(0.5 * mean), finest), correlation_time=constant, doubt=doubt)


def usual_interval(times: Array) -> float:
    """Between samples at times (n,), n >= 3 [s]: half of the median over two, which may have come together."""
    return 0.5 * float(np.median(times[2:] - times[:-2]))


def apart(times: Array, interval: float) -> Array:
    """Times (n,) [s], put at least half an interval from one another.

    What little noise two samples at nearly one time do not share is no process' that is seen once in an interval:
    by their stamps, twins that differ would need any variance.
    """
    steps = np.diff(times)
    least = CLOSEST * interval
    if (steps >= least).all():
        return times
    spread: Array = times[0] + np.cumsum(np.append(0.0, np.maximum(steps, least)))
    return spread


def _restricted(rests: Sequence[tuple[Array, Array]], interval: float, rho: float) -> tuple[float, float]:
    """Squares of rests (times, values), whitened and less their means, and the log determinant, at unit variance."""
    squares = log_determinant = 0.0
    for times, values in rests:
        spread = apart(times, usual_interval(times))
        gaps = np.abs(spread[:, None] - spread[None, :]) / interval
        lower = np.linalg.cholesky(rho**gaps + 1e-9 * np.eye(len(times)))
        white = np.linalg.solve(lower, np.column_stack([values, np.ones(len(values))]))
        ones = float(white[:, 1] @ white[:, 1])
        residual = white[:, 0] - white[:, 1] * float(white[:, 1] @ white[:, 0]) / ones
        squares += float(residual @ residual)
        log_determinant += 2.0 * float(np.log(np.diag(lower)).sum()) + math.log(ones)
    return squares, log_determinant
