"""Derivatives by one-sided differences of rollouts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NUISANCE_STEP = 0.5  # of the prior's standard deviation, for differences


def nuisance_steps(nuisance: Array) -> list[Array]:
    """Nuisance parameters (k,) of a push, one list entry for each of them with a step towards zero."""
    return [nuisance + step for step in np.diag(_nuisance_sizes(nuisance))]


def nuisance_slopes(base: Array, nuisance: Array, vectors: Iterator[Array | None]) -> Array:
    """Derivatives (m, k) of a prediction with respect to a push's nuisance parameters.

    Args:
        base: (m,), the prediction at ``nuisance``.
        nuisance: (k,).
        vectors: predictions (m,) at each of ``nuisance_steps``; k of them are taken.
    """
    return np.column_stack([slope(base, next(vectors), size) for size in _nuisance_sizes(nuisance)])


def _nuisance_sizes(nuisance: Array) -> Array:
    return np.where(nuisance <= 0.0, NUISANCE_STEP, -NUISANCE_STEP)


def slope(base: Array, moved: Array | None, step: float) -> Array:
    """Derivative (m,) of a prediction; zero where the stepped rollout could not be made."""
    return np.zeros_like(base) if moved is None else (moved - base) / step
