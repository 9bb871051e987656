"""The vocabulary's laws as records that the compiled integrator reads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.laws import (
    Attraction,
    Ellipse,
    Falling,
    Gradient,
    Law,
    Patch,
    Quadratic,
    Spring,
    Tilt,
    Viscous,
)
from physid_drake.twin.records import (
    ATTRACTION,
    ELLIPSE,
    FALLING,
    GRADIENT,
    LAW,
    PATCH,
    PUSH,
    QUADRATIC,
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


def by_place(law: Law) -> bool:
    """Whether friction changes within the base by where it is on the table."""
    return isinstance(law, Patch)


def records_of(sets: Sequence[tuple[Sequence[Law], float]]) -> tuple[NDArray[np.void], NDArray[np.int64], Array]:
    """Records of all laws, where each set's end, and the numbers of their tables.

    Args:
        sets: the laws of each rollout, and the weight on the table [N].
    """
    rows = [_row(law, weight) for laws, weight in sets for law in laws]
    padded = [(kind, *values, *(0.0,) * (8 - len(values))) for kind, values in rows]
    return np.array(padded, dtype=LAW), np.cumsum([0, *(len(laws) for laws, _ in sets)]), np.zeros(1)


def _row(law: Law, weight: float) -> tuple[int, tuple[float, ...]]:
    if isinstance(law, Tilt):  # the one that is in shares of the weight
        return PUSH, (weight * law.x, weight * law.y)
    try:
        kind, values = _KINDS[type(law)]
    except KeyError:
        raise TypeError(f"{type(law).__name__} is no law of the vocabulary") from None
    return kind, values(law)
