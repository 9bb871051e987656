"""The scatter of friction between pushes: the values that are looked at, and what is known of it beforehand."""

from __future__ import annotations

import numpy as np

SCATTERS = tuple(np.geomspace(0.15, 8.0, 16).tolist())  # times the unit scatter
SCATTER_PRIOR = (1.0, 0.6)  # median, in units of it, and standard deviation of the logarithm


def log_prior_of_scatter(scatter: float) -> float:
    """Of the friction scatter between pushes, but for a constant."""
    return -0.5 * float(np.log(scatter / SCATTER_PRIOR[0]) / SCATTER_PRIOR[1]) ** 2


def scatters_beside(scatter: float) -> tuple[float, ...]:
    """Those that a refit may come to: from a little more down to the least, every second one.

    What orders frictions from push to push leaves less of them to chance.
    """
    k = SCATTERS.index(scatter)
    return SCATTERS[k % 2 : k + 3 : 2]
