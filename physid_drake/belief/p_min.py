"""P_min, the probability of each candidate to be the minimiser, from samples of the function."""

from typing import Any

import numpy as np
import numpy.typing as npt

from physid_drake.errors import ParameterError
from physid_drake.space import Array

_LEAST_EFFECTIVE_SHARE = 0.1


def estimate_p_min(samples: npt.NDArray[np.floating[Any]]) -> Array:
    """Fraction of sampled functions whose lowest value is at each candidate.

    Args:
        samples: Function values (s, n): s draws of the error at n candidates, any unit.

    Returns:
        Probabilities (n,) that sum to 1, in steps of 1/s.

    Raises:
        ParameterError: When `samples` is not a non-empty matrix.

    Source: Zhu, Kimmel, Boularias, "Information-theoretic Model Identification and Policy Search using
        Physics Engines", section III.B, the Monte Carlo estimate of P_min.
    """
    if samples.ndim != 2 or samples.size == 0:
        raise ParameterError(f"estimate_p_min: samples are (s, n), s and n > 0, but got {samples.shape}.")
    counts = np.bincount(np.argmin(samples, axis=1), minlength=samples.shape[1])
    return np.asarray(counts / samples.shape[0])


def entropy_terms(p: Array) -> Array:
    """The contributions -p log p (n,) in nats of probabilities p (n,); 0 where p is 0."""
    positive = p > 0.0
    return np.where(positive, -p * np.log(np.where(positive, p, 1.0)), 0.0)


def entropy(p: Array) -> float:
    """Entropy in nats of probabilities p (n,): 0 when one is certain, log(n) when all are equal."""
    return float(entropy_terms(p).sum())


def weigh_p_min(p: Array, log_weights: Array) -> tuple[Array, float]:
    """Multiplies P_min with the candidates' prior weights, as far as the samples can carry it.

    Every sampled function is given the weight of its minimiser, which is importance sampling: p(E) becomes
    p(E) P_t(argmin E). A prior much narrower than P_min would leave the weight on one or two of the samples,
    whose entropy of about zero means nothing; the weights are then raised to the greatest power <= 1 that
    leaves an effective sample size of a tenth of the samples. Equal weights change nothing, bit for bit.

    Args:
        p: P_min (n,) under equal weights.
        log_weights: Logarithms of the prior weights (n,), up to a constant.

    Returns:
        The weighted P_min (n,) and the power that was used.
    """
    seen = np.flatnonzero(p)
    logs = log_weights[seen] - log_weights[seen].max()
    if np.all(logs == 0.0):
        return p, 1.0
    power = _greatest_power(p[seen], logs)
    weighted = np.zeros_like(p)
    weighted[seen] = p[seen] * np.exp(power * logs)
    return weighted / weighted.sum(), power


def _greatest_power(p: Array, logs: Array) -> float:
    """Bisects for the power at which the effective share of the samples falls to the least allowed."""

    def enough(power: float) -> bool:
        w = np.exp(power * logs)
        return bool((p @ w) ** 2 >= _LEAST_EFFECTIVE_SHARE * (p @ w**2))

    if enough(1.0):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if enough(middle) else (low, middle)
    return low
