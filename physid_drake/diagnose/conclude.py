"""From evidence to the answer: the verdict and all figures, without a rollout."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.candidate import (
    EXPLAINED,
    push_scores,
    standard_error,
)
from physid_drake.diagnose.classes import class_beside, others_than, probability_of
from physid_drake.diagnose.estimates import parameters_of, smallest, theta_of
from physid_drake.diagnose.evidence import (
    TOO_SCATTERED,
    Evidence,
    confirmed,
    scatter_p_value,
)
from physid_drake.diagnose.frictions import friction_trend
from physid_drake.diagnose.left_out import errors_of, least_motion
from physid_drake.diagnose.looks import locate
from physid_drake.diagnose.model import Fitted
from physid_drake.diagnose.ranking import ranking_of
from physid_drake.diagnose.regimes import regime_gains
from physid_drake.diagnose.sentence import sentence
from physid_drake.diagnose.values import (
    Diagnosis,
    EffectFinding,
    FitQuality,
    Location,
    Partly,
)
from physid_drake.diagnose.verdict import FEWEST_PUSHES, is_own_error, p_value_of, verdict_of
from physid_drake.identify.identify import MOST_SCATTER
from physid_drake.pushes.case import UNIT_SCATTER, Case
from physid_drake.pushes.misfit import diverged
from physid_drake.pushes.stated import quieter_by

Array = NDArray[np.float64]

GOOD_PART = 0.25  # of the squared error: less is not worth a word
FAR_OUT = 5.0  # standard deviations: of ten answers of the proof that call as much nothing, four missed an effect


def conclude(evidence: Evidence, *, seed: int, alpha: float) -> Diagnosis:
    """The verdict and all figures, from evidence; no rollouts."""
    case, plain, final = evidence.case, evidence.plain, evidence.final
    p_value = p_value_of(evidence)
    detectable = smallest(evidence, alpha, least_motion(case, evidence.errors_before))
    verdict = verdict_of(evidence, p_value, alpha, detectable)
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
            quieter=quieter_by(plain.reduced_chi2, plain.degrees),
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
        ranking=ranking_of(evidence, findings, partly),
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
            *(() if is_own_error(evidence) else _hidden(verdict, fit)),
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


def _location(evidence: Evidence, verdict: str, findings: Sequence[EffectFinding], seed: int) -> Location | None:
    """Where the mismatch is; the frame is that of the physics found, where some was found."""
    if verdict in ("consistent", "underpowered"):
        return None
    frame = evidence.steps[0][0].score.kind.frame if findings else None
    found = locate(evidence.case, evidence.plain, evidence.wrenches, np.random.default_rng(seed), frame)
    return found if frame is None else dc.replace(found, frame=frame)


def _findings(evidence: Evidence) -> tuple[EffectFinding, ...]:
    found = []
    for k, step in enumerate(evidence.steps):
        kind = step[0].score.kind
        found.append(
            EffectFinding(
                name=kind.name,
                element=kind.element,
                indistinguishable_from=class_beside(evidence, k),
                probability=probability_of(step, others_than(evidence, k)),
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


def _left(evidence: Evidence, verdict: str, after: Fitted, partly: Partly | None) -> str:
    if is_own_error(evidence):
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
