"""The story: fit, screen, confirm, add, locate. What needs rollouts is here; conclusions are drawn in `conclude`."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.case import Case
from physid_drake.diagnose.conclude import class_of, conclude
from physid_drake.diagnose.confirm import Candidate, confirm, push_scores
from physid_drake.diagnose.estimates import rms
from physid_drake.diagnose.evidence import EXPLAINED, Evidence, mismatch
from physid_drake.diagnose.fit import Fitted, Fitter, State
from physid_drake.diagnose.linear import own_unknowns
from physid_drake.diagnose.localise import missing_wrenches, with_phases
from physid_drake.diagnose.memory import Memory
from physid_drake.diagnose.next_push import next_push
from physid_drake.diagnose.plain import coarse, fit_plain, numerics
from physid_drake.diagnose.screen import (
    Signature,
    empty_signatures,
    screen,
    signatures,
    tolerances,
)
from physid_drake.diagnose.values import Diagnosis
from physid_drake.effects import Effect, applicable

Array = NDArray[np.float64]
Tick = Callable[[str, int, int], None]

MOST_EFFECTS = 3
LEAST_SHARE = 0.25  # of the cost beyond noise that an effect must take away unless nothing is left
LONGEST = 450  # rollouts per push after which no further effect is looked for
ANOTHER_BASIN = 10.0  # nats by which a plain fit must be better to be another one
LOUDER = 4  # rounds in which an unknown noise is found
CANDIDATES = 4  # fitted in the first step, one less in each that follows
HOPELESS = 6.0  # cost per degree of freedom with an effect: no second one of the catalogue will make up for that,
PROMISING = 0.3  # unless so little is left of what there was before


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
    kinds = applicable(case.around, effects)
    rough = coarse(case)
    first = _first(rough, search_rng, tick, memory)
    if not case.noise.known:
        # Only ratios can speak then: the plain cell is taken to leave noise, and effects must leave less of it.
        case, rough, first = _as_loud_as_left(case, rough, first)
    guard, found = _looks(rough, first, kinds, tick, memory)
    allowed = tolerances(rough, found)
    fitter = Fitter(rough, guard, allowed)
    plain = fitter.guard(first)
    screening = screen(plain, found, screen_rng)
    current, remaining, at = plain, screening, found
    steps: list[tuple[Candidate, ...]] = []
    rejected: tuple[Candidate, ...] = ()
    while (
        len(steps) < min(MOST_EFFECTS, len(kinds))
        and rough.pool.count < LONGEST * len(case.problems)
        and mismatch(current, remaining) < alpha
    ):
        candidates = confirm(fitter, current, remaining.scores, tick, most=CANDIDATES - len(steps))
        if current is plain and candidates:
            better = _plain_from(fitter, plain, candidates[0], tick)
            if better is not None:
                # The effect only led out of a wrong basin of theta: everything again from the better plain fit.
                plain = current = better
                at = found = signatures(Fitter(rough), Fitter(rough).linearise(plain.state), kinds)
                screening = remaining = screen(plain, found, screen_rng)
                continue
        if not candidates or not candidates[0].accepted or not _worthwhile(current, candidates[0].fitted):
            rejected = candidates
            break
        steps.append(candidates)
        tick(f"model with {candidates[0].name}", 0, 0)
        before, current = current, _model_with(fitter, candidates[0])
        if current.reduced_chi2 > max(HOPELESS, PROMISING * before.reduced_chi2):
            break
        # The signatures at the plain cell are near enough to ask whether anything is left.
        left = [s for s in at if s.kind not in {e.kind for e in current.state.effects}]
        remaining = screen(current, left, screen_rng)
        if mismatch(current, remaining) < alpha and len(steps) < MOST_EFFECTS:
            tick("score tests of what is left", 0, 0)
            missing = [k for k in kinds if k not in {e.kind for e in current.state.effects}]
            at = signatures(Fitter(rough), current, missing)
            remaining = screen(current, at, screen_rng)
    steps = [_reconsidered(fitter, plain, current, k, step, tick) for k, step in enumerate(steps)]
    fine = Fitter(case, guard, allowed)
    tick("on short ticks", 0, 0)
    refined = fine.refine(plain)
    final = fine.refine(current) if steps else refined
    case.pool.count += rough.pool.count
    return Evidence(
        case=case, fitter=fine, plain=refined, screening=screening, signatures=tuple(found), steps=tuple(steps),
        rejected=rejected, final=final, remaining=remaining,
    )  # fmt: skip


def _plain_from(fitter: Fitter, plain: Fitted, candidate: Candidate, tick: Tick) -> Fitted | None:
    """A better plain fit from the theta at which an effect's fit ended; None where there is none."""
    if candidate.fitted.score - plain.score < ANOTHER_BASIN:
        return None
    tick("plain fit from there", 0, 0)
    again = fitter.fit(fitter.start(candidate.fitted.state.u), rounds=4, careful=2, renew=True)
    return again if again.score - plain.score > ANOTHER_BASIN else None


def _worthwhile(before: Fitted, after: Fitted) -> bool:
    """Whether an effect takes away a good part of what noise does not account for, where much is left."""
    excess = after.reduced_chi2 - 1.0
    return after.reduced_chi2 <= EXPLAINED or excess <= (1.0 - LEAST_SHARE) * (before.reduced_chi2 - 1.0)


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


def _as_loud_as_left(case: Case, rough: Case, fitted: Fitted) -> tuple[Case, Case, Fitted]:
    """Noise so large that the plain model leaves just that, in poses and in forces, for both cases."""
    for _ in range(LOUDER):
        factors = _left_over(rough, fitted)
        case, rough = case.louder(*factors), rough.louder(*factors)
        fitted = Fitter(rough).linearise(fitted.state)
        if fitted.reduced_chi2 < 1.1:
            break
    return case, rough, fitted


def _left_over(case: Case, fitted: Fitted) -> tuple[float, float]:
    """How many times their deviations poses and forces (relative to a scatter of one) are off, at least 1."""
    poses, forces = [], []
    for push, features in zip(fitted.pushes, case.features, strict=True):
        own = own_unknowns(push, fitted.state.scatter, fitted.solution.beta)
        left = push.residual - push.shared @ fitted.solution.beta - push.own @ own
        count = 3 * len(features.middles)
        poses.append(left[:count])
        if len(left) > count:
            white = np.linalg.solve(np.linalg.cholesky(push.noise[count:, count:]), left[count:])
            forces.append(white)
    # The pushes' unknowns took a part of what is left: the cost says how much.
    share = float(np.sqrt(fitted.reduced_chi2 / np.mean(np.concatenate([*poses, *forces]) ** 2)))
    sizes = [share * rms(np.concatenate(values)) if values else 1.0 for values in (poses, forces)]
    return max(1.0, sizes[0]), max(1.0, sizes[1])


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
    if kept is not None:
        edges = iter(kept)
        return tuple(guard_kept), [dc.replace(s, columns=tuple(next(edges) for _ in case.problems)) for s in blank]
    found = signatures(fitter, first, kinds, lambda done, total: tick("score tests", done, total))
    memory.keep("signatures", [c for s in found for c in s.columns])
    return tuple(guard_kept), found


def _reconsidered(
    fitter: Fitter, plain: Fitted, final: Fitted, k: int, step: tuple[Candidate, ...], tick: Tick
) -> tuple[Candidate, ...]:
    """A step's rivals judged again beside the effects that came after it: what was missing then blurred them."""
    count = len(final.state.effects)
    alike = class_of(plain, step)
    if k + 1 >= count or not alike:
        return step
    before = push_scores(plain)
    judged = [dc.replace(step[0], gains=push_scores(final) - before)]
    for other in step[1:]:
        if other.name in alike and other.name not in {e.kind.name for e in final.state.effects}:
            tick(f"{other.name} in place of {step[0].name}", 0, 0)
            effects = list(final.state.effects)
            effects[k] = other.fitted.state.effects[-1]
            swapped = fitter.fit(dc.replace(final.state, effects=tuple(effects)), rounds=4, like=final)
            judged.append(dc.replace(other, gains=push_scores(swapped) - before))
        else:
            judged.append(other)
    return tuple(judged)


def _model_with(fitter: Fitter, candidate: Candidate) -> Fitted:
    """The model with an effect, all its coordinates free, all derivatives taken where it is."""
    state = candidate.fitted.state
    effects = tuple(e.freed(fitter.case) for e in state.effects)
    near = fitter.fit(dc.replace(state, effects=effects), rounds=3, renew=True)
    if near.reduced_chi2 <= EXPLAINED or near.reduced_chi2 > HOPELESS:
        return near
    # The pushes' unknowns may have been imitating what is missing: once more, without them at first.
    far = fitter.fit(fitter.start(near.state.u, near.state.effects), rounds=4, careful=1, renew=True)
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
    last = evidence.steps[-1]
    alike = class_of(evidence.plain, last)
    others = [c for c in last[1:] if c.name in alike] or [c for c in last[1:] if not c.degenerate][:1]
    return [evidence.final.state, *(c.fitted.state for c in others)]
