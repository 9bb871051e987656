"""A push, linearised in what all pushes share and in its nuisance parameters, which are integrated out.

In units of the noise, a push is r = X dz + J u + e, where u ~ N(0, diag(prior^2)) are its nuisance parameters and
e ~ t_nu(0, s^2 I) its errors: a multivariate t distribution with nu degrees of freedom (``tail``) and the noise scale
s. Its one heavy tail is for the push as a whole: a push that the model explains worse than the others counts less.
All pushes share s, which is 1 where a hypothesis explains them. Far from an explanation s is large; this keeps u near
zero, so that nuisance parameters do not imitate missing physics.
"""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

Array = NDArray[np.float64]

TAIL = 15.0  # degrees of freedom of a push's noise
NO_TAIL = 1e6  # of noise that is normal
TOO_ALIKE = 1e-10  # least eigenvalue of information scaled to a diagonal of 1: less is rounding
WEIGHINGS = 5  # iterations of a push's weight and its nuisance parameters


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class LinearPush:
    """One push, linearised at a point z; all in units of the noise.

    Attributes:
        residual: r (m,), recorded less predicted features, had the push's nuisance parameters been zero.
        shared: X (m, n), derivatives of the prediction with respect to z.
        nuisance: J (m, k), derivatives with respect to u.
    """

    residual: Array
    shared: Array
    nuisance: Array


def cost_of(square: float, count: int, noise_scale: float, tail: float) -> float:
    """Twice the negative log density of a push's errors e, up to a constant.

    Args:
        square: e^T e.
        count: m, the number of errors.
        noise_scale: s.
        tail: nu, degrees of freedom.
    """
    return (tail + count) * math.log1p(square / (tail * noise_scale**2)) + 2.0 * count * math.log(noise_scale)


def weight_of(square: float, count: int, noise_scale: float, tail: float) -> float:
    """Weight of a push: the factor on its squared errors in the Gaussian that stands for the t distribution.

    It is 1 / s^2 where the mean squared error is s^2, and less where errors are larger.
    Arguments as in ``cost_of``.

    Source: K. Lange, R. Little, J. Taylor, J. Am. Stat. Assoc. 84, 1989.
    """
    return (tail + count) / (tail * noise_scale**2 + square)


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Weighed:
    """A push with its nuisance parameters integrated out.

    Attributes:
        precision: (n, n), information of the push about dz.
        right: (n,), precision times the push's estimate of dz.
        nuisance: (k,), the most probable u at dz = 0.
        to_nuisance: (k, n), derivative of the most probable u with respect to dz.
        log_density: of the push at dz = 0, u integrated out.
        square: e^T e of the errors at dz = 0 and the most probable u.
        weight: of the push, as in ``weight_of``.
    """

    precision: Array
    right: Array
    nuisance: Array
    to_nuisance: Array
    log_density: float
    square: float
    weight: float


def weighed(
    residual: Array, shared: Array, nuisance: Array, prior: Array, noise_scale: float, tail: float = TAIL
) -> Weighed:
    """Integrate a push's nuisance parameters out, by Laplace's approximation.

    Args:
        residual: r (m,).
        shared: X (m, n).
        nuisance: J (m, k).
        prior: (k,), standard deviations of u.
        noise_scale: s.
        tail: nu, degrees of freedom of the errors.
    """
    count, total = len(residual), float(residual @ residual)
    scaled = nuisance * prior  # of unknowns v = u / prior ~ N(0, I); in the eigenvectors' basis all is diagonal
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    basis = scaled @ vectors
    moment, cross = basis.T @ residual, basis.T @ shared
    w = noise_scale**-2.0
    for _ in range(WEIGHINGS):
        v = w * moment / (1.0 + w * values)
        w = weight_of(max(0.0, total - float(v @ (2.0 * moment - values * v))), count, noise_scale, tail)
    share = w / (1.0 + w * values)
    v = share * moment
    errors = residual - basis @ v
    square = float(errors @ errors)
    log_det = float(np.log1p(w * np.maximum(values, 0.0)).sum())
    twice = cost_of(square, count, noise_scale, tail) + float(v @ v) + log_det
    return Weighed(
        precision=w * (shared.T @ shared - cross.T @ (share[:, None] * cross)),
        right=w * (shared.T @ residual - cross.T @ v),
        nuisance=prior * (vectors @ v), to_nuisance=-prior[:, None] * (vectors @ (share[:, None] * cross)),
        log_density=_log_constant(count, tail) - 0.5 * twice, square=square, weight=w,
    )  # fmt: skip


def _log_constant(count: int, tail: float) -> float:
    return float(gammaln(0.5 * (tail + count)) - gammaln(0.5 * tail)) - 0.5 * count * math.log(tail * math.pi)


def noise_scale_of(squares: Sequence[float], counts: Sequence[int], least: float, tail: float) -> float:
    """The noise scale s of highest likelihood for pushes with known errors, by expectation maximisation.

    Args:
        squares: e^T e of each push.
        counts: m of each push.
        least: smallest s.
        tail: nu, degrees of freedom of a push's errors.

    Source: K. Lange, R. Little, J. Taylor, J. Am. Stat. Assoc. 84, 1989.
    """
    q, m = np.array(squares), np.array(counts, dtype=np.float64)
    square = max(least**2, float(np.median(q / m)))
    for _ in range(50):
        square = max(least**2, float(np.sum((tail + m) / (tail * square + q) * q) * square / m.sum()))
    return math.sqrt(square)


def held_out(
    pushes: Sequence[LinearPush],
    priors: Sequence[Array],
    mean: Array,
    precision: Array,
    noise_scale: float,
    found: Sequence[Weighed],
    tail: float = TAIL,
    folds: Sequence[Sequence[int]] | None = None,
) -> Array:
    """Log predictive density of each push, given the other pushes or those outside its fold.

    Args:
        pushes: linearised at the fitted z.
        priors: (k,) of each push, standard deviations of its nuisance parameters.
        mean: (n,), prior mean of dz.
        precision: (n, n), prior precision of dz.
        noise_scale: s.
        found: the same pushes, weighed.
        tail: nu, degrees of freedom of the errors.
        folds: indices of pushes that are held out together; None holds out each alone.

    Returns:
        An array with one number per push.
    """
    scores = np.zeros(len(pushes))
    for fold in [[i] for i in range(len(pushes))] if folds is None else folds:
        dz, root = without(fold, mean, precision, found)
        for i in fold:
            push = pushes[i]
            scores[i] = weighed(
                push.residual - push.shared @ dz, np.zeros((len(push.residual), 0)),
                np.column_stack([push.nuisance, push.shared @ root]), np.concatenate([priors[i], np.ones(len(dz))]),
                noise_scale, tail,
            ).log_density  # fmt: skip
    return scores


def without(fold: Sequence[int], mean: Array, precision: Array, found: Sequence[Weighed]) -> tuple[Array, Array]:
    """Posterior of dz without some pushes.

    Args:
        fold: indices of the pushes that are left out.
        mean: (n,), prior mean of dz.
        precision: (n, n), prior precision of dz.
        found: all pushes, weighed.

    Returns:
        The mean (n,), and R (n, n) with R R^T the covariance.
    """
    kept = [one for i, one in enumerate(found) if i not in fold]
    information = sum((one.precision for one in kept), precision)
    right = sum((one.right for one in kept), precision @ mean)
    # Scaled to a diagonal of 1, since units differ by orders of magnitude; what nothing is known of gets a ridge.
    nothing = np.where(np.diag(information) > 0.0, 0.0, TOO_ALIKE * np.trace(information))
    information = information + np.diag(nothing)
    scale = np.diag(information) ** -0.5
    values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
    root = scale[:, None] * vectors / np.sqrt(np.maximum(values, TOO_ALIKE))
    return root @ (root.T @ right), root


def normal_equations(found: Sequence[Weighed], mean: Array, precision: Array) -> tuple[Array, Array]:
    """Posterior precision (n, n) of dz given all pushes, and that precision times the posterior mean (n,).

    Args:
        found: the pushes, weighed.
        mean: (n,), prior mean of dz.
        precision: (n, n), prior precision of dz.
    """
    whole = sum((one.precision for one in found), precision)
    right = sum((one.right for one in found), precision @ mean)
    return ridged(np.asarray(whole)), np.asarray(right)


def ridged(precision: Array) -> Array:
    """The precision (n, n) with a ridge that makes it invertible: each diagonal entry grows by a factor of 1 + 1e-12.

    This does not depend on the coordinates' units. A coordinate whose diagonal entry is 0, which neither a push nor
    the prior says anything about, gets 1e-12 of the trace instead.
    """
    size = np.diag(precision)
    return precision + np.diag(1e-12 * np.where(size > 0.0, size, float(size.sum())))
