"""Derivatives by differences of rollouts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

OWN_STEP = 0.5  # of the prior's standard deviation, for differences


def own_steps(own: Array) -> list[Array]:
    """Each of a push's unknowns (k,) stepped, towards its middle."""
    return [own + step for step in np.diag(_own_sizes(own))]


def own_slopes(base: Array, own: Array, vectors: Iterator[Array | None]) -> Array:
    """Derivatives (m, k) by a push's unknowns, from the rollouts of ``own_steps``."""
    return np.column_stack([slope(base, next(vectors), size) for size in _own_sizes(own)])


def _own_sizes(own: Array) -> Array:
    return np.where(own <= 0.0, OWN_STEP, -OWN_STEP)


def slope(base: Array, moved: Array | None, step: float) -> Array:
    """Of a prediction (m,); none where the step cannot be rolled out."""
    return np.zeros_like(base) if moved is None else (moved - base) / step
