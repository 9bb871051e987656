"""Process noise: frictions with table and tip that vary along a push's way, estimated from what a model leaves.

Repeated pushes of a real object end millimetres apart, however small the tracker's noise is (K.-T. Yu et al., IROS
2016; M. Bauza and A. Rodriguez, ICRA 2017); no deterministic model explains that. The process noise is estimated from
what the richest hypothesis leaves, so that missing physics is not taken for noise, and is added to the sensors' noise
from then on.
"""

from __future__ import annotations

import dataclasses as dc
import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.push import LinearPush, noise_scale_of, weighed
from physid_drake.inference.scatter import SCATTERS, log_prior_of_scatter

Array = NDArray[np.float64]

SHARES = (0.0, 0.02, 0.04, 0.08, 0.16, 0.32)  # relative standard deviations of friction
EVEN = 0.5  # probability beforehand that both surfaces are even
ROUNDS = 4  # iterations of noise scale and weights


@dc.dataclass(frozen=True, kw_only=True)
class ProcessNoise:
    """Relative standard deviations [-] of the friction with the table, and with the tip, along a push's way."""

    table: float = 0.0
    tip: float = 0.0

    @property
    def is_none(self) -> bool:
        """Whether there is none of either."""
        return self.table == 0.0 and self.tip == 0.0


EVEN_SURFACES = ProcessNoise()


def learned(fitter: Fitter, fit: Fit) -> tuple[ProcessNoise, list[Array]]:
    """The process noise of highest posterior probability beside a fit, out of a grid.

    Args:
        fitter: of the recording.
        fit: where its pushes are linearised.

    Returns:
        It, and what it adds to the covariance (m, m) of each push, in units of the noise.
    """
    found = fitter.predictor.wanders(fit.point.nuisance, fit.hypothesis.physics(fit.point.z))

    def covariances(noise: ProcessNoise) -> list[Array]:
        return [noise.table**2 * w @ w.T + noise.tip**2 * v @ v.T for w, v in found]

    choices = [ProcessNoise(table=table, tip=tip) for table, tip in itertools.product(SHARES, SHARES)]
    uneven = math.log((1.0 - EVEN) / (len(choices) - 1) / EVEN)
    values = [
        _log_likelihood(fitter, fit, covariances(one)) + (0.0 if one.is_none else uneven) for one in choices
    ]  # fmt: skip
    best = choices[int(np.argmax(values))]
    return best, covariances(best)


def _log_likelihood(fitter: Fitter, fit: Fit, added: Sequence[Array]) -> float:
    """Of the pushes where the fit is, with more noise, at the likeliest scatter of friction and noise scale."""
    roots: list[Array] = [np.asarray(np.linalg.cholesky(np.eye(len(one)) + one), dtype=np.float64) for one in added]
    pushes = [_whitened(push, root) for push, root in zip(fit.pushes, roots, strict=True)]
    dets = sum(float(np.log(np.diag(root)).sum()) for root in roots)
    return max(_with_scatter(fitter, fit, pushes, scatter) for scatter in SCATTERS[::2]) - dets


def _whitened(push: LinearPush, root: Array) -> LinearPush:
    residual, nuisance = (solve_triangular(root, one, lower=True) for one in (push.residual, push.nuisance))
    return LinearPush(residual=residual, shared=np.zeros((len(residual), 0)), nuisance=nuisance)


def _with_scatter(fitter: Fitter, fit: Fit, pushes: Sequence[LinearPush], scatter: float) -> float:
    noise_scale, priors = fit.noise_scale, fitter.priors(scatter)
    for _ in range(ROUNDS):
        found = [
            weighed(push.residual, push.shared, push.nuisance, prior, noise_scale, fit.tail)
            for push, prior in zip(pushes, priors, strict=True)
        ]
        squares, counts = [one.square for one in found], [len(push.residual) for push in pushes]
        noise_scale = noise_scale_of(squares, counts, fitter.least, fit.tail)
    return sum(one.log_density for one in found) + log_prior_of_scatter(scatter)
