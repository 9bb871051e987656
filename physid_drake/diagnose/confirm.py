"""Confirmation: the best few effects in the cell, fitted with theta, judged on pushes that were left out."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.candidate import EXPLAINED, FAR_OFF, Candidate, push_scores, ranked
from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.model import EffectPoint, Fitted
from physid_drake.diagnose.screen import Score
from physid_drake.diagnose.starts import elsewhere, in_place, scanned_start, start_of
from physid_drake.progress import Progress

Array = NDArray[np.float64]

WORTH_A_FIT = 0.35  # of the best score test's gain
RIVAL = 0.5  # where one explains the pushes already
AS_MUCH = 0.9  # of the best score test's gain: what promises so much may be the same physics
WORTH_A_TRY = 0.1  # where none takes a good part of the mismatch away
ENOUGH = 120  # rollouts per push in one step after which no further effect is tried, nor another shape of one
STUCK = 1.6  # cost per degree of freedom after which a fit is tried again from elsewhere
NEAR = 0.5  # of the cost beyond noise: an effect that leaves more is not near another place or shape
HOP = 3  # steps of a fit from another place or shape: an effect that belongs there shows by then
ANOTHER_BASIN = 10.0  # nats by which a fit must be better to be another one
FELL_SHORT = 0.8  # of the gain that the score test promised: such a fit is tried again too
PERSISTENT = 2  # candidates that are worth that, where none explains the pushes
LEAST_SHARE = 0.25  # of the cost beyond noise that an effect must take away unless nothing is left
FAR = 0.3  # of theta's unit cube


def confirm(
    fitter: Fitter, before: Fitted, scores: Sequence[Score], tick: Progress, *, most: int
) -> tuple[Candidate, ...]:
    """Fit the best few effects of a screening, each added to the model ``before``; best held-out gain first.

    Args:
        fitter: fits.
        before: the model so far.
        scores: of the effects that are not in it.
        tick: told which effect is fitted.
        most: effects that are fitted in any case, if they are worth it; as long as none leads near an explanation,
            twice as many. Far from the plain cell a score test says little of what a fit will find.
    """
    worth, more = _worth_fitting(scores, most)
    step = _Step(fitter=fitter, before=before, plain=push_scores(before), tick=tick)
    for k, one in enumerate((*worth, *more)):
        if k == len(worth) and not step.leads_near:
            # Before what promises little: derivatives of the model before may have led the best one astray.
            step.fit_once_more(_most_promising(step.found))
        if k >= len(worth) and (step.leads_near or step.spent):
            break
        if _explained([c for c in step.found if c.accepted]) and one.gain < RIVAL * worth[0].gain:
            break
        tick(f"fit with {one.kind.name}", k, len(worth))
        step.found.append(_candidate(fitter, one, _fit(fitter, before, one), step.plain))
    step.found = _tried_elsewhere(fitter, before, ranked(step.found), step.plain, tick)
    step.found = _gone_on_with(fitter, before, step.found, step.plain, tick)
    for k in _once_more(step.found):
        step.fit_once_more(k)
    step.found = _tried_from_nearer_theta(fitter, before, ranked(step.found), step.plain, tick)
    step.found = _simpler_tried_from_there(fitter, step.found, step.plain, tick)
    return tuple(_tried_in_its_place(fitter, before, step.found, scores, step.plain, tick))


class _Step:
    """The candidates of one step, and which of them were fitted from elsewhere."""

    def __init__(self, *, fitter: Fitter, before: Fitted, plain: Array, tick: Progress) -> None:
        self.fitter, self.before, self.plain, self.tick = fitter, before, plain, tick
        self.found: list[Candidate] = []
        self._again: set[str] = set()
        self._most = fitter.case.pool.count + ENOUGH * len(fitter.case.problems)

    @property
    def spent(self) -> bool:
        """Whether the step took its share of rollouts."""
        return self.fitter.case.pool.count > self._most

    @property
    def leads_near(self) -> bool:
        """Whether a candidate leads near an explanation."""
        return any(worthwhile(self.before, c) and c.fitted.reduced_chi2 <= FAR_OFF for c in self.found)

    def fit_once_more(self, k: int) -> None:
        """Fit candidate k from elsewhere, if it was not yet and may do better."""
        one = self.found[k]
        if self.spent or one.name in self._again or not _may_do_better(self.before, one, _explained(self.found)):
            return
        self._again.add(one.name)
        self.tick(f"fit with {one.name} once more", 0, 0)
        again = _fit_from_afar(self.fitter, self.before, one.score)
        if again is not None and again.score > one.fitted.score:
            self.found[k] = _candidate(self.fitter, one.score, again, self.plain)


def _worth_fitting(scores: Sequence[Score], most: int) -> tuple[list[Score], list[Score]]:
    """Effects to fit in any case, the best first, and those to fit as long as none leads near an explanation."""
    ordered = sorted((s for s in scores if s.kept), key=lambda s: -s.gain)
    worth = [s for s in ordered if s.gain >= WORTH_A_FIT * ordered[0].gain][:most]
    taken = {s.kind for s in worth}
    # Frictions that follow the pushes' order are seen by their ranks, whatever gains more in linearised pushes.
    worth += [s for s in ordered if s.in_order and s.kind not in taken]
    taken = {s.kind for s in worth}
    rest = [s for s in ordered if s.gain >= WORTH_A_TRY * ordered[0].gain and s.kind not in taken]
    return worth, rest[: 2 * most - len(worth)]


def _tried_elsewhere(
    fitter: Fitter, before: Fitted, found: Sequence[Candidate], plain: Array, tick: Progress
) -> list[Candidate]:
    """The candidates, the best of them fitted from other places as long as none explains the pushes.

    Only what has a place and may be near: a candidate that takes most of the mismatch away.
    """
    if _explained(found):
        return list(found)
    tried = list(found)
    near = [k for k, c in enumerate(tried) if takes_most(before, c.fitted) and elsewhere(fitter.case, c.score)]
    for k in near[:PERSISTENT]:
        if _explained(tried):
            break
        tick(f"fit with {tried[k].name} elsewhere", 0, 0)
        better = _fit_elsewhere(fitter, before, tried[k])
        if better is not None:
            tried[k] = _candidate(fitter, tried[k].score, better, plain)
    return ranked(tried)


def _gone_on_with(
    fitter: Fitter, before: Fitted, found: Sequence[Candidate], plain: Array, tick: Progress
) -> list[Candidate]:
    """The candidates; where none leads near an explanation, the best fits gone on with before one is chosen.

    Far off, the derivatives of the model before end a fit long before its effect is where it belongs, and which got
    further by then says little. Beside another effect only: the first is fitted from the best of a scan as well.
    """
    tried = list(found)
    if any(c.fitted.reduced_chi2 <= FAR_OFF for c in found) or not before.state.effects:
        return tried
    rivals = [k for k, c in enumerate(found) if worthwhile(before, c)][:PERSISTENT]
    if len(rivals) < PERSISTENT:
        return tried
    for k in rivals:
        one, stopped = found[k], found[k].fitted.state
        tick(f"fit with {one.name} gone on with", 0, 0)
        further = fitter.fit(fitter.start(stopped.u, stopped.effects), rounds=7, careful=4, renew=True)
        if further.score > one.fitted.score:
            tried[k] = _candidate(fitter, one.score, further, plain)
    return ranked(tried)


def _tried_from_nearer_theta(
    fitter: Fitter, before: Fitted, found: Sequence[Candidate], plain: Array, tick: Progress
) -> list[Candidate]:
    """The candidates; those far from an explanation fitted again from the theta of one that is near but will not do.

    One that ran to the end of its range tells where theta is, too: the weakest of springs, anchored far away, is a
    table that is tilted.
    """
    tried = list(found)
    if not found:
        return tried
    nearest = min((c.fitted for c in found), key=lambda fitted: fitted.reduced_chi2)
    if _explained([c for c in found if c.accepted]) or nearest.reduced_chi2 > FAR_OFF:
        return tried
    promised = max(c.score.gain for c in found)
    far = [k for k, c in enumerate(found) if c.fitted.reduced_chi2 > FAR_OFF and c.score.gain >= RIVAL * promised]
    for k in far[:PERSISTENT]:
        one = found[k].score
        tick(f"fit with {one.kind.name} from another theta", 0, 0)
        start = fitter.start(nearest.state.u, (*before.state.effects, start_of(fitter, one)))
        again = fitter.fit(start, rounds=7, careful=4, renew=True)
        if again.score > found[k].fitted.score:
            tried[k] = _candidate(fitter, one, again, plain)
    return ranked(tried)


def _simpler_tried_from_there(
    fitter: Fitter, found: Sequence[Candidate], plain: Array, tick: Progress
) -> list[Candidate]:
    """The candidates; a simpler one that promised as much as the best is fitted from the theta of the best.

    Its own fit set out from the theta of the model before, and may have stopped a little short of one that is the
    same physics with more coordinates: a spring that is anchored thirty metres away is a tilted table.
    """
    tried, best = list(found), found[0] if found and found[0].accepted else None
    if best is None:
        return tried
    simpler = [
        k
        for k, c in enumerate(found)
        if c.coordinates < best.coordinates
        and c.score.gain >= AS_MUCH * best.score.gain
        and c.fitted.score < best.fitted.score
    ]
    for k in simpler[:PERSISTENT]:
        one = found[k]
        tick(f"fit with {one.name} from the theta of {best.name}", 0, 0)
        start = fitter.start(best.fitted.state.u, one.fitted.state.effects)
        again = fitter.fit(start, rounds=7, careful=4, renew=True)
        if again.score > one.fitted.score:
            tried[k] = _candidate(fitter, one.score, again, plain)
    return ranked(tried)


def _tried_in_its_place(
    fitter: Fitter, before: Fitted, found: Sequence[Candidate], scores: Sequence[Score], plain: Array, tick: Progress
) -> list[Candidate]:
    """The candidates; where the best has a place, what else may act there is fitted from there.

    A weak attraction to a place slows and speeds an object about it as a patch does.
    """
    tried = {c.name: c for c in found}
    best = found[0] if found and found[0].accepted else None
    place = None if best is None else best.fitted.state.effects[-1].effect(fitter.case).place
    if best is None or place is None:
        return list(found)
    for one in in_place(fitter, before, [s.kind for s in scores if s.kind is not best.score.kind], place):
        if one.gain < RIVAL * best.score.gain:
            continue
        tick(f"fit with {one.kind.name} in the same place", 0, 0)
        there = _fit(fitter, before, one)
        if one.kind.name not in tried or there.score > tried[one.kind.name].fitted.score:
            tried[one.kind.name] = _candidate(fitter, one, there, plain)
    return ranked(list(tried.values()))


def _may_do_better(before: Fitted, candidate: Candidate, explained: bool) -> bool:
    """Whether a fit from elsewhere may find more.

    Where an effect explains the pushes, only one that fell short of what its score test promised. Beside an effect
    that leaves little, one that took little of that away found what there is.
    """
    if explained:
        return candidate.fitted.score - before.score < FELL_SHORT * 0.5 * candidate.score.gain
    far = not before.state.effects or before.reduced_chi2 > FAR_OFF
    return far or takes_most(before, candidate.fitted)


def _once_more(found: Sequence[Candidate]) -> list[int]:
    """Which candidates to fit again: the one that promised most, whatever came of it, and the best."""
    best = list(range(len(found)))[:PERSISTENT]
    if not found:
        return []
    promised = _most_promising(found)
    return best if promised in best else [promised, *best]


def _most_promising(found: Sequence[Candidate]) -> int:
    return max(range(len(found)), key=lambda k: found[k].score.gain)


def worthwhile(before: Fitted, candidate: Candidate) -> bool:
    """Whether an accepted effect takes away a good part of what noise does not account for, where much is left."""
    after = candidate.fitted.reduced_chi2
    enough = after <= EXPLAINED or after - 1.0 <= (1.0 - LEAST_SHARE) * (before.reduced_chi2 - 1.0)
    return candidate.accepted and enough


def _explained(candidates: Sequence[Candidate]) -> bool:
    return any(c.fitted.reduced_chi2 <= STUCK for c in candidates)


def _candidate(fitter: Fitter, one: Score, fitted: Fitted, plain: Array) -> Candidate:
    return candidate_of(fitter, one, fitted, fitted.state.effects[-1], plain)


def candidate_of(fitter: Fitter, one: Score, fitted: Fitted, point: EffectPoint, before: Array) -> Candidate:
    """An effect that is at ``point`` in a fitted model, over the scores (n,) of the pushes without it."""
    return Candidate(
        score=one, fitted=fitted, gains=push_scores(fitted) - before, degenerate=_degenerate(fitter, one, point),
        coordinates=len(one.kind.leading(fitter.case.around)),
    )  # fmt: skip


def fit_with(fitter: Fitter, before: Fitted, one: Score) -> Fitted:
    """The model with an effect; from the best of a scan, too, where it falls short of its promise."""
    first = _fit(fitter, before, one)
    if first.score - before.score >= FELL_SHORT * 0.5 * one.gain:
        return first
    again = _fit_from_afar(fitter, before, one)
    return again if again is not None and again.score > first.score else first


def _fit(fitter: Fitter, before: Fitted, one: Score) -> Fitted:
    """The model with an effect, from where the score test says, with the derivatives of the model before."""
    effects = (*before.state.effects, start_of(fitter, one))
    if before.reduced_chi2 > FAR_OFF:
        return fitter.fit(fitter.start(before.state.u, effects), rounds=7, careful=4, like=before)
    return fitter.fit(dc.replace(before.state, effects=effects), rounds=4, like=before)


def takes_most(before: Fitted, after: Fitted) -> bool:
    """Whether a model leaves less than half of the cost beyond noise, so that what is missing may be near."""
    return after.reduced_chi2 - 1.0 <= NEAR * (before.reduced_chi2 - 1.0)


def _fit_elsewhere(fitter: Fitter, before: Fitted, candidate: Candidate) -> Fitted | None:
    """The best of a few steps from other places and of the other sign, fitted; None where none is better.

    A score test takes the rim of a slippery patch for a rough one beside it, and no step leads on from there.
    """
    best = candidate.fitted
    for other in elsewhere(fitter.case, candidate.score):
        start = fitter.start(before.state.u, (*before.state.effects, start_of(fitter, other)))
        tried = fitter.fit(start, rounds=HOP, careful=HOP, like=before)
        best = tried if tried.score > best.score + ANOTHER_BASIN else best
        if best.reduced_chi2 <= STUCK:
            break
    return None if best is candidate.fitted else fitter.fit(best.state, rounds=4, like=before)


def _fit_from_afar(fitter: Fitter, before: Fitted, one: Score) -> Fitted | None:
    """The same from the best of a scan, all derivatives taken on the way: far off, the plain ones mislead.

    None where all of the scan is worse than no effect: objects topple, or leave.
    """
    point, theta, score = scanned_start(fitter, before, one)
    if score < before.score:
        return None
    u = np.clip(before.state.u + np.clip(theta, -FAR, FAR), 1e-3, 1.0 - 1e-3)
    return fitter.fit(fitter.start(u, (*before.state.effects, point)), rounds=4, careful=2, renew=True)


def _degenerate(fitter: Fitter, one: Score, point: EffectPoint) -> bool:
    """Whether a one-sided amplitude is at its null."""
    chart = one.kind.chart(fitter.case.around)
    free = one.signature.family.free
    return any(
        one_sided and point.point[j] <= chart[j].lower + 1e-3 * chart[j].step
        for j, one_sided in zip(free, one.signature.one_sided, strict=True)
    )
