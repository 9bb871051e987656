"""Where the tip is as something pushes the object: at its outline, whatever the physics, if all is as it is said."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.solid import solid_of
from physid_drake.cell.touch import Tip
from physid_drake.recording import Push, Recording

Array = NDArray[np.float64]

NEAR: Final = 3e-3
"""m between tip and object as it is pushed: no physics that goes without saying leaves it further away."""
MOVING: Final = 0.02
"""m/s of the object: faster, and the hand is at it, or has let go."""


def gap_of(recording: Recording) -> float:
    """How far the tip is from the outline while something pushes the object [m], the median; NaN if nothing does.

    It takes milliseconds, and tells most of what is wrong with frames apart.
    """
    if recording.hand is None:
        return math.nan
    gaps = gaps_at(recording, [driven_samples(push) for push in recording.pushes])
    return float(np.median(np.abs(gaps))) if len(gaps) else math.nan


def gaps_of(recording: Recording) -> Array:
    """The same of each push (n,) [m]; NaN where nothing pushes, or the object is too slow to tell."""
    return np.array([gap_of(recording.subset([k])) for k in range(len(recording.pushes))])


def elsewhere(recording: Recording, push: Push) -> bool:
    """Whether something other than the tip moves the object: that is away as it sets out, or its middle is inside.

    A tip that strikes is at the object at first, one that gives way goes less deep.
    """
    assert recording.hand is not None
    gaps = gaps_at(replace(recording, pushes=(push,)), [driven_samples(push)])
    if not len(gaps) or float(np.median(np.abs(gaps))) < NEAR:
        return False
    return bool(gaps[0] >= NEAR or gaps.min() < -recording.hand.radius)


def reading_by_most(readings: Iterable[Recording]) -> Recording:
    """That reading of a recording by which the tip is at the object in most pushes; the first of several.

    Where an object is carried as well, no reading brings the tip to it: those are no pushes.
    """
    return max(readings, key=lambda one: int(np.count_nonzero(gaps_of(one) < NEAR)))


def gaps_at(recording: Recording, rows: Sequence[NDArray[np.intp]], late: float = 0.0) -> Array:
    """Between tip and outline [m] at some samples of each push, of all pushes."""
    assert recording.hand is not None
    tip = Tip(solid_of(recording.object.shape).outline, recording.hand.radius)
    found = [np.zeros(0)]
    for push, chosen in zip(recording.pushes, rows, strict=True):
        if push.hand is not None and len(chosen):
            times, planar = push.object.times[chosen], push.object.planar[chosen]
            at = [np.interp(times - late, push.hand.times, column) for column in push.hand.positions[:, :2].T]
            states = np.column_stack([planar, *at]).tolist()
            found.append(np.array([tip.gap(*state)[0] for state in states]))
    return np.concatenate(found)


def driven_samples(push: Push) -> NDArray[np.intp]:
    """Up to forty samples in which the object moves and does not slow down: something pushes it."""
    times, planar = push.object.times, push.object.planar
    if len(times) < 10:
        return np.zeros(0, dtype=np.intp)
    stride = max(1, len(times) // 40)
    t, p = times[::stride], planar[::stride, :2]
    speed = np.linalg.norm(np.gradient(p, t, axis=0), axis=1)
    fast = (speed > max(MOVING, 0.3 * float(speed.max()))) & (np.gradient(speed, t) > -0.5 * float(speed.max()))
    return np.asarray(np.flatnonzero(fast) * stride)
