"""What a person asks first of a diagnosis, each with a short answer from what was computed."""

from __future__ import annotations

import math

from physid_drake.diagnose.decide import FEWEST_PUSHES
from physid_drake.diagnose.values import Diagnosis, NextPush
from physid_drake.report.numbers import chance, fixed, number, tiny

SURELY = 2.0  # standard errors by which pushes of another regime are predicted better


def answers(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Question and answer, in the order in which they are asked."""
    found = [("How sure is that?", _how_sure(diagnosis))]
    if diagnosis.location is not None:
        found.append(("Where?", _capital(diagnosis.location.statement) + "."))
    return [*found, ("What now?", _what_now(diagnosis)), ("May I trust it?", _trust(diagnosis))]


def is_unconfirmed(d: Diagnosis) -> bool:
    """Whether a verdict is not conclusive because the errors are rare by chance, and no effect is confirmed."""
    return d.verdict == "underpowered" and d.p_value < d.alpha and d.pushes >= FEWEST_PUSHES


def _how_sure(d: Diagnosis) -> str:
    p_value = f"p {'< 1e-300' if d.p_value <= 0.0 else '= ' + tiny(d.p_value)}"
    if d.verdict == "consistent":
        return (
            f"The errors of the baseline model are noise ({p_value}; a mismatch is claimed below {number(d.alpha)})."
        )
    if is_unconfirmed(d):
        return f"Not conclusive: chance hardly leaves such errors ({p_value}), but held-out pushes confirm no effect."
    if d.verdict == "underpowered":
        return f"Not conclusive: the pushes are too few, or move too little ({p_value})."
    said = f"Baseline model: {p_value} (a mismatch is claimed below {number(d.alpha)})."
    if d.effects:
        names = ", ".join(f"{e.name} {chance(e.probability)}" for e in d.effects)
        said += f" Probability of the effect, among those of the catalogue: {names}."
        alike = sorted({name for e in d.effects for name in e.indistinguishable_from})
        if alike:
            said += f" Indistinguishable from {' or '.join(alike)}."
    return said


def _what_now(d: Diagnosis) -> str:
    use = "use model.yaml, which includes it: load_model(folder) builds it in Drake, and physid_drake plan uses it."
    match d.verdict:
        case "explained":
            return _capital(use)
        case "ambiguous":
            return f"{_next(d.next_push)} Until then, {use}"
        case "consistent":
            return "Use the baseline model in model.yaml. The smallest detectable effects are listed below."
        case "underpowered" if is_unconfirmed(d):
            return "Repeat the pushes with the largest errors, and record more, at other speeds and headings."
        case "underpowered":
            return "Record more pushes: faster, longer, with several headings, and repeat some."
    without = " model.yaml has an unnamed force instead." if d.with_it else ""
    return (
        "Run physid_drake inspect, which tests whether a unit or a convention of the recording is wrong. If not, the"
        f" physics is not in the catalogue: add your own effect.{without}"
    )


def _next(push: NextPush | None) -> str:
    if push is None:
        return "Record other pushes: faster or slower, with other headings."
    return (
        f"Make the push that distinguishes them (with probability {chance(push.settles_with_probability)}): towards"
        f" {push.direction_deg:.0f} deg at {1e3 * push.speed_mps:.0f} mm/s, {push.aim}."
    )


def _trust(d: Diagnosis) -> str:
    fit = d.fit
    before, after = fixed(1e3 * fit.position_before), fixed(1e3 * fit.position_after)
    turned = fixed(math.degrees(fit.rotation_before)), fixed(math.degrees(fit.rotation_after))
    if d.with_it:
        said = f"Error on held-out pushes: {after} mm (baseline model {before})"
        said += f", {turned[1]} deg ({turned[0]})" if math.isfinite(fit.rotation_before) else ""
    else:
        said = f"Error on held-out pushes: {before} mm"
        said += f", {turned[0]} deg" if math.isfinite(fit.rotation_before) else ""
    regimes = [r for r in fit.regimes if math.isfinite(r.gain)]
    if regimes:
        better = sum(r.gain > SURELY * r.standard_error for r in regimes)
        said += f"; significantly better in {better} of {len(regimes)} tests across regimes"
    said += f". Remaining misfit: {d.left}."
    if d.warnings:
        count = len(d.warnings)
        said += f" {count} warning{'' if count == 1 else 's'} below."
    return said


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
