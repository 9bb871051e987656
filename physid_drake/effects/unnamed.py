"""What is missing and has no name: a smooth force and a smooth friction, by place, speed and heading.

It is no entry of the catalogue. Each of its tables is a draw of a Gaussian process (C. E. Rasmussen and
C. K. I. Williams, Gaussian Processes for Machine Learning, 2006, section 2.2) in its leading modes: coordinates are
N(0, 1) multiples of the covariance's largest eigenvectors.
"""

from __future__ import annotations

import dataclasses as dc
import math
from functools import cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.forces import ForceLaw, FrictionLaw
from physid_drake.cell.laws import ForceTable, HeadingTable, MotionTable, PlaceTable, SpeedTable
from physid_drake.cell.tables import Places, Row, Rows, Speeds
from physid_drake.effects.effect import Coordinate, Effect, Family, PushFacts, Surroundings, parameter

Array = NDArray[np.float64]

NODES = 6  # of a table over places, on either side
HEADINGS, SPEEDS = 12, 8  # numbers of the other tables
ALIKE = 0.5  # of the region, of the logarithms of speeds: over which numbers are about the same
FORCE, FRICTION = 0.1, 0.15  # standard deviations: of the friction with the table, and of its logarithm
STEP = 0.15  # of a coordinate, for differences
SLOWEST = 0.02  # of the top speed: the first of the speeds
FASTER = 1.5  # times the top speed: the last
MODES = {"force_x": 6, "force_y": 6, "friction": 6, "by_speed": 3, "by_heading": 4, "along": 3, "across": 3}
BLOCKS = {
    "force by place": ("force_x", "force_y"), "friction by place": ("friction",), "friction by speed": ("by_speed",),
    "friction by heading": ("by_heading",), "force by speed": ("along", "across"),
}  # fmt: skip
"""Which tables go together, by what they depend on."""
OVER_PLACES = ("force_x", "force_y", "friction")
FRICTIONS = ("friction", "by_speed", "by_heading")


@dc.dataclass(frozen=True, kw_only=True)
class UnnamedForce(Effect):
    """Forces and frictions of tables; empty ones do nothing.

    Attributes:
        force_x, force_y: at the centre of mass, by place [N].
        friction: logarithm of a factor, by place [-].
        by_speed: logarithm of a factor of friction, by slip [-].
        by_heading: the same by the heading of the slip [-].
        along, across: force along the velocity and to its left, by speed [N].
        places: x and y of the first place, and steps along x and y [m].
        speeds: the first and the last [m/s].
    """

    name: ClassVar[str] = "unnamed_force"
    element: ClassVar[str] = "world"
    statement: ClassVar[str] = "a force that has no name in the catalogue"
    frame: ClassVar[str] = "world"
    amplitudes: ClassVar[tuple[str, ...]] = tuple(MODES)

    force_x: tuple[tuple[float, ...], ...] = parameter((), "N")
    force_y: tuple[tuple[float, ...], ...] = parameter((), "N")
    friction: tuple[tuple[float, ...], ...] = parameter((), "-")
    by_speed: tuple[float, ...] = parameter((), "-")
    by_heading: tuple[float, ...] = parameter((), "-")
    along: tuple[float, ...] = parameter((), "N")
    across: tuple[float, ...] = parameter((), "N")
    places: tuple[float, ...] = parameter((0.0, 0.0, 1.0, 1.0), "m")
    speeds: tuple[float, ...] = parameter((0.01, 1.0), "m/s")

    @property
    def is_null(self) -> bool:
        """Whether all tables are empty, or hold nothing but zeros."""
        over_places = any(any(row) for name in OVER_PLACES for row in getattr(self, name))
        return not over_places and not any(any(getattr(self, name)) for name in MODES if name not in OVER_PLACES)

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Multiples of each table's modes."""
        del around
        return tuple(
            Coordinate(name=f"{name}_{k}", step=STEP, std=1.0) for name, count in MODES.items() for k in range(count)
        )

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """One of each block, and one of all."""
        every = range(len(cls.chart(around)))
        some = [cls.free(names) for names in BLOCKS.values()]
        return tuple(Family(point=(0.0,) * len(every), free=free) for free in (*some, tuple(every)))

    @classmethod
    def free(cls, names: tuple[str, ...]) -> tuple[int, ...]:
        """Indices of the coordinates of some tables."""
        owners = [name for name, count in MODES.items() for _ in range(count)]
        return tuple(k for k, owner in enumerate(owners) if owner in names)

    @classmethod
    def at(cls, point: Array, around: Surroundings) -> UnnamedForce:
        """The tables at multiples of their modes."""
        numbers, begin = dict[str, Any](), 0
        low, high = around.region[0], around.region[1]
        span = np.maximum(high - low, 1e-3)
        held = around.friction * around.weight
        for name, count in MODES.items():
            some, begin = point[begin : begin + count], begin + count
            if not some.any():
                continue
            size = FRICTION if name in FRICTIONS else FORCE * held
            found = size * _modes(name) @ some
            numbers[name] = _rows(found) if name in OVER_PLACES else tuple(found.tolist())
        step = (span / (NODES - 1)).tolist()
        return cls(
            **numbers, places=(*low.tolist(), *step), speeds=(SLOWEST * around.top_speed, FASTER * around.top_speed)
        )

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """Forces by place and by speed."""
        del facts
        found: list[ForceLaw] = []
        if self.force_x or self.force_y:
            found.append(ForceTable(*_beside(self.force_x, self.force_y), Places(*self.places)))
        if self.along or self.across:
            found.append(MotionTable(*_beside(self.along, self.across), Speeds(*self.speeds)))
        return tuple(found)

    def frictions(self, facts: PushFacts) -> tuple[FrictionLaw, ...]:
        """Factors by place, speed and heading."""
        del facts
        found: list[FrictionLaw] = []
        if self.friction:
            found.append(PlaceTable(tuple(_factors(row) for row in self.friction), Places(*self.places)))
        if self.by_speed:
            found.append(SpeedTable(_factors(self.by_speed), Speeds(*self.speeds)))
        if self.by_heading:
            found.append(HeadingTable(_factors(self.by_heading)))
        return tuple(found)


def _factors(logarithms: Row) -> Row:
    return tuple(math.exp(one) for one in logarithms)


def _rows(numbers: Array) -> Rows:
    return tuple(tuple(row) for row in numbers.reshape(NODES, NODES).tolist())


def _beside(first: Any, second: Any) -> tuple[Any, Any]:
    """Two tables, of which one that is empty becomes one of zeros."""

    def zeros(like: Any) -> Any:
        return tuple(zeros(one) if isinstance(one, tuple) else 0.0 for one in like)

    return first or zeros(second), second or zeros(first)


@cache
def _modes(name: str) -> Array:
    """Modes (n, MODES[name]) of a table: leading eigenvectors of its covariance, times roots of eigenvalues."""
    if name == "by_heading":
        # Eigenvectors on a circle are waves; a constant is a friction.
        angles = np.linspace(0.0, 2.0 * math.pi, HEADINGS, endpoint=False)
        waves = [wave(times * angles) / times for times in range(1, MODES[name]) for wave in (np.cos, np.sin)]
        return np.column_stack(waves)[:, : MODES[name]]
    if name in ("by_speed", "along", "across"):
        return _modes_along(SPEEDS)[:, : MODES[name]]
    side, each = _modes_along(NODES), range(NODES)
    pairs = sorted(((i, j) for i in each for j in each), key=lambda pair: (sum(pair), pair))
    return np.column_stack([np.kron(side[:, i], side[:, j]) for i, j in pairs[: MODES[name]]])


def _modes_along(count: int) -> Array:
    """Modes (count, count) of numbers in a row, largest first."""
    places = np.linspace(0.0, 1.0, count)
    values, vectors = np.linalg.eigh(np.exp(-0.5 * ((places[:, None] - places[None, :]) / ALIKE) ** 2))
    # The first of a vector's numbers decides its sign, so that a basis is the same on all machines.
    signed = vectors * np.where(vectors[0] < 0.0, -1.0, 1.0)
    return np.asarray((signed * np.sqrt(np.maximum(values, 0.0)))[:, ::-1])
