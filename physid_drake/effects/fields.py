"""Effects that pull at an object by where it is: a tilted table, a tether, a magnet."""

from __future__ import annotations

import dataclasses as dc
import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.forces import ForceLaw
from physid_drake.cell.laws import Attraction, Spring, Tilt
from physid_drake.effects.effect import Coordinate, Effect, Family, PushFacts, Surroundings, parameter
from physid_drake.effects.places import grid_of_places
from physid_drake.ranges import NOT_NEGATIVE, POSITIVE

Array = NDArray[np.float64]
WEAKEST = 1e-9  # N/m: a spring weaker than this has no anchor
SHORT = 0.1  # m: of a cable beside a table, at least as likely
CORE = 0.03  # m, of a magnet
PULL = 20.0  # times what friction holds: a stiff cable that is slack nearly everywhere


@dc.dataclass(frozen=True, kw_only=True)
class TableTilt(Effect):
    """Gravity has a component along the table: m g sin(x) along x of W, m g sin(y) along y."""

    name: ClassVar[str] = "table_tilt"
    element: ClassVar[str] = "table"
    statement: ClassVar[str] = "a constant force along one direction of the table: it is not level"
    frame: ClassVar[str] = "world"
    amplitudes: ClassVar[tuple[str, ...]] = ("x", "y")

    x: float = parameter(0.0, "rad")
    y: float = parameter(0.0, "rad")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The two angles."""
        step, most = 0.015 * around.friction, 0.9 * math.atan(around.friction)
        return tuple(Coordinate(name=name, step=step, lower=-most, upper=most) for name in ("x", "y"))

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """Gravity's component."""
        del facts
        return (Tilt(math.sin(self.x), math.sin(self.y)),)


@dc.dataclass(frozen=True, kw_only=True)
class Tether(Effect):
    """A spring or cable to a point of the world: pulls with stiffness (d - rest_length) where it is taut."""

    name: ClassVar[str] = "tether"
    element: ClassVar[str] = "world"
    statement: ClassVar[str] = "a pull towards a point of the world that grows with the distance: a spring or a cable"
    frame: ClassVar[str] = "world"
    amplitudes: ClassVar[tuple[str, ...]] = ("stiffness",)
    limits: ClassVar[tuple[str, ...]] = ("table_tilt",)

    stiffness: float = parameter(0.0, "N/m", values=NOT_NEGATIVE)
    x: float = parameter(0.0, "m")
    y: float = parameter(0.0, "m")
    rest_length: float = parameter(0.0, "m", values=NOT_NEGATIVE)

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Stiffness, its pull at the region's middle if there were no rest length, and the rest length.

        The wrench is linear in the first three where the rest length is 0, and a fit that begins there finds a cable
        that is slack over a part of the table, or at its middle.
        """
        reach = max(float(np.max(around.region[1] - around.region[0])), 1e-3)  # of an object that only turns in place
        force, most = around.slight, PULL * around.friction * around.weight
        return (
            Coordinate(name="stiffness", step=2.0 * force / reach, lower=0.0),
            Coordinate(name="force_x", step=force, lower=-most, upper=most),
            Coordinate(name="force_y", step=force, lower=-most, upper=most),
            Coordinate(
                name="rest_length",
                step=0.02 * reach,
                lower=0.0,
                upper=max(2.0 * reach, 1.0),
                std=max(0.3 * reach, SHORT),
            ),
        )

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """With rest length 0."""
        return (Family(point=(0.0, 0.0, 0.0, 0.0), free=(0, 1, 2)),)

    @classmethod
    def at(cls, point: Array, around: Surroundings) -> Tether:
        """The spring whose pull at the region's middle would be the chart's force if it had no rest length."""
        stiffness, fx, fy, rest = point.tolist()
        if stiffness == fx == fy == 0.0:
            return cls(rest_length=rest)
        middle = 0.5 * (around.region[0] + around.region[1])
        k = max(stiffness, WEAKEST)
        x, y = middle + np.array([fx, fy]) / k
        return cls(stiffness=k, x=float(x), y=float(y), rest_length=rest)

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """The spring."""
        del facts
        return (Spring(self.stiffness, self.x, self.y, self.rest_length),)


@dc.dataclass(frozen=True, kw_only=True)
class Magnet(Effect):
    """A short-range attraction to a point of the table: F = strength / (d^2 + core^2)."""

    name: ClassVar[str] = "magnet"
    element: ClassVar[str] = "world"
    statement: ClassVar[str] = "an attraction to a point of the table that fades with distance"
    frame: ClassVar[str] = "world"
    amplitudes: ClassVar[tuple[str, ...]] = ("strength",)
    limits: ClassVar[tuple[str, ...]] = ("table_tilt",)

    strength: float = parameter(0.0, "N*m^2", values=NOT_NEGATIVE)
    x: float = parameter(0.0, "m")
    y: float = parameter(0.0, "m")
    core: float = parameter(0.03, "m", values=POSITIVE)

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Strength, place, log of the core."""
        _, spacing = grid_of_places(around)
        return (
            Coordinate(name="strength", step=1.0 * around.slight * spacing**2, lower=0.0),
            Coordinate(name="x", step=0.05 * spacing, std=spacing),
            Coordinate(name="y", step=0.05 * spacing, std=spacing),
            Coordinate(name="core", log=True, step=0.1, lower=math.log(0.002), upper=math.log(0.3), std=0.7),
        )

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """A grid of places."""
        places, _ = grid_of_places(around)
        return tuple(_magnet_family((x, y), CORE) for x, y in places.tolist())

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """The attraction."""
        del facts
        return (Attraction(self.strength, self.x, self.y, self.core),)


def _magnet_family(place: tuple[float, float], core: float) -> Family:
    return Family(point=(0.0, *place, math.log(core)), free=(0,))
