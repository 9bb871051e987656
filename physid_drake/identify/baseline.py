"""Fits the hypothesis without effects from many starts, and with errors that are no missing physics."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.effects import tolerated
from physid_drake.errors import RecordingError
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.hypothesis import Hypothesis
from physid_drake.inference.multistart import reseated
from physid_drake.inference.predictions import Predictor
from physid_drake.inference.push import TAIL
from physid_drake.inference.rollouts import Ask, Physics
from physid_drake.inference.scores import columns
from physid_drake.inference.unknown_noise import as_loud_as_left
from physid_drake.pushes.case import Case

Array = NDArray[np.float64]

CANDIDATES, STARTS = 64, 4  # points of theta that are looked at, and from which the baseline is fitted
LAST = 8  # steps of a fit
RESEATINGS, WORTH = 12, 1.0  # most searches; gain of log likelihood that is worth another
TRIED = 8  # thetas beside the nominal one: a push that fails at all of them is left to the cell, or out
STICKS = "static_ratio"  # a parameter that the twin does not know: static over kinetic friction


def fitter_of(case: Case, seed: int) -> Fitter:
    """A fitter for a case, without the pushes that cannot be rolled out.

    Where the recording neither states nor shows the tracker's noise, it is estimated from what the baseline model
    leaves.

    Args:
        case: the recording, made ready.
        seed: of the starts of that fit of the baseline model.

    Raises:
        RecordingError: if no push can be rolled out.
    """
    case, by_cell = _rolled_by(case)
    fitter = Fitter(case, Predictor(case, by_cell))
    if not case.noise.known:
        case = as_loud_as_left(fitter, baseline(fitter, np.random.default_rng(seed)))
        fitter = Fitter(case, Predictor(case, by_cell))
    return fitter


def _rolled_by(case: Case) -> tuple[Case, tuple[int, ...]]:
    """The case without pushes that nothing can roll out, and those that only the cell can."""
    space = case.thetas.space
    thetas = [space.nominal, *space.sample(np.random.default_rng(0), TRIED, from_prior=True)]

    def lost(predictor: Predictor, pushes: Sequence[int]) -> list[int]:
        for theta in thetas:
            nuisance = [np.zeros(len(n.names)) for n in case.nuisances]
            asks = [Ask(i, Physics(np.asarray(theta)), nuisance[i]) for i in pushes]
            pushes = [i for i, vector in zip(pushes, predictor.vectors(asks), strict=True) if vector is None]
        return list(pushes)

    every = range(len(case.problems))
    by_cell = list(every) if STICKS in space.names else lost(Predictor(case), every)
    gone = lost(Predictor(case, every), by_cell)
    names = [case.problems[i].name for i in by_cell if i not in gone]
    case = case.without(gone) if gone else case
    return case, tuple(i for i, problem in enumerate(case.problems) if problem.name in names)


def baseline_hypothesis(case: Case) -> Hypothesis:
    """The hypothesis without effects."""
    return Hypothesis(space=case.thetas.space, around=case.around)


def baseline(fitter: Fitter, rng: np.random.Generator, starts: Sequence[Array] = ()) -> Fit:
    """The baseline model, fitted on the twin from the best of many starts.

    Args:
        fitter: of the recording.
        rng: draws starts from the prior.
        starts: thetas (d,) that are tried beside these, each entry in its unit.

    Raises:
        RecordingError: if no start can be rolled out.
    """
    hypothesis = baseline_hypothesis(fitter.case)
    space = hypothesis.space
    drawn = [*starts, *space.sample(rng, CANDIDATES - 1, from_prior=True)]
    zs = [hypothesis.mean, *(np.clip(space.to_unit(theta), *hypothesis.bounds) for theta in drawn)]
    points = fitter.points([hypothesis] * len(zs), zs, [fitter.at_rest()] * len(zs))
    best = sorted((p for p in points if p is not None), key=fitter.roughly)[:STARTS]
    if not best:
        name = fitter.case.recording.name
        raise RecordingError(
            f"recording '{name}': no parameters were found with which all of its pushes can be simulated."
        )
    fits = fitter.fitted(fitter.started([hypothesis] * len(best), best, [None] * len(best)), LAST)
    fits = fitter.fitted(fitter.renewed(fitter.robust(fits)), LAST)
    return settled(fitter, max(fits, key=lambda f: f.log_likelihood), rng)


def settled(fitter: Fitter, fit: Fit, rng: np.random.Generator) -> Fit:
    """The fit after repeated searches for better nuisance parameters, each followed by a fit.

    The searches are those of ``multistart.reseated``. It ends after two searches in a row that gain nothing, since
    starts are drawn and one search may miss a better minimum.

    Args:
        fitter: of the fit.
        fit: where to begin.
        rng: draws starts.
    """
    in_vain = 0
    for _ in range(RESEATINGS):
        seated = reseated(fitter, fit, rng)
        again = fitter.fitted([seated.again()], LAST)[0]
        gained = again.log_likelihood - fit.log_likelihood
        in_vain = 0 if gained > WORTH else in_vain + 1
        if in_vain > 1 or (in_vain and seated is fit):
            return again if gained > 0.0 else fit
        fit = again if gained > 0.0 else fit
    return fit


def with_tolerances(fitter: Fitter, fit: Fit) -> Fit:
    """The fit with errors that are no missing physics, fitted anew; the fitter is changed to have them.

    Each push's hand path has the errors that its stream's noise allows; all pushes share slight errors of sizes, of
    the pressure, of centres and of clocks (``effects.tolerated``).
    """
    h, predictor = fit.hypothesis, fitter.predictor
    predictor.with_directions(predictor.path_errors(fit.point.nuisance, h.physics(fit.point.z)))
    fit = fitted_at(fitter, h, fit.point.z, fit)
    found = columns(fitter, fit, tolerated(fitter.case.around))
    slight = [c for c in found if c.coordinate.tolerance > 0.0 and c.family.size == 1.0]
    fitter.shared_by_all([
        np.column_stack([np.zeros((len(y), 0)), *(c.coordinate.tolerance * c.pushes[i] for c in slight)])
        for i, y in enumerate(predictor.recorded)
    ])  # fmt: skip
    h = dc.replace(h, tolerances=len(slight))
    return fitted_at(fitter, h, np.concatenate([fit.point.z, np.zeros(len(slight))]), fit)


def fitted_at(fitter: Fitter, h: Hypothesis, z: Array, near: Fit) -> Fit:
    """A hypothesis fitted from z (n,), which can be rolled out, and from the nuisance parameters of another fit."""
    point = fitter.points([h], [z], [near.point.nuisance])[0]
    assert point is not None
    return fitter.fitted(fitter.started([h], [point], [None], TAIL), LAST)[0]
