"""The vocabulary's laws as records that the compiled integrator reads."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.laws import (
    Attraction,
    Ellipse,
    Falling,
    ForceTable,
    Gradient,
    HeadingTable,
    Law,
    MotionTable,
    Patch,
    PlaceTable,
    Quadratic,
    SpeedTable,
    Spring,
    Tilt,
    Viscous,
)
from physid_drake.cell.tables import Places, Speeds
from physid_drake.twin.records import (
    ATTRACTION,
    ELLIPSE,
    FALLING,
    FORCE_TABLE,
    GRADIENT,
    HEADING_TABLE,
    LAW,
    MOTION_TABLE,
    PATCH,
    PLACE_TABLE,
    PUSH,
    QUADRATIC,
    SPEED_TABLE,
    SPRING,
    VISCOUS,
)

Array = NDArray[np.float64]


_KINDS: Final[dict[type, tuple[int, Callable[[Any], tuple[float, ...]]]]] = {
    Viscous: (VISCOUS, lambda law: (law.coefficient, law.coefficient * law.polar)),
    Quadratic: (QUADRATIC, lambda law: (law.coefficient,)),
    Spring: (SPRING, lambda law: (law.stiffness, law.x, law.y, law.rest_length)),
    Attraction: (ATTRACTION, lambda law: (law.strength, law.x, law.y, law.core)),
    Falling: (FALLING, lambda law: (law.excess, law.speed)),
    Ellipse: (ELLIPSE, lambda law: (law.axes, law.angle, float(law.fixed_in_object))),
    Patch: (PATCH, lambda law: (law.inside, law.x, law.y, law.radius)),
    Gradient: (GRADIENT, lambda law: (law.slope_x, law.slope_y, law.largest)),
}


def _of_places(law: PlaceTable | ForceTable) -> tuple[float, ...]:
    places: Places = law.places
    return (*law.numbers.shape, places.x, places.y, places.step_x, places.step_y)


def _of_speeds(law: SpeedTable | MotionTable) -> tuple[float, ...]:
    speeds: Speeds = law.speeds
    return len(law.numbers), math.log(speeds.slowest), speeds.step(len(law.numbers)), speeds.slowest


_TABLES: Final[dict[type, tuple[int, Callable[[Any], tuple[float, ...]]]]] = {
    PlaceTable: (PLACE_TABLE, _of_places),
    ForceTable: (FORCE_TABLE, _of_places),
    SpeedTable: (SPEED_TABLE, _of_speeds),
    MotionTable: (MOTION_TABLE, _of_speeds),
    HeadingTable: (HEADING_TABLE, lambda law: (len(law.numbers),)),
}
"""What their records hold behind the place of their first number."""


def records_of(sets: Sequence[tuple[Sequence[Law], float]]) -> tuple[NDArray[np.void], NDArray[np.int64], Array]:
    """Records of all laws, where each set's end, and the numbers of their tables.

    Args:
        sets: the laws of each rollout, and the weight on the table [N].
    """
    numbers = _Numbers()
    rows = [_row(law, weight, numbers) for laws, weight in sets for law in laws]
    padded = [(kind, *values, *(0.0,) * (8 - len(values))) for kind, values in rows]
    return np.array(padded, dtype=LAW), np.cumsum([0, *(len(laws) for laws, _ in sets)]), numbers.together()


class _Numbers:
    """The numbers of tables, one after the other; of a table that several rollouts share, once."""

    def __init__(self) -> None:
        self._parts, self._count = [np.zeros(1)], 1
        self._firsts: dict[int, int] = {}

    def first_of(self, table: Any) -> int:
        """Where a table's numbers begin; of complex ones the real parts, then the imaginary ones."""
        if id(table) not in self._firsts:
            values = table.numbers.ravel()
            parts = [values.real, values.imag] if np.iscomplexobj(values) else [values]
            self._firsts[id(table)] = self._count
            self._parts += parts
            self._count += sum(map(len, parts))
        return self._firsts[id(table)]

    def together(self) -> Array:
        """All of them; at least one."""
        return np.concatenate(self._parts) if len(self._parts) > 1 else self._parts[0]


def _row(law: Law, weight: float, numbers: _Numbers) -> tuple[int, tuple[float, ...]]:
    if isinstance(law, Tilt):  # the one that is in shares of the weight
        return PUSH, (weight * law.x, weight * law.y)
    if type(law) in _TABLES:
        kind, values = _TABLES[type(law)]
        return kind, (numbers.first_of(law), *values(law))
    try:
        kind, values = _KINDS[type(law)]
    except KeyError:
        raise TypeError(f"{type(law).__name__} is no law of the vocabulary") from None
    return kind, values(law)
