"""Whether object, hand and table of a recording are where they can be: else a fit would call it missing physics."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from physid_drake.cell.solid import solid_of
from physid_drake.cell.touch import Tip
from physid_drake.errors import RecordingError
from physid_drake.pushes.standing import misread, standing_of
from physid_drake.recording import Box, Cylinder, PoseStream, Push, Recording
from physid_drake.recording.clocks import check_seconds
from physid_drake.recording.rests import rests_of
from physid_drake.recording.screening import find_gaps

Array = NDArray[np.float64]
Check = Callable[[], None]  # raises RecordingError

UPRIGHT = 0.87  # cosine of 30 degrees: an object that leans more does not stand on its face
TIPPED = 3  # samples: fewer are a tracker's error
OFF_TABLE = 0.01  # m: a caliper's error
MOVED = 0.01  # m
AT_ONCE, SOON = 0.05, 0.1  # s
LONGEST_LOOK = 0.2  # s, of a slow tracker
AT_A_TIME = 5  # samples, that one of most noise does not count
SURE = 6.0  # standard deviations
FEWEST = 4  # samples
MAY_PUSH = 0.01  # m: from the object's corner, turned to the hand
BESIDE_GAP = 5  # samples that tell a speed
SELDOM = 0.09  # s between samples of a hand: at 12 Hz, the errors of its path still cover what it may do
UNSEEN_WAY = 0.005  # m: what a hand loses of its speed in a gap, times the gap
STILL_FAST = 0.5  # of a hand's speed: faster, it has not come to a stop
LIGHTEST, HEAVIEST = 1.0, 23000.0  # kg/m^3, of the box around an object: lighter than air, denser than osmium
FEWEST_FORCES = 3  # pushes
FEWEST_FREE = 3  # poses of a free motion
MOST_HALTS = 12  # of a hand in one push; seven where the noise of a published log is slow
BESIDE = 0.05  # m between tip and object that no error of calibration explains


def checks_of(recording: Recording) -> tuple[Check, ...]:
    """What must be true of a recording as a whole."""
    every = (check_mass, check_hand_near, check_hand_outside, check_force_direction)
    return tuple(partial(check, recording) for check in every)


def push_checks_of(recording: Recording, push: Push) -> tuple[Check, ...]:
    """What must be true of each push whose clocks are in order."""
    return (
        partial(check_upright, recording, push),
        partial(check_on_table, recording, push),
        partial(check_free_start, push),
        partial(check_one_push, push),
    )


def check_mass(recording: Recording) -> None:
    """Refuses a mass that no object of that size has."""
    mass = recording.object.mass
    if mass is None:
        return
    solid = solid_of(recording.object.shape)
    x0, y0, x1, y1 = solid.outline.extent()
    density = mass / ((x1 - x0) * (y1 - y0) * solid.height)
    if not LIGHTEST < density < HEAVIEST:
        what = "lighter than air" if density <= LIGHTEST else "denser than any metal"
        raise RecordingError(
            f"recording '{recording.name}': with {mass:g} kg the object would be {what} ({density:.3g} kg/m^3);"
            " is its mass in kg, and its size in m?"
        )


def check_standing(recording: Recording) -> None:
    """Refuses an object that tips as it is read, and stands in all pushes by other axes or another order."""
    if standing_of(recording).tipped and (odd := misread(recording)):
        raise RecordingError(f"recording '{recording.name}': {odd}.")


def check_upright(recording: Recording, push: Push) -> None:
    """Refuses an object that lies on another face than the recording says, or tips on its way.

    A lying cylinder may be turned; a box or a cylinder upside down is the same object.
    """
    shape = recording.object.shape
    if isinstance(shape, Cylinder) and shape.axis == "y":
        return
    _, x, y, _ = push.object.quaternions.T
    cosines = 1.0 - 2.0 * (x * x + y * y)
    if isinstance(shape, Box | Cylinder):
        cosines = np.abs(cosines)
    over = np.flatnonzero(cosines < UPRIGHT)
    lean = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    if len(over) and over[0] == 0:
        raise RecordingError(
            f"push '{push.name}': the object's z axis is {lean[0]:.0f} degrees from the vertical as the push begins;"
            " give its shape in a frame B whose z axis points up."
        )
    if len(over) >= min(TIPPED, len(push.object) - 1):
        begin = push.object.times[over[0]]
        raise RecordingError(
            f"push '{push.name}': the object tips by {lean.max():.0f} degrees, from {begin:.2f} s on;"
            " cut the push before that, or leave it out."
        )


def check_clocks(push: Push) -> None:
    """Refuses times in ms, and a hand whose stream is over before the object's begins, or the other way round."""
    for what, stream in (("object", push.object), ("hand", push.hand), ("force", push.force)):
        if stream is not None:
            check_seconds(stream.times, f"push '{push.name}': the {what}'s samples")
    if push.hand is None:
        return
    hand, seen = push.hand.times, push.object.times
    if hand[0] > seen[-1] or seen[0] > hand[-1]:
        raise RecordingError(
            f"push '{push.name}': the hand is recorded from {hand[0]:.3f} to {hand[-1]:.3f} s, and the object from"
            f" {seen[0]:.3f} to {seen[-1]:.3f} s; are both on the same clock?"
        )


def check_free_start(push: Push) -> None:
    """Refuses a free motion with so few poses that they have no start velocity."""
    if push.hand is None and len(push.object) < FEWEST_FREE:
        raise RecordingError(
            f"push '{push.name}': without a hand, at least {FEWEST_FREE} poses are needed for the start velocity, but"
            f" got {len(push.object)}."
        )


def check_one_push(push: Push) -> None:
    """Refuses a log of many pushes in one table: a path with so many knots would take minutes to find."""
    halts = 0 if push.hand is None else len(rests_of(push.hand))
    if halts > MOST_HALTS:
        raise RecordingError(
            f"push '{push.name}': the hand stands still {halts} times in {push.duration:.0f} s; cut the table where"
            " it does, so that each push is one of its own."
        )


def check_on_table(recording: Recording, push: Push) -> None:
    """Refuses an object that starts beside the table: in the simulation it would fall."""
    place = push.object.positions[0, :2]
    centre, half = np.array(recording.table.centre), 0.5 * np.array(recording.table.size)
    if (np.abs(place - centre) > half + OFF_TABLE).any():
        low, high = centre - half, centre + half
        raise RecordingError(
            f"push '{push.name}': the object starts at ({place[0]:.3f}, {place[1]:.3f}) m, beside the table, which is"
            f" from ({low[0]:.3f}, {low[1]:.3f}) to ({high[0]:.3f}, {high[1]:.3f}) m; are both in the same frame?"
        )


def check_hand_near(recording: Recording) -> None:
    """Refuses hands that never come near objects that move; a push without a touch may be among others."""
    if recording.hand is None:
        return
    gaps = [_least_gap(recording, push) for push in recording.pushes if moves(push) and push.hand is not None]
    if gaps and min(gaps) > BESIDE:
        raise RecordingError(
            f"recording '{recording.name}': the object moves, but the hand stays {1e3 * min(gaps):.0f} mm or more"
            " away from it; are both streams in the same frame, and in m?"
        )


def check_hand_outside(recording: Recording) -> None:
    """Refuses a tip that reaches deep into every object as it sets it moving: a radius in mm, or another frame."""
    if recording.hand is None:
        return
    depths = depths_at_touch(recording)
    if depths and min(depths) > BESIDE:
        raise RecordingError(
            f"recording '{recording.name}': the hand's tip, of radius {recording.hand.radius:g} m, is"
            f" {1e3 * min(depths):.0f} mm or more inside the object as it begins to move; is the radius in m?"
        )


def depths_at_touch(recording: Recording) -> list[float]:
    """How deep [m] the tip is in the object as that has begun to move, of each push in which it does."""
    if recording.hand is None:
        return []
    depths = (_depth_at_touch(recording, push) for push in recording.pushes)
    return [depth for depth in depths if depth is not None]


def check_force_direction(recording: Recording) -> None:
    """Refuses forces that brake the objects which the hand sets moving: those of the object on the hand."""
    works = [_work(push) for push in recording.pushes if push.force is not None and moves(push)]
    if len(works) >= FEWEST_FORCES and sum(work < 0.0 for work in works) > 0.5 * len(works):
        raise RecordingError(
            f"recording '{recording.name}': the hand's force points against the object's motion in most pushes; it"
            " has to be the force of the hand on the object, in W."
        )


def _work(push: Push) -> float:
    """Of the hand on the object, in the plane [J]."""
    assert push.force is not None
    times, forces = push.force.times, push.force.forces[:, :2]
    places = np.column_stack([np.interp(times, push.object.times, c) for c in push.object.positions[:, :2].T])
    return float((0.5 * (forces[1:] + forces[:-1]) * np.diff(places, axis=0)).sum())


def _depth_at_touch(recording: Recording, push: Push) -> float | None:
    """How deep [m] the tip is in the object as that has begun to move; None where it does not, or without a hand."""
    assert recording.hand is not None
    poses = push.object.planar
    moved = np.linalg.norm(poses[:, :2] - poses[0, :2], axis=1) > MOVED
    if push.hand is None or push.endpoint_only or not moved.any():
        return None
    first = int(np.argmax(moved))
    times = push.object.times
    tip = Tip(solid_of(recording.object.shape).outline, recording.hand.radius)
    # A short hit has let go of an object that has slid so far: what counts is how deep the tip was just before.
    just = slice(int(np.searchsorted(times, times[first] - LONGEST_LOOK)), first + 1)
    places = [np.interp(times[just], push.hand.times, column) for column in push.hand.positions[:, :2].T]
    rows = np.column_stack([poses[just], *places]).tolist()
    depths = np.array([-tip.gap(x, y, yaw, hx, hy)[0] for x, y, yaw, hx, hy in rows])
    return float(median_filter(depths, AT_A_TIME, mode="reflect").max())


def moves(push: Push) -> bool:
    """Whether the object is pushed by more than a centimetre."""
    return float(np.linalg.norm(np.ptp(push.object.positions[:, :2], axis=0))) > MOVED


def _least_gap(recording: Recording, push: Push) -> float:
    """Distance [m] that tip and object surely have at least, wherever the object is turned."""
    assert push.hand is not None and recording.hand is not None
    return float(from_object(push, push.hand).min()) - reach_of(recording) - recording.hand.radius


def reach_of(recording: Recording) -> float:
    """How far the object reaches from Bo at most, however it is turned [m]: the corner of its bounding box."""
    x0, y0, x1, y1 = np.abs(solid_of(recording.object.shape).outline.extent()).tolist()
    return float(np.hypot(max(x0, x1), max(y0, y1)))


def from_object(push: Push, hand: PoseStream) -> Array:
    """Distances (n,) in the plane from Bo to samples of the hand [m]."""
    seen, places = push.object.times, push.object.positions[:, :2]
    there = np.column_stack([np.interp(hand.times, seen, column) for column in places.T])
    return np.asarray(np.linalg.norm(hand.positions[:, :2] - there, axis=1))


def unseen_motion(recording: Recording, sigma: float) -> tuple[str, ...]:
    """What begins or ends out of sight, in words: a simulation starts from rest, and its hand stops where it is lost.

    Args:
        recording: the pushes.
        sigma: standard deviation of the object's place [m].
    """
    found = {
        "the object already moves in the first poses, as if it had been pushed before": _already_moving,
        "the hand's stream ends while it moves, or has a gap in which it brakes"
        " (poses after that are left out where it may push)": _hand_lost,
    }
    return tuple(
        f"{what}: {', '.join(names)}"
        for what, is_so in found.items()
        if (names := [push.name for push in recording.pushes if is_so(push, sigma)])
    )


def _already_moving(push: Push, sigma: float) -> bool:
    way = _way(push, AT_ONCE)
    return push.hand is not None and way is not None and way > SURE * sigma


def check_moved_by_something(recording: Recording, sigma: float) -> None:
    """Refuses objects that all set out from rest by themselves: a hand that was not recorded, or not as one.

    Args:
        recording: the pushes.
        sigma: standard deviation of the object's place [m].
    """
    moving = [push for push in recording.pushes if moves(push)]
    if moving and len(moved_by_nothing(recording, sigma)) == len(moving):
        raise RecordingError(
            f"recording '{recording.name}': the pushes have no hand, but their object starts from rest and moves;"
            " is the hand's stream missing, or read as another push?"
        )


def moved_by_nothing(recording: Recording, sigma: float) -> tuple[str, ...]:
    """Names of pushes in which no hand is recorded, and an object that rests at first moves later."""
    found = []
    for push in recording.pushes:
        soon, ever = _way(push, SOON), _way(push, np.inf)
        if push.hand is None and moves(push) and soon is not None and ever is not None:
            found += [push.name] if soon < SURE * sigma < ever - MOVED else []
    return tuple(found)


def _way(push: Push, within: float) -> float | None:
    """How far the object comes from its first place within a time [s], or four samples; None if that is not seen."""
    times, places = push.object.times, push.object.positions[:, :2]
    if len(times) < FEWEST or times[FEWEST - 1] > times[0] + max(within, LONGEST_LOOK):
        return None
    seen = places[: max(FEWEST, int(np.count_nonzero(times <= times[0] + within)))]
    return float(np.linalg.norm(seen[-2:].mean(axis=0) - seen[:2].mean(axis=0)))


def _hand_lost(push: Push, sigma: float) -> bool:
    del sigma
    return push.hand is not None and bool(_lost_at(push, push.hand))


def _lost_at(push: Push, hand: PoseStream) -> list[int]:
    """The last samples of the hand before its way is unknown: where it brakes in a gap, or ends in motion."""
    ended = len(hand) >= 2 * FEWEST and push.object.times[-1] >= hand.times[-1] + SOON
    steps = np.linalg.norm(np.diff(hand.positions[:, :2], axis=0), axis=1) / np.diff(hand.times)
    moves = ended and float(np.median(steps[-3:])) > STILL_FAST * float(np.quantile(steps, 0.9))
    return sorted({*_brakes_unseen(hand), *_brakes_hardly_seen(hand)}) + ([len(hand) - 1] if moves else [])


def hand_seen_until(recording: Recording, push: Push) -> float:
    """When a hand that moves beside the object is seen last [s]: from then on, nobody knows what pushes.

    It is lost where its stream ends in motion, or has a gap in which it brakes by much. Infinite where
    it is seen all the while, or is away from the object when it is lost.
    """
    if push.hand is None or recording.hand is None:
        return math.inf
    lost = _lost_at(push, push.hand)
    away = from_object(push, push.hand) - reach_of(recording) - recording.hand.radius
    return next((float(push.hand.times[k]) for k in lost if away[k] < MAY_PUSH), math.inf)


def _brakes_hardly_seen(hand: PoseStream) -> list[int]:
    """The last samples before a hand that is seen too seldom loses much of its speed, or goes back."""
    intervals = np.diff(hand.times)
    velocities = np.diff(hand.positions[:, :2], axis=0) / intervals[:, None]
    speeds = np.linalg.norm(velocities, axis=1)
    kept = (velocities[:-2] * velocities[2:]).sum(axis=1) / np.maximum(speeds[:-2], 1e-9)
    between = intervals[1:-1]
    # Beside a gap of a fast stream, the differences of neighbours are noise: those are for ``_brakes_unseen``.
    seldom = (between > SELDOM) & (np.minimum(intervals[:-2], intervals[2:]) > 0.5 * SELDOM)
    lost = (speeds[:-2] - kept) * between > UNSEEN_WAY
    moved = speeds[:-2] * between > UNSEEN_WAY  # the way of one that stood is noise
    found: list[int] = (np.flatnonzero(seldom & moved & lost) + 1).tolist()
    return found


def _brakes_unseen(hand: PoseStream) -> list[int]:
    """The last samples before gaps in which the hand brakes: when it does is when it lets go of the object."""
    times, places = hand.times, hand.positions[:, :2]

    def speed(samples: slice) -> float:
        return float(np.hypot(*np.polyfit(times[samples] - times[samples][0], places[samples], 1)[0]))

    found = []
    for k in find_gaps(times).tolist():
        before, after = slice(k + 1 - BESIDE_GAP, k + 1), slice(k + 1, k + 1 + BESIDE_GAP)
        told = before.start >= 0 and after.stop <= len(times)
        if told and (speed(before) - speed(after)) * (times[k + 1] - times[k]) > UNSEEN_WAY:
            found.append(k)
    return found
