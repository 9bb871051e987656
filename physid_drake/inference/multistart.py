"""Searches a push's nuisance parameters from many starts, since a push can go two ways."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.push import weighed
from physid_drake.inference.rollouts import Ask
from physid_drake.inference.slopes import nuisance_slopes, nuisance_steps

Array = NDArray[np.float64]

ODD = 1.5  # mean squared error in units of the noise: above it, the fit does not explain a push
DRAWN, STEPS = 4, 4  # starts of a push's nuisance parameters that are drawn; steps from each


def reseated(fitter: Fitter, fit: Fit, rng: np.random.Generator) -> Fit:
    """The fit with better nuisance parameters of the pushes that it does not explain, at the same z.

    An object that is about to slip off the hand goes one way or the other, so that the cost has several minima. Given
    z, a push's cost depends on its own nuisance parameters alone; therefore all pushes are searched in one batch.

    Args:
        fitter: of the fit.
        fit: where to search.
        rng: draws starts.
    """
    left = [y - f for y, f in zip(fitter.predictor.recorded, fit.point.predicted, strict=True)]
    odd = [i for i, errors in enumerate(left) if float(errors @ errors) > ODD * len(errors)]
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


def _starts(nuisance: Array, most: Array, rng: np.random.Generator) -> list[Array]:
    """Where the unknowns (k,) are, zero, and draws."""
    return [nuisance, np.zeros(len(nuisance)), *np.clip(rng.standard_normal((DRAWN, len(nuisance))), -most, most)]
