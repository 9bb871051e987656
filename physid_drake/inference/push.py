"""A push, linearised in what all pushes share and in its per-push parameters, which are integrated out.

In units of the noise, a push is r = X dz + J u + e with u ~ N(0, diag(prior^2)) its nuisance parameters and
e ~ t_nu(0, noise scale^2 I): one heavy tail for a push as a whole, so that a push about which something else is odd
counts less, the less the further it is off. The noise scale is shared by all pushes: 1 where a hypothesis explains
them. Far from an explanation it is large; then u stays near zero and cannot imitate what is missing.
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
TOO_ALIKE = 1e-10  # of information about coordinates that act alike, as a share of that about each: less is rounding
WEIGHINGS = 5  # rounds in which a push's weight and unknowns find each other


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class LinearPush:
    """One push at a point z.

    Attributes:
        residual: (m,) recorded less predicted, as if the push's nuisance parameters were zero.
        shared: (m, n) derivatives of the prediction with respect to z.
        nuisance: (m, k) with respect to u.
    """

    residual: Array
    shared: Array
    nuisance: Array


def cost_of(square: float, count: int, noise_scale: float, tail: float) -> float:
    """Twice the negative log density of ``count`` errors e with e^T e = ``square``, but for a constant."""
    return (tail + count) * math.log1p(square / (tail * noise_scale**2)) + 2.0 * count * math.log(noise_scale)


def weight_of(square: float, count: int, noise_scale: float, tail: float) -> float:
    """What a push counts: 1 where its errors are as large as noise."""
    return (tail + count) / (tail * noise_scale**2 + square)


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Weighed:
    """A push with its unknowns integrated out.

    Attributes:
        precision: (n, n) that it gives z.
        right: (n,) precision times estimate.
        nuisance: (k,) most likely unknowns at dz = 0.
        to_own: (k, n) how they change with dz.
        log_density: of the push at dz = 0.
        square: of its errors there.
        weight: of them.
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
    """Integrate a push's nuisance parameters out, by Laplace's method.

    Args:
        residual: (m,).
        shared: (m, n).
        nuisance: (m, k).
        prior: (k,) standard deviations of u.
        noise_scale: of all pushes.
        tail: degrees of freedom of their errors.
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
    """The likeliest noise scale of pushes whose errors are known.

    The scale of a t distribution, by expectation maximisation.

    Args:
        squares: of each push's errors, e^T e.
        counts: of them.
        least: that it can be.
        tail: degrees of freedom of a push's errors.
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
    """Log predictive density (n,) of each push given the others.

    Args:
        pushes: linearised at the fitted z.
        priors: (k,) of each push's nuisance parameters.
        mean: (n,) of the prior of dz.
        precision: (n, n) of it.
        noise_scale: of the pushes.
        found: the pushes, weighed.
        tail: degrees of freedom of their errors.
        folds: indices of pushes that are held out together; each alone where None.
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
    """What all pushes but some say of dz: estimate (n,), and a root (n, n) of its covariance."""
    kept = [one for i, one in enumerate(found) if i not in fold]
    information = sum((one.precision for one in kept), precision)
    right = sum((one.right for one in kept), precision @ mean)
    # In units in which each coordinate alone is known to one: theirs are far apart, and some no push may tell.
    nothing = np.where(np.diag(information) > 0.0, 0.0, TOO_ALIKE * np.trace(information))
    information = information + np.diag(nothing)
    scale = np.diag(information) ** -0.5
    values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
    root = scale[:, None] * vectors / np.sqrt(np.maximum(values, TOO_ALIKE))
    return root @ (root.T @ right), root


def normal_equations(found: Sequence[Weighed], mean: Array, precision: Array) -> tuple[Array, Array]:
    """Precision (n, n) of dz, and precision times estimate (n,), with a prior of such a mean and precision."""
    whole = sum((one.precision for one in found), precision)
    right = sum((one.right for one in found), precision @ mean)
    return ridged(np.asarray(whole)), np.asarray(right)


def ridged(precision: Array) -> Array:
    """A precision (n, n) that can be inverted: 1e-12 more of each variance's inverse, whatever the units.

    What nothing says anything about gets that part of the trace instead.
    """
    size = np.diag(precision)
    return precision + np.diag(1e-12 * np.where(size > 0.0, size, float(size.sum())))
