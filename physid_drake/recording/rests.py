"""Where a tracked body does not move: what the noise and the start pose are read from."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy import stats

from physid_drake.recording.clocks import samples_within
from physid_drake.recording.values import Array, PoseStream

Flags = npt.NDArray[np.bool_]

REST_SPEED: Final = 5e-4
"""Below this speed in m/s, smoothed over a quarter of a second, a body is taken to be at rest."""

REST_TURN_RATE: Final = 0.01
"""The same for its yaw, in rad/s."""

REST_WINDOW: Final = 0.25
SHORTEST_REST: Final = 10
TO_STD: Final = 1.4826
"""From the median of absolute deviations to the standard deviation of a normal distribution."""

CREEP: Final = 6.0
"""A line through a rest may rise by so many deviations of what scatters about it; slow noise does by three."""

LONG: Final = 0.5
"""In s: of a shorter rest, slow noise and creeping cannot be told apart."""

BEND: Final = 0.02
"""In s: the noise's memory is read from second differences over so long. Motion bends little within it."""

QUIET_SHARE: Final = 0.35
"""Of the second differences are surely without motion. As much of normal noise is within 0.454 deviations."""

GROWTH: Final = 1.3
"""From one length to the next at which a rest is asked whether it still is one."""

MOST_BLOCKS: Final = 300
"""Of a rest are looked at: their median tells what scatters, and no log of hours takes longer."""

FEWEST_IN_BLOCK: Final = 3
"""Samples, of which fewer show no scatter; so seldom seen, a block is longer than ``LONG``."""

_KEPT: Final = "_rests"
_LIMITS: Final = np.array([REST_SPEED, REST_SPEED, REST_TURN_RATE])


def rests_of(stream: PoseStream) -> list[slice]:
    """Slices of a stream in which the body does not move, each of at least ten samples.

    Windows of a quarter of a second find motion that rises above the noise within them. What is slower than that, a
    push at some millimetres per second, shows over a longer time: a rest that creeps is cut to the part before the
    creeping begins, or after it has ended. Noise that is slow itself looks like motion within a window: a stream that
    does not seem to rest at both of its ends is looked at again, with as much of it as its bends show. A slide that
    ends would pass for such noise, but does not stay where it was.
    """
    # A stream is frozen, and asked for its rests by all that looks at it.
    if _KEPT not in vars(stream):
        vars(stream)[_KEPT] = tuple(_find_rests(stream))
    return list(vars(stream)[_KEPT])


def _find_rests(stream: PoseStream) -> list[slice]:
    count = len(stream)
    if count < 2 * SHORTEST_REST:
        return []
    found = _rests(stream.times, stream.planar, slow=False)
    if found and found[0].start == 0 and found[-1].stop == count:
        return found
    again = [r for r in _rests(stream.times, stream.planar, slow=True) if _stays(stream.times[r], stream.planar[r])]
    return max((found, again), key=lambda rests: sum(rest.stop - rest.start for rest in rests))


def _rests(times: Array, planar: Array, *, slow: bool) -> list[slice]:
    """Slices in which nothing moves or creeps, the noise taken as white, or as slow as it seems."""
    found: list[slice] = []
    for rest in _still(times, planar, slow=slow):
        found += _without_creep(times, planar, rest)
    return found


def _still(times: Array, planar: Array, *, slow: bool) -> list[slice]:
    """Slices whose windows show no motion."""
    interval = float(np.median(np.diff(times)))
    half = min(max(3, samples_within(0.5 * REST_WINDOW, interval, len(times))), len(times) // 3)
    still = np.ones(len(times) - 2 * half + 1, dtype=np.bool_)
    averages, centres = _means(planar, half), _means(times[:, None], half)[:, 0]
    spans = centres[half:] - centres[:-half]
    changes = np.abs(averages[half:] - averages[:-half])
    for columns, limit in (([0, 1], REST_SPEED), ([2], REST_TURN_RATE)):
        values = planar[:, columns]
        noise = _slow_noise(values, half, interval) if slow else _white_noise(values, half)
        allowed = limit * spans + 4.0 * noise
        still &= (changes[:, columns] <= allowed[:, None]).all(axis=1)
    return _runs(still, half, len(times))


def _means(values: Array, count: int) -> Array:
    """Means of so many neighbours (n - count + 1, k) of values (n, k), less the first value."""
    sums = np.cumsum(np.vstack([np.zeros(values.shape[1]), values - values[0]]), axis=0)
    means: Array = (sums[count:] - sums[:-count]) / count
    return means


def _white_noise(values: Array, half: int) -> float:
    """Standard deviation of a change between the means of two windows, if the noise of values (n, k) is white."""
    # Second differences see the noise and not the motion.
    bends = np.abs(np.diff(values, n=2, axis=0))
    return float(TO_STD * np.median(bends) / np.sqrt(6.0) * np.sqrt(2.0 / half))


def _slow_noise(values: Array, half: int, interval: float) -> float:
    """The same if it is an autoregressive process of first order, whose memory second differences at two lags tell.

    At lag L they have the variance 2 (1 - r) (3 - r), with r the correlation over L samples, times that of the noise.
    """
    lag = min(max(2, samples_within(BEND, interval, len(values))), (len(values) - 1) // 4)
    near, far = (
        np.quantile(np.abs(values[2 * k :] - 2.0 * values[k:-k] + values[: -2 * k]), QUIET_SHARE) for k in (1, lag)
    )
    if near == 0.0:
        return _white_noise(values, half)
    correlations = np.linspace(0.0, 0.98, 99)

    def variance(r: Array) -> Array:
        return 2.0 * (1.0 - r) * (3.0 - r)

    ratios = variance(correlations**lag) / variance(correlations)
    best = int(np.argmin(np.abs(ratios - (far / near) ** 2)))
    sigma = near / stats.norm.ppf(0.5 + 0.5 * QUIET_SHARE) / np.sqrt(variance(correlations[best]))
    # How often each lag is between a sample of one window and one of the other, or of the same.
    lags = np.arange(1, 2 * half)
    weights = np.where(lags <= half, 2 * half - 3 * lags, lags - 2 * half)
    spread = 2.0 * (half + float(weights @ correlations[best] ** lags)) / half**2
    return float(sigma * math.sqrt(max(spread, 0.0)))


def _runs(still: Flags, half: int, count: int) -> list[slice]:
    """Slices whose windows are all still; a window that starts at k covers samples k to k + 2 half - 1."""
    # Motion fills every window that touches it; an unrest that is over sooner is correlated noise.
    for first, beyond in _edges(~still):
        if beyond - first < half and first > 0 and beyond < len(still):
            still[first:beyond] = True
    found: list[slice] = []
    for first, beyond in _edges(still):
        # Only the middle of a still window is surely still, unless the stream begins or ends there.
        start = 0 if first == 0 else first + half
        stop = count if beyond == len(still) else beyond - 1 + half
        if stop - start >= SHORTEST_REST:
            found.append(slice(start, stop))
    return found


def _edges(flags: Flags) -> list[tuple[int, int]]:
    """First and one past the last index of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def _without_creep(times: Array, planar: Array, rest: slice) -> list[slice]:
    """A rest as it is; or what of it is one at the ends of the stream; nothing of one in between."""
    t, p = times[rest], planar[rest]
    if not _creeps(t, p):
        return [rest]
    found = []
    if rest.start == 0 and (kept := _before_creep(t, p)) is not None:
        found.append(slice(0, kept))
    if rest.stop == len(times) and (kept := _before_creep(-t[::-1], p[::-1])) is not None:
        found.append(slice(rest.stop - kept, rest.stop))
    return found


def _creeps(times: Array, planar: Array) -> bool:
    """Whether a line through poses (n, 3) rises by more than rest and slow noise allow.

    What scatters is seen within short blocks: about a line through all of a slow push, the push itself does. A line
    through more of them is surer, and a rest ends where it began, however long it is.
    """
    span = float(times[-1] - times[0])
    if span < LONG:
        return False
    design = np.column_stack([np.ones(len(times)), (times - times[0]) / span])
    line, *_ = np.linalg.lstsq(design, planar, rcond=None)
    count = max(3, min(int(span / LONG), len(planar) // FEWEST_IN_BLOCK))
    scatter = _block_scatter(planar, count) * min(1.0, math.sqrt(4.0 * LONG / span))
    return bool((np.abs(line[1]) > CREEP * scatter + _LIMITS * min(span, LONG)).any())


def _block_scatter(planar: Array, count: int) -> Array:
    """Median of the standard deviations (3,) of poses (n, 3) within so many blocks of about equal size."""
    size, longer = divmod(len(planar), count)
    looked_at = np.arange(0, count, -(-count // MOST_BLOCKS))
    starts = looked_at * size + np.minimum(looked_at, longer)
    stops = starts + size + (looked_at < longer)
    spreads = [planar[a:b].std(axis=0) for a, b in zip(starts.tolist(), stops.tolist(), strict=True)]
    return np.asarray(np.median(spreads, axis=0))


def _stays(times: Array, planar: Array) -> bool:
    """Whether the last third of a rest is where the first is, by what the quietest third scatters."""
    thirds = np.array_split(planar, 3)
    away = np.abs(thirds[-1].mean(axis=0) - thirds[0].mean(axis=0))
    scatter = np.min([third.std(axis=0) for third in thirds], axis=0)
    return bool((away <= CREEP * scatter + _LIMITS * min(float(times[-1] - times[0]), LONG)).all())


def _before_creep(times: Array, planar: Array) -> int | None:
    """How many samples of a rest that creeps at last are before that; None if too few."""
    count = SHORTEST_REST
    while count < len(times) and not _creeps(times[:count], planar[:count]):
        count = min(len(times), max(count + 1, int(GROWTH * count)))
    corner = _corner(times[:count], planar[:count])
    return corner if corner >= SHORTEST_REST else None


def _corner(times: Array, planar: Array) -> int:
    """Index at which poses (n, 3) begin to move: of the constants that turn into lines, the one that fits best."""
    noise = TO_STD * np.median(np.abs(np.diff(planar, n=2, axis=0)), axis=0) / np.sqrt(6.0)
    scaled = planar / np.maximum(noise, 1e-3 * _LIMITS)
    best, least = 0, np.inf
    for k in range(0, len(times) - 2, max(1, len(times) // 60)):
        design = np.column_stack([np.ones(len(times)), np.maximum(times - times[k], 0.0)])
        solution, *_ = np.linalg.lstsq(design, scaled, rcond=None)
        misfit = float(((scaled - design @ solution) ** 2).sum())
        if misfit < least:
            best, least = k, misfit
    return best
