"""The story: fit, screen, confirm, add, locate. What needs rollouts is here; conclusions are drawn in `conclude`."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.case import Case
from physid_drake.diagnose.conclude import class_of, conclude
from physid_drake.diagnose.confirm import (
    A_LAW,
    EXPLAINED,
    WORTH_A_TRY,
    Candidate,
    confirm,
    push_scores,
    ranked,
    rejudged,
    worthwhile,
)
from physid_drake.diagnose.evidence import MOST_OF_UNKNOWN, Evidence, confirmed, mismatch
from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.localise import missing_wrenches, with_phases
from physid_drake.diagnose.loudness import as_loud_as_left, quieter
from physid_drake.diagnose.memory import Memory
from physid_drake.diagnose.model import EffectPoint, Fitted, State
from physid_drake.diagnose.next_push import next_push
from physid_drake.diagnose.pairs import confirmed_pairs, steps_of
from physid_drake.diagnose.plain import coarse, fit_plain, nearest, numerics
from physid_drake.diagnose.screen import (
    Screening,
    Signature,
    empty_signatures,
    screen,
    signatures,
    tolerances,
    with_frictions,
)
from physid_drake.diagnose.starts import of_other_strength
from physid_drake.diagnose.values import Diagnosis
from physid_drake.effects import Effect, applicable

Array = NDArray[np.float64]
Tick = Callable[[str, int, int], None]

MOST_EFFECTS = 3
LONGEST = 450  # rollouts per push, after the first score tests, after which no further effect is looked for
ANOTHER_BASIN = 10.0  # nats by which a plain fit must be better to be another one
CANDIDATES = 4  # fitted in the first step, one less in each that follows
WIDE = 2.0  # times the usual scatter of friction: it may be what is missing in disguise
HOPELESS = 6.0  # cost per degree of freedom with two effects: no third one of the catalogue will make up for that


def diagnose(
    case: Case,
    *,
    seed: int = 0,
    alpha: float = 0.01,
    effects: Sequence[str] | None = None,
    tick: Tick | None = None,
    memory: Memory | None = None,
) -> tuple[Diagnosis, Evidence]:
    """Diagnose a recording; arguments as in ``gather``."""
    say = tick or (lambda stage, done, total: None)
    evidence = gather(case, seed=seed, alpha=alpha, effects=effects, tick=say, memory=memory or Memory())
    evidence = _located(evidence, say)
    return conclude(evidence, seed=seed, alpha=alpha), evidence


def gather(
    case: Case, *, seed: int, alpha: float, effects: Sequence[str] | None, tick: Tick, memory: Memory
) -> Evidence:
    """Fit, screen, confirm: all that needs rollouts.

    All but the last look is done on ticks twice as long, whose error is one of the guard's directions.

    Args:
        case: the recording, ready.
        seed: of everything random.
        alpha: false-alarm rate of the detection.
        effects: names of the catalogue to look at; None for all.
        tick: told the stage, steps done, steps in all.
        memory: of the stages that are done.
    """
    search_rng, screen_rng = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(2))
    look = _Search(kinds=applicable(case.around, effects), alpha=alpha, rng=screen_rng, tick=tick)
    rough = coarse(case)
    first = _first(rough, search_rng, tick, memory)
    answer = (look.answer if case.noise.known else look.answer_by_ratios)(case, rough, first, memory)
    return _on_short_ticks(answer, tick)


def _on_short_ticks(answer: _Answer, tick: Tick) -> Evidence:
    """The evidence of an answer, both models taken to the case's own ticks."""
    case, grown, fitter = answer.case, answer.grown, answer.fitter
    plain, model = grown.base.fitted, grown.last.fitted
    fine = Fitter(case, fitter.extra, fitter.tolerances)
    tick("on short ticks", 0, 0)
    refined = fine.refine(plain)
    final = fine.refine(model) if grown.steps else refined
    closest = nearest(fitter.case, case, plain)
    tick("pushes left out", 0, 0)
    before = after = fine.left_out(closest or refined)
    best = confirmed(grown.steps, grown.rejected, final)
    if best is not None:
        after = (fine if grown.steps else fitter).left_out(best[1])
    case.pool.count += fitter.case.pool.count
    return Evidence(
        case=case, fitter=fine, plain=refined, nearest=closest or refined, errors_before=before, errors_after=after,
        screening=grown.base.screening, signatures=grown.base.signatures,
        steps=grown.steps, rejected=grown.rejected, final=final, remaining=grown.last.screening,
        noise_share=answer.noise_share, detected=answer.detected,
    )  # fmt: skip


@dc.dataclass(frozen=True, kw_only=True)
class _Answer:
    """A grown model with the case it belongs to; ``fitter`` is on longer ticks. The rest as in ``Evidence``."""

    case: Case
    fitter: Fitter
    grown: _Grown
    noise_share: float = 1.0
    detected: float | None = None


def _in_question(grown: _Grown) -> list[type[Effect]]:
    """The effects that were found, and those whose score tests came near enough to be tried."""
    scores = grown.base.screening.scores
    least = WORTH_A_TRY * max(s.gain for s in scores)
    found = {step[0].name for step in grown.steps}
    return [s.kind for s in scores if s.gain >= least or s.kind.name in found]


@dc.dataclass(frozen=True, kw_only=True)
class _Search:
    """How a model is grown from a plain fit."""

    kinds: Sequence[type[Effect]]
    alpha: float
    rng: np.random.Generator
    tick: Tick

    def answer(self, case: Case, rough: Case, first: Fitted, memory: Memory) -> _Answer:
        """Look at the whole catalogue, add effects, and take out what became superfluous."""
        guard, found = _looks(rough, first, self.kinds, self.tick, memory)
        fitter = Fitter(rough, guard, tolerances(rough, found))
        looked = _Looked.at(fitter.guard(first), found, self.rng)
        grown = _grown(fitter, looked, self.kinds, self.alpha, self.rng, self.tick)
        grown = _pruned(fitter, grown, self.rng, self.tick)
        for k in range(len(grown.steps) - 1):
            grown = _reconsidered(fitter, grown, k, self.rng, self.tick)
        return _Answer(case=case, fitter=fitter, grown=grown)

    def answer_by_ratios(self, case: Case, rough: Case, first: Fitted, memory: Memory) -> _Answer:
        """The same where the noise is not known: as loud as the plain cell leaves, then as what was found leaves."""
        loud = self.answer(*as_loud_as_left(case, rough, first), memory)
        if not loud.grown.steps:
            return loud
        model = Fitter(loud.fitter.case).linearise(loud.grown.last.fitted.state)
        quiet, rough, _ = as_loud_as_left(case, rough, model)
        share, detected = quieter(loud.case, quiet), loud.grown.base.p_value
        if share > MOST_OF_UNKNOWN:
            return dc.replace(loud, noise_share=share, detected=detected)
        # What was noise so far was missing physics: with less noise the pushes tell more.
        self.tick("plain fit with less noise", 0, 0)
        first = Fitter(rough).fit(loud.grown.base.fitted.state, renew=True)
        again = dc.replace(self, kinds=_in_question(loud.grown)).answer(quiet, rough, first, Memory())
        return dc.replace(again, noise_share=share, detected=detected)


@dc.dataclass(frozen=True, kw_only=True)
class _Looked:
    """A model, what the catalogue's effects would change of it, and their score tests."""

    fitted: Fitted
    signatures: tuple[Signature, ...]
    screening: Screening

    @classmethod
    def at(cls, fitted: Fitted, signatures: Sequence[Signature], rng: np.random.Generator) -> _Looked:
        # Derivatives with respect to the pushes' own frictions may have been taken anew since.
        fresh = tuple(with_frictions(fitted, s) for s in signatures)
        return cls(fitted=fitted, signatures=fresh, screening=screen(fitted, fresh, rng))

    @property
    def p_value(self) -> float:
        """Of "nothing is missing"."""
        return mismatch(self.fitted, self.screening)


@dc.dataclass(frozen=True, kw_only=True)
class _Grown:
    """A model grown effect by effect: the plain one, the last, the steps between, and what a last step rejected."""

    base: _Looked
    last: _Looked
    steps: tuple[tuple[Candidate, ...], ...]
    rejected: tuple[Candidate, ...]


def _grown(
    fitter: Fitter,
    base: _Looked,
    kinds: Sequence[type[Effect]],
    alpha: float,
    rng: np.random.Generator,
    tick: Tick,
) -> _Grown:
    """Add the effect that pushes left out confirm most, as long as something is missing; or two at once."""
    last, steps, rejected = base, list[tuple[Candidate, ...]](), tuple[Candidate, ...]()
    pool = fitter.case.pool
    longest = pool.count + LONGEST * len(fitter.case.problems)
    while len(steps) < min(MOST_EFFECTS, len(kinds)) and pool.count < longest and last.p_value < alpha:
        candidates = confirm(fitter, last.fitted, last.screening.scores, tick, most=CANDIDATES - len(steps))
        if not steps and candidates:
            better = _plain_from(fitter, base.fitted, candidates[0], tick)
            if better is not None:
                # The effect led out of a wrong basin of theta, and perhaps did nothing else.
                if better.reduced_chi2 <= EXPLAINED:
                    base = last = _Looked.at(better, signatures(Fitter(fitter.case), better, kinds), rng)
                    continue
                base = last = _Looked.at(better, base.signatures, rng)
                candidates = rejudged(candidates, better)
        added = _worth_adding(base.fitted, last.fitted, candidates)
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
        model = _model_with(fitter, state)
        hopeless = len(steps) > 1 and model.reduced_chi2 > HOPELESS
        more = not hopeless and len(steps) < MOST_EFFECTS and pool.count < longest
        last = _what_is_left(fitter, model, last.signatures, kinds, rng, tick, alpha if more else 0.0)
        if hopeless:
            break
    return _Grown(base=base, last=last, steps=tuple(steps), rejected=rejected)


def _worth_adding(base: Fitted, last: Fitted, candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """The candidates, the one to add first: the simplest of the best, or the best; none where neither will do.

    What is a hundredth of what the effects before it explain may be no more than the error of their laws.
    """
    if not candidates:
        return ()
    least = A_LAW * float((push_scores(last) - push_scores(base)).sum())
    best = max((c for c in candidates if not c.degenerate), key=lambda c: c.gain, default=candidates[0])
    for one in (candidates[0], best):
        if worthwhile(last, one) and one.gain > least:
            return (one, *(c for c in candidates if c is not one))
    return ()


def _pruned(fitter: Fitter, grown: _Grown, rng: np.random.Generator, tick: Tick) -> _Grown:
    """Without the effects that a later one made superfluous: they had stood in for what was still missing."""
    last, steps = grown.last, list(grown.steps)
    for k in reversed(range(len(steps) - 1)):
        name = steps[k][0].name
        tick(f"model without {name}", 0, 0)
        effects = tuple(e for e in last.fitted.state.effects if e.kind.name != name)
        without = fitter.fit(dc.replace(last.fitted.state, effects=effects), rounds=4, like=last.fitted)
        gains = push_scores(last.fitted) - push_scores(without)
        if not dc.replace(steps[k][0], fitted=last.fitted, gains=gains).accepted:
            missed = [s for s in grown.base.signatures if s.kind.name == name]
            last = _Looked.at(without, (*last.signatures, *missed), rng)
            del steps[k]
    return dc.replace(grown, last=last, steps=tuple(steps))


def _what_is_left(
    fitter: Fitter, model: Fitted, before: Sequence[Signature], kinds: Sequence[type[Effect]],
    rng: np.random.Generator, tick: Tick, alpha: float,
) -> _Looked:  # fmt: skip
    """The score tests of what a model leaves; signatures are taken anew only if something is missing at ``alpha``."""
    present = {e.kind for e in model.state.effects}
    # Those of the model before are near enough to ask whether anything is left.
    looked = _Looked.at(model, [s for s in before if s.kind not in present], rng)
    if looked.p_value >= alpha:
        return looked
    tick("score tests of what is left", 0, 0)
    fresh = signatures(Fitter(fitter.case), model, [k for k in kinds if k not in present])
    return _Looked.at(model, fresh, rng)


def _plain_from(fitter: Fitter, plain: Fitted, candidate: Candidate, tick: Tick) -> Fitted | None:
    """A better plain fit from the theta at which an effect's fit ended; None where there is none."""
    lost = candidate.fitted.reduced_chi2 > HOPELESS  # and so is its theta
    if lost or candidate.fitted.score - plain.score < ANOTHER_BASIN:
        return None
    tick("plain fit from there", 0, 0)
    near = fitter.fit(fitter.start(candidate.fitted.state.u), rounds=2, careful=2, renew=True)
    if near.score < plain.score:
        return None
    again = fitter.fit(near.state, rounds=2, like=near, renew=True)
    return again if again.score - plain.score > ANOTHER_BASIN else None


def _first(case: Case, rng: np.random.Generator, tick: Tick, memory: Memory) -> Fitted:
    """The plain fit, or that of an interrupted run."""
    kept = memory.recall("plain")
    if kept is not None:
        u, scatter, *own = kept
        return Fitter(case).linearise(State(u=u, effects=(), own=tuple(own), scatter=float(scatter)))
    found = fit_plain(case, rng, tick).state
    memory.keep("plain", [found.u, np.array(found.scatter), *found.own])
    # All derivatives here, so that a run that goes on from what was kept has the same bits.
    return Fitter(case).linearise(found)


def _looks(
    case: Case, first: Fitted, kinds: Sequence[type[Effect]], tick: Tick, memory: Memory
) -> tuple[tuple[Array, ...], list[Signature]]:
    """The guard's directions and the catalogue's signatures, or those of an interrupted run."""
    guard_kept, kept = memory.recall("guard"), memory.recall("signatures")
    if guard_kept is None:
        tick("numerics guard", 0, 0)
        guard_kept = list(numerics(case, first.state))
        memory.keep("guard", guard_kept)
    fitter = Fitter(case)
    blank = empty_signatures(fitter, kinds)
    if kept is not None and len(kept) == len(blank) * len(case.problems):  # of a run of this version
        edges = iter(kept)
        return tuple(guard_kept), [dc.replace(s, columns=tuple(next(edges) for _ in case.problems)) for s in blank]
    found = signatures(fitter, first, kinds, lambda done, total: tick("score tests", done, total))
    memory.keep("signatures", [c for s in found for c in s.columns])
    return tuple(guard_kept), found


def _reconsidered(fitter: Fitter, grown: _Grown, k: int, rng: np.random.Generator, tick: Tick) -> _Grown:
    """The rivals of a step judged again beside the effects that came after it: what was missing then blurred them.

    One that does better there takes the place of the step's effect.
    """
    plain, model, step = grown.base.fitted, grown.last.fitted, grown.steps[k]
    effects = model.state.effects
    present = {e.kind.name for e in effects}
    alike = class_of(plain, step)
    rivals = [c for c in step[1:] if c.name in alike and c.name not in present]
    if not rivals:
        return grown

    def with_kth(points: tuple[EffectPoint, ...]) -> State:
        return dc.replace(model.state, effects=(*effects[:k], *points, *effects[k + 1 :]))

    models = {step[0].name: model}
    for other in rivals:
        tick(f"{other.name} in place of {step[0].name}", 0, 0)
        point = next(e for e in other.fitted.state.effects if e.kind.name == other.name)
        models[other.name] = fitter.fit(with_kth((point,)), rounds=4, like=model)
    tick(f"model without {step[0].name}", 0, 0)
    without = push_scores(fitter.fit(with_kth(()), rounds=4, like=model))
    scores = {name: push_scores(one) for name, one in models.items()}
    best = ranked([dc.replace(c, gains=scores[c.name] - without) for c in (step[0], *rivals)])[0].name
    before = push_scores(plain)
    judged = [dc.replace(c, gains=scores[c.name] - before) if c.name in scores else c for c in step]
    judged.sort(key=lambda c: c.name != best)
    steps = (*grown.steps[:k], tuple(judged), *grown.steps[k + 1 :])
    if best == step[0].name:
        return dc.replace(grown, steps=steps)
    tick(f"model with {best}", 0, 0)
    swapped = _model_with(fitter, models[best].state)
    missed = [s for s in grown.base.signatures if s.kind.name == step[0].name]
    left = [s for s in grown.last.signatures if s.kind.name != best]
    return dc.replace(grown, steps=steps, last=_Looked.at(swapped, (*left, *missed), rng))


def _model_with(fitter: Fitter, state: State) -> Fitted:
    """A fitted model with all coordinates of its effects free, all derivatives taken where it is."""
    effects = tuple(e.freed(fitter.case) for e in state.effects)
    near = fitter.fit(dc.replace(state, effects=effects), rounds=3, renew=True)
    if near.reduced_chi2 > HOPELESS or (near.reduced_chi2 <= EXPLAINED and near.state.scatter <= WIDE):
        return near
    # The pushes' unknowns may have been imitating what is missing: once more, without them at first.
    far = fitter.fit(of_other_strength(fitter, near), rounds=4, careful=1, renew=True)
    return far if far.score > near.score else near


def _located(evidence: Evidence, tick: Tick) -> Evidence:
    """With the missing wrench, and the push that would tell rivals apart."""
    rough = Fitter(coarse(evidence.case))
    tick("the missing wrench", 0, 0)
    wrenches = with_phases(evidence.case, missing_wrenches(rough, evidence.plain))
    tick("the next push", 0, 0)
    push = next_push(rough.case, _rival_states(evidence))
    evidence.case.pool.count += rough.case.pool.count
    return dc.replace(evidence, wrenches=wrenches, next_push=push)


def _rival_states(evidence: Evidence) -> list[State]:
    """The models that are still in question: the final one, and the rivals of its last effect."""
    if not evidence.steps:
        return []
    last, final = evidence.steps[-1], evidence.final.state
    alike = class_of(evidence.plain, last)
    others = [c for c in last[1:] if c.name in alike] or [c for c in last[1:] if not c.degenerate][:1]
    points = [next(e for e in c.fitted.state.effects if e.kind.name == c.name) for c in others]
    return [
        final,
        *(
            dc.replace(c.fitted.state, effects=(*final.effects[:-1], point))
            for c, point in zip(others, points, strict=True)
        ),
    ]
