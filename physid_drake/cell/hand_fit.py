"""The path behind recorded streams of a hand: few knots, and a shape for the ramps of speed between them.

A recorded path is not a polygon: linear interpolation of 0.05 mm of noise at 100 Hz is 7 mm/s of velocity
noise, on which the object bounces, and smoothing splines overshoot at the brake and throw it. Few straight pieces
of a smooth ramp are off by some percent of the speed at which the object is let go, and bias its friction by as much.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from physid_drake.cell.hand_curves import SmoothFit, StraightFit
from physid_drake.cell.hand_path import HandPath, PathError
from physid_drake.cell.path_errors import path_errors

Array = NDArray[np.float64]

SMALLEST_STD = 2e-5  # m: a stream recorded without noise is still sampled and rounded
SURE = 10.0  # of the criterion, in all streams: smooth ramps must be that much better
MOST = 20.0  # what one stream may say for or against them; one of a smooth robot that says more keeps straight ones
VOTERS = 12  # about so many streams of a robot are asked
FAST = 0.3  # of a stream's largest speed: samples that show whether time stamps are late or early
STILL = 1e-9  # m/s: of a hand that does not move
FEWEST_FAST = 40  # of them
ROUNDS = 3  # of fits, until they show no jitter that is so much
LARGER = 1.1  # times as large as the one that they were made with
NOTABLE = 1.3  # times as far off along the way as across it
MEDIAN_OF_NORMAL = 0.6745  # of the absolute value, over the standard deviation
DIFFERENCES = (3, 5)  # orders that show a stream's noise
LONG = 12  # samples, of which fifth differences are enough to tell

# Speeds s(x) from 0 to 1 over a ramp, x from 0 to 1: limited jerk, and least jerk (Flash and Hogan 1985).
SMOOTH_RAMPS: Final = (Polynomial([0, 0, 3, -2]), Polynomial([0, 0, 0, 10, -15, 6]))


def fit_uncertain_paths(
    streams: Sequence[tuple[Array, Array]], std: float | None, *, least: float, memory: float = 0.0
) -> tuple[tuple[HandPath, tuple[PathError, ...]], ...]:
    """The paths with the fewest knots that explain the streams of one robot.

    Knots are added where they explain most (orthogonal matching pursuit over all sample times), moved to
    where they fit best, and taken away again while the Bayesian information criterion falls. Where time stamps are
    late or early, fast samples count for less. The same criterion, summed over all streams, tells whether the robot's
    ramps of speed are straight or smooth.

    Args:
        streams: per push times (n,) [s], n >= 2, and positions (n, 2) [m].
        std: standard deviation of one position [m]; None estimates it from differences (``stream_std``).
        least: errors that move the hand by less [m] are left out.
        memory: correlation time of the noise [s], a first-order autoregressive process; 0 is white.

    Returns:
        Per push its path and the independent errors that the noise of its stream lets it have. Of a stream of fewer
        than six samples none are known.
    """
    fits = _fits_of(streams, std, memory)
    errors = {k: path_errors(fit, float(streams[k][0][0]), least) for k, fit in fits.items()}
    return tuple((_path_of(fits.get(k), stream), errors.get(k, ())) for k, stream in enumerate(streams))


def _path_of(fit: StraightFit | None, stream: tuple[Array, Array]) -> HandPath:
    return _polygon_path(*stream) if fit is None else fit.path(float(stream[0][0]))


def _fits_of(streams: Sequence[tuple[Array, Array]], std: float | None, memory: float) -> dict[int, StraightFit]:
    """Of the streams that are long enough, by their number."""
    best = {k: _fit_of(*stream, std, memory) for k, stream in enumerate(streams) if len(stream[0]) >= 6}
    best = _with_jitter(best)
    ramped = [fit for fit in best.values() if len(fit.knots) > 1]  # others have no ramps to judge
    asked = ramped[:: max(1, len(ramped) // VOTERS)]
    votes = [sum(_vote(fit, SmoothFit(fit, ramp)) for fit in asked) for ramp in SMOOTH_RAMPS]
    if max(votes) > SURE:
        ramp = SMOOTH_RAMPS[int(np.argmax(votes))]
        best = {k: _smoother(fit, ramp) for k, fit in best.items()}
    return best


def _with_jitter(exact: dict[int, StraightFit]) -> dict[int, StraightFit]:
    """Fits to streams whose stamps are late or early, as far as they show it; the same ones where they do not."""
    best, believed = exact, 0.0
    # Fits that take stamps for exact follow a part of the jitter, and show the less of it.
    for _ in range(ROUNDS):
        jitter = _jitter_of(list(best.values()))
        if jitter <= LARGER * believed:
            break
        best, believed = {k: fit.with_jitter(jitter) for k, fit in exact.items()}, jitter
    return best


def _jitter_of(fits: Sequence[StraightFit]) -> float:
    """Standard deviation of the time stamps [s]: what fast samples are off by along their way more than across it."""
    along, across = [np.empty(0)], [np.empty(0)]
    for fit in fits:
        velocities = fit.velocities()
        fast = np.abs(velocities) > max(FAST * np.abs(velocities).max(), STILL)
        turned = fit.residuals()[fast] * np.conj(velocities[fast])  # a velocity as x + iy: parts along it and across
        along.append(turned.real / np.abs(velocities[fast]) ** 2)
        across.append(turned.imag / np.abs(velocities[fast]) ** 2)
    late, beside = np.concatenate(along), np.concatenate(across)
    if len(late) < FEWEST_FAST:
        return 0.0
    own, other = (float(np.median(np.abs(values))) / MEDIAN_OF_NORMAL for values in (late, beside))
    return math.sqrt(own**2 - other**2) if own > NOTABLE * other else 0.0


def _vote(straight: StraightFit, smooth: StraightFit) -> float:
    """By how much smooth ramps are better for a stream; one that is stuck in a bad fit does not decide."""
    return float(np.clip(straight.criterion - smooth.criterion, -MOST, MOST))


def _smoother(straight: StraightFit, ramp: Polynomial) -> StraightFit:
    """A smooth robot's stream: smooth ramps, unless the hand has none or straight ones are much better."""
    smooth = SmoothFit(straight, ramp)
    return smooth if len(smooth.knots) > 1 and _vote(straight, smooth) > -MOST else straight


def _fit_of(times: Array, positions: Array, std: float | None, memory: float) -> StraightFit:
    sigma = max(std if std is not None else stream_std(times, positions), SMALLEST_STD)
    return StraightFit(times - times[0], positions, np.full(len(times), sigma), memory)


def stream_std(times: Array, positions: Array) -> float:
    """Noise of a stream, times (n,) [s] and positions (n, 2) [m], from high differences, which a path hardly has.

    The least of what third and, of long streams, fifth differences say, the samples taken as they are stamped and as
    evenly spaced: at few samples a second, third ones have the path's own jerk, and stamps may be uneven or late.
    """
    orders = DIFFERENCES if len(times) >= LONG else DIFFERENCES[:1]
    even = np.arange(len(times), dtype=np.float64)
    return min(_rough(when, positions, order) for order in orders for when in (times, even))


def _rough(times: Array, positions: Array, order: int) -> float:
    """Standard deviation of white noise that makes the divided differences (n - order, 2) of a stream.

    Where not a digit changes, the hand was held, or its last sample repeated: that says nothing of its noise.
    """
    windows, places = (sliding_window_view(values, order + 1, axis=0) for values in (times, positions))
    alive = (np.ptp(places, axis=2) > 0.0).any(axis=1)
    if not alive.any():
        return 0.0
    windows, places = windows[alive], places[alive]
    gaps = windows[:, :, None] - windows[:, None, :] + np.eye(order + 1)
    weights = 1.0 / np.prod(gaps / np.ptp(windows, axis=1)[:, None, None], axis=2)
    weights /= np.linalg.norm(weights, axis=1, keepdims=True)
    differences = np.einsum("ij,ikj->ik", weights, places)
    return float(np.median(np.abs(differences)) / MEDIAN_OF_NORMAL)


def _polygon_path(times: Array, positions: Array) -> HandPath:
    """Constant velocity between few samples; a knot pair at each corner keeps the velocity a function."""
    knots, velocities = [], []
    for k in range(len(times) - 1):
        v = (positions[k + 1] - positions[k]) / (times[k + 1] - times[k])
        knots += [times[k] + (1e-6 if k else 0.0), times[k + 1]]
        velocities += [v, v]
    return HandPath(times=np.array(knots), velocities=np.array(velocities), start=positions[0].copy())
