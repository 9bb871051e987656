"""Confirmation: the best few effects in the cell, fitted with theta, judged on pushes that were left out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.candidate import EXPLAINED, FAR_OFF, Candidate, push_scores, ranked
from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.model import EffectPoint, Fitted
from physid_drake.diagnose.screen import Score
from physid_drake.diagnose.starts import elsewhere, in_place, nearer_start, scanned_start, start_of
from physid_drake.progress import Progress

Array = NDArray[np.float64]

WORTH_A_FIT = 0.35  # of the best score test's gain
RIVAL = 0.5  # where one explains the pushes already
AS_MUCH = 0.9  # of the best score test's gain: what promises so much may be the same physics
WORTH_A_TRY = 0.1  # where none takes a good part of the mismatch away
ENOUGH = 120  # rollouts per push in one step after which no further effect is tried, nor another shape of one
STUCK = 1.6  # cost per degree of freedom after which a fit is tried again from elsewhere
NEAR = 0.5  # of the cost beyond noise: an effect that leaves more is not near another place or shape
AFRESH, CAREFUL = 7, 4  # rounds of a fit from afar; in the first of them the pushes' unknowns are held
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
    step = Confirmation(fitter=fitter, before=before, tick=tick)
    step.fit_the_best(scores, most)
    step.try_elsewhere()
    step.go_on()
    step.fit_once_more()
    step.try_from_nearer_theta()
    step.try_simpler_from_the_best()
    step.try_in_the_same_place(scores)
    return tuple(step.found)


class Confirmation:
    """The candidates of one step; each method fits some of them again from where more may be found.

    Attributes:
        found: the candidates, best held-out gain first.
    """

    def __init__(self, *, fitter: Fitter, before: Fitted, tick: Progress, found: Sequence[Candidate] = ()) -> None:
        self.fitter, self.before, self.tick = fitter, before, tick
        self.found = list(found)
        self._plain = push_scores(before)
        self._again: set[str] = set()  # fitted once more
        self._most = fitter.case.pool.count + ENOUGH * len(fitter.case.problems)

    @property
    def spent(self) -> bool:
        """Whether the step took its share of rollouts."""
        return self.fitter.case.pool.count > self._most

    @property
    def leads_near(self) -> bool:
        """Whether a candidate leads near an explanation."""
        return any(worthwhile(self.before, c) and c.fitted.reduced_chi2 <= FAR_OFF for c in self.found)

    def fit_the_best(self, scores: Sequence[Score], most: int) -> None:
        """Fit the effects that promise most, and as long as none leads near an explanation, others."""
        worth, more = _worth_fitting(scores, most)
        for k, one in enumerate((*worth, *more)):
            if k == len(worth) and not self.leads_near:
                # Before what promises little: derivatives of the model before may have led the best one astray.
                self._fit_once_more(_most_promising(self.found))
            if k >= len(worth) and (self.leads_near or self.spent):
                break
            if _explained([c for c in self.found if c.accepted]) and one.gain < RIVAL * worth[0].gain:
                break
            self.tick(f"fit with {one.kind.name}", k, len(worth))
            self.found.append(self._candidate(one, _fit(self.fitter, self.before, one)))
        self.found = ranked(self.found)

    def try_elsewhere(self) -> None:
        """Fit the best from other places as long as none explains the pushes.

        Only what has a place and may be near: a candidate that takes most of the mismatch away.
        """
        if _explained(self.found):
            return
        case = self.fitter.case
        near = [c for c in self.found if takes_most(self.before, c.fitted) and elsewhere(case, c.score)]
        for one in near[:PERSISTENT]:
            if _explained(self.found):
                break
            self.tick(f"fit with {one.name} elsewhere", 0, 0)
            self._replace(one, _fit_elsewhere(self.fitter, self.before, one))
        self.found = ranked(self.found)

    def go_on(self) -> None:
        """Where none leads near an explanation, go on with the best fits before one is chosen.

        Far off, the derivatives of the model before end a fit long before its effect is where it belongs, and which
        got further by then says little. Beside another effect only: the first is fitted from the best of a scan as
        well.
        """
        if any(c.fitted.reduced_chi2 <= FAR_OFF for c in self.found) or not self.before.state.effects:
            return
        rivals = [c for c in self.found if worthwhile(self.before, c)][:PERSISTENT]
        if len(rivals) < PERSISTENT:
            return
        for one in rivals:
            self.tick(f"fit with {one.name} gone on with", 0, 0)
            stopped = one.fitted.state
            self._replace(one, fit_afresh(self.fitter, stopped.u, stopped.effects))
        self.found = ranked(self.found)

    def fit_once_more(self) -> None:
        """Fit the best, and what promised most, from elsewhere."""
        for one in _once_more(self.found):
            self._fit_once_more(one)
        self.found = ranked(self.found)

    def try_from_nearer_theta(self) -> None:
        """Fit what is far from an explanation again from the theta of one that is near but will not do.

        One that ran to the end of its range tells where theta is, too: the weakest of springs, anchored far away, is
        a table that is tilted.
        """
        if not self.found or _explained([c for c in self.found if c.accepted]):
            return
        nearest = min((c.fitted for c in self.found), key=lambda fitted: fitted.reduced_chi2)
        if nearest.reduced_chi2 > FAR_OFF:
            return
        least = RIVAL * max(c.score.gain for c in self.found)
        far = [c for c in self.found if c.fitted.reduced_chi2 > FAR_OFF and c.score.gain >= least]
        for one in far[:PERSISTENT]:
            self.tick(f"fit with {one.name} from another theta", 0, 0)
            effects = (*self.before.state.effects, start_of(self.fitter, one.score))
            self._replace(one, fit_afresh(self.fitter, nearest.state.u, effects))
        self.found = ranked(self.found)

    def try_simpler_from_the_best(self) -> None:
        """Fit a simpler effect that promised as much as the best one from the theta of the best.

        Its own fit set out from the theta of the model before, and may have stopped a little short of one that is the
        same physics with more coordinates: a spring that is anchored thirty metres away is a tilted table.
        """
        best = self._best
        if best is None:
            return
        least = AS_MUCH * best.score.gain
        simpler = [
            c
            for c in self.found
            if c.coordinates < best.coordinates and c.score.gain >= least and c.fitted.score < best.fitted.score
        ]
        for one in simpler[:PERSISTENT]:
            self.tick(f"fit with {one.name} from the theta of {best.name}", 0, 0)
            self._replace(one, fit_afresh(self.fitter, best.fitted.state.u, one.fitted.state.effects))
        self.found = ranked(self.found)

    def try_in_the_same_place(self, scores: Sequence[Score]) -> None:
        """Where the best has a place, fit from there what else may act there.

        A weak attraction to a place slows and speeds an object about it as a patch does.
        """
        best = self._best
        place = None if best is None else best.fitted.state.effects[-1].effect(self.fitter.case).place
        if best is None or place is None:
            return
        others = [s.kind for s in scores if s.kind is not best.score.kind]
        for one in in_place(self.fitter, self.before, others, place):
            if one.gain < RIVAL * best.score.gain:
                continue
            self.tick(f"fit with {one.kind.name} in the same place", 0, 0)
            there = _fit(self.fitter, self.before, one)
            here = next((c for c in self.found if c.score.kind is one.kind), None)
            if here is None:
                self.found.append(self._candidate(one, there))
            elif there.score > here.fitted.score:
                self._put(here, self._candidate(one, there))
        self.found = ranked(self.found)

    @property
    def _best(self) -> Candidate | None:
        """The first candidate, if pushes that were left out confirm it."""
        return self.found[0] if self.found and self.found[0].accepted else None

    def _fit_once_more(self, one: Candidate) -> None:
        """Fit a candidate from elsewhere, if it was not yet and may do better."""
        if self.spent or one.name in self._again or not _may_do_better(self.before, one, _explained(self.found)):
            return
        self._again.add(one.name)
        self.tick(f"fit with {one.name} once more", 0, 0)
        self._replace(one, _fit_from_afar(self.fitter, self.before, one.score))

    def _replace(self, one: Candidate, again: Fitted | None) -> None:
        """Take another fit of a candidate, if it is better."""
        if again is not None and again.score > one.fitted.score:
            self._put(one, self._candidate(one.score, again))

    def _put(self, before: Candidate, after: Candidate) -> None:
        self.found = [after if c is before else c for c in self.found]

    def _candidate(self, one: Score, fitted: Fitted) -> Candidate:
        return candidate_of(self.fitter, one, fitted, fitted.state.effects[-1], self._plain)


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


def _may_do_better(before: Fitted, candidate: Candidate, explained: bool) -> bool:
    """Whether a fit from elsewhere may find more.

    Where an effect explains the pushes, only one that fell short of what its score test promised. Beside an effect
    that leaves little, one that took little of that away found what there is.
    """
    if explained:
        return candidate.fitted.score - before.score < FELL_SHORT * 0.5 * candidate.score.gain
    far = not before.state.effects or before.reduced_chi2 > FAR_OFF
    return far or takes_most(before, candidate.fitted)


def _once_more(found: Sequence[Candidate]) -> list[Candidate]:
    """Which candidates to fit again: the one that promised most, whatever came of it, and the best."""
    if not found:
        return []
    best, promised = list(found[:PERSISTENT]), _most_promising(found)
    return best if any(c is promised for c in best) else [promised, *best]


def _most_promising(found: Sequence[Candidate]) -> Candidate:
    return max(found, key=lambda c: c.score.gain)


def worthwhile(before: Fitted, candidate: Candidate) -> bool:
    """Whether an accepted effect takes away a good part of what noise does not account for, where much is left."""
    after = candidate.fitted.reduced_chi2
    enough = after <= EXPLAINED or after - 1.0 <= (1.0 - LEAST_SHARE) * (before.reduced_chi2 - 1.0)
    return candidate.accepted and enough


def _explained(candidates: Sequence[Candidate]) -> bool:
    return any(c.fitted.reduced_chi2 <= STUCK for c in candidates)


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


def fit_afresh(fitter: Fitter, u: Array, effects: tuple[EffectPoint, ...]) -> Fitted:
    """A model fitted from a theta (d,) and effects that may be far off, all derivatives taken on the way."""
    return fitter.fit(fitter.start(u, effects), rounds=AFRESH, careful=CAREFUL, renew=True)


def _fit(fitter: Fitter, before: Fitted, one: Score) -> Fitted:
    """The model with an effect, from where the score test says, with the derivatives of the model before."""
    if before.reduced_chi2 > FAR_OFF:
        effects = (*before.state.effects, start_of(fitter, one))
        return fitter.fit(fitter.start(before.state.u, effects), rounds=AFRESH, careful=CAREFUL, like=before)
    # Frictions that differ by a half are not what the derivatives of the pushes' own say.
    like = None if one.in_order else before
    return fitter.fit(nearer_start(fitter, before, one), rounds=4, like=like)


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
