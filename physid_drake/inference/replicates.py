"""Distribution of the catalogue's best held-out gain where no effect is there, by replicates of the recording.

Replicates are drawn from a fitted model at this recording's pushes, with its noise and scatter of friction. Each is
refitted and searched with the linearised pushes and the columns of the score tests, without rollouts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.push import ridged
from physid_drake.inference.scatter import log_prior_of_scatter, scatters_beside
from physid_drake.inference.scores import Column, by_family

Array = NDArray[np.float64]

REPLICATES = 300
TAIL_SHARE = 0.15  # of the replicates: their excesses over the least of them give the tail
FEWEST = 10  # replicates in which an effect has the right sign: fewer have no tail
LEAST_SCALE = 1.0  # nats, of a tail: a likelihood ratio of x nats has a chance of exp(-x) at most (Markov)
MOST_GAIN = 1e6  # nats


def without_best(gains: Array) -> Array:
    """Sum of gains (n, ...) over the first axis, that of pushes, without the largest: no push decides alone."""
    return np.asarray(gains.sum(axis=0) - np.where(np.isfinite(gains).all(axis=0), gains.max(axis=0), 0.0))


def of_all(gains: Array) -> Array:
    """Sum of gains (n, ...) over the first axis, that of pushes [log likelihood]."""
    return np.asarray(gains.sum(axis=0))


def gains_by_chance(
    fitter: Fitter,
    fit: Fit,
    found: Sequence[Column],
    rng: np.random.Generator,
    summed: Callable[[Array], Array] = without_best,
) -> tuple[dict[str, float], dict[str, Array]]:
    """Held-out gains of each effect's best family, linearised, in the recording and in replicates without an effect.

    A push whose errors are large in the fit has errors as large in all replicates.

    Args:
        fitter: of the recording.
        fit: the model from which replicates are drawn.
        found: columns of the effects beside it (``scores.columns``).
        rng: draws the replicates.
        summed: makes one number of the gains (n, ...) of n pushes. To claim an effect, no push should decide alone
            (``without_best``); to claim that a model is not enough, one push may (``of_all``).

    Returns:
        By the effects' names, the gain in the recording, and the gains (REPLICATES,) in the replicates [log
        likelihood].
    """
    drawn = [
        np.column_stack([push.residual, _drawn(push.nuisance, prior, one.weight**-0.5, rng)])
        for push, prior, one in zip(fit.pushes, fitter.priors(fit.scatter), fit.weighed, strict=True)
    ]
    tables = [_Table(fitter, fit, found, drawn, scatter) for scatter in scatters_beside(fit.scatter)]
    null = _best([table.scored([]) for table in tables])
    best: dict[str, Array] = {}
    for members in by_family(found):
        gains = summed(_best([table.scored(members) for table in tables]) - null)
        name = found[members[0]].kind.name
        best[name] = np.maximum(best.get(name, gains), gains)
    return {name: float(g[0]) for name, g in best.items()}, {name: g[1:] for name, g in best.items()}


def surprise(values: Array, replicates: Array) -> Array:
    """Minus the logarithm of the probability that a replicate has at least such a value, for each of values (n,).

    Above the quantile that 15 % of the replicates exceed, an exponential tail with their mean excess is used.

    Args:
        values: to look at; not finite where an effect has the wrong sign, whose surprise is 0.
        replicates: (r,) of the same number; those that are not finite count as smaller than any value.

    Where fewer than ``FEWEST`` replicates are finite, every finite value has the surprise log(r).
    """
    some = np.sort(replicates[np.isfinite(replicates)])
    if len(some) < FEWEST:
        return np.where(np.isfinite(values), math.log(len(replicates)), 0.0)
    count = max(1, round(TAIL_SHARE * len(replicates)))
    tail = some[-count:]
    scale = max(float((tail - tail[0]).mean()), LEAST_SCALE)
    above = len(some) - np.searchsorted(some, values)
    within = -np.log(np.maximum(above, 1) / len(replicates))
    beyond = math.log(len(replicates) / len(tail)) + (values - tail[0]) / scale
    return np.asarray(np.where(values > tail[0], beyond, np.where(np.isfinite(values), within, 0.0)))


def gain_of(wanted: float, replicates: Array) -> float:
    """The gain [log likelihood] whose ``surprise`` among the replicates (r,) is ``wanted``."""
    low, high = np.array([0.0]), np.array([1.0])
    while surprise(high, replicates)[0] < wanted and high[0] < MOST_GAIN:
        high *= 2.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if surprise(middle, replicates)[0] < wanted else (low, middle)
    return float(high[0])


def p_value(seen: dict[str, float], by_chance: dict[str, Array]) -> float:
    """Probability, where the fitted model is true, that some effect has a gain as surprising as the recording's best.

    Each effect's gain is compared with that effect's own replicates: an effect with many shapes gains more by chance,
    and would otherwise hide one with a single number. The result takes into account that the best of all is looked
    at.

    Args:
        seen: gain of each effect in the recording [log likelihood].
        by_chance: its gains in the replicates, (REPLICATES,) each.
    """
    if not seen:
        return 1.0
    of_replicates = np.max([surprise(g, g) for g in by_chance.values()], axis=0)
    best = max(float(surprise(np.array([seen[name]]), by_chance[name])[0]) for name in seen)
    return float(np.exp(-surprise(np.array([best]), of_replicates)[0]))


def _drawn(nuisance: Array, prior: Array, noise_scale: float, rng: np.random.Generator) -> Array:
    """Residuals (m, REPLICATES) of a push."""
    noise = noise_scale * rng.standard_normal((len(nuisance), REPLICATES))
    return np.asarray(noise + nuisance @ (prior[:, None] * rng.standard_normal((nuisance.shape[1], REPLICATES))))


def _best(scored: Sequence[tuple[Array, Array]]) -> Array:
    """Held-out densities (n, r) of pushes at the scatter that is likeliest, replicate by replicate."""
    values = np.array([value for value, _ in scored])
    held = np.array([one for _, one in scored])
    return np.asarray(held[np.argmax(values, axis=0), :, np.arange(held.shape[2])].T)


class _Table:
    """Normal equations of all columns, push by push, at one scatter, for drawn residuals (m_i, r) of each."""

    def __init__(
        self, fitter: Fitter, fit: Fit, found: Sequence[Column], drawn: Sequence[Array], scatter: float
    ) -> None:
        self.found, self.n = found, fit.hypothesis.dimension
        self.h, self.off = fit.hypothesis, fit.point.z - fit.hypothesis.mean
        self.prior = np.diag(np.concatenate([np.zeros(self.n), [c.coordinate.std**-2.0 for c in found]]))
        self.prior[: self.n, : self.n] = self.h.precision
        self.log_prior = log_prior_of_scatter(scatter)
        made = [
            _equations(np.column_stack([push.shared, *(c.pushes[i] for c in found)]), push.nuisance * prior,
                       fit.weighed[i].weight, drawn[i])
            for i, (push, prior) in enumerate(zip(fit.pushes, fitter.priors(scatter), strict=True))
        ]  # fmt: skip
        self.precisions, self.rights, self.squares, self.log_dets = map(np.array, zip(*made, strict=True))

    def scored(self, members: Sequence[int]) -> tuple[Array, Array]:
        """Log likelihood (r,) and held-out log densities (n, r) of the model with some of the columns.

        Where the only coordinate of a family would go below its bound, it is none.
        """
        index = np.array([*range(self.n), *(self.n + j for j in members)], dtype=np.intp)
        blocks, rights = self.precisions[:, index[:, None], index], self.rights[:, index]
        whole, right = ridged(self.prior[np.ix_(index, index)] + blocks.sum(axis=0)), rights.sum(axis=0)
        # Of replicates the fitted model is true, and what is known beforehand is about it.
        right[: self.n, 0] -= self.h.precision @ self.off
        inverse, log_det = np.linalg.inv(whole), np.linalg.slogdet(whole)[1]
        beta = inverse @ right
        value = self.log_prior + 0.5 * (_dot(right, beta) - self.squares.sum(axis=0) - self.log_dets.sum())
        off = beta[: self.n].copy()
        off[:, 0] += self.off
        cost = 0.5 * ((self.h.whitening @ off)[self.h.known] ** 2).sum(axis=0) - self.log_prior
        # Each push, given the others; each bears its part of what is unlikely beforehand.
        others = whole - blocks
        b = np.linalg.solve(others, right - rights)
        left = rights - blocks @ b
        squares = self.squares - _dot(b, rights + left) - _dot(left, inverse @ left)
        dets = self.log_dets + log_det - np.linalg.slogdet(others)[1]
        held = -0.5 * (squares + dets[:, None]) - cost / len(blocks)
        if len(members) == 1:
            c = self.found[members[0]]
            wrong = beta[-1] < c.coordinate.lower - c.null
            value, held = np.where(wrong, -np.inf, value), np.where(wrong, -np.inf, held)
        return value, held


def _equations(shared: Array, nuisance: Array, weight: float, drawn: Array) -> tuple[Array, Array, Array, float]:
    """A push's precision (n, n), precision times estimate (n, r), squares (r,) and log determinant of its noise."""
    factor = cho_factor(np.eye(len(nuisance)) / weight + nuisance @ nuisance.T, lower=True)
    solved = cho_solve(factor, shared)
    squares = np.einsum("ij,ij->j", drawn, cho_solve(factor, drawn))
    return shared.T @ solved, solved.T @ drawn, squares, 2.0 * float(np.log(np.diag(factor[0])).sum())


def _dot(first: NDArray[Any], second: NDArray[Any]) -> Array:
    """Of each column, of the last two axes."""
    return np.asarray((first * second).sum(axis=-2), dtype=np.float64)
