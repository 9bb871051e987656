"""What friction changes with between pushes, where it differs by more than usual."""

from __future__ import annotations

import numpy as np
from scipy import stats

from physid_drake.diagnose.regimes import speed_of
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.pushes.case import Case

FEWEST = 6  # pushes
CHANCE = 0.05  # of the best of all looks


def friction_trend(fitter: Fitter, fit: Fit) -> str | None:
    """Which property of a push its friction is correlated with, in words; None where none is significant.

    Properties are the length of the object's motion, the speed of the push and its number. The strongest of Kendall's
    rank correlations is reported if its p-value, corrected for three looks, is below ``CHANCE``.

    Args:
        fitter: of the fit.
        fit: the model with a friction for each push.
    """
    case, frictions = fitter.case, fitter.frictions(fit)
    every = range(len(frictions))
    if len(every) < FEWEST:
        return None
    looks = {
        "for longer motions": [_way(case, i) for i in every],
        "at higher speed": [speed_of(case, i) for i in every],
        "in later pushes": [float(case.problems[i].order) for i in every],
    }
    seen = {words: stats.kendalltau(frictions, values) for words, values in looks.items()}
    best = min(seen, key=lambda words: float(np.nan_to_num(seen[words].pvalue, nan=1.0)))
    if not len(looks) * seen[best].pvalue < CHANCE:
        return None
    tau = float(seen[best].statistic)
    return f"{'higher' if tau > 0.0 else 'lower'} {best} (rank correlation {tau:.2f})"


def _way(case: Case, i: int) -> float:
    """From the object's start to its end [m]."""
    problem = case.problems[i]
    return float(np.linalg.norm(problem.poses[-1, :2] - np.array(problem.start.pose[:2])))
