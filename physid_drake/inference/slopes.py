"""Derivatives by differences of rollouts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NUISANCE_STEP = 0.5  # of the prior's standard deviation, for differences


def nuisance_steps(nuisance: Array) -> list[Array]:
    """Each of a push's nuisance parameters (k,) stepped, towards its middle."""
    return [nuisance + step for step in np.diag(_nuisance_sizes(nuisance))]


def nuisance_slopes(base: Array, nuisance: Array, vectors: Iterator[Array | None]) -> Array:
    """Derivatives (m, k) by a push's nuisance parameters, from the rollouts of ``own_steps``."""
    return np.column_stack([slope(base, next(vectors), size) for size in _nuisance_sizes(nuisance)])


def _nuisance_sizes(nuisance: Array) -> Array:
    return np.where(nuisance <= 0.0, NUISANCE_STEP, -NUISANCE_STEP)


def slope(base: Array, moved: Array | None, step: float) -> Array:
    """Of a prediction (m,); none where the step cannot be rolled out."""
    return np.zeros_like(base) if moved is None else (moved - base) / step
