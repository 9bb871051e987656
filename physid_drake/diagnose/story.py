"""The story: is there a mismatch, which physics is missing, how sure, and what would tell."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.diagnose.case import UNIT_SCATTER, Case
from physid_drake.diagnose.confirm import Candidate, confirm, push_scores, rivals, standard_error
from physid_drake.diagnose.fit import Fitted, Fitter, State
from physid_drake.diagnose.linear import left_out_scores
from physid_drake.diagnose.localise import MissingWrench, locate, missing_wrenches, with_phases
from physid_drake.diagnose.memory import Memory
from physid_drake.diagnose.next_push import next_push
from physid_drake.diagnose.plain import coarse, fit_plain, numerics
from physid_drake.diagnose.screen import (
    Screening,
    Signature,
    cosine,
    empty_signatures,
    log_probability,
    projected,
    screen,
    signatures,
    tolerances,
)
from physid_drake.diagnose.values import (
    Detectable,
    Diagnosis,
    EffectFinding,
    FitQuality,
    Location,
    NextPush,
    ParameterEstimate,
    Ranked,
    ThetaEstimate,
)
from physid_drake.effects import Effect, applicable

Array = NDArray[np.float64]
Tick = Callable[[str, int, int], None]

MOST_EFFECTS = 3
ALIKE = 0.95  # cosine of two projected signatures that these pushes cannot tell apart
FEWEST_PUSHES = 3
SAMPLES = 400  # of an effect's chart, for the intervals of its parameters
# The cell's own error that guard, floor and tolerances leave: cost per degree of freedom where nothing is missing.
SLACK = 1.15
EXPLAINED = 1.5  # cost per degree of freedom, over that slack, above which something is still missing
LEAST_SHARE = 0.25  # of the cost beyond noise that an effect must take away unless nothing is left
CANDIDATES = 4  # fitted in the first step, one less in each that follows
HOPELESS = 6.0  # cost per degree of freedom with an effect: no second one of the catalogue will make up for that
VISIBLE = 10.0  # standard deviations of motion: pushes that would not show such an effect show nothing
IDENTIFIABLE = 0.5  # posterior over prior standard deviation


@dc.dataclass(frozen=True, kw_only=True)
class Evidence:
    """Everything that was computed, for the report and the models that leave.

    Attributes:
        case: the recording.
        fitter: with guard and tolerances.
        plain: the plain cell, fitted.
        screening: of the catalogue at the plain cell.
        signatures: of the catalogue at the plain cell.
        steps: one per accepted effect: all candidates of that step.
        rejected: candidates of a step in which none was accepted.
        final: the model at the end.
        remaining: screening of what it leaves.
        wrenches: what is missing from the plain cell, window by window.
        next_push: that would tell the rivals apart.
    """

    case: Case
    fitter: Fitter
    plain: Fitted
    screening: Screening
    signatures: tuple[Signature, ...]
    steps: tuple[tuple[Candidate, ...], ...]
    rejected: tuple[Candidate, ...]
    final: Fitted
    remaining: Screening
    wrenches: tuple[MissingWrench, ...] = ()
    next_push: NextPush | None = None


def gather(
    case: Case, *, seed: int, alpha: float, effects: Sequence[str] | None, tick: Tick, memory: Memory
) -> Evidence:
    """Fit, screen, confirm: all that needs rollouts.

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
    first = _first(case, search_rng, tick, memory)
    rough = Fitter(coarse(case))
    guard, found = _looks(case, first, rough, kinds, tick, memory)
    fitter = Fitter(case, guard, tolerances(rough, found))
    plain = fitter.guard(first)
    screening = screen(plain, found, screen_rng)
    current, remaining, at = plain, screening, found
    steps: list[tuple[Candidate, ...]] = []
    rejected: tuple[Candidate, ...] = ()
    while len(steps) < min(MOST_EFFECTS, len(kinds)) and mismatch(current, remaining) < alpha:
        candidates = confirm(fitter, current, remaining.scores, tick, most=CANDIDATES - len(steps))
        if not candidates or not candidates[0].accepted or not _worthwhile(current, candidates[0].fitted):
            rejected = candidates
            break
        steps.append(candidates)
        tick(f"model with {candidates[0].name}", 0, 0)
        freed = _freed(case, candidates[0].fitted.state)
        current = fitter.fit(freed, rounds=3, like=fitter.linearise(freed))
        if current.reduced_chi2 > HOPELESS:
            break
        # The signatures at the plain cell are near enough to ask whether anything is left.
        left = [s for s in at if s.kind not in {e.kind for e in current.state.effects}]
        remaining = screen(current, left, screen_rng)
        if mismatch(current, remaining) < alpha and len(steps) < MOST_EFFECTS:
            tick("score tests of what is left", 0, 0)
            at = signatures(rough, current, [k for k in kinds if k not in {e.kind for e in current.state.effects}])
            remaining = screen(current, at, screen_rng)
    case.pool.count += rough.case.pool.count
    return Evidence(
        case=case, fitter=fitter, plain=plain, screening=screening, signatures=tuple(found), steps=tuple(steps),
        rejected=rejected,
        final=current, remaining=remaining,
    )  # fmt: skip


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
    first = fit_plain(case, rng, tick)
    # Linearised again, so that a run that goes on from here has the same bits.
    memory.keep("plain", [first.state.u, np.array(first.state.scatter), *first.state.own])
    return first


def _looks(
    case: Case, first: Fitted, rough: Fitter, kinds: Sequence[type[Effect]], tick: Tick, memory: Memory
) -> tuple[tuple[Array, ...], list[Signature]]:
    """The guard's directions and the catalogue's signatures, or those of an interrupted run."""
    guard_kept, kept = memory.recall("guard"), memory.recall("signatures")
    if guard_kept is None:
        tick("numerics guard", 0, 0)
        guard_kept = list(numerics(case, first.state))
        memory.keep("guard", guard_kept)
    blank = empty_signatures(rough, kinds)
    if kept is not None:
        edges = iter(kept)
        return tuple(guard_kept), [dc.replace(s, columns=tuple(next(edges) for _ in case.problems)) for s in blank]
    found = signatures(rough, first, kinds, lambda done, total: tick("score tests", done, total))
    memory.keep("signatures", [c for s in found for c in s.columns])
    return tuple(guard_kept), found


def _freed(case: Case, state: State) -> State:
    return dc.replace(state, effects=tuple(e.freed(case) for e in state.effects))


def mismatch(fitted: Fitted, screening: Screening | None) -> float:
    """P-value of "this model explains the pushes": the better of the catalogue's and the cost's, for two looks.

    Args:
        fitted: the model.
        screening: of the catalogue; None where pushes that were left out confirm nothing of it, so that only the cost
            speaks: one odd push is no physics.
    """
    cost = float(stats.chi2.sf(fitted.solution.chi2 / SLACK, fitted.degrees))
    best = cost if screening is None else min(screening.p_value, cost)
    return float(-np.expm1(2.0 * np.log1p(-min(best, 1.0 - 1e-16))))


def unexplained(fitted: Fitted) -> bool:
    """Whether what is left is more than noise and the cell's own error."""
    return fitted.reduced_chi2 > EXPLAINED


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
    alike = _class_of(evidence, last)
    others = [c for c in last[1:] if c.name in alike] or [c for c in last[1:] if not c.degenerate][:1]
    return [evidence.final.state, *(c.fitted.state for c in others)]


def conclude(evidence: Evidence, *, seed: int, alpha: float) -> Diagnosis:
    """The verdict and all figures, from evidence; no rollouts."""
    case, plain, final = evidence.case, evidence.plain, evidence.final
    p_value = mismatch(plain, evidence.screening if evidence.steps else None)
    detectable = smallest(evidence, alpha)
    verdict = _verdict(evidence, p_value, alpha, detectable)
    findings = _findings(evidence) if verdict in ("explained", "ambiguous") else ()
    after = final if findings else plain
    return Diagnosis(
        recording=case.recording.name,
        verdict=verdict,
        sentence=_sentence(verdict, findings, evidence, detectable),
        p_value=p_value,
        alpha=alpha,
        effects=findings,
        location=_location(evidence, verdict, findings, seed),
        fit=_quality(case, plain, after),
        theta=_theta(evidence, after),
        next_push=evidence.next_push if verdict in ("explained", "ambiguous", "unexplained") else None,
        seed=seed,
        ranking=_ranking(evidence, findings),
        detectable=detectable,
        left=_left(evidence, after),
        reduced_chi2_before=plain.reduced_chi2,
        reduced_chi2_after=after.reduced_chi2,
        friction_scatter=UNIT_SCATTER * after.state.scatter,
        noise={
            "position_m": case.noise.position,
            "rotation_rad": case.noise.rotation,
            "correlation_time_s": list(case.noise.correlation_time),
            "jitter_s": case.noise.jitter,
        },
        warnings=case.noise.warnings,
        rollouts=case.pool.count,
    )


def _verdict(evidence: Evidence, p_value: float, alpha: float, detectable: Sequence[Detectable]) -> str:
    if len(evidence.case.problems) < FEWEST_PUSHES:
        return "underpowered"  # nothing can be confirmed on pushes that were left out
    if p_value >= alpha:
        blind = float(np.median([d.sigmas for d in detectable])) > VISIBLE if detectable else True
        return "underpowered" if blind else "consistent"
    if not evidence.steps or unexplained(evidence.final):
        return "unexplained"
    return "ambiguous" if any(_class_of(evidence, step) for step in evidence.steps) else "explained"


def _location(evidence: Evidence, verdict: str, findings: Sequence[EffectFinding], seed: int) -> Location | None:
    """Where the mismatch is; the frame is that of the physics found, where some was found."""
    if verdict in ("consistent", "underpowered"):
        return None
    found = locate(evidence.case, evidence.wrenches, np.random.default_rng(seed))
    if found is None or not findings:
        return found
    return dc.replace(found, frame=evidence.steps[0][0].score.kind.frame)


def _class_of(evidence: Evidence, step: Sequence[Candidate]) -> tuple[str, ...]:
    """Names that explain these pushes as well as the best of a step."""
    best = step[0]
    close = {c.name for c in rivals(best, step)}
    for other in step[1:]:
        if other.accepted and abs(cosine(evidence.plain, best.score, other.score)) > ALIKE:
            difference = best.gains - other.gains
            if difference.sum() < 3.0 * standard_error(difference):
                close.add(other.name)
    return tuple(sorted(close))


def _probability(step: Sequence[Candidate]) -> float:
    """That the best of a step is the right one: odds of each rival from its held-out deficit and standard error."""
    best, total = step[0], 1.0
    for other in step[1:]:
        if other.degenerate:
            continue
        difference = best.gains - other.gains
        # Some error of the scores themselves, so that few pushes do not make sure.
        spread = math.hypot(standard_error(difference), 2.0)
        worse = float(stats.norm.sf(difference.sum() / spread))
        total += worse / max(1.0 - worse, 1e-9)
    return 1.0 / total


def _findings(evidence: Evidence) -> tuple[EffectFinding, ...]:
    found = []
    for k, step in enumerate(evidence.steps):
        kind = step[0].score.kind
        found.append(
            EffectFinding(
                name=kind.name,
                element=kind.element,
                indistinguishable_from=_class_of(evidence, step),
                probability=_probability(step),
                parameters=_parameters(evidence, k),
                statement=kind.statement,
            )
        )
    return tuple(found)


def shared_covariance(fitted: Fitted) -> Array:
    """Covariance (d, d) of theta and the effects' coordinates, widened where the model does not fit."""
    covariance: Array = np.asarray(np.linalg.pinv(fitted.solution.precision), dtype=np.float64)
    widened: Array = covariance * max(1.0, fitted.reduced_chi2)
    return widened


def _t_factor(fitted: Fitted) -> float:
    """How much wider than a normal interval one is with so few pushes."""
    free = max(2, len(fitted.pushes) - fitted.own_dimension)
    return float(stats.t.ppf(0.95, free) / stats.norm.ppf(0.95))


def _parameters(evidence: Evidence, k: int) -> dict[str, ParameterEstimate]:
    """Values and intervals of the k-th effect, by drawing its chart point."""
    final, case = evidence.final, evidence.case
    here = final.state.effects[k]
    at = len(final.state.u) + sum(len(e.free) for e in final.state.effects[:k])
    part = slice(at, at + len(here.free))
    covariance = shared_covariance(final)[part, part]
    rng = np.random.default_rng(0)
    draws = rng.multivariate_normal(np.zeros(len(here.free)), covariance, SAMPLES, method="eigh") * _t_factor(final)
    drawn = [here.moved(case, d).effect(case) for d in draws]
    effect = here.effect(case)
    return {
        name: ParameterEstimate(
            value=_plain(getattr(effect, name)),
            unit=unit,
            ci90=_interval(effect, name, [getattr(d, name) for d in drawn]),
            null=_plain(effect.nulls()[name]),
        )
        for name, unit in effect.units().items()
    }


def _plain(value: Any) -> Any:
    return [list(row) for row in value] if isinstance(value, tuple) else value


def _interval(effect: Effect, name: str, values: Sequence[Any]) -> Any:
    if name == "angle":
        # An axis: the draws are turned to within a quarter turn of the value.
        here = float(getattr(effect, name))
        turned = here + (np.asarray(values) - here + 0.5 * math.pi) % math.pi - 0.5 * math.pi
        return [float(q) for q in np.quantile(turned, [0.05, 0.95])]
    low, high = np.quantile(np.asarray(values, dtype=np.float64), [0.05, 0.95], axis=0)
    return [low.tolist(), high.tolist()]


def _theta(evidence: Evidence, fitted: Fitted) -> dict[str, ThetaEstimate]:
    space = evidence.case.thetas.space
    covariance = shared_covariance(fitted)
    _, prior = evidence.fitter.priors(fitted.state)
    reach = float(stats.norm.ppf(0.95)) * _t_factor(fitted)
    before = np.asarray(space.from_unit(evidence.plain.state.u))
    here = np.asarray(space.from_unit(fitted.state.u))
    result = {}
    for j, parameter in enumerate(space.parameters):
        std = math.sqrt(covariance[j, j])
        told = std < IDENTIFIABLE * prior[j]
        ends = []
        for sign in (-1.0, 1.0):
            u = fitted.state.u.copy()
            u[j] = float(np.clip(u[j] + sign * reach * std, 0.0, 1.0))
            ends.append(float(space.from_unit(u)[j]))
        result[parameter.name] = ThetaEstimate(
            value=float(here[j]) if told else None,
            unit=parameter.unit,
            ci90=(ends[0], ends[1]) if told else None,
            identifiable=bool(told),
            before=float(before[j]),
        )
    return result


def _quality(case: Case, plain: Fitted, after: Fitted) -> FitQuality:
    gains = push_scores(after) - push_scores(plain)
    figures = []
    per_push: list[list[float]] = []
    for fitted in (plain, after):
        _, residuals = left_out_scores(fitted.pushes, fitted.state.scatter, fitted.prior_mean, fitted.prior_std)
        poses = [f.poses(r) for f, r in zip(case.features, residuals, strict=True)]
        sigmas = [p / f.sigmas for p, f in zip(poses, case.features, strict=True)]
        every, scaled = np.concatenate(poses), np.concatenate(sigmas)
        per_push.append([_rms(s) for s in sigmas])
        figures.append((_rms(scaled), math.sqrt(2.0) * _rms(every[:, :2]), _rms(every[:, 2])))
    (rms0, position0, rotation0), (rms1, position1, rotation1) = figures
    return FitQuality(
        rms_before=rms0, rms_after=rms1, position_before=position0, position_after=position1,
        rotation_before=rotation0, rotation_after=rotation1,
        log_score_gain=float(gains.sum()), log_score_gain_se=standard_error(gains) if len(gains) > 1 else 0.0,
        per_push=tuple((p.name, b, a) for p, b, a in zip(case.problems, *per_push, strict=True)),
    )  # fmt: skip


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def smallest(evidence: Evidence, alpha: float) -> tuple[Detectable, ...]:
    """The smallest effect of each kind that the score tests would have shown, in its own unit and in motion."""
    plain, case = evidence.plain, evidence.case
    found = list(evidence.signatures)
    if not found:
        return ()
    threshold = _gain_needed(len(plain.pushes), plain.own_dimension, evidence.screening.looks, alpha)
    _, blocks = projected(plain, [s.columns for s in found])
    best: dict[str, Detectable] = {}
    for signature, block in zip(found, blocks, strict=True):
        amplitudes = signature.family.free[:1] if signature.one_sided[0] else signature.family.free
        for d, j in enumerate(amplitudes):
            norm = float(np.linalg.norm(block[:, d]))
            if norm < 1e-9:
                continue
            steps = math.sqrt(threshold) / norm
            coordinate = signature.kind.chart(case.around)[j]
            point = np.array(signature.family.point)
            point[j] += steps * signature.family.size * coordinate.step
            moved = steps * _rms(np.concatenate([c[:, d] for c in signature.columns]))
            one = _detectable(case, signature.kind, point, j, moved)
            if one.name not in best or moved < best[one.name].sigmas:
                best[one.name] = one
    return tuple(best.values())


def _detectable(case: Case, kind: type[Effect], point: Array, j: int, sigmas: float) -> Detectable:
    """The effect at a chart point that left its null along coordinate j."""
    chart = kind.chart(case.around)
    within = np.array([np.clip(p, c.lower, c.upper) for p, c in zip(point, chart, strict=True)])
    effect = kind.at(within, case.around)
    numbers = {n: getattr(effect, n) for n in kind.amplitudes if isinstance(getattr(effect, n), float)}
    if not numbers:
        return Detectable(
            name=kind.name, parameter=chart[j].name, value=float(within[j]), unit="-", sigmas=sigmas
        )  # fmt: skip
    name = max(numbers, key=lambda n: abs(numbers[n] - kind.nulls()[n]))
    return Detectable(name=kind.name, parameter=name, value=numbers[name], unit=kind.units()[name], sigmas=sigmas)


def _gain_needed(pushes: int, spent: int, looks: float, alpha: float) -> float:
    """Gain at which an effect of one direction is seen with even odds."""
    wanted = math.log(alpha / (2.0 * looks))
    gains = np.linspace(0.0, 400.0, 2001)
    seen = [log_probability(float(g), 1, pushes, spent) <= wanted for g in gains]
    return float(gains[int(np.argmax(seen))]) if any(seen) else float(gains[-1])


def _ranking(evidence: Evidence, findings: Sequence[EffectFinding]) -> tuple[Ranked, ...]:
    named = {f.name for f in findings}
    classes = {name for f in findings for name in f.indistinguishable_from}
    steps = (*evidence.steps, evidence.rejected)
    fitted = {c.name: c for step in reversed(steps) for c in step}
    rows = []
    for one in evidence.screening.scores:
        candidate = fitted.get(one.kind.name)
        rows.append(
            Ranked(
                name=one.kind.name,
                gain=one.gain,
                p_value=float(min(1.0, evidence.screening.looks * math.exp(one.log_p))),
                held_out_gain=None if candidate is None else candidate.gain,
                held_out_se=None if candidate is None else candidate.standard_error,
                why=_why(one.kind.name, candidate, named, classes, evidence),
            )
        )
    return tuple(rows)


def _why(name: str, candidate: Candidate | None, named: set[str], classes: set[str], evidence: Evidence) -> str:
    if name in named:
        return "found"
    if name in classes:
        return "these pushes cannot tell it from what was found"
    if candidate is None:
        return _why_not_fitted(name, evidence)
    if candidate.degenerate:
        return "its fit ran to nothing"
    if not candidate.accepted:
        return "pushes that were left out do not confirm it"
    return "predicts pushes that were left out worse"


def _why_not_fitted(name: str, evidence: Evidence) -> str:
    score = evidence.screening.score_of(name)
    if score is None or not score.kept:
        return "would have to act the other way round"
    chance = evidence.screening.looks * math.exp(score.log_p) > 0.05
    return "explains no more than chance would" if chance else "explains far less"


def _left(evidence: Evidence, after: Fitted) -> str:
    ratio = after.reduced_chi2
    if ratio <= EXPLAINED:
        return "nothing beyond noise, scatter and the simulator's own error"
    best = evidence.remaining.scores[0].kind.name if evidence.remaining.scores else "none"
    return (
        f"{math.sqrt(ratio):.1f} times what noise and the simulator's own error would leave;"
        f" the nearest of the catalogue is {best}, which does not account for it"
    )


def _sentence(
    verdict: str, findings: Sequence[EffectFinding], evidence: Evidence, detectable: Sequence[Detectable]
) -> str:
    match verdict:
        case "consistent":
            return "The plain cell explains these pushes: nothing is missing that they could show."
        case "underpowered":
            return "These pushes cannot tell: an effect would have to be large to show in them."
        case "unexplained":
            return "Simulation and recording differ, and nothing in the catalogue accounts for it."
    names = [
        f"{f.name} ({f.statement})"
        + (f", or {' or '.join(f.indistinguishable_from)}" if f.indistinguishable_from else "")
        for f in findings
    ]
    return "What is missing: " + "; and ".join(names) + "."


def _or(names: Sequence[str]) -> str:
    return f", or {' or '.join(names)}, which these pushes cannot tell from it" if names else ""


def state_of(evidence: Evidence, diagnosis: Diagnosis) -> State:
    """The model that leaves: with the effects if they were found, else plain."""
    return evidence.final.state if diagnosis.effects else evidence.plain.state
