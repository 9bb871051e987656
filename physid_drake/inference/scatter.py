"""The scatter of friction between pushes: a grid of values, and its prior.

It is the relative standard deviation of a push's friction, in units of ``pushes.case.UNIT_SCATTER``.
"""

from __future__ import annotations

import numpy as np

SCATTERS = tuple(np.geomspace(0.15, 8.0, 16).tolist())  # times the unit scatter
SCATTER_PRIOR = (1.0, 0.6)  # median, in units of it, and standard deviation of the logarithm


def log_prior_of_scatter(scatter: float) -> float:
    """Log prior density of the scatter, up to a constant: log-normal with ``SCATTER_PRIOR``."""
    return -0.5 * float(np.log(scatter / SCATTER_PRIOR[0]) / SCATTER_PRIOR[1]) ** 2


def scatters_beside(scatter: float) -> tuple[float, ...]:
    """Every second value of the grid, from two places above the scatter down to the least: what a refit tries.

    Mostly down, since an effect such as a drift of friction leaves less of the scatter to chance.
    """
    k = SCATTERS.index(scatter)
    return SCATTERS[k % 2 : k + 3 : 2]
