"""A model, grown: effects that pushes left out confirm are added, and those that became superfluous taken out."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Mapping, Sequence

import numpy as np

from physid_drake.diagnose.candidate import A_LAW, EXPLAINED, FAR_OFF, Candidate, push_scores, ranked, rejudged
from physid_drake.diagnose.classes import class_of
from physid_drake.diagnose.confirm import (
    ANOTHER_BASIN,
    ENOUGH,
    HOP,
    confirm,
    fit_afresh,
    takes_most,
    worthwhile,
)
from physid_drake.diagnose.evidence import mismatch, takes_enough, unexplained
from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.left_out import comes_nearer
from physid_drake.diagnose.model import EffectPoint, Fitted, State
from physid_drake.diagnose.pairs import confirmed_pairs, steps_of
from physid_drake.diagnose.plain import search_theta
from physid_drake.diagnose.screen import Screening, Signature, screen, signatures, with_frictions
from physid_drake.diagnose.starts import corners, of_other_shape, of_other_strength
from physid_drake.effects import Effect
from physid_drake.progress import Progress

MOST_EFFECTS = 3
LONGEST = 450  # rollouts per push, after the first score tests, after which only what may be right is grown further
CANDIDATES = 4  # fitted in the first step, one less in each that follows
WIDE = 2.0  # times the usual scatter of friction: it may be what is missing in disguise
HOPELESS = 6.0  # cost per degree of freedom: two effects that leave as much are not made right by a third one
LEADS_ON = 0.25  # of the cost beyond noise: beside the right effect, the next one's score test promises more


@dc.dataclass(frozen=True, kw_only=True)
class Looked:
    """A model, what the catalogue's effects would change of it, and their score tests."""

    fitted: Fitted
    signatures: tuple[Signature, ...]
    screening: Screening

    @classmethod
    def at(cls, fitted: Fitted, signatures: Sequence[Signature], rng: np.random.Generator) -> Looked:
        """Look at a model with signatures that were taken there or near."""
        # Derivatives with respect to the pushes' own frictions may have been taken anew since.
        fresh = tuple(with_frictions(fitted, s) for s in signatures)
        return cls(fitted=fitted, signatures=fresh, screening=screen(fitted, fresh, rng))

    @property
    def p_value(self) -> float:
        """Of "nothing is missing"."""
        return mismatch(self.fitted, self.screening)

    @property
    def leads_on(self) -> bool:
        """Whether another effect may explain the pushes.

        Far from an explanation a model whose effects are right is near what is still missing, and a score test sees
        it. One whose effects stand in for something else has no neighbour that is better.
        """
        promised = max((s.gain for s in self.screening.scores), default=0.0)
        return self.fitted.reduced_chi2 <= FAR_OFF or promised >= LEADS_ON * self.fitted.excess


@dc.dataclass(frozen=True, kw_only=True)
class Grown:
    """A model grown effect by effect: the plain one, the last, the steps between, and what a last step rejected.

    ``superfluous`` has steps that were taken back; ``without`` the last model's fits without one of its effects, by
    the effect's name, as far as they were made.
    """

    base: Looked
    last: Looked
    steps: tuple[tuple[Candidate, ...], ...]
    rejected: tuple[Candidate, ...]
    superfluous: tuple[tuple[Candidate, ...], ...] = ()
    without: Mapping[str, Fitted] = dc.field(default_factory=dict)


@dc.dataclass(frozen=True, kw_only=True)
class Growth:
    """How a model is grown.

    Attributes:
        fitter: with guard and tolerances.
        kinds: the effects that may be missing.
        alpha: false-alarm rate below which something is.
        rng: of the score tests.
        tick: told the stage.
    """

    fitter: Fitter
    kinds: Sequence[type[Effect]]
    alpha: float
    rng: np.random.Generator
    tick: Progress

    def grow(self, plain: Looked) -> Grown:
        """Add effects to the plain model, take out what became superfluous, and judge rivals again."""
        grown = self.pruned(self._added_to(plain))
        for k in range(len(grown.steps) - 1):
            grown = self.reconsidered(grown, k)
        return grown

    def _added_to(self, base: Looked) -> Grown:
        """Add the effect that pushes left out confirm most, as long as something is missing; or two at once."""
        fitter, tick = self.fitter, self.tick
        last, steps, rejected = base, list[tuple[Candidate, ...]](), tuple[Candidate, ...]()
        pool = fitter.case.pool
        longest = pool.count + LONGEST * len(fitter.case.problems)
        most = min(MOST_EFFECTS, len(self.kinds))

        def may_grow(model: Fitted) -> bool:
            # The first of two effects may take long to find its place: what would be the answer is looked at again,
            # and what would be if the pushes were noisier.
            near = takes_enough(base.fitted, model) or not unexplained(base.fitted, model)
            return len(steps) < most and ((len(steps) > 0 and near) or pool.count < longest)

        more = may_grow(last.fitted)
        while more and last.p_value < self.alpha:
            candidates = confirm(fitter, last.fitted, last.screening.scores, tick, most=CANDIDATES - len(steps))
            if not steps and candidates:
                better = self.plain_from(base.fitted, candidates[0])
                if better is not None:
                    # The effect led out of a wrong basin of theta, and perhaps did nothing else.
                    if better.reduced_chi2 <= EXPLAINED:
                        fresh = signatures(Fitter(fitter.case), better, self.kinds)
                        base = last = Looked.at(better, fresh, self.rng)
                        more = may_grow(better)
                        continue
                    base = last = Looked.at(better, base.signatures, self.rng)
                    candidates = rejudged(candidates, better)
            added = worth_adding(base.fitted, last.fitted, candidates)
            if added:
                steps.append(added)
                state = added[0].fitted.state
            else:
                scores = last.screening.scores
                pairs = [] if steps else confirmed_pairs(fitter, last.fitted, scores, tick, most=longest)
                rejected = candidates
                if not pairs:
                    break
                steps += steps_of(pairs)
                state = pairs[0].fitted.state
            tick(f"model with {' and '.join(step[0].name for step in steps)}", 0, 0)
            model = self._model_with(state, last.fitted)
            hopeless = len(steps) > 1 and model.reduced_chi2 > HOPELESS
            more = not hopeless and may_grow(model)
            # What these score tests find is fitted, even if they are what used the rollouts up.
            last = self._what_is_left(model, last.signatures, self.alpha if more else 0.0)
            if not last.leads_on:
                break
        return Grown(base=base, last=last, steps=tuple(steps), rejected=rejected)

    def pruned(self, grown: Grown) -> Grown:
        """Without effects that are superfluous beside the others.

        One that a later effect made so had stood in for what was still missing. One with which left-out pushes are
        simulated no better took up what noise and the cell's own error leave.
        """
        last, steps, taken_back = grown.last, list(grown.steps), list(grown.superfluous)
        made = dict[str, Fitted]()
        for k in reversed(range(len(steps))):
            if len(steps) == 1:
                break
            name = steps[k][0].name
            made[name] = without = self.without(name, last.fitted)
            gains = push_scores(last.fitted) - push_scores(without)
            confirmed = dc.replace(steps[k][0], fitted=last.fitted, gains=gains).accepted
            if not confirmed or not self._shows(without, last.fitted):
                missed = [s for s in grown.base.signatures if s.kind.name == name]
                last = Looked.at(without, (*last.signatures, *missed), self.rng)
                made.clear()
                taken_back.append(steps.pop(k))
        return dc.replace(grown, last=last, steps=tuple(steps), superfluous=tuple(taken_back), without=made)

    def _shows(self, without: Fitted, model: Fitted) -> bool:
        """Whether a model simulates left-out pushes visibly better than one without an effect of it."""
        before, after = (self.fitter.left_out(m) for m in (without, model))
        return comes_nearer(self.fitter.case, before, after)

    def without(self, name: str, model: Fitted) -> Fitted:
        """A model fitted again without one of its effects."""
        self.tick(f"model without {name}", 0, 0)
        effects = tuple(e for e in model.state.effects if e.kind.name != name)
        return self.fitter.fit(dc.replace(model.state, effects=effects), rounds=4, like=model)

    def reconsidered(self, grown: Grown, k: int) -> Grown:
        """The rivals of a step judged again beside the effects that came after it: what was missing blurred them.

        One that does better there takes the place of the step's effect. Gains are what each adds to the others.
        """
        plain, model, step = grown.base.fitted, grown.last.fitted, grown.steps[k]
        effects = model.state.effects
        present = {e.kind.name for e in effects}
        alike = class_of(plain, step)
        rivals = [c for c in step[1:] if c.name in alike and c.name not in present]
        if not rivals:
            return grown

        def with_kth(point: EffectPoint) -> State:
            return dc.replace(model.state, effects=(*effects[:k], point, *effects[k + 1 :]))

        models = {step[0].name: model}
        for other in rivals:
            self.tick(f"{other.name} in place of {step[0].name}", 0, 0)
            point = next(e for e in other.fitted.state.effects if e.kind.name == other.name)
            models[other.name] = self.fitter.fit(with_kth(point), rounds=4, like=model)
        bare = grown.without.get(step[0].name) or self.without(step[0].name, model)
        without = push_scores(bare)
        again = [
            dc.replace(c, fitted=models[c.name], gains=push_scores(models[c.name]) - without)
            for c in (step[0], *rivals)
        ]
        judged = tuple(ranked(again))
        best = judged[0].name
        # The others' gains are over the plain model: they do not compare with these.
        others = tuple(c for c in step[1:] if c.name not in models)
        steps = (*grown.steps[:k], judged, *grown.steps[k + 1 :])
        grown = dc.replace(grown, steps=steps, rejected=(*grown.rejected, *others))
        if best == step[0].name:
            return grown
        self.tick(f"model with {best}", 0, 0)
        swapped = self._model_with(models[best].state, bare, k)
        missed = [s for s in grown.base.signatures if s.kind.name == step[0].name]
        left = [s for s in grown.last.signatures if s.kind.name != best]
        return dc.replace(grown, last=Looked.at(swapped, (*left, *missed), self.rng), without={})

    def plain_from(self, plain: Fitted, candidate: Candidate) -> Fitted | None:
        """A better plain fit from the theta at which an effect's fit ended; None where there is none."""
        lost = candidate.fitted.reduced_chi2 > HOPELESS  # and so is its theta
        if lost or candidate.fitted.score - plain.score < ANOTHER_BASIN:
            return None
        self.tick("plain fit from there", 0, 0)
        start = self.fitter.start(candidate.fitted.state.u)
        near = self.fitter.fit(start, rounds=2, careful=2, renew=True)
        if near.score < plain.score:
            return None
        again = self.fitter.fit(near.state, rounds=2, like=near, renew=True)
        return again if again.score - plain.score > ANOTHER_BASIN else None

    def _model_with(self, state: State, before: Fitted, which: int = -1) -> Fitted:
        """A fitted model with all coordinates of its effects free, all derivatives taken where it is.

        Args:
            state: where to start.
            before: the model without one of its effects, or without any.
            which: of the effects, that one.
        """
        fitter = self.fitter
        effects = tuple(e.freed(fitter.case) for e in state.effects)
        best = fitter.fit(dc.replace(state, effects=effects), rounds=3, renew=True)
        if best.reduced_chi2 <= EXPLAINED and best.state.scatter <= WIDE:
            return best
        if best.reduced_chi2 <= HOPELESS:
            # The pushes' unknowns may have been imitating what is missing: once more, without them at first.
            far = fitter.fit(of_other_strength(fitter, best, which), rounds=4, careful=1, renew=True)
            best = max((best, far), key=lambda model: model.score)
        if best.reduced_chi2 > FAR_OFF:
            best = self._from_another_theta(best)
        return self._of_other_shape(best, before, which)

    def _from_another_theta(self, model: Fitted) -> Fitted:
        """A model far from an explanation, fitted again from where theta is best beside its effects.

        The plain cell's theta made up for what was missing, and a hand's friction of a third of the true one leaves
        no step that leads back.
        """
        fitter, effects = self.fitter, model.state.effects
        u = search_theta(fitter.case, self.rng, self.tick, effects=effects, near=model.state.u)
        if np.array_equal(u, model.state.u):
            return model
        self.tick(f"model with {' and '.join(e.kind.name for e in effects)} from another theta", 0, 0)
        return max((model, fit_afresh(fitter, u, effects)), key=lambda one: one.score)

    def _of_other_shape(self, model: Fitted, before: Fitted, which: int = -1) -> Fitted:
        """A model fitted again from other shapes of one of its effects, as long as none explains the pushes.

        A patch that is found half as large and beside where it is takes most of a mismatch away, and no step leads on
        from there. One that takes less away is not near.
        """
        if model.reduced_chi2 <= EXPLAINED or not takes_most(before, model):
            return model
        pool, best = self.fitter.case.pool, model
        enough = pool.count + ENOUGH * len(self.fitter.case.problems)
        ways = corners(self.fitter, model, which)
        for k, corner in enumerate(ways):
            if best.reduced_chi2 <= EXPLAINED or pool.count > enough:
                break
            self.tick(f"{best.state.effects[which].kind.name} elsewhere", k, len(ways))
            start = of_other_shape(self.fitter, best, corner, which)
            tried = self.fitter.fit(start, rounds=HOP, careful=HOP, like=best)
            best = tried if tried.score > best.score + ANOTHER_BASIN else best
        return best if best is model else self.fitter.fit(best.state, rounds=3, like=best, renew=True)

    def _what_is_left(self, model: Fitted, before: Sequence[Signature], alpha: float) -> Looked:
        """The score tests of what a model leaves; signatures are taken anew only if something is missing at alpha."""
        present = {e.kind for e in model.state.effects}
        # Those of the model before are near enough to ask whether anything is left, unless frictions hide it.
        looked = Looked.at(model, [s for s in before if s.kind not in present], self.rng)
        if alpha == 0.0 or (looked.p_value >= alpha and model.state.scatter <= WIDE):
            return looked
        self.tick("score tests of what is left", 0, 0)
        fresh = signatures(Fitter(self.fitter.case), model, [k for k in self.kinds if k not in present])
        return Looked.at(model, fresh, self.rng)


def worth_adding(base: Fitted, last: Fitted, candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """The candidates, the one to add first: the simplest of the best, or the best; none where neither will do.

    Where left-out pushes are unsure of both, one that they confirm and that explains all is the answer, even if it
    gains less: one push may make the most of an effect that the others deny.

    What is a hundredth of what the effects before it explain may be no more than the error of their laws, unless they
    leave more than such an error. What a tracker does to poses has no such error: nothing of it is simulated.
    """
    if not candidates:
        return ()
    exact = all(e.kind.element == "sensor" for e in last.state.effects)
    bare = exact or unexplained(base, last)
    least = 0.0 if bare else A_LAW * float((push_scores(last) - push_scores(base)).sum())
    best = max((c for c in candidates if not c.degenerate), key=lambda c: c.gain, default=candidates[0])
    answers = [c for c in candidates if c.accepted and not unexplained(base, c.fitted)]
    surest = max(answers, key=lambda c: c.gain, default=best)
    for one in (candidates[0], best, *(() if best.accepted else (surest,))):
        if worthwhile(last, one) and one.gain > least:
            return (one, *(c for c in candidates if c is not one))
    return ()
