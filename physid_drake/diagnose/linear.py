"""Many pushes, linearised: what shared coefficients explain, with each push's own unknowns integrated out.

A push is ``r = A beta + J eta + e`` with eta ~ N(0, I) its own unknowns in units of their priors, e ~ N(0, N)
noise, and beta what all pushes share: theta and effects. What a diagnosis asks is linear algebra on such pushes.
"""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from physid_drake.inference.bounded import Bounds, bounded
from physid_drake.inference.scatter import SCATTERS, log_prior_of_scatter

Array = NDArray[np.float64]


@dc.dataclass(frozen=True, kw_only=True)
class LinearPush:
    """One push, linearised.

    Attributes:
        residual: (m,) recorded less predicted, as if the push's unknowns were zero.
        shared: (m, d) derivatives of the prediction with respect to beta.
        own: (m, k) with respect to the push's unknowns, in units of their priors.
        noise: (m, m) covariance.
        friction: column of ``own`` that is the push's friction, in units of ``UNIT_SCATTER``.
    """

    residual: Array
    shared: Array
    own: Array
    noise: Array
    friction: int

    def covariance(self, scatter: float) -> Array:
        """Covariance (m, m) of the residual, the friction's prior being ``scatter`` times that of the column."""
        own = self.own.copy()
        own[:, self.friction] *= scatter
        covariance: Array = self.noise + own @ own.T
        return covariance


@dc.dataclass(frozen=True, kw_only=True)
class Whitened:
    """All pushes, divided by the roots of their covariances.

    Attributes:
        residuals: one (m_i,) per push.
        shared: one (m_i, d) per push.
        log_determinant: of all covariances.
    """

    residuals: tuple[Array, ...]
    shared: tuple[Array, ...]
    log_determinant: float

    @classmethod
    def of(cls, pushes: Sequence[LinearPush], scatter: float) -> Whitened:
        """Whiten with the Cholesky factors."""
        residuals, shared, total = [], [], 0.0
        for push in pushes:
            lower = np.linalg.cholesky(push.covariance(scatter))
            white = solve_triangular(lower, np.column_stack([push.residual, push.shared]), lower=True)
            residuals.append(np.asarray(white[:, 0]))
            shared.append(np.asarray(white[:, 1:]))
            total += 2.0 * float(np.log(np.diag(lower)).sum())
        return cls(residuals=tuple(residuals), shared=tuple(shared), log_determinant=total)

    @property
    def y(self) -> Array:
        """All residuals (M,)."""
        return np.concatenate(self.residuals)

    @property
    def x(self) -> Array:
        """All derivatives (M, d)."""
        return np.concatenate(self.shared)


@dc.dataclass(frozen=True, kw_only=True)
class Solution:
    """Shared coefficients by penalised least squares.

    Attributes:
        beta: (d,) change of the shared parameters.
        precision: (d, d) of beta, prior included.
        chi2: of what is left, prior included.
        log_likelihood: marginal over the pushes' unknowns, at beta.
    """

    beta: Array
    precision: Array
    chi2: float
    log_likelihood: float


def solve(white: Whitened, prior_mean: Array, prior_std: Array, bounds: Bounds | None = None) -> Solution:
    """Fit beta.

    Args:
        white: the pushes.
        prior_mean: (d,) of beta.
        prior_std: (d,), inf where nothing is known.
        bounds: least and greatest beta, of as many coordinates as it has, the first; the others have none.
    """
    weight = 1.0 / prior_std**2
    precision = white.x.T @ white.x + np.diag(weight)
    right = white.x.T @ white.y + weight * prior_mean
    beta = bounded(precision + 1e-12 * np.trace(precision) * np.eye(len(right)), right, bounds)
    left = white.y - white.x @ beta
    chi2 = float(left @ left) + float(weight @ (beta - prior_mean) ** 2)
    return Solution(beta=beta, precision=precision, chi2=chi2, log_likelihood=-0.5 * (chi2 + white.log_determinant))


def best_scatter(
    pushes: Sequence[LinearPush],
    prior_mean: Array,
    prior_std: Array,
    among: Sequence[float] = (),
    bounds: Bounds | None = None,
) -> tuple[float, float]:
    """The friction's scatter from push to push, in units of the columns', and its log posterior."""
    best = (1.0, -np.inf)
    for scatter in among or SCATTERS:
        value = solve(Whitened.of(pushes, float(scatter)), prior_mean, prior_std, bounds).log_likelihood
        value += log_prior_of_scatter(scatter)
        if value > best[1]:
            best = (float(scatter), float(value))
    return best


def own_unknowns(push: LinearPush, scatter: float, beta: Array) -> Array:
    """Most likely unknowns (k,) of a push, in units of the columns' priors."""
    scale = np.ones(push.own.shape[1])
    scale[push.friction] = scatter
    own = push.own * scale
    factor = cho_factor(push.noise + own @ own.T)
    values: Array = scale * (own.T @ cho_solve(factor, push.residual - push.shared @ beta))
    return values


TOLD = 0.5  # of a friction's spread: a push that leaves more of it does not tell it


def told_frictions(pushes: Sequence[LinearPush], scatter: float, beta: Array) -> tuple[list[int], Array]:
    """Which pushes tell their own friction, and those frictions (k,), in units of the columns'.

    The others' are what the prior says. Which pushes these are does not depend on their order.
    """
    told = [i for i, push in enumerate(pushes) if _left_open(push, scatter) < TOLD]
    return told, np.array([own_unknowns(pushes[i], scatter, beta)[pushes[i].friction] for i in told])


def _left_open(push: LinearPush, scatter: float) -> float:
    """The standard deviation that a push leaves of its friction, over the prior's."""
    own = push.own.copy()
    own[:, push.friction] *= scatter
    precision = np.eye(own.shape[1]) + own.T @ np.linalg.solve(push.noise, own)
    return float(np.sqrt(np.linalg.inv(precision)[push.friction, push.friction]))


def left_out_scores(
    pushes: Sequence[LinearPush],
    scatter: float,
    prior_mean: Array,
    prior_std: Array,
    folds: Sequence[Sequence[int]] | None = None,
    bounds: Bounds | None = None,
) -> tuple[Array, Array]:
    """Predict pushes by a fit to those of the other folds.

    Args:
        pushes: linearised.
        scatter: of friction, in units of the columns'.
        prior_mean: (d,) of beta.
        prior_std: (d,).
        folds: indices of pushes that are left out together; None leaves out one at a time.
        bounds: as in ``solve``.

    Returns:
        (n,) log predictive densities, and (n, d) the beta by which each push was predicted.
    """
    pieces = [_information(push, scatter) for push in pushes]
    information = sum((p[0] for p in pieces), np.diag(1.0 / prior_std**2))
    right = sum((p[1] for p in pieces), prior_mean / prior_std**2)
    ridge = 1e-10 * np.trace(information) * np.eye(len(right))
    scores = np.zeros(len(pushes))
    betas = np.zeros((len(pushes), len(right)))
    for fold in folds or [(i,) for i in range(len(pushes))]:
        others = information - sum(pieces[i][0] for i in fold) + ridge
        beta = bounded(others, right - sum(pieces[i][1] for i in fold), bounds)
        for i in fold:
            scores[i] = _log_density(pushes[i], scatter, beta, others)
            betas[i] = beta
    return scores, betas


def _information(push: LinearPush, scatter: float) -> tuple[Array, Array]:
    """What a push says of beta: precision (d, d) and precision times estimate (d,)."""
    solved = cho_solve(cho_factor(push.covariance(scatter), lower=True), push.shared)
    return push.shared.T @ solved, solved.T @ push.residual


def _log_density(push: LinearPush, scatter: float, beta: Array, precision: Array) -> float:
    """Of a push under beta with its precision (d, d)."""
    spread = push.covariance(scatter) + push.shared @ np.linalg.solve(precision, push.shared.T)
    lower = np.linalg.cholesky(0.5 * (spread + spread.T))
    left = push.residual - push.shared @ beta
    white = solve_triangular(lower, left, lower=True)
    log_root = float(np.log(np.diag(lower)).sum())
    return -0.5 * float(white @ white) - log_root - 0.5 * len(left) * float(np.log(2.0 * np.pi))
