"""From evidence to the answer: the verdict and all figures, without a rollout."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.diagnose.candidate import (
    EXPLAINED,
    Candidate,
    out_of_question,
    push_scores,
    rivals,
    spread,
    standard_error,
    surely_better,
)
from physid_drake.diagnose.case import UNIT_SCATTER, Case
from physid_drake.diagnose.estimates import parameters_of, smallest, theta_of
from physid_drake.diagnose.evidence import (
    MOST_OF_UNKNOWN,
    TOO_SCATTERED,
    Evidence,
    confirmed,
    mismatch,
    scatter_p_value,
    unexplained,
)
from physid_drake.diagnose.frictions import friction_trend
from physid_drake.diagnose.left_out import comes_nearer, errors_of, least_motion, shown_by_several
from physid_drake.diagnose.looks import locate
from physid_drake.diagnose.model import Fitted
from physid_drake.diagnose.regimes import regime_gains
from physid_drake.diagnose.screen import cosine
from physid_drake.diagnose.sentence import sentence
from physid_drake.diagnose.values import (
    Detectable,
    Diagnosis,
    EffectFinding,
    FitQuality,
    Location,
    Partly,
    Ranked,
)
from physid_drake.identify.identify import MOST_SCATTER
from physid_drake.identify.misfit import diverged

Array = NDArray[np.float64]

ALIKE = 0.95  # cosine of two projected signatures that these pushes cannot tell apart
SURELY = 3.0  # standard errors of a difference of gains: signatures that are alike need more than others
LIKELY = 0.5  # odds against what was found: so likely a candidate is in its class though nothing confirms it
CHANCE = 0.05  # of all looks: what explains no more is not worth a word
FEWEST_PUSHES = 3
GOOD_PART = 0.25  # of the squared error: less is not worth a word
QUIET = 5e-5  # m: a tracker's noise that is no longer what hides the cell's own error
OWN_POSITION, OWN_ROTATION = 2e-4, 2e-3  # m, rad: of left-out pushes, what the cell itself may be off by
PART = "takes a part away, and leaves more than noise"
FAR_OUT = 5.0  # standard deviations: of ten answers of the proof that call as much nothing, four missed an effect
VISIBLE = 10.0  # standard deviations of motion: pushes that would not show such an effect show nothing


def conclude(evidence: Evidence, *, seed: int, alpha: float) -> Diagnosis:
    """The verdict and all figures, from evidence; no rollouts."""
    case, plain, final = evidence.case, evidence.plain, evidence.final
    p_value = _p_value(evidence)
    detectable = smallest(evidence, alpha, least_motion(case, evidence.errors_before))
    verdict = _verdict(evidence, p_value, alpha, detectable)
    findings = _findings(evidence) if verdict in ("explained", "ambiguous") else ()
    after, shown = (final, final) if findings else (plain, evidence.nearest)
    fit = _quality(evidence, after)
    partly = _partly(evidence) if verdict == "unexplained" else None
    return Diagnosis(
        recording=case.recording.name,
        verdict=verdict,
        sentence=sentence(
            verdict,
            findings,
            partly,
            evidence.foil,
            known=case.noise.known,
            fewest=FEWEST_PUSHES if len(case.problems) < FEWEST_PUSHES else None,
        ),
        p_value=p_value,
        alpha=alpha,
        effects=findings,
        location=_location(evidence, verdict, findings, seed),
        fit=fit,
        theta=theta_of(evidence, shown),
        next_push=evidence.next_push if verdict in ("explained", "ambiguous", "unexplained") else None,
        seed=seed,
        ranking=_ranking(evidence, findings, partly),
        detectable=detectable,
        left=_left(evidence, verdict, after, partly),
        partly=partly,
        reduced_chi2_before=plain.reduced_chi2,
        reduced_chi2_after=after.reduced_chi2,
        friction_scatter=UNIT_SCATTER * after.state.scatter,
        noise={
            "position_m": case.noise.position,
            "rotation_rad": case.noise.rotation,
            "correlation_time_s": list(case.noise.correlation_time),
            "jitter_s": case.noise.jitter,
            **_noise_of_sensors(case),
        },
        warnings=(
            *case.warnings,
            *_diverged(case, shown),
            *(() if _is_own_error(evidence) else _hidden(verdict, fit)),
        ),
        rollouts=case.pool.count,
        pushes=case.pushes,
    )


def _diverged(case: Case, shown: Fitted) -> tuple[str, ...]:
    """That the model cannot simulate some pushes at all, which then tell nothing."""
    names = [p.name for p, vector in zip(case.problems, shown.predicted, strict=True) if diverged(vector)]
    if not names:
        return ()
    return (
        f"the model cannot simulate some pushes (the solver diverges, or no object stands so): {', '.join(names)}",
    )


def _hidden(verdict: str, fit: FitQuality) -> tuple[str, ...]:
    """That pushes are explained by what each of them has for itself, which those that are left out have not."""
    if verdict in ("unexplained", "underpowered") or not fit.rms_after > FAR_OUT:
        return ()
    return (
        f"left-out pushes are off by {fit.rms_after:.1f} standard deviations, which each push makes up for by itself"
        " (its start, its friction, its hand's path): an effect may hide there",
    )


def _noise_of_sensors(case: Case) -> dict[str, float]:
    """Of the hand and of a force component, where they were recorded."""
    hand = {} if case.recording.hand is None else {"hand_m": case.sensors.hand}
    if case.sensors.hand_memory > 0.0:
        hand["hand_correlation_time_s"] = case.sensors.hand_memory
    compared = any(len(problem.force_times) for problem in case.problems)
    return hand | ({"force_n": case.sensors.force} if compared else {})


def _p_value(evidence: Evidence) -> float:
    """Of "the plain cell explains these pushes".

    A simulation without noise shows how two honest simulators differ: all of that has structure, and is no physics.
    Where the noise is not known, it is as loud as what the plain cell leaves: what was found made it quieter.
    """
    if _is_own_error(evidence):
        return 1.0
    plain, screening = evidence.loud or (evidence.plain, evidence.screening)
    confirmed_by_pushes = bool(evidence.steps) and _predicts(evidence)
    return mismatch(plain, screening if confirmed_by_pushes else None)


def _is_own_error(evidence: Evidence) -> bool:
    """Whether there is hardly any noise, and the plain cell predicts pushes to its own error."""
    before = errors_of(evidence.case, evidence.errors_before)
    near = before.position < OWN_POSITION and before.rotation < OWN_ROTATION
    return evidence.case.noise.position < QUIET and near


def _verdict(evidence: Evidence, p_value: float, alpha: float, detectable: Sequence[Detectable]) -> str:
    if len(evidence.case.problems) < FEWEST_PUSHES:
        return "underpowered"  # nothing can be confirmed on pushes that were left out
    if p_value >= alpha:
        return "underpowered" if _blind(evidence, detectable) else "consistent"
    if not evidence.steps or not _explained(evidence):
        return "unexplained"
    return "ambiguous" if any(class_beside(evidence, k) for k in range(len(evidence.steps))) else "explained"


def _blind(evidence: Evidence, detectable: Sequence[Detectable]) -> bool:
    """Whether most effects could be large and not show; one that these pushes do not feel at all never shows."""
    unfelt = {signature.kind.name for signature in evidence.signatures} - {one.name for one in detectable}
    sizes = [one.sigmas for one in detectable] + [math.inf] * len(unfelt)
    return not sizes or float(np.median(sizes)) > VISIBLE


def _predicts(evidence: Evidence) -> bool:
    """Whether the last model comes visibly nearer to pushes that were left out than the plain one."""
    return comes_nearer(evidence.case, evidence.errors_before, evidence.errors_after)


def _by_several(evidence: Evidence) -> bool:
    """Whether more than one of these pushes shows it; those of an order do, which their number bears out."""
    ordered = bool(evidence.steps) and all(step[0].score.in_order for step in evidence.steps)
    return ordered or shown_by_several(evidence.case, evidence.errors_before, evidence.errors_after)


def _explained(evidence: Evidence) -> bool:
    """Whether the last model accounts for the pushes."""
    if evidence.foil is not None or not _predicts(evidence) or not _by_several(evidence):
        return False
    if evidence.case.noise.known:
        return not unexplained(evidence.plain, evidence.final)
    # A noise that was taken to be what a model leaves: it must have become much less. Nobody states there how much
    # friction scatters either: what it leaves is said (``left``), and takes no name away.
    return evidence.noise_share <= MOST_OF_UNKNOWN


def _location(evidence: Evidence, verdict: str, findings: Sequence[EffectFinding], seed: int) -> Location | None:
    """Where the mismatch is; the frame is that of the physics found, where some was found."""
    if verdict in ("consistent", "underpowered"):
        return None
    frame = evidence.steps[0][0].score.kind.frame if findings else None
    found = locate(evidence.case, evidence.plain, evidence.wrenches, np.random.default_rng(seed), frame)
    return found if frame is None else dc.replace(found, frame=frame)


def class_of(plain: Fitted, step: Sequence[Candidate]) -> tuple[str, ...]:
    """Names that explain these pushes as well as the best of a step, or look like it from the plain model.

    Also what one push speaks for so loudly that it is likely, although the others do not confirm it.
    """
    best = step[0]
    close = {c.name for c in rivals(best, step)}
    if not best.score.in_order:  # whose gains spread as widely as they are large: odds say nothing then
        close |= {c.name for c in step[1:] if not out_of_question(best, c) and _odds(best, c) > LIKELY}
    for other in step[1:]:
        if not other.accepted or out_of_question(best, other) or surely_better(best, other, SURELY):
            continue
        if abs(cosine(plain, best.score, other.score)) > ALIKE:
            close.add(other.name)
    return tuple(sorted(close))


def _others(evidence: Evidence, k: int) -> set[str]:
    """Effects of the model but that of step k: what the model has beside it is no rival of it."""
    return {step[0].name for j, step in enumerate(evidence.steps) if j != k}


def class_beside(evidence: Evidence, k: int) -> tuple[str, ...]:
    """Names that these pushes cannot tell from the effect of step k, beside the model's other effects."""
    others = _others(evidence, k)
    return tuple(name for name in class_of(evidence.plain, evidence.steps[k]) if name not in others)


def _probability(step: Sequence[Candidate], others: set[str]) -> float:
    """That the best of a step is the right one: odds of each rival from its held-out deficit and standard error."""
    best, total = step[0], 1.0
    for other in step[1:]:
        if other.name not in others and not out_of_question(best, other):
            total += _odds(best, other)
    return 1.0 / total


def _odds(best: Candidate, other: Candidate) -> float:
    """Of another candidate against the best, from its held-out deficit and the standard error of that."""
    difference = best.gains - other.gains
    deficit = float(difference.sum())
    if other.coordinates > best.coordinates:  # a little better for being more complicated is not likelier
        deficit = max(0.0, deficit)
    worse = float(stats.norm.sf(deficit / spread(difference)))
    return worse / max(1.0 - worse, 1e-9)


def _findings(evidence: Evidence) -> tuple[EffectFinding, ...]:
    found = []
    for k, step in enumerate(evidence.steps):
        kind = step[0].score.kind
        found.append(
            EffectFinding(
                name=kind.name,
                element=kind.element,
                indistinguishable_from=class_beside(evidence, k),
                probability=_probability(step, _others(evidence, k)),
                parameters=parameters_of(evidence, k),
                statement=kind.statement,
            )
        )
    return tuple(found)


def _partly(evidence: Evidence) -> Partly | None:
    """The effects that were added, or the best one that left-out pushes confirm, if they take a good part away."""
    found = confirmed(evidence.steps, evidence.rejected, evidence.final)
    if found is None or evidence.foil is not None:
        return None
    names, model = found
    before, after = (errors_of(evidence.case, e) for e in (evidence.errors_before, evidence.errors_after))
    share = 1.0 - (after.rms / before.rms) ** 2
    if share < GOOD_PART:
        return None
    return Partly(
        effects=names, share=share, position=after.position, rotation=after.rotation, reduced_chi2=model.reduced_chi2
    )  # fmt: skip


def _quality(evidence: Evidence, after: Fitted) -> FitQuality:
    case, plain = evidence.case, evidence.plain
    gains = push_scores(after) - push_scores(plain)
    left_out = (evidence.errors_before, evidence.errors_before if after is plain else evidence.errors_after)
    old, new = (errors_of(case, residuals) for residuals in left_out)
    return FitQuality(
        rms_before=old.rms, rms_after=new.rms, position_before=old.position, position_after=new.position,
        rotation_before=old.rotation, rotation_after=new.rotation,
        log_score_gain=float(gains.sum()), log_score_gain_se=standard_error(gains) if len(gains) > 1 else 0.0,
        per_push=tuple((p.name, b, a) for p, b, a in zip(case.problems, old.per_push, new.per_push, strict=True)),
        force_before=old.force if math.isfinite(old.force) else None,
        force_after=new.force if math.isfinite(new.force) else None,
        regimes=() if after is plain else regime_gains(case, plain, after),
    )  # fmt: skip


def _ranking(evidence: Evidence, findings: Sequence[EffectFinding], partly: Partly | None) -> tuple[Ranked, ...]:
    named = {f.name for f in findings}
    some = set() if partly is None else set(partly.effects)
    classes = {name for f in findings for name in f.indistinguishable_from}
    steps = (*evidence.steps, evidence.rejected, *evidence.superfluous)
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
                why=PART if one.kind.name in some else _why(one.kind.name, candidate, named, classes, evidence),
            )
        )
    return tuple(rows)


def _why(name: str, candidate: Candidate | None, named: set[str], classes: set[str], evidence: Evidence) -> str:
    if name in named:
        return "found"
    if name in classes:
        return "these pushes cannot tell it from what was found"
    if any(name == step[0].name for step in evidence.superfluous):
        return "was taken back: without it the others do as well"
    return _why_not_fitted(name, evidence) if candidate is None else _why_fitted_in_vain(candidate, named, evidence)


def _why_fitted_in_vain(candidate: Candidate, named: set[str], evidence: Evidence) -> str:
    if candidate.degenerate:
        return "its fit ran to nothing"
    if not candidate.accepted:
        return "pushes that were left out do not confirm it"
    if _is_own_error(evidence):
        return "smaller than the cell's own error"
    if named:
        return "predicts pushes that were left out worse"
    return _why_not_named(evidence)


def _why_not_named(evidence: Evidence) -> str:
    if evidence.foil is not None:
        return "a law that the catalogue does not have predicts pushes that were left out better"
    if not _predicts(evidence):
        return "pushes that were left out are simulated hardly better with it"
    if not _by_several(evidence):
        return "one push that was left out is simulated better with it, the others hardly"
    return "pushes that were left out confirm it, but it leaves more than noise"


def _why_not_fitted(name: str, evidence: Evidence) -> str:
    score = evidence.screening.score_of(name)
    if score is None or not score.kept:
        return "would have to act the other way round"
    chance = evidence.screening.looks * math.exp(score.log_p) > CHANCE
    return "explains no more than chance would" if chance else "explains far less"


def _left(evidence: Evidence, verdict: str, after: Fitted, partly: Partly | None) -> str:
    if _is_own_error(evidence):
        return "no more than what two simulators differ by"
    if verdict == "unexplained" and evidence.foil is not None:
        foil = evidence.foil
        return f"what {foil.instead_of} stands in for; left-out pushes are likelier if {foil.statement}"
    hardly = _hardly_left(evidence, verdict, after) if after.reduced_chi2 <= EXPLAINED else None
    if hardly is not None:
        return hardly
    much = f"{math.sqrt(after.reduced_chi2):.1f} times what noise and the simulator's own error would leave"
    if partly is not None:
        return f"{much}; with {' and '.join(partly.effects)} {math.sqrt(partly.reduced_chi2):.1f} times"
    scores = (evidence.screening if after is evidence.plain else evidence.remaining).scores
    nearest = scores[0].kind.name if scores else "none"
    return f"{much}; the nearest of the catalogue is {nearest}, which does not account for it"


def _hardly_left(evidence: Evidence, verdict: str, after: Fitted) -> str | None:
    """What a model leaves that explains the pushes, but perhaps by frictions; None if it is in the pushes' motion."""
    wide = UNIT_SCATTER * after.state.scatter > MOST_SCATTER
    if verdict == "unexplained" and not wide:
        return None
    scatters = _scatters(evidence.case, after)
    too_wide = verdict in ("explained", "ambiguous") and scatter_p_value(after) < TOO_SCATTERED
    if verdict == "unexplained" or too_wide:
        return f"what a friction would hide that {scatters}"
    nothing = "nothing beyond noise, scatter and the simulator's own error"
    return (
        f"{nothing}; but friction {scatters}, which may hide an effect"
        if verdict == "consistent" and wide
        else nothing
    )


def _scatters(case: Case, fitted: Fitted) -> str:
    """By how much friction differs from push to push, and with what."""
    scatter = 100.0 * UNIT_SCATTER * fitted.state.scatter
    trend = friction_trend(case, fitted)
    return f"scatters by {scatter:.0f} % from push to push" + ("" if trend is None else f", {trend}")
