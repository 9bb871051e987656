"""Laws that the catalogue does not have: where one does better than what was found, that has a wrong name."""

from __future__ import annotations

import dataclasses as dc
import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import HandPath
from physid_drake.cell.forces import FrictionLaw
from physid_drake.cell.object_state import Complex, ObjectState
from physid_drake.effects.effect import (
    Coordinate,
    Effect,
    Family,
    PushFacts,
    Surroundings,
    families_of_sizes,
    parameter,
)
from physid_drake.effects.hand import HandEffect

Array = NDArray[np.float64]
LENGTHS = (0.01, 0.03, 0.1)  # m, after which most of the change is done


@dc.dataclass(frozen=True, kw_only=True)
class FrictionByDistance(Effect):
    """Friction changes by a factor of ``ratio`` ^ (1 - exp(-s / length)) as an object slides a distance s.

    It begins anew in each push: what warms or wears off cools or recovers while the object rests.
    The form is the plainest one that saturates, and from no source.
    """

    name: ClassVar[str] = "friction_by_distance"
    element: ClassVar[str] = "table"
    statement: ClassVar[str] = "friction with the table changes as the object slides, afresh in each push"
    frame: ClassVar[str] = "time"
    amplitudes: ClassVar[tuple[str, ...]] = ("ratio",)

    ratio: float = parameter(1.0, "-")
    length: float = parameter(0.03, "m")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Logs of both."""
        del around
        return (
            Coordinate(name="ratio", log=True, step=0.03, lower=math.log(0.1), upper=math.log(10.0)),
            Coordinate(name="length", log=True, step=0.05, lower=math.log(1e-3), upper=math.log(1.0), std=1.0),
        )

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """A few lengths."""
        del around
        return tuple(Family(point=(0.0, math.log(length)), free=(0,)) for length in LENGTHS)

    def frictions(self, facts: PushFacts) -> tuple[FrictionLaw, ...]:
        """A fresh count of the distance for each rollout."""
        del facts
        return (_DistanceLaw(self.ratio, self.length),)


class _DistanceLaw:
    """What was slid is the law's own state: the mean over the support points, over the ticks so far."""

    def __init__(self, ratio: float, length: float) -> None:
        """``ratio`` after a long slide, ``length`` in m."""
        self._log, self._length = math.log(ratio), length
        self._time, self._slid = math.inf, 0.0  # of the tick that was looked at last; what was slid before it
        self._next = 0.0  # slid at its end

    @property
    def largest(self) -> float:
        return math.exp(max(0.0, self._log))

    def ratio(self, state: ObjectState) -> Array | Complex:
        if state.time < self._time:  # a rollout begins
            self._next = 0.0
        if state.time != self._time:
            self._time, self._slid = state.time, self._next
        step = float(state.underside.weights @ np.abs(state.slips)) * state.span
        self._next = self._slid + step
        slid = self._slid + 0.5 * step
        done = -math.expm1(-slid / self._length)
        return np.full(len(state.underside.points), math.exp(self._log * done))


@dc.dataclass(frozen=True, kw_only=True)
class HandClock(HandEffect):
    """The hand's clock runs fast by ``rate`` [-], and is in step with the tracker's as the hand sets out, at t0.

    At time t the tip is where the recording says it is at t0 + (1 + rate) (t - t0).
    The plainest error of a clock, and from no source.
    """

    name: ClassVar[str] = "hand_clock"
    element: ClassVar[str] = "hand"
    statement: ClassVar[str] = "the clocks of hand and tracker do not run at the same rate"
    frame: ClassVar[str] = "time"
    amplitudes: ClassVar[tuple[str, ...]] = ("rate",)

    rate: float = parameter(0.0, "-")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The rate."""
        del around
        return (Coordinate(name="rate", step=2e-3, lower=-0.2, upper=0.2),)

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """Small and large."""
        del around
        return families_of_sizes(1.0, 8.0)

    def hand(self, path: HandPath, facts: PushFacts) -> HandPath:
        """The path at another pace."""
        del facts
        pace, first = 1.0 + self.rate, path.times[0]
        return dc.replace(path, times=first + (path.times - first) / pace, velocities=pace * path.velocities)


FOILS: tuple[type[Effect], ...] = (FrictionByDistance, HandClock)
