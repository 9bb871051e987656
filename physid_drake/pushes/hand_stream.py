"""Which part of a hand's stream is a push: where its tip is beside the object, and between two standstills."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.solid import solid_of
from physid_drake.errors import RecordingError
from physid_drake.pushes.frame_checks import from_object
from physid_drake.recording import Cylinder, Hand, PoseStream, Push, Recording, motion_span
from physid_drake.recording.rests import rests_of

Array = NDArray[np.float64]

MOVED = 5e-3  # m, beside the tracker's noise: an object that moves
SPREAD = 8.0  # deviations between the outermost of a stream's samples, in two dimensions
LONGEST_SLIDE = 1.5  # s: after it a released object rests
BLINK = 0.1  # s: a hand that is away from the object for so long is not
SEEN_LATE = 0.25  # s: by so much, the end of one body's rest may be seen before or after that of another
FEWEST = 20  # samples of a hand of which a part is kept
THINNEST = 0.1  # of a round tip's radius: how near its axis comes to what it touches
GRIP = 0.5  # of a round tip's radius: so far beyond the object's edge it still touches it nearly as wide as it is


def beside_object(recording: Recording, push: Push, height: float, sigma: float) -> PoseStream | None:
    """The hand's stream from where it has come down beside the object to where it lifts off.

    All of it where the object moves at other times, too: then heights tell nothing.

    Args:
        recording: the push's.
        push: whose hand is cut; None is returned of one without.
        height: of the object [m].
        sigma: standard deviation of the object's place [m].

    Raises:
        RecordingError: if the hand passes above or below the object, or comes down beside it for several pushes.
    """
    tip, hand = recording.hand, push.hand
    if tip is None or hand is None:
        return None
    z, reach = hand.positions[:, 2], vertical_reach(tip)
    beside = (z - max(reach, GRIP * tip.radius) < height) & (z + reach > 0.0)
    if beside.all():
        return hand
    runs = _runs_of(beside, hand.times)
    kept = max(runs, key=lambda run: run.stop - run.start, default=None)
    if kept is not None and _rests_outside(push, hand.times[kept], sigma):
        return _part_of(hand, kept)
    pushing = [hand.times[run] for run in runs if _moves(push, *_felt(hand.times[run]), sigma)]
    if len(pushing) > 1 and _is_over(recording, push, hand)[~beside].any():
        spans = ", ".join(f"{times[0]:.2f} to {times[-1]:.2f} s" for times in pushing)
        raise RecordingError(
            f"push '{push.name}': the hand pushes the object more than once, and passes over it in between"
            f" ({spans}); record each as a push of its own."
        )
    if beside.mean() < 0.5:
        raise RecordingError(
            f"push '{push.name}': the hand at z = {np.median(z):.3f} m passes the object, which is {height:.3f} m"
            " high; correct hand_z_m or the object's size."
        )
    return hand


def touching_radius(recording: Recording, height: float) -> float:
    """How far a tip's axis is from the face that it touches [m].

    Less than its radius, where a round tip's middle is above the object's edge, or beside a lying cylinder's.

    Args:
        recording: of pushes with a hand.
        height: of the object [m].
    """
    tip = recording.hand
    assert tip is not None
    if tip.tip == "cylinder":
        return tip.radius
    z = np.concatenate([push.hand.positions[:, 2] for push in recording.pushes if push.hand is not None])
    shape, reach = recording.object.shape, vertical_reach(tip)
    if isinstance(shape, Cylinder) and shape.axis == "y":
        # Two round bodies touch between their middles: the further apart in height these are, the nearer in plan.
        both = shape.radius + tip.radius
        over = _usual_height(np.abs(z - shape.radius) - reach, GRIP * both)
        # High on a wide cylinder the tip's axis is within its outline, which no circle in the plane can say.
        return max(math.sqrt(both**2 - over**2) - shape.radius, THINNEST * tip.radius) if over else tip.radius
    over = _usual_height(z - reach - height, GRIP * tip.radius)
    return math.sqrt(tip.radius**2 - over**2)


def _usual_height(above: Array, most: float) -> float:
    """The median of heights (n,) [m] of a tip over what it touches, where it is near enough to do so; at least 0."""
    beside = above[above < most]
    return max(0.0, float(np.median(beside))) if len(beside) else 0.0


def while_pushing(push: Push, hand: PoseStream) -> PoseStream:
    """A hand's stream from its last standstill before the object moves to its first one when that has come to rest.

    A hand that comes from afar, stands, pushes, stands and withdraws goes three ways, each at a speed of its own.
    """
    moves, rests = motion_span(push)
    first, last = 0, len(hand)
    for stand in rests_of(hand):
        begins, ends = float(hand.times[stand.start]), float(hand.times[stand.stop - 1])
        if begins < moves and ends < moves + SEEN_LATE:
            first = stand.start
        elif begins < rests + SEEN_LATE and ends > rests:
            last = stand.stop
            break
    return _part_of(hand, slice(first, last)) if last - first >= FEWEST else hand


def _part_of(hand: PoseStream, part: slice) -> PoseStream:
    return replace(hand, times=hand.times[part], positions=hand.positions[part], quaternions=hand.quaternions[part])


def _runs_of(flags: NDArray[np.bool_], times: Array) -> list[slice]:
    """Runs of True, over gaps shorter than ``BLINK``, of more than one sample."""
    where = np.flatnonzero(flags)
    parted = (np.diff(where) > 1) & (np.diff(times[where]) > BLINK)
    runs = np.split(where, np.flatnonzero(parted) + 1)
    return [slice(int(run[0]), int(run[-1]) + 1) for run in runs if len(run) > 1]


def _is_over(recording: Recording, push: Push, hand: PoseStream) -> NDArray[np.bool_]:
    """At which samples (n,) of the hand the middle of its tip is surely within the object's outline."""
    inner = 0.5 * float(np.abs(solid_of(recording.object.shape).outline.extent()).min())
    return np.asarray(from_object(push, hand) < inner)


def _rests_outside(push: Push, times: Array, sigma: float) -> bool:
    """Whether the object moves only while the hand is beside it at times (n,) [s], and slides to rest after that.

    Nothing speaks against it where only the first and the last pose are known.
    """
    if push.endpoint_only:
        return True
    begin, end = _felt(times)
    pushed = _moves(push, -math.inf, float(times[-1]) + BLINK, sigma) or not _moves(push, -math.inf, math.inf, sigma)
    return pushed and not _moves(push, -math.inf, begin, sigma) and not _moves(push, end, math.inf, sigma)


def _felt(times: Array) -> tuple[float, float]:
    """Within which times a hand that is beside an object at times (n,) moves it [s]."""
    return float(times[0]), float(times[-1]) + LONGEST_SLIDE


def _moves(push: Push, begin: float, end: float, sigma: float) -> bool:
    """Whether the object moves from one time to another [s] by more than samples scatter."""
    places = push.object.positions[(push.object.times >= begin) & (push.object.times <= end), :2]
    return len(places) > 0 and float(np.linalg.norm(np.ptp(places, axis=0))) > MOVED + SPREAD * sigma


def vertical_reach(hand: Hand) -> float:
    """Half the height over which the tip is as wide as its radius [m]."""
    return 0.5 * hand.length if hand.length is not None else 0.0
