"""Effects that brake an object as it moves: viscous and quadratic drag, rolling resistance."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence
from typing import ClassVar

from physid_drake.cell.forces import ForceLaw, Wrench
from physid_drake.cell.laws import Quadratic, Viscous
from physid_drake.cell.object_state import ObjectState
from physid_drake.effects.effect import Coordinate, Effect, PushFacts, Surroundings, parameter
from physid_drake.ranges import NOT_NEGATIVE

# Times what friction holds, and at which speed [m/s]: no fluid above a table drags more (water drags a box of 50 g
# that is 12 cm wide and 3 cm high by a seventh of what friction holds). Beside slow pushes alone, a drag far above
# friction does what a support near the middle does: it brakes turns less than motion.
STRONGEST, STRONGEST_AT = 10.0, 0.1


@dc.dataclass(frozen=True, kw_only=True)
class ViscousDrag(Effect):
    """A force -c v at the centre of mass and a torque -c k^2 w, k^2 the mean square radius of the underside."""

    name: ClassVar[str] = "viscous_drag"
    element: ClassVar[str] = "table"
    statement: ClassVar[str] = "a drag in proportion to the object's speed"
    frame: ClassVar[str] = "object_velocity"
    amplitudes: ClassVar[tuple[str, ...]] = ("coefficient",)

    coefficient: float = parameter(0.0, "N*s/m", values=NOT_NEGATIVE)

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The coefficient."""
        return (Coordinate(name="coefficient", step=around.slight / (0.5 * around.top_speed), lower=0.0),)

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """The drag."""
        return (Viscous(self.coefficient, facts.polar),)


@dc.dataclass(frozen=True, kw_only=True)
class QuadraticDrag(Effect):
    """A force -c v abs(v) at the centre of mass: air."""

    name: ClassVar[str] = "quadratic_drag"
    element: ClassVar[str] = "world"
    statement: ClassVar[str] = "a drag in proportion to the square of the object's speed"
    frame: ClassVar[str] = "object_velocity"
    amplitudes: ClassVar[tuple[str, ...]] = ("coefficient",)

    coefficient: float = parameter(0.0, "N*s^2/m^2", values=NOT_NEGATIVE)

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The coefficient."""
        step = around.slight / (0.4 * around.top_speed**2)
        most = STRONGEST * around.friction * around.weight / STRONGEST_AT**2
        return (Coordinate(name="coefficient", step=step, lower=0.0, upper=most),)

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """The drag."""
        del facts
        return (Quadratic(self.coefficient),)


@dc.dataclass(frozen=True, kw_only=True)
class RollingResistance(Effect):
    """A rolling object loses speed: the contact force leads by ``coefficient``, so a moment N b opposes the roll.

    On a cylinder that rolls without slip the moment is a force N b / R at the centre of mass.
    """

    name: ClassVar[str] = "rolling_resistance"
    element: ClassVar[str] = "object"
    statement: ClassVar[str] = "a rolling object slows down"
    frame: ClassVar[str] = "object_velocity"
    amplitudes: ClassVar[tuple[str, ...]] = ("coefficient",)

    coefficient: float = parameter(0.0, "m", values=NOT_NEGATIVE)

    @classmethod
    def applies(cls, around: Surroundings) -> bool:
        """On lying cylinders."""
        return around.rolls

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The coefficient."""
        return (Coordinate(name="coefficient", step=5e-4 * around.height, lower=0.0, upper=0.2 * around.height),)

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """The force."""
        return (_RollingLaw(self.coefficient / facts.rolling_radius),) if facts.rolling_radius else ()


@dc.dataclass(frozen=True)
class _RollingLaw:
    """Coulomb's law: as much as stops the roll within a time step, up to ``share`` of the weight.

    A force that fades with speed instead would let a cylinder creep down a tilt on which it rests.
    """

    share: float

    def wrench(self, state: ObjectState) -> Wrench:
        return self.brake(state, ())

    def brake(self, state: ObjectState, others: Sequence[Wrench]) -> Wrench:
        # Across the axis (y of B) it rolls; along the axis it slides.
        x, y = math.cos(state.yaw), math.sin(state.yaw)
        speed = float(state.v_WBcm @ (x, y))
        stops = state.rolling_mass * speed / state.span + sum(x * w.fx + y * w.fy for w in others)
        most = self.share * state.weight
        force = -min(max(stops, -most), most)
        return Wrench(fx=force * x, fy=force * y, torque=0.0)
