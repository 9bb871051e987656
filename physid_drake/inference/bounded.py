"""The likeliest of normally distributed unknowns within bounds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

Array = NDArray[np.float64]
Bounds = tuple[Array, Array]


def bounded(precision: Array, right: Array, bounds: Bounds | None) -> Array:
    """The beta (d,) that is likeliest within bounds: no rollout can be made beyond.

    Args:
        precision: (d, d).
        right: (d,) precision times the estimate.
        bounds: least and greatest beta, of as many coordinates as it has, the first; the others have none.
    """
    beta = np.asarray(np.linalg.solve(precision, right), dtype=np.float64) if len(right) else np.zeros(0)
    if bounds is None:
        return beta
    free = len(right) - len(bounds[0])
    least, most = np.append(bounds[0], [-np.inf] * free), np.append(bounds[1], [np.inf] * free)
    if np.all((least <= beta) & (beta <= most)):
        return beta
    # In units in which each alone is known to one: theirs are far apart, and what is least known is not rounding.
    scale = np.diag(precision) ** -0.5
    values, vectors = np.linalg.eigh(precision * np.outer(scale, scale))
    roots = np.sqrt(np.maximum(values, 1e-14 * values[-1]))
    root, scaled = roots[:, None] * vectors.T, (least / scale, most / scale)
    within = lsq_linear(root, (vectors.T @ (right * scale)) / roots, scaled, method="bvls").x
    return np.asarray(np.clip(scale * within, least, most))
