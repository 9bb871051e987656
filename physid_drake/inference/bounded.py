"""The most probable value of normally distributed unknowns that must stay within bounds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

Array = NDArray[np.float64]
Bounds = tuple[Array, Array]


def bounded(precision: Array, right: Array, bounds: Bounds | None) -> Array:
    """The beta (d,) within bounds that minimises 0.5 beta^T P beta - right^T beta, P being the precision.

    Outside the bounds no rollout can be made.

    Args:
        precision: P (d, d), symmetric, positive definite.
        right: (d,) precision times the unbounded estimate.
        bounds: least and greatest values of the first coordinates, (b,) each with b <= d; the remaining d - b are
            not bounded. None bounds none.
    """
    beta = np.asarray(np.linalg.solve(precision, right), dtype=np.float64) if len(right) else np.zeros(0)
    if bounds is None:
        return beta
    free = len(right) - len(bounds[0])
    least, most = np.append(bounds[0], [-np.inf] * free), np.append(bounds[1], [np.inf] * free)
    if np.all((least <= beta) & (beta <= most)):
        return beta
    # Scaled to a diagonal of 1: units differ by orders of magnitude, and small eigenvalues are no rounding.
    scale = np.diag(precision) ** -0.5
    values, vectors = np.linalg.eigh(precision * np.outer(scale, scale))
    roots = np.sqrt(np.maximum(values, 1e-14 * values[-1]))
    root, scaled = roots[:, None] * vectors.T, (least / scale, most / scale)
    within = lsq_linear(root, (vectors.T @ (right * scale)) / roots, scaled, method="bvls").x
    return np.asarray(np.clip(scale * within, least, most))
