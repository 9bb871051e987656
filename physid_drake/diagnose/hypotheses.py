"""All hypotheses fitted: proposals in one queue, of which the better half goes on."""

from __future__ import annotations

import dataclasses as dc
from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.proposals import Proposal, proposals
from physid_drake.effects import Effect, applicable
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.hypothesis import Hypothesis
from physid_drake.inference.predictions import Physics
from physid_drake.inference.push import TAIL
from physid_drake.inference.scores import Column, columns, scores
from physid_drake.inference.seats import reseated

Array = NDArray[np.float64]

CANDIDATES, STARTS = 64, 4  # points of theta that are looked at, and from which the baseline is fitted
FIRST, SECOND, LAST = 2, 4, 8  # steps of a fit before the halvings, and after them
FINALISTS = 8
BESIDE = 12  # families of score tests beside a single effect
RESEATINGS, WORTH = 3, 1.0  # at most, while one gains so much log likelihood


def baseline(fitter: Fitter, hypothesis: Hypothesis, rng: np.random.Generator) -> Fit:
    """The model without effects, fitted from the best of many starts.

    Raises:
        ValueError: if the twin can roll out none of them.
    """
    space = hypothesis.space
    drawn = [np.asarray(space.to_unit(theta)) for theta in space.sample(rng, CANDIDATES - 1, from_prior=True)]
    zs = [hypothesis.mean, *(np.clip(z, *hypothesis.bounds) for z in drawn)]
    points = fitter.points([hypothesis] * len(zs), zs, [fitter.at_rest()] * len(zs))
    best = sorted((p for p in points if p is not None), key=fitter.roughly)[:STARTS]
    if not best:
        raise ValueError("the twin can roll out no point of theta")
    fits = fitter.fitted(fitter.started([hypothesis] * len(best), best, [None] * len(best)), LAST)
    fits = fitter.fitted(fitter.renewed(fitter.robust(fits)), LAST)
    return settled(fitter, max(fits, key=lambda f: f.log_likelihood), rng)


def settled(fitter: Fitter, fit: Fit, rng: np.random.Generator) -> Fit:
    """The fit with each push on the better of its ways, fitted again while that helps."""
    for _ in range(RESEATINGS):
        again = fitter.fitted([reseated(fitter, fit, rng).again()], LAST)[0]
        gained = again.log_likelihood - fit.log_likelihood
        fit = again if gained > 0.0 else fit
        if gained < WORTH:
            break
    return fit


def with_tolerances(fitter: Fitter, fit: Fit) -> tuple[Fit, list[Column]]:
    """The model with what pushes may differ by without its being physics, and the catalogue's columns beside it.

    Each push's hand path has the errors that its stream's noise allows; all share slight errors of size, pressure,
    centre and clocks.
    """
    h, predictor = fit.hypothesis, fitter.predictor
    predictor.with_directions(predictor.path_errors(fit.point.own, Physics(h.theta(fit.point.z))))
    fit = _at(fitter, h, fit.point.z, fit)
    found = columns(fitter, fit, applicable(fitter.case.around))
    slight = [c for c in found if c.coordinate.tolerance > 0.0 and c.family.size == 1.0]
    fitter.shared_by_all([
        np.column_stack([np.zeros((len(y), 0)), *(c.coordinate.tolerance * c.pushes[i] for c in slight)])
        for i, y in enumerate(predictor.recorded)
    ])  # fmt: skip
    h = dc.replace(h, tolerances=len(slight))
    return _at(fitter, h, np.concatenate([fit.point.z, np.zeros(len(slight))]), fit), found


def _at(fitter: Fitter, h: Hypothesis, z: Array, near: Fit) -> Fit:
    """A hypothesis fitted from a point that can be rolled out."""
    point = fitter.points([h], [z], [near.point.own])[0]
    assert point is not None
    return fitter.fitted(fitter.started([h], [point], [None], TAIL), LAST)[0]


def with_one_more(fitter: Fitter, fit: Fit, found: Sequence[Column]) -> list[Fit]:
    """The model with each of the effects beside it whose columns are given, fitted; the best of each, best first."""
    return halved(fitter, fit, proposals(fit, scores(fitter, fit, found)))


def with_two(fitter: Fitter, singles: Sequence[Fit], kinds: Sequence[type[Effect]]) -> list[Fit]:
    """Pairs of effects, fitted, best first: the best single ones, each with what scores best beside it."""
    found: list[Proposal] = []
    for single in singles:
        present = {part.kind for part in single.hypothesis.parts}
        beside = columns(fitter, single, [kind for kind in kinds if kind not in present])
        found += proposals(single, scores(fitter, single, beside)[:BESIDE])
    return halved(fitter, singles[0], found, of_each=1)


def halved(fitter: Fitter, near: Fit, found: Sequence[Proposal], of_each: int = 2) -> list[Fit]:
    """The best fit of each hypothesis, by successive halving of the proposals.

    Args:
        fitter: fits.
        near: whose derivatives by the pushes' own unknowns will do at first.
        found: the proposals.
        of_each: hypothesis so many proposals are kept at the first halving; none of a pair's at later ones.
    """
    hypotheses = [p.hypothesis for p in found]
    points = fitter.points(hypotheses, [p.z for p in found], [fitter.at_rest()] * len(found))
    rolled = [(h, p) for h, p in zip(hypotheses, points, strict=True) if p is not None]
    rolled.sort(key=lambda one: fitter.roughly(one[1]))
    rolled = [rolled[k] for k in _kept([h.name for h, _ in rolled], len(rolled) // 2, of_each)]
    fits = fitter.started([h for h, _ in rolled], [p for _, p in rolled], [near] * len(rolled))
    fits = _by_cost(fitter.fitted(fits, FIRST))
    fits = [fits[k] for k in _kept([f.hypothesis.name for f in fits], len(fits) // 2, of_each - 1)]
    fits = _by_cost(fitter.fitted(fitter.robust(fitter.fitted(fits, SECOND)), SECOND))
    best = [fits[k] for k in _kept([f.hypothesis.name for f in fits], 0, 1)]
    last = fitter.fitted(fitter.renewed(best[:FINALISTS]), LAST)
    return sorted([*last, *best[FINALISTS:]], key=lambda f: -f.log_likelihood)


def _by_cost(fits: Sequence[Fit]) -> list[Fit]:
    return sorted(fits, key=lambda f: f.cost)


def _kept(names: Sequence[str], most: int, of_each: int) -> list[int]:
    """Indices of the first ``most``, and of the first ``of_each`` of each name."""
    times: Counter[str] = Counter()
    kept = []
    for k, name in enumerate(names):
        if k < most or times[name] < of_each:
            kept.append(k)
        times[name] += 1
    return kept
