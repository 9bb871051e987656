"""Estimates a noise that the recording does not state and no rest shows: as large as what the baseline model leaves.

Then only ratios count: the baseline is assumed to leave noise alone, and an effect has to leave much less.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from physid_drake.inference.fit import Fit, Fitter
from physid_drake.pushes.case import Case
from physid_drake.pushes.tracker_noise import FORCE_SCATTER, ForceNoise

Array = NDArray[np.float64]

SCATTERS = tuple(FORCE_SCATTER * np.geomspace(1.0, 16.0, 9))  # of a wandering force
OFFSETS = (0.0, *np.geomspace(0.02, 0.64, 6))  # of an error of the force that is constant over a push


def as_loud_as_left(fitter: Fitter, fit: Fit) -> Case:
    """The case with noise as large as the errors that a model leaves in most pushes, and no smaller than it was."""
    forces: list[Array] = []
    for i, (push, features) in enumerate(zip(fit.pushes, fitter.case.features, strict=True)):
        left = np.linalg.solve(fitter.predictor.whitening[i], push.residual - push.nuisance @ fit.point.nuisance[i])
        forces.append(np.asarray(left[features.pose_numbers :].reshape(2, -1).T, dtype=np.float64))
    return fitter.case.louder(max(1.0, fit.noise_scale), _force_noise(fitter.case, forces))


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
