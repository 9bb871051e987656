"""Finds where a tracked stream lost track, jumped, stalled or paused; leaves out only what cannot be a pose.

Left out: rows whose place is all zeros (a tracker's way of saying "lost"), samples that leap away and come straight
back, the repeats of a tracker that is slower than the log, and what lies beyond a leap of the object that nothing on
a table does. Kept and reported: gaps, stalls that the tracker caught up from, other leaps that stay.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

GAP_FACTOR: Final = 5.0
"""A pause longer than this many median sample intervals is a gap."""

STALL_SAMPLES: Final = 5
"""More samples than this with exactly the same pose can be a stall."""

LEAP_FACTOR: Final = 5.0
"""A leap is this much longer than nine tenths of the stream's steps, and than the steps beside it."""

FEWEST_STEPS: Final = 3
"""From value to value that show a grid: a leap away and back makes two."""

GRID_FACTOR: Final = 1.5
"""A leap is this much longer than a step of the grid that a stream was rounded to: slow motion goes by such steps."""

HELD: Final = 1.5
"""A tracker that is slower than the log shows each of its poses so many times or more, on the average."""

FEWEST_HELD: Final = 10
"""Poses of such a tracker: what rests without noise has fewer."""

MOST_HELD: Final = 0.8
"""Share of its poses that are shown so often; the others are those of rests, which repeat for longer."""

PLATEAU: Final = 2.0
"""Times the steps of what is lost meanwhile: so large are those there and back."""

LONGEST_LEAP: Final = 0.1
"""From before a leap to after it [s]: what is away for longer may have been there."""

SHORTEST_SCREENED: Final = 25
"""Streams shorter than this have too few steps to tell a leap from motion."""

MOST_BRAKE: Final = 40.0
"""Deceleration [m/s^2] that a table has for no object: four times that of a friction of 1."""

LEAST_SWAP: Final = 5e-3
"""A leap of the object that stays and is shorter [m] may be its tracker's noise."""

LONG_STEP: Final = 10.0
"""In s between samples: with that brake an object comes 2 km meanwhile, which is no leap of any."""

FEW: Final = 11
"""Poses at either end of what lies between such leaps, whose median tells where the object was."""

NOTABLE_TURN: Final = 5.0
"""Degrees of a leap that are said."""

PUSHED: Final = 0.2
"""Of the furthest way of an object between such leaps: where it goes less far, it rests."""

MOST_SAID: Final = 20
"""Lines for one stream of one kind: a stream with more is broken, and its reader need not be told where each time."""

_ARM: Final = 0.05
_SMALLEST_LEAP: Final = 1e-5


@dataclass(frozen=True, kw_only=True)
class Screened:
    """Which samples (n,) to keep, and one line of warning for each thing found."""

    keep: Flags
    warnings: tuple[str, ...]


def describe_rows(rows: Sequence[int]) -> str:
    """``"row 7"`` or ``"rows 7-9, 12"``; at most eight ranges are spelt out."""
    ranges: list[list[int]] = []
    for row in rows:
        if ranges and row == ranges[-1][1] + 1:
            ranges[-1][1] = row
        else:
            ranges.append([row, row])
    texts = [f"{first}" if first == last else f"{first}-{last}" for first, last in ranges[:8]]
    more = f" and {len(ranges) - 8} more places" if len(ranges) > 8 else ""
    return f"{'row' if len(rows) == 1 else 'rows'} {', '.join(texts)}{more}"


def find_gaps(times: Array) -> npt.NDArray[np.intp]:
    """Indices k of the samples whose successor comes after a gap, for times (n,) in s."""
    if len(times) < 4:
        return np.zeros(0, dtype=np.intp)
    intervals = np.diff(times)
    return np.flatnonzero(intervals > GAP_FACTOR * np.median(intervals))


def screen_poses(
    times: Array, positions: Array, quaternions: Array, rows: Sequence[int], what: str, *, turned: bool = True
) -> Screened:
    """Screens one stream of poses.

    Args:
        times: (n,) in s, increasing.
        positions: (n, 3) in m.
        quaternions: (n, 4), w first; a lost body's may be all zeros.
        rows: n row numbers for the messages.
        what: "object" or "hand", for the messages.
        turned: whether the quaternions were recorded. A lost body is at the origin: with a quaternion of zeros, or at
            another height than elsewhere.

    Returns:
        Which of the n samples to keep, and the warnings.
    """
    warnings: list[str] = []
    at_origin = (positions == 0.0).all(axis=1)
    lost = at_origin & bool((positions[:, 2] != 0.0).any())
    if turned:
        lost |= at_origin & (quaternions == 0.0).all(axis=1)
    if lost.any():
        lost_rows = [rows[k] for k in np.flatnonzero(lost).tolist()]
        warnings.append(f"{what}: {describe_rows(lost_rows)}: track lost (all zeros), left out.")
    tracked = np.flatnonzero(~lost)
    repeats = find_repeats(positions[tracked], quaternions[tracked])
    if repeats.any():
        shown = len(repeats) / float((~repeats).sum())
        warnings.append(
            f"{what}: each pose is shown {shown:.2g} times, by a tracker slower than the log; repeats left out."
        )
    tracked = tracked[~repeats]
    times, positions, quaternions = times[tracked], positions[tracked], quaternions[tracked]
    leaps, lone = _find_leaps(times, positions, quaternions)
    stalls = _find_stalls(positions, quaternions)
    caught_up = {last for _, last in stalls}
    lone = [k for k in lone if k not in caught_up]
    swaps = _find_swaps(times, positions, quaternions, lone) if what == "object" else []
    part = _part_that_moves(positions, quaternions, swaps)
    keep = np.zeros(len(lost), dtype=np.bool_)
    keep[tracked[part]] = True
    for first, last in leaps:
        keep[tracked[first : last + 1]] = False
    numbers = [rows[k] for k in tracked.tolist()]
    # Of what lies beyond the part that is kept, only its edges are said.
    said = range(part.start - 1, part.stop)
    leap_words = [_leap_words(positions, quaternions, numbers, *leap) for leap in leaps if leap[0] in said]
    stall_words = [_stall_words(numbers, *stall) for stall in stalls if stall[0] in said]
    lone_words = [_lone_words(positions, quaternions, numbers, k, part, set(swaps)) for k in lone if k in said]
    for words in (leap_words, stall_words, lone_words):
        warnings += _few(f"{what}: {word}" for word in words)
    warnings += gap_warnings(times[part], numbers[part], what)
    return Screened(keep=keep, warnings=tuple(warnings))


def _few(lines: Iterable[str]) -> list[str]:
    """The first of lines that are alike, and how many more there are."""
    every = list(lines)
    more = len(every) - MOST_SAID
    return (
        every if more <= 0 else [*every[:MOST_SAID], f"{every[0].partition(':')[0]}: {more} more of the same kind."]
    )


def _leap_words(positions: Array, quaternions: Array, rows: Sequence[int], first: int, last: int) -> str:
    far = _how_far(positions, quaternions, first - 1)
    return f"{describe_rows(rows[first : last + 1])}: jumps {far} away and comes straight back, left out."


def _stall_words(rows: Sequence[int], first: int, last: int) -> str:
    return f"rows {rows[first]}-{rows[last]}: stalls (same pose {last - first + 1} times, then catches up), kept."


def _lone_words(
    positions: Array, quaternions: Array, rows: Sequence[int], k: int, part: slice, swaps: Collection[int]
) -> str:
    beyond = "before" if k < part.start else "after"
    fate = f"; what comes {beyond} is left out" if k in swaps else ", kept"
    return f"row {rows[k + 1]}: jumps {_how_far(positions, quaternions, k)} and stays there{fate}."


def gap_warnings(times: Array, rows: Sequence[int], what: str) -> list[str]:
    """One line for each gap in times (n,) in s, whose samples stand at ``rows``."""
    gaps: list[int] = find_gaps(times).tolist()
    return _few(f"{what}: rows {rows[k]}-{rows[k + 1]}: gap of {times[k + 1] - times[k]:.3g} s, kept." for k in gaps)


def _distances(positions: Array, quaternions: Array, first: slice, second: slice) -> Array:
    """Distance between two rows of poses; a rotation counts as the travel of a point 50 mm away."""
    travel = np.linalg.norm(positions[second] - positions[first], axis=1)
    cosine = np.abs((quaternions[second] * quaternions[first]).sum(axis=1))
    angle = 2.0 * np.arccos(np.clip(cosine, 0.0, 1.0))
    # arccos loses half the digits near 1: an angle below 1e-6 is rounding.
    distances: Array = travel + _ARM * np.where(angle > 1e-6, angle, 0.0)
    return distances


def _how_far(positions: Array, quaternions: Array, k: int) -> str:
    """The leap after sample k in words."""
    distance = np.linalg.norm(positions[k + 1] - positions[k])
    cosine = min(1.0, abs(float(quaternions[k + 1] @ quaternions[k])))
    angle = math.degrees(2.0 * math.acos(cosine))
    return f"{distance:.3g} m" + (f" and {angle:.0f} degrees" if angle > NOTABLE_TURN else "")


def _find_leaps(times: Array, positions: Array, quaternions: Array) -> tuple[list[tuple[int, int]], list[int]]:
    """First and last samples of leaps away and back, and samples before a lone leap that stays."""
    if len(times) < SHORTEST_SCREENED:
        return [], []
    steps = _distances(positions, quaternions, slice(None, -1), slice(1, None))
    steps = steps / np.maximum(1.0, np.diff(times) / np.median(np.diff(times)))
    grid = GRID_FACTOR * _grid(positions, quaternions)
    floor = max(LEAP_FACTOR * float(np.quantile(steps, 0.9)), _SMALLEST_LEAP, grid)
    padded = np.concatenate([[0.0], steps, [0.0]])
    far = np.flatnonzero(steps > floor).tolist()
    leaps: list[tuple[int, int]] = []
    for i, before in enumerate(far):
        first = before + 1
        if leaps and first <= leaps[-1][1] + 1:  # the way back of the one before
            continue
        largest = 0.0  # step of what is lost meanwhile
        for j in range(i + 1, len(far)):
            last, between = far[j], far[j - 1] if j > i + 1 else first
            if last > first and times[last + 1] - times[first - 1] > LONGEST_LEAP:
                break
            largest = max(largest, float(steps[between:last].max(initial=0.0)))
            # Lost, it is somewhere else meanwhile; a tap goes there and back, fastest in between.
            if steps[before] <= PLATEAU * largest:
                break
            both = min(steps[before], steps[last])
            sudden = both > max(floor, LEAP_FACTOR * max(padded[before], padded[last + 2]), PLATEAU * largest)
            ends = slice(first - 1, first), slice(last + 1, last + 2)
            if sudden and float(_distances(positions, quaternions, *ends)[0]) < 0.3 * both:
                leaps.append((first, last))
                break
    beside = {k for first, last in leaps for k in range(first - 1, last + 1)}
    lone = [
        k
        for k in far
        if 0 < k < len(steps) - 1
        and k not in beside
        and steps[k] > 2.0 * max(floor, LEAP_FACTOR * max(steps[k - 1], steps[k + 1]))
    ]
    return leaps, lone


def _grid(positions: Array, quaternions: Array) -> float:
    """One step of a stream's grid in all coordinates, in the measure of ``_distances``; tiny without a grid."""
    places = np.abs(np.diff(positions, axis=0)).ravel()
    turns = _distances(np.zeros_like(positions), quaternions, slice(None, -1), slice(1, None))
    place, turn = (_fine(steps) for steps in (places, turns))
    return math.sqrt(3.0) * place + turn


def _fine(steps: Array) -> float:
    """A step that is among the shortest; 0 where there are too few to tell them from leaps."""
    some = np.sort(steps[steps > 0.0])
    return float(some[FEWEST_STEPS - 1]) if len(some) >= FEWEST_STEPS else 0.0


def _find_swaps(times: Array, positions: Array, quaternions: Array, lone: Sequence[int]) -> list[int]:
    """Of leaps that stay, by the sample before, those that no object makes: the tracker took up something else.

    What leaps within one step of the stream, and hardly moves in the next, has been stopped within it.
    """
    far = _distances(positions, quaternions, slice(None, -1), slice(1, None))
    moves = np.flatnonzero(far > 0.0)  # a slow camera's pose may be held in between

    def stands_out(k: int) -> bool:
        i = int(np.searchsorted(moves, k))
        beside = [float(far[moves[j]]) for j in (i - 1, i + 1) if 0 <= j < len(moves)]
        interval = min(float(times[k + 1] - times[k]), LONG_STEP)
        least = max(LEAST_SWAP, 0.5 * MOST_BRAKE * interval**2)
        return float(far[k]) > max(least, LEAP_FACTOR * max(beside, default=0.0))

    return [k for k in lone if stands_out(k)]


def _part_that_moves(positions: Array, quaternions: Array, swaps: Sequence[int]) -> slice:
    """Of the parts between swaps, the first in which the object is pushed: from a rest, that is."""
    if not swaps:
        return slice(0, len(positions))
    edges = [0, *(k + 1 for k in swaps), len(positions)]
    parts = [slice(first, last) for first, last in pairwise(edges)]
    ways = [_way(positions[part], quaternions[part]) for part in parts]
    return next(part for part, way in zip(parts, ways, strict=True) if way >= PUSHED * max(ways))


def _way(positions: Array, quaternions: Array) -> float:
    """From the first few poses to the last few; from their middle ones, of the rotation."""
    few = max(1, min(FEW, len(positions) // 2))
    travel = np.median(positions[-few:], axis=0) - np.median(positions[:few], axis=0)
    first, last = quaternions[few // 2], quaternions[-1 - few // 2]
    return float(np.linalg.norm(travel)) + 2.0 * _ARM * math.acos(min(1.0, abs(float(first @ last))))


def find_repeats(positions: Array, quaternions: Array) -> Flags:
    """Samples (n,) that repeat the one before because the tracker is slower than the log; none of other repeats.

    A slower clock shows all its poses about equally often while the body moves. Rounded noise repeats as chance has
    it, and what rests without noise repeats for as long as it rests.
    """
    poses = np.column_stack([positions, quaternions])
    none = np.zeros(len(poses), dtype=np.bool_)
    if len(poses) < SHORTEST_SCREENED:
        return none
    same = np.concatenate([[False], (poses[1:] == poses[:-1]).all(axis=1)])
    runs = np.diff(np.append(np.flatnonzero(~same), len(poses)))
    if len(runs) < FEWEST_HELD:
        return none
    low = float(np.quantile(runs, 0.05))
    usual = (runs >= low) & (runs <= low + 1.0)
    if usual.mean() < MOST_HELD or float(runs[usual].mean()) < HELD:
        return none
    # In a rest the tracker's poses are alike, too: it still shows one in so many samples.
    period = round(float(runs[usual].mean()))
    for first, count in zip(np.flatnonzero(~same)[runs > low + 1.0], runs[runs > low + 1.0], strict=True):
        same[first : first + count : period] = False
    return same


def _find_stalls(positions: Array, quaternions: Array) -> list[tuple[int, int]]:
    """Runs (first, last) of one exact pose that end in a step much longer than the usual one.

    A body at rest also repeats its pose where there is no noise, but it starts with a usual step.
    """
    poses = np.column_stack([positions, quaternions])
    same = (poses[1:] == poses[:-1]).all(axis=1)
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    if not (steps > 0.0).any():
        return []
    usual = float(np.median(steps[steps > 0.0]))
    stalls, first = [], 0
    for k, repeats in enumerate([*same.tolist(), False]):
        if repeats:
            continue
        moved_before = first > 0 and steps[first - 1] > 0.0
        if k - first + 1 > STALL_SAMPLES and k < len(steps) and moved_before and steps[k] > 3.0 * usual:
            stalls.append((first, k))
        first = k + 1
    return stalls
