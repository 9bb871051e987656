"""Searches from many starts: a push can go two ways, and a bounce or a magnet's core acts all at once."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.push import weighed
from physid_drake.inference.rollouts import Ask
from physid_drake.inference.slopes import nuisance_slopes, nuisance_steps

Array = NDArray[np.float64]

ODD = 1.5  # mean squared error in units of the noise: above it, the fit does not explain a push
DRAWN, STEPS = 4, 4  # starts of a push's nuisance parameters that are drawn; steps from each
SIZES, BASINS, ROUNDS = 8, 4, 8  # moves of a coordinate each way; points that are fitted, and steps from each
FURTHEST = 100.0  # standard deviations, where a coordinate has no bound


def reseated(fitter: Fitter, fit: Fit, rng: np.random.Generator) -> Fit:
    """The fit with better nuisance parameters of the pushes that it does not explain, at the same z.

    An object that is about to slip off the hand goes one way or the other, so that the cost has several minima. Given
    z, a push's cost depends on its own nuisance parameters alone; therefore all pushes are searched in one batch.

    Args:
        fitter: of the fit.
        fit: where to search.
        rng: draws starts.
    """
    odd = _odd(fitter, fit)
    if not odd:
        return fit
    h, point = fit.hypothesis, fit.point
    physics, priors = h.physics(point.z), fitter.priors(fit.scatter)
    added = [more @ point.z[h.simulated :] for more in fitter.tolerances]

    def cost(i: int, nuisance: Array, predicted: Array) -> float:
        return fitter.cost_of_push(i, nuisance, predicted, priors[i], fit.noise_scale, fit.tail)

    nuisances = list(point.nuisance)
    best = [
        cost(i, nuisance, predicted)
        for i, (nuisance, predicted) in enumerate(zip(nuisances, point.predicted, strict=True))
    ]
    seats = [(i, seat) for i in odd for seat in _starts(nuisances[i], fitter.most[i], rng)]
    for _ in range(STEPS):
        asks = [Ask(i, physics, one) for i, seat in seats for one in (seat, *nuisance_steps(seat))]
        vectors, again = iter(fitter.predictor.vectors(asks)), []
        for i, seat in seats:
            base = next(vectors)
            if base is None:
                for _ in seat:
                    next(vectors)
                continue
            here = cost(i, seat, base + added[i])
            if here < best[i]:
                best[i], nuisances[i] = here, seat
            nuisance = nuisance_slopes(base, seat, vectors)
            residual = fitter.predictor.recorded[i] - base - added[i] + nuisance @ seat
            none = np.zeros((len(residual), 0))
            step = weighed(residual, none, nuisance, priors[i], fit.noise_scale, fit.tail)
            again.append((i, np.clip(step.nuisance, -fitter.most[i], fitter.most[i])))
        seats = again
    if all(new is old for new, old in zip(nuisances, point.nuisance, strict=True)):
        return fit
    moved = fitter.points([h], [point.z], [tuple(nuisances)])[0]
    return fit if moved is None else fitter.started([h], [moved], [None], fit.tail)[0]


def refound(fitter: Fitter, fit: Fit) -> Fit:
    """A likelier fit of the same hypothesis from elsewhere along its effects' coordinates, where pushes are left odd.

    Each coordinate is moved both ways, by one standard deviation up to its bound, and all others follow as the
    linearised posterior has it. The best of these points are fitted.

    Args:
        fitter: of the fit.
        fit: where to search.
    """
    h, z = fit.hypothesis, fit.point.z
    moves = _along_profiles(fitter, fit) if _odd(fitter, fit) else []
    if not moves:
        return fit
    zs = [np.clip(z + move, *h.bounds) for move in moves]
    nuisances = [
        tuple(
            np.clip(one.nuisance + one.to_nuisance @ (there - z), -most, most)
            for one, most in zip(fit.weighed, fitter.most, strict=True)
        )
        for there in zs
    ]
    points = [point for point in fitter.points([h] * len(zs), zs, nuisances) if point is not None]
    points.sort(key=lambda point: fitter.cost(h, point, fit.scatter, fit.noise_scale, fit.tail))
    best = points[:BASINS]
    fits = fitter.fitted(fitter.started([h] * len(best), best, [fit] * len(best), fit.tail), ROUNDS)
    return max([fit, *fits], key=lambda one: one.log_likelihood)


def _along_profiles(fitter: Fitter, fit: Fit) -> list[Array]:
    """Moves (n,) of z, each along the profile of one of the effects' coordinates."""
    h, covariance = fit.hypothesis, fitter.covariance(fit)
    moves: list[Array] = []
    for j in range(h.space.dimension, h.simulated):
        std = math.sqrt(covariance[j, j])
        for way, bound in zip((-1.0, 1.0), h.bounds, strict=True):
            room = min(abs(float(bound[j] - fit.point.z[j])), FURTHEST * std)
            if room >= std:
                moves += [way * size * covariance[:, j] / std**2 for size in np.geomspace(std, room, SIZES)]
    return moves


def _odd(fitter: Fitter, fit: Fit) -> list[int]:
    """Indices of the pushes that a fit does not explain."""
    left = [y - f for y, f in zip(fitter.predictor.recorded, fit.point.predicted, strict=True)]
    return [i for i, errors in enumerate(left) if float(errors @ errors) > ODD * len(errors)]


def _starts(nuisance: Array, most: Array, rng: np.random.Generator) -> list[Array]:
    """Where the unknowns (k,) are, zero, and draws."""
    return [nuisance, np.zeros(len(nuisance)), *np.clip(rng.standard_normal((DRAWN, len(nuisance))), -most, most)]
