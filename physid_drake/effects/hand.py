"""Effects on the hand's path: a lag, an offset, a spring."""

from __future__ import annotations

import dataclasses as dc
import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import HandPath
from physid_drake.cell.soft_tip import Mount
from physid_drake.effects.effect import (
    Coordinate,
    Effect,
    Family,
    PushFacts,
    Surroundings,
    families_of_sizes,
    parameter,
)
from physid_drake.ranges import NOT_NEGATIVE, POSITIVE

Array = NDArray[np.float64]
FINE = 2e-3  # s between knots of a path that was changed
SHORTEST = 1e-7  # s between knots


@dc.dataclass(frozen=True, kw_only=True)
class HandEffect(Effect):
    """An effect that needs a hand."""

    @classmethod
    def applies(cls, around: Surroundings) -> bool:
        """With a hand."""
        return around.has_hand


@dc.dataclass(frozen=True, kw_only=True)
class HandCompliance(HandEffect):
    """The tip is on a spring and a damper: it is behind where the robot says by compliance times the force.

    Assumed: the spring is linear and alike in all directions of the plane; the hand columns are of its far end, which
    goes its way whatever the force (a robot that regulates position and is measured at its joints or flange); the
    damper is ``damping`` of critical for the object on the spring. Series elasticity, a soft fingertip and a bending
    finger are near that; an impedance-controlled arm is where its own inertia counts little. Not in it: stiffness
    that grows with the force, torsion of the tip, a patch of contact, give along the vertical.

    ``share`` is not in the catalogue: what moves with the tip over the object's mass. A touch takes the tip's
    momentum at once.
    """

    name: ClassVar[str] = "hand_compliance"
    element: ClassVar[str] = "hand"
    statement: ClassVar[str] = "the tip gives way under the force of the contact"
    frame: ClassVar[str] = "contact"
    amplitudes: ClassVar[tuple[str, ...]] = ("compliance",)
    beyond: ClassVar[tuple[str, ...]] = ("share",)

    compliance: float = parameter(0.0, "m/N", values=NOT_NEGATIVE)
    damping: float = parameter(0.5, "-", values=NOT_NEGATIVE)
    share: float = parameter(0.2, "-", values=POSITIVE)

    @classmethod
    def applies(cls, around: Surroundings) -> bool:
        """With a hand, unless the face slips past the tip up or down, as a rolling one does: the tip is planar."""
        return around.has_hand and not around.rolls

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Compliance, log damping, log share."""
        force = around.friction * around.weight
        return (
            Coordinate(name="compliance", step=2e-4 / force, lower=0.0, upper=0.05 / force),
            Coordinate(name="damping", log=True, step=0.2, lower=math.log(0.02), upper=math.log(3.0), std=1.0),
            Coordinate(name="share", log=True, step=0.4, lower=math.log(0.01), upper=math.log(2.0), std=0.7),
        )

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """Small and large."""
        del around
        return tuple(
            Family(point=(0.0, math.log(0.5), math.log(0.2)), free=(0,), size=size) for size in (1.0, 5.0, 25.0)
        )

    @classmethod
    def leading(cls, around: Surroundings) -> tuple[int, ...]:
        """The compliance."""
        del around
        return (0,)

    def mount(self, facts: PushFacts) -> Mount | None:
        """The spring and the damper."""
        stiffness = 1.0 / self.compliance
        return Mount(
            stiffness=stiffness, damping=2.0 * self.damping * math.sqrt(stiffness * facts.mass),
            mass=self.share * facts.mass,
        )  # fmt: skip


@dc.dataclass(frozen=True, kw_only=True)
class ActuatorLag(HandEffect):
    """The hand columns are commands; the tip follows with a first-order lag."""

    name: ClassVar[str] = "actuator_lag"
    element: ClassVar[str] = "hand"
    statement: ClassVar[str] = "the tip is behind the recorded hand by a constant time"
    frame: ClassVar[str] = "time"
    amplitudes: ClassVar[tuple[str, ...]] = ("time_constant",)

    time_constant: float = parameter(0.0, "s", values=NOT_NEGATIVE)

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The time constant."""
        return (Coordinate(name="time_constant", step=2e-3, lower=0.0, upper=0.3, tolerance=2e-4),)

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """Small and large."""
        del around
        return families_of_sizes(1.0, 8.0, 30.0)

    def hand(self, path: HandPath, facts: PushFacts) -> HandPath:
        """The path, lagged."""
        del facts
        times = _fine_times(path, float(path.times[-1]) + 8.0 * self.time_constant)
        velocities = _lagged(times, _velocities(path, times), self.time_constant)
        velocities[-1] = 0.0
        # A path that begins in motion is followed from behind.
        return _path_through(times, path.start - self.time_constant * velocities[0], velocities)


@dc.dataclass(frozen=True, kw_only=True)
class HandOffset(HandEffect):
    """The tip is not where its calibration says: an offset in P.

    The axes of P are the mean ones of each push; those of W where the recording has no rotation of the hand.
    """

    name: ClassVar[str] = "hand_offset"
    element: ClassVar[str] = "hand"
    statement: ClassVar[str] = "the tip is not where the recording says"
    frame: ClassVar[str] = "hand"
    amplitudes: ClassVar[tuple[str, ...]] = ("x", "y")

    x: float = parameter(0.0, "m")
    y: float = parameter(0.0, "m")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The offsets."""
        most = 0.5 * around.radius
        return tuple(Coordinate(name=name, step=4e-4, lower=-most, upper=most, tolerance=5e-5) for name in ("x", "y"))

    def hand(self, path: HandPath, facts: PushFacts) -> HandPath:
        """The path, shifted."""
        return dc.replace(path, start=path.start + facts.hand_axes @ np.array([self.x, self.y]))


def _fine_times(path: HandPath, end: float) -> Array:
    """Knots: the path's own and a fine grid over it (n,) [s]."""
    first, last = float(path.times[0]), max(float(path.times[-1]), end)
    count = max(2, math.ceil((last - first) / FINE) + 1)
    # Just after the path's end, where what is left of the velocity stops at once.
    times = np.unique(np.concatenate([np.linspace(first, last, count), path.times, path.times[-1:] + 1e-6]))
    kept: Array = times[np.concatenate([[True], np.diff(times) > SHORTEST])]
    return kept


def _velocities(path: HandPath, times: Array) -> Array:
    """Velocities (n, 2) [m/s]; at rest outside the path's knots."""
    inside = (times >= path.times[0]) & (times <= path.times[-1])
    columns = [np.interp(times, path.times, column) for column in path.velocities.T]
    velocities: Array = np.column_stack(columns) * inside[:, None]
    return velocities


def _lagged(times: Array, values: Array, constant: float) -> Array:
    """First-order lag of values (n, k) that are linear between times (n,): exact over each piece."""
    if constant <= 0.0:
        return values.copy()
    spans = np.diff(times)[:, None]
    decays = np.exp(-spans / constant)
    # y' = (u - y) / T with u linear: y = u - T u' + (y0 - u0 + T u') exp(-h / T).
    behind = constant * np.diff(values, axis=0) / spans
    fresh = values[1:] - behind - decays * (values[:-1] - behind)
    # One number after the other, which plain floats do faster than arrays.
    columns = []
    for first, column in zip(values[0].tolist(), fresh.T.tolist(), strict=True):
        column_of, last = [first], first
        for decay, new in zip(decays[:, 0].tolist(), column, strict=True):
            last = decay * last + new
            column_of.append(last)
        columns.append(column_of)
    return np.array(columns).T


def _path_through(times: Array, start: Array, velocities: Array) -> HandPath:
    return HandPath(times=times, velocities=velocities, start=start)
