"""From the evidence to the answer: the verdict and all figures, without further rollouts."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Mapping

import numpy as np
from scipy import stats

from physid_drake.diagnose.decide import FEWEST_PUSHES, is_own_error, kinds_of, most_noise_scale, probability
from physid_drake.diagnose.estimates import least_motions, parameters_of, smallest, theta_of
from physid_drake.diagnose.evidence import Evidence
from physid_drake.diagnose.frictions import friction_trend
from physid_drake.diagnose.ranking import ranking_of
from physid_drake.diagnose.regimes import regime_gains, standard_error
from physid_drake.diagnose.sentence import sentence
from physid_drake.diagnose.values import Diagnosis, EffectFinding, FitQuality, Location, Partly
from physid_drake.diagnose.wrench_patterns import locate
from physid_drake.identify.accuracy import accuracy_of
from physid_drake.inference.fit import Fit
from physid_drake.inference.push import TAIL
from physid_drake.inference.replicates import p_value, without_best
from physid_drake.pushes.case import UNIT_SCATTER
from physid_drake.pushes.stated import quieter_by

GOOD_PART = 0.25  # of the squared error: a smaller part is not reported
VISIBLE = 10.0  # units of tracker noise: where most effects would have to be larger, the pushes are underpowered
ODD = 0.001  # chance that any push of a recording is as far off as those that are named for it


def conclude(evidence: Evidence, *, seed: int, alpha: float) -> Diagnosis:
    """The diagnosis that the evidence supports; no rollouts are made.

    Args:
        evidence: all that was fitted and decided.
        seed: random seed, of the sign flips that locate the mismatch; it is reported.
        alpha: false-alarm rate that was asked for.
    """
    case, found, plain, after = evidence.case, evidence.found, evidence.baseline, evidence.corrected
    motions = least_motions(found)
    verdict = evidence.decision.verdict
    if verdict == "consistent" and _blind(motions):
        verdict = "underpowered"
    findings = _findings(evidence) if evidence.named else ()
    partly = _partly(evidence)
    before, left = plain.reduced_chi2, after.reduced_chi2
    return Diagnosis(
        recording=case.recording.name,
        verdict=verdict,
        sentence=sentence(
            verdict,
            findings,
            partly,
            better=evidence.best is not None,
            known=case.noise.known,
            quieter=quieter_by(before, plain.degrees),
            fewest=FEWEST_PUSHES if len(case.problems) < FEWEST_PUSHES else None,
            rare=found.rare,
        ),
        p_value=p_value_of(evidence, alpha),
        alpha=alpha,
        effects=findings,
        location=_location(evidence, seed),
        fit=_quality(evidence),
        theta=theta_of(evidence.fitter, after, plain),
        next_push=evidence.next_push,
        seed=seed,
        ranking=ranking_of(evidence, evidence.decision.classes() if evidence.named else ()),
        detectable=smallest(found),
        undetectable=tuple(name for name, motion in motions.items() if math.isinf(motion)),
        left=_left(evidence),
        partly=partly,
        reduced_chi2_before=before,
        reduced_chi2_after=left,
        friction_scatter=UNIT_SCATTER * after.scatter,
        noise=evidence.known.noise,
        warnings=(*_odd(evidence), *case.warnings, *_by_cell(evidence)),
        rollouts=found.fitter.predictor.count + evidence.fitter.predictor.count,
        pushes=case.pushes,
    )


def p_value_of(evidence: Evidence, alpha: float) -> float:
    """p-value of the hypothesis that no physics is missing.

    It is that of the catalogue's best held-out gain, linearised. Where the verdict claims a mismatch although that
    p-value is not below ``alpha``, the smallest p-value of all criteria that can claim one is taken: also of the
    gains of whole fits, of the scatter of frictions, and of errors larger than noise. It is corrected for their
    number.

    Args:
        evidence: all that was fitted and decided.
        alpha: false-alarm rate that was asked for.

    Source: Z. Sidak, J. Am. Stat. Assoc. 62, 1967, for the correction.
    """
    found, noise = evidence.found, evidence.case.noise
    if is_own_error(accuracy_of(evidence.case, evidence.errors_before)):
        return 1.0
    if found.p_value < alpha or evidence.decision.verdict in ("consistent", "underpowered"):
        return found.p_value
    whole = {kinds_of(one)[0].name: float(without_best(one.gains)) for one in found.named if len(kinds_of(one)) == 1}
    looks = [found.p_value, p_value(whole, found.by_chance), found.alike]
    if found.baseline.noise_scale > most_noise_scale(noise):
        squares = sum(one.square for one in found.baseline.weighed) / most_noise_scale(noise) ** 2
        looks.append(float(stats.chi2.sf(squares, found.baseline.degrees)))
    return float(-np.expm1(len(looks) * np.log1p(-min(*looks, 1.0 - 1e-16))))


def _blind(motions: Mapping[str, float]) -> bool:
    """Whether most effects could be large and not show; one that these pushes do not feel at all never shows."""
    return not motions or float(np.median(list(motions.values()))) > VISIBLE


def _by_cell(evidence: Evidence) -> tuple[str, ...]:
    """That a part was rolled out by the cell alone, which takes longer."""
    count = len(evidence.found.fitter.predictor.by_cell)
    if not count:
        return ()
    return (
        f"{count} of the pushes were simulated in the Drake cell alone, because the fast twin does not cover them",
    )


def _location(evidence: Evidence, seed: int) -> Location | None:
    """Where the mismatch is; the frame is that of the physics found, where some was found."""
    if evidence.decision.verdict in ("consistent", "underpowered"):
        return None
    frame = evidence.decision.effects[0].frame if evidence.named else None
    found = locate(evidence.fitter, evidence.baseline, evidence.wrenches, np.random.default_rng(seed), frame)
    return found if frame is None else dc.replace(found, frame=frame)


def _findings(evidence: Evidence) -> tuple[EffectFinding, ...]:
    assert evidence.best is not None
    return tuple(
        EffectFinding(
            name=kind.name,
            element=kind.element,
            indistinguishable_from=alike,
            probability=probability(evidence.decision, k),
            parameters=parameters_of(evidence.fitter, evidence.best, k),
            statement=kind.statement,
        )
        for k, (kind, alike) in enumerate(zip(evidence.decision.effects, evidence.decision.classes(), strict=True))
    )


def _partly(evidence: Evidence) -> Partly | None:
    """The effects that take a part of an unexplained mismatch away, if it is a good part."""
    one = evidence.decision.partly
    if one is None or evidence.errors_partly is None:
        return None
    before, after = (accuracy_of(evidence.case, e) for e in (evidence.errors_before, evidence.errors_partly))
    share = 1.0 - (after.rms / before.rms) ** 2
    if share < GOOD_PART:
        return None
    names = tuple(kind.name for kind in kinds_of(one))
    return Partly(effects=names, share=share, position=after.position, rotation=after.rotation)


def _quality(evidence: Evidence) -> FitQuality:
    case, plain, after = evidence.case, evidence.baseline, evidence.corrected
    gains = evidence.fitter.held_out(after) - evidence.fitter.held_out(plain)
    old, new = (accuracy_of(case, errors) for errors in (evidence.errors_before, evidence.errors_after))
    return FitQuality(
        rms_before=old.rms, rms_after=new.rms, position_before=old.position, position_after=new.position,
        rotation_before=old.rotation, rotation_after=new.rotation,
        log_score_gain=float(gains.sum()), log_score_gain_se=standard_error(gains) if len(gains) > 1 else 0.0,
        per_push=tuple((p.name, b, a) for p, b, a in zip(case.problems, old.per_push, new.per_push, strict=True)),
        force_before=old.force if math.isfinite(old.force) else None,
        force_after=new.force if math.isfinite(new.force) else None,
        regimes=() if after is plain else regime_gains(evidence.fitter, plain, after),
    )  # fmt: skip


def odd_pushes(fit: Fit) -> tuple[int, ...]:
    """Indices of pushes with errors too large even for the heavy-tailed distribution of errors.

    Bonferroni's bound takes all pushes into account. If the m errors of a push have a multivariate t distribution,
    their mean square has an F distribution with m and ``TAIL`` degrees of freedom.
    """
    counts = np.array([len(push.residual) for push in fit.pushes])
    squares = np.array([one.square for one in fit.weighed]) / fit.noise_scale**2
    chances = stats.f.sf(squares / counts, counts, TAIL)
    return tuple(np.flatnonzero(chances * len(counts) < ODD).tolist())


def _odd(evidence: Evidence) -> list[str]:
    """A line on the pushes that nothing explains."""
    odd = odd_pushes(evidence.corrected)
    if not odd:
        return []
    errors = accuracy_of(evidence.case, evidence.errors_after).per_push
    said = ", ".join(f"{evidence.case.problems[k].name} ({errors[k]:.0f} sigma)" for k in odd)
    return [f"pushes that differ from all others hardly count; look at their cut and their track: {said}"]


def _left(evidence: Evidence) -> str:
    """What the final model does not account for, in words."""
    if is_own_error(accuracy_of(evidence.case, evidence.errors_before)):
        return "no more than the difference between two simulators"
    after = evidence.corrected
    scatter = 100.0 * UNIT_SCATTER * after.scatter
    trend = friction_trend(evidence.fitter, after)
    friction = f"friction scatter between pushes {scatter:.0f} %" + ("" if trend is None else f", {trend}")
    rough = evidence.known.rough
    if not rough.is_none:
        friction += f", within a push {100 * rough.table:.0f} % ({100 * rough.tip:.0f} % at the tip)"
    nameless = "" if evidence.named or evidence.best is None else "beside an unnamed force, "
    if after.noise_scale <= most_noise_scale(evidence.case.noise):
        but = ", but for pushes that differ from all others" if odd_pushes(after) else ""
        return f"{nameless}no more than noise{but}; {friction}"
    return f"{nameless}{after.noise_scale:.1f} times the noise and the simulator's own error; {friction}"
