"""Confirmation: the best few effects in the cell, fitted with theta, judged on pushes that were left out."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.linear import left_out_scores
from physid_drake.diagnose.model import EffectPoint, Fitted
from physid_drake.diagnose.screen import Score
from physid_drake.diagnose.starts import elsewhere, scanned_start, start_of
from physid_drake.progress import Progress

Array = NDArray[np.float64]

WORTH_A_FIT = 0.35  # of the best score test's gain
RIVAL = 0.5  # where one explains the pushes already
WORTH_A_TRY = 0.1  # where none takes a good part of the mismatch away
ENOUGH = 120  # rollouts per push in one step after which no further effect is tried, nor another shape of one
SURE = 2.0  # standard errors
LEAST = 4.0  # nats of held-out gain
CERTAIN = 40.0  # nats of held-out gain, the best push not counted
UNLIKELY = 0.05  # of the signed-rank test of held-out gains
BOUND = 10.0  # nats: no push counts more, for or against
CLOSE = 1.5  # nats: gains that differ by less tell no rivals apart, however sure
STUCK = 1.6  # cost per degree of freedom after which a fit is tried again from elsewhere
NEAR = 0.5  # of the cost beyond noise: an effect that leaves more is not near another place or shape
HOP = 3  # steps of a fit from another place or shape: an effect that belongs there shows by then
ANOTHER_BASIN = 10.0  # nats by which a fit must be better to be another one
FELL_SHORT = 0.8  # of the gain that the score test promised: such a fit is tried again too
PERSISTENT = 2  # candidates that are worth that, where none explains the pushes
EXPLAINED = 1.5  # cost per degree of freedom above which something is still missing
LEAST_SHARE = 0.25  # of the cost beyond noise that an effect must take away unless nothing is left
A_COORDINATE = 2.0  # nats of held-out gain that one more coordinate must be worth
A_LAW = 0.01  # of the gain: two honest implementations of one effect differ by more
FAR_OFF = 3.0  # cost per degree of freedom from which the pushes' unknowns would imitate what is missing
FAR = 0.3  # of theta's unit cube


@dc.dataclass(frozen=True, kw_only=True)
class Candidate:
    """One effect in the model, fitted.

    Attributes:
        score: its score test.
        fitted: the model with it.
        gains: (n,) log predictive density of each push, left out, over that without the effect.
        degenerate: whether an amplitude ran to its null, so that it is another effect or none.
        coordinates: how many numbers of the effect were fitted.
    """

    score: Score
    fitted: Fitted
    gains: Array
    degenerate: bool
    coordinates: int = 1

    @property
    def name(self) -> str:
        """The effect's."""
        return self.score.kind.name

    @property
    def gain(self) -> float:
        """Total."""
        return float(self.gains.sum())

    @property
    def standard_error(self) -> float:
        """Of the total."""
        return standard_error(self.gains)

    @property
    def accepted(self) -> bool:
        """Whether held-out pushes confirm the effect.

        Either most of them do, or, for what only a few pushes feel (a patch, a magnet), more than one does far beyond
        what the simulator's own error explains. Pushes differ in what they feel of an effect, so that the sum of
        their gains is as unsure as the largest of them; gains are bounded before they are compared with their spread.

        Or their frictions follow what the effect does to them beyond chance. Whole pushes' frictions differ anyway:
        an effect that orders them makes the first and last pushes likelier by far and those between hardly, so that
        gains spread as widely as they are large.
        """
        if self.degenerate or self.gain < LEAST:
            return False
        if self.score.in_order:
            return True
        bounded = np.clip(self.gains, -BOUND, BOUND)
        some = np.sort(self.gains)[:-1]
        local = some.sum() > CERTAIN and (self.gains > CERTAIN / 4.0).sum() >= 2
        return bool((bounded.sum() > SURE * standard_error(bounded) and self._most_gain()) or local)

    def _most_gain(self) -> bool:
        """Whether gains outweigh losses in number and size; one large gain does not make an effect."""
        return len(self.gains) < 5 or float(stats.wilcoxon(self.gains, alternative="greater").pvalue) < UNLIKELY


def standard_error(values: Array) -> float:
    """Of the sum of values (n,) over pushes; infinite for one push."""
    return float(np.std(values, ddof=1) * np.sqrt(len(values))) if len(values) > 1 else np.inf


def push_scores(fitted: Fitted, folds: Sequence[Sequence[int]] | None = None) -> Array:
    """Log predictive density (n,) of each push, fitted without it; each bears its part of the tolerances' use.

    Args:
        fitted: the model.
        folds: indices of pushes that are left out together; None leaves out one at a time.

    A model may claim that all pushes share an error of the simulator or of a caliper. The others then predict the
    push that is left out with that very error, at no cost: a centre of mass off by ten tolerances would be predicted
    as well as by the effect.
    """
    scores, _ = left_out_scores(fitted.pushes, fitted.state.scatter, fitted.prior_mean, fitted.prior_std, folds)
    return scores - fitted.tolerance_cost / len(scores)


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
    for k in _once_more(step.found):
        step.fit_once_more(k)
    return tuple(_tried_from_nearer_theta(fitter, before, ranked(step.found), step.plain, tick))


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
        again = _fit_from_afar(self.fitter, self.before, one)
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


def _tried_from_nearer_theta(
    fitter: Fitter, before: Fitted, found: Sequence[Candidate], plain: Array, tick: Progress
) -> list[Candidate]:
    """The candidates; those far from an explanation fitted again from the theta of one that is near but will not do.

    One that ran to the end of its range tells where theta is, too: the weakest of springs, anchored far away, is a
    table that is tilted.
    """
    tried = list(found)
    nearest = min((c.fitted for c in found), key=lambda fitted: fitted.reduced_chi2, default=before)
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


def rejudged(candidates: Sequence[Candidate], plain: Fitted) -> tuple[Candidate, ...]:
    """The candidates with their gains over another model."""
    before = push_scores(plain)
    return tuple(ranked([dc.replace(c, gains=push_scores(c.fitted) - before) for c in candidates]))


def ranked(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Best held-out gain first; before it the simplest that does as well: a far-off spring is a tilted table."""
    ordered = sorted(candidates, key=lambda c: (c.degenerate, -c.gain))
    if not ordered:
        return []
    best = ordered[0]
    as_good = [c for c in ordered if c is best or (c.accepted and _does_as_well(c, best))]
    first = min(as_good, key=lambda c: c.coordinates)
    return [first, *(c for c in ordered if c is not first)]


def _does_as_well(simple: Candidate, best: Candidate) -> bool:
    spared = best.coordinates - simple.coordinates
    return spared > 0 and best.gain - simple.gain < A_COORDINATE * spared + A_LAW * best.gain


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


def _fit_from_afar(fitter: Fitter, before: Fitted, candidate: Candidate) -> Fitted | None:
    """The same from the best of a scan, all derivatives taken on the way: far off, the plain ones mislead.

    None where all of the scan is worse than no effect: objects topple, or leave.
    """
    point, theta, score = scanned_start(fitter, before, candidate.score)
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


def out_of_question(best: Candidate, other: Candidate) -> bool:
    """Whether a candidate ran to nothing, or leaves pushes far from explained that the best one explains.

    One push in which an effect shows a hundredfold makes the difference of two gains unsure, and yet tells them
    apart.
    """
    explains = best.fitted.reduced_chi2 <= EXPLAINED
    return other.degenerate or (explains and other.fitted.reduced_chi2 > FAR_OFF)


def rivals(best: Candidate, others: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Accepted candidates whose held-out gain is not surely below the best one's."""
    close = []
    for other in others:
        if other is best or not other.accepted or out_of_question(best, other):
            continue
        difference = best.gains - other.gains
        if difference.sum() < max(SURE * standard_error(difference), CLOSE):
            close.append(other)
    return tuple(close)
