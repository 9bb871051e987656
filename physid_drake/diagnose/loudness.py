"""How loud a noise is that nobody states and no rest shows: as loud as what a model leaves.

Only ratios speak then. The plain cell is taken to leave noise, and an effect has to leave much less of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.linalg import solve_triangular

from physid_drake.diagnose.estimates import rms
from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.linear import own_unknowns
from physid_drake.diagnose.model import Fitted
from physid_drake.pushes.case import Case
from physid_drake.pushes.tracker_noise import FORCE_SCATTER, ForceNoise

Array = NDArray[np.float64]

ROUNDS = 4  # in which the noise is found: the pushes' unknowns take less of it, the louder it is
SETTLED = 1.1  # cost per degree of freedom
SCATTERS = tuple(FORCE_SCATTER * np.geomspace(1.0, 16.0, 9))  # of a wandering force
OFFSETS = (0.0, *np.geomspace(0.02, 0.64, 6))  # of a force that is off over a whole push
ODD = 2.0  # times the usual error of a push: one with more is given its own noise


def as_loud_as_left(case: Case, rough: Case, fitted: Fitted) -> tuple[Case, Case, Fitted]:
    """Noise so large that a model leaves just that, in poses and in forces.

    As loud as most pushes say: one that stands out is louder by itself.

    Args:
        case: with the noise that is assumed at least.
        rough: the same on longer ticks.
        fitted: a model of ``rough``.

    Returns:
        Both cases with that noise, and the model linearised in the second.
    """
    for _ in range(ROUNDS):
        factor, forces, odd = _left_over(rough, fitted)
        case, rough = case.louder(factor, forces, odd), rough.louder(factor, forces, odd)
        fitted = Fitter(rough).linearise(fitted.state)
        if fitted.reduced_chi2 < SETTLED:
            break
    return case, rough, fitted


def quieter(before: Case, after: Case) -> float:
    """Share of the noise's variance that is left."""
    return (after.noise.position / before.noise.position) ** 2


def _left_over(case: Case, fitted: Fitted) -> tuple[float, ForceNoise, list[float]]:
    """How many times their deviations poses are off, at least 1, what the forces are, and how much more each push."""
    poses, forces = _left(case, fitted)
    # The pushes' unknowns took a part of what is left: the cost says how much.
    share = float(np.sqrt(fitted.reduced_chi2 / np.mean(np.concatenate([*poses, *_white(case, forces)]) ** 2)))
    before = case.odd or (1.0,) * len(poses)
    each = [share * rms(left) * times for left, times in zip(poses, before, strict=True)]
    # Squares of normal errors have the median of the chi-square distribution.
    usual = float(np.median([e**2 * len(p) / stats.chi2.median(len(p)) for e, p in zip(each, poses, strict=True)]))
    factor = max(1.0, float(np.sqrt(usual)))
    return factor, _force_noise(case, forces), [max(1.0, e / (ODD * factor)) for e in each]


def _left(case: Case, fitted: Fitted) -> tuple[list[Array], list[Array]]:
    """What a model leaves of poses and of forces, in standard deviations; a list per push, of (k, 2) for forces."""
    poses, forces = [], []
    for push, features in zip(fitted.pushes, case.features, strict=True):
        own = own_unknowns(push, fitted.state.scatter, fitted.solution.beta)
        left = push.residual - push.shared @ fitted.solution.beta - push.own @ own
        count = 3 * len(features.middles)
        poses.append(left[:count])
        forces.append(left[count:].reshape(2, -1).T)
    return poses, forces


def _white(case: Case, forces: Sequence[Array]) -> list[Array]:
    """Forces that are left, in the deviations of the noise that is assumed."""
    noises = (f.force_noise(case.noise.forces) for f in case.features)
    return [
        solve_triangular(np.linalg.cholesky(n), r, lower=True).ravel() for n, r in zip(noises, forces, strict=True)
    ]


def _force_noise(case: Case, forces: Sequence[Array]) -> ForceNoise:
    """The likeliest noise of forces (k, 2) that a model leaves, wandering at least as much as it does anyway."""
    if not sum(map(len, forces)):
        return case.noise.forces

    def cost(noise: ForceNoise) -> float:
        total = 0.0
        for features, left in zip(case.features, forces, strict=True):
            lower = np.linalg.cholesky(features.force_noise(noise))
            total += 4.0 * float(np.log(np.diag(lower)).sum())
            total += float((solve_triangular(lower, left, lower=True) ** 2).sum())
        return total

    return min((ForceNoise(scatter=s, offset=o) for s in SCATTERS for o in OFFSETS), key=cost)
