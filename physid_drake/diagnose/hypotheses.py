"""Fits all hypotheses: proposals are fitted together, and the better half goes on."""

from __future__ import annotations

import dataclasses as dc
from collections import Counter
from collections.abc import Sequence

import numpy as np

from physid_drake.diagnose.proposals import Proposal, proposals
from physid_drake.effects import Effect
from physid_drake.effects.unnamed import UnnamedForce
from physid_drake.identify.baseline import LAST, fitted_at
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.hypothesis import Part
from physid_drake.inference.push import TAIL
from physid_drake.inference.scores import Column, columns, scores

FIRST, SECOND = 2, 4  # steps of a fit before the halvings
FINALISTS = 8
BESIDE = 12  # families of score tests beside a single effect


def with_one_more(fitter: Fitter, fit: Fit, found: Sequence[Column]) -> list[Fit]:
    """A model with one more effect, for each effect whose columns are given; the best fit of each, best first.

    Args:
        fitter: of the fit.
        fit: the model to which effects are added.
        found: columns of the effects.
    """
    return halved(fitter, fit, proposals(fit, scores(fitter, fit, found)))


def with_two(fitter: Fitter, singles: Sequence[Fit], kinds: Sequence[type[Effect]]) -> list[Fit]:
    """Models with two effects, best first: each of the best single ones with what scores best beside it.

    Args:
        fitter: of the fits.
        singles: models with one effect, best first.
        kinds: effects that may be added.
    """
    found: list[Proposal] = []
    for single in singles:
        present = {part.kind for part in single.hypothesis.parts}
        beside = columns(fitter, single, [kind for kind in kinds if kind not in present])
        found += proposals(single, scores(fitter, single, beside)[:BESIDE])
    return halved(fitter, singles[0], found, of_each=1)


def freed(fitter: Fitter, fit: Fit) -> Fit:
    """The fit with all coordinates of its effects free, where some were held; the same fit if that gains nothing."""
    h = fit.hypothesis
    parts = tuple(
        dc.replace(part, point=tuple(point.tolist()), free=tuple(range(len(point))))
        for part, point in zip(h.parts, h.points(fit.point.z), strict=True)
        if part.kind is not UnnamedForce
    )
    if not parts or all(new.free == old.free for new, old in zip(parts, h.parts, strict=True)):
        return fit
    more, d = dc.replace(h, parts=parts), h.space.dimension
    effects = [x for part in parts for x in part.point]
    z = np.concatenate([fit.point.z[:d], effects, fit.point.z[h.simulated :]])
    again = fitted_at(fitter, more, z, fit)
    return again if again.log_likelihood > fit.log_likelihood else fit


def each_alone(fitter: Fitter, pair: Fit) -> list[Fit]:
    """Each effect of a pair alone, fitted from its values in the pair.

    The earlier fit of it alone may have stopped early.
    """
    h, z, fits = pair.hypothesis, pair.point.z, []
    for k in range(len(h.parts)):
        kept = dc.replace(h, parts=h.parts[:k] + h.parts[k + 1 :])
        begin = h.space.dimension + sum(len(part.free) for part in h.parts[:k])
        shorter = np.delete(z, range(begin, begin + len(h.parts[k].free)))
        point = fitter.points([kept], [shorter], [pair.point.nuisance])[0]
        if point is not None:
            fits += fitter.fitted(fitter.started([kept], [point], [None], TAIL), LAST)
    return fits


def unnamed(fitter: Fitter, fit: Fit) -> list[Fit]:
    """The model with an unnamed force: fits with each block of smooth forces and frictions, and with all blocks."""
    beside = columns(fitter, fit, [UnnamedForce])
    fits = []
    for score in scores(fitter, fit, beside):
        free, n = score.family.free, fit.hypothesis.simulated
        part = Part(kind=UnnamedForce, point=score.family.point, free=free)
        h = dc.replace(fit.hypothesis, parts=(*fit.hypothesis.parts, part))
        moved, nothing = score.point[list(free)], np.zeros(len(free))
        z = fit.point.z + score.dz
        starts = [np.concatenate([z[:n], moved, z[n:]]), np.concatenate([fit.point.z[:n], nothing, fit.point.z[n:]])]
        zs = [np.clip(one, *h.bounds) for one in starts]
        points = [p for p in fitter.points([h] * 2, zs, [fit.point.nuisance] * 2) if p is not None]
        best = min(points, key=fitter.roughly)
        fits += fitter.fitted(fitter.started([h], [best], [fit], TAIL), SECOND)
    return fits


def halved(fitter: Fitter, near: Fit, found: Sequence[Proposal], of_each: int = 2) -> list[Fit]:
    """The best fit of each hypothesis, by successive halving of proposals, best first.

    Args:
        fitter: makes the fits.
        near: a fit whose derivatives with respect to nuisance parameters are used at first.
        found: the proposals.
        of_each: proposals of each hypothesis that are kept in any case at the first halving; one less at the second.

    Source: K. Jamieson, A. Talwalkar, AISTATS 2016, for successive halving.
    """
    hypotheses = [p.hypothesis for p in found]
    points = fitter.points(hypotheses, [p.z for p in found], [fitter.at_rest()] * len(found))
    rolled = [(h, p) for h, p in zip(hypotheses, points, strict=True) if p is not None]
    rolled.sort(key=lambda one: fitter.roughly(one[1]))
    rolled = [rolled[k] for k in _kept([h.name for h, _ in rolled], len(rolled) // 2, of_each)]
    fits = fitter.started([h for h, _ in rolled], [p for _, p in rolled], [near] * len(rolled), theta=False)
    fits = _by_cost(fitter.fitted(fits, FIRST, roughly=True))
    fits = [fits[k] for k in _kept([f.hypothesis.name for f in fits], len(fits) // 2, of_each - 1)]
    fits = fitter.robust(fitter.fitted(fits, SECOND, roughly=True))
    fits = _by_cost(fitter.fitted(fits, SECOND, roughly=True))
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
