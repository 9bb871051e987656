"""Where the fit of an effect starts: from its score test, or from a coarse scan where that is too far off.

A score test knows small versions of an effect. Those of a strong one may be the best at the wrong frequency, speed or
place, from which a fit does not find out; a few rollouts of strong versions tell.
"""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence
from itertools import product, zip_longest

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.model import EffectPoint, Fitted, State
from physid_drake.diagnose.screen import Score, empty_signature, filled, score
from physid_drake.effects import Effect
from physid_drake.pushes.case import Case

Array = NDArray[np.float64]

ELSEWHERE = 3  # other places from which an effect is fitted
FAMILIES = 4  # of an effect, the best by their score tests
MULTIPLES = (1.0, 2.5, 5.0)  # of what the score test says
STRENGTHS = (1.0, 0.7, 0.85, 1.2, 1.4)  # times that of a fit
ASIDE = 0.7  # prior standard deviations, in each coordinate of shape


def start_of(fitter: Fitter, one: Score) -> EffectPoint:
    """The chart point that a score test suggests; a fit may then move the leading coordinates."""
    return _started(fitter, one, 1.0)


def nearer_start(fitter: Fitter, before: Fitted, one: Score) -> State:
    """The model ``before`` with an effect as its score test says; all else as it was or, if better, moved along.

    Theta and the pushes' unknowns may have made up for the effect. A friction that falls from push to push was in the
    pushes' own frictions, and would count twice beside them.
    """
    point = start_of(fitter, one)
    held = dc.replace(point, free=())
    starts = [dc.replace(s, effects=(*s.effects, point)) for s in (before.state, _moved_along(fitter, before, one))]
    seen = [fitter.seen_from(before, dc.replace(s, effects=(*s.effects[:-1], held))) for s in starts]
    return starts[int(np.argmax([model.score for model in seen]))]


def _moved_along(fitter: Fitter, before: Fitted, one: Score) -> State:
    """Where the score test of an effect takes the model that it is added to."""
    kept = list(one.kept)
    explained = [columns[:, kept] @ one.coefficients[kept] for columns in one.signature.columns]
    return fitter.stepped(fitter.relieved(before, explained))


def scanned_start(
    fitter: Fitter, before: Fitted, one: Score, beside: tuple[EffectPoint, ...] = ()
) -> tuple[EffectPoint, Array, float]:
    """The best of an effect's families at several strengths, one rollout per push each.

    Args:
        fitter: makes the rollouts.
        before: the model to which the effect is added; theta and the pushes' unknowns follow by its derivatives.
        one: the effect's score test.
        beside: other effects that are in the model meanwhile.

    Returns:
        The chart point, the change (d,) of theta that goes with it, and the log likelihood there.
    """
    points = [_started(fitter, family, multiple) for family in _families(one) for multiple in MULTIPLES]
    held = tuple(dc.replace(other, free=()) for other in beside)
    seen = []
    for point in points:
        effects = (*before.state.effects, *held, dc.replace(point, free=()))
        seen.append(fitter.seen_from(before, dc.replace(before.state, effects=effects)))
    best = int(np.argmax([model.score for model in seen]))
    return points[best], seen[best].solution.beta[: len(before.state.u)], seen[best].score


def elsewhere(case: Case, one: Score) -> list[Score]:
    """Score tests of an effect at other places, those of the other sign and of its own in turn, no place twice."""
    tried = {_place(case, one)}
    turns: dict[bool, list[Score]] = {False: [], True: []}
    for other in sorted((s for s in one.others if s.kept), key=lambda s: -s.gain):
        alike = _sign(other) == _sign(one)
        place = _place(case, other)
        if place not in tried:
            tried.add(place)
            turns[alike].append(other)
    mixed = zip_longest(turns[False], turns[True])
    return [s for pair in mixed for s in pair if s is not None][:ELSEWHERE]


def in_place(
    fitter: Fitter, before: Fitted, kinds: Sequence[type[Effect]], place: tuple[float, float]
) -> list[Score]:
    """Score tests at one place [m] of the effects that have a place, the best size of each; one rollout per size.

    Grids of places are too wide to tell what acts there.
    """
    around = fitter.case.around
    found = []
    for kind in kinds:
        blank = [empty_signature(fitter, kind, family) for family in kind.families_at(place, around)]
        tested = [one for one in (score(before, s) for s in filled(fitter, before, blank)) if one.kept]
        if tested:
            found.append(max(tested, key=lambda one: one.gain))
    return found


def _place(case: Case, one: Score) -> tuple[float, ...]:
    """What sets an effect's families apart but for scales: a place on the table; nothing where there is none."""
    family, chart = one.signature.family, one.kind.chart(case.around)
    return tuple(family.point[j] for j in range(len(chart)) if j not in family.free and not chart[j].log)


def _sign(one: Score) -> float:
    return float(np.sign(one.coefficients[0]))


def of_other_strength(fitter: Fitter, model: Fitted, which: int = -1) -> State:
    """Where to fit once more: one of the model's effects as strong as fits best, the pushes' unknowns at zero.

    Objects that bounce off the hand twice, or miss it, leave a cost with many minima; unknowns that were fitted in
    one of them belong to it.
    """
    one = model.state.effects[which]
    shape = _shape(one, fitter)
    strong = [j for j in one.kind.leading(fitter.case.around) if j not in shape]
    chart = one.chart(fitter.case)
    states = []
    for strength in STRENGTHS:
        point = one.point.copy()
        for j in strong:
            stronger = one.origin[j] + strength * (one.point[j] - one.origin[j])
            point[j] = np.clip(stronger, chart[j].lower, chart[j].upper)
        states.append(fitter.start(model.state.u, _with(model, which, dc.replace(one, point=point))))
    return min(states, key=lambda state: fitter.seen_from(model, state).cost_here)


def of_other_shape(fitter: Fitter, model: Fitted, corner: tuple[int, ...], which: int = -1) -> State:
    """A model of whose effects one has another shape, the pushes' unknowns at zero.

    Args:
        fitter: that of the model.
        model: where a fit ended.
        corner: of the cube around the effect's shape, -1 or 1 in each coordinate of it.
        which: of the effects.
    """
    one = model.state.effects[which]
    chart = one.chart(fitter.case)
    point, origin = one.point.copy(), one.origin.copy()
    for j, side in zip(_shape(one, fitter), corner, strict=True):
        origin[j] = point[j] = np.clip(point[j] + side * ASIDE * chart[j].std, chart[j].lower, chart[j].upper)
    return fitter.start(model.state.u, _with(model, which, dc.replace(one, point=point, origin=origin)))


def _with(model: Fitted, which: int, point: EffectPoint) -> tuple[EffectPoint, ...]:
    """The effects of a model, one of them elsewhere."""
    effects = list(model.state.effects)
    effects[which] = point
    return tuple(effects)


def corners(fitter: Fitter, model: Fitted, which: int = -1) -> list[tuple[int, ...]]:
    """Of the cube around the shape of one of a model's effects, those where it costs least first.

    None for an effect that has strengths only.
    """
    count = len(_shape(model.state.effects[which], fitter))
    ways = list(product((-1, 1), repeat=count)) if count else []
    return sorted(ways, key=lambda way: fitter.seen_from(model, of_other_shape(fitter, model, way, which)).cost_here)


def _shape(one: EffectPoint, fitter: Fitter) -> list[int]:
    """Leading coordinates in which no score test moves: a place, a speed, a frequency."""
    around = fitter.case.around
    moved = {j for family in one.kind.families(around) for j in family.free}
    chart = one.kind.chart(around)
    return [j for j in one.kind.leading(around) if j not in moved and np.isfinite(chart[j].std)]


def _families(one: Score) -> list[Score]:
    """Families of an effect, best first, each as strong as the best one where it would act the other way round."""
    alike = [s for s in (one, *one.others) if s.signature.steps == one.signature.steps]
    every = sorted(alike, key=lambda s: -s.gain)[:FAMILIES]
    return [s if s.kept else _as_strong_as(one, s) for s in every]


def _as_strong_as(one: Score, other: Score) -> Score:
    steps = one.signature.family.size / other.signature.family.size
    return dc.replace(other, kept=one.kept, coefficients=steps * one.coefficients)


def _started(fitter: Fitter, one: Score, multiple: float) -> EffectPoint:
    chart = one.kind.chart(fitter.case.around)
    family = one.signature.family
    origin = np.array(family.point)
    point = origin.copy()
    for j, c in zip(family.free, one.coefficients.tolist(), strict=True):
        moved = point[j] + multiple * c * family.size * chart[j].step
        point[j] = float(np.clip(moved, chart[j].lower, chart[j].upper))
    return EffectPoint(kind=one.kind, point=point, free=one.kind.leading(fitter.case.around), origin=origin)
