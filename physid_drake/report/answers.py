"""What a person asks first of a diagnosis, each with a short answer from what was computed."""

from __future__ import annotations

import math

from physid_drake.diagnose.values import Diagnosis, NextPush
from physid_drake.report.numbers import chance, fixed, number, tiny

SURELY = 2.0  # standard errors by which pushes of another regime are predicted better


def answers(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Question and answer, in the order in which they are asked."""
    found = [("How sure is that?", _how_sure(diagnosis))]
    if diagnosis.location is not None:
        found.append(("Where?", _capital(diagnosis.location.statement) + "."))
    return [*found, ("What now?", _what_now(diagnosis)), ("May I trust it?", _trust(diagnosis))]


def _how_sure(d: Diagnosis) -> str:
    p_value = f"p {'< 1e-300' if d.p_value <= 0.0 else '= ' + tiny(d.p_value)}"
    if d.verdict == "consistent":
        return f"The baseline model leaves as much as noise does ({p_value}; a mismatch is below {number(d.alpha)})."
    if d.verdict == "underpowered":
        return f"These pushes are too few, or show too little, to tell ({p_value})."
    said = f"That the baseline model is not enough: {p_value}."
    if d.effects:
        names = ", ".join(f"{e.name} {chance(e.probability)}" for e in d.effects)
        said += f" That the name is right, among those of the catalogue: {names}."
        alike = sorted({name for e in d.effects for name in e.indistinguishable_from})
        if alike:
            said += f" These pushes cannot tell it from {' or '.join(alike)}."
    return said


def _what_now(d: Diagnosis) -> str:
    use = "model.yaml has it: load_model(folder) builds that in Drake, and physid_drake plan pushes with it."
    match d.verdict:
        case "explained":
            return use
        case "ambiguous":
            return f"{_next(d.next_push)} Until then, {use}"
        case "consistent":
            return "Use the baseline model of model.yaml. What these pushes would have shown is listed below."
        case "underpowered":
            return "Record more pushes: faster ones, longer ones, of several headings, and repeat some."
    without = " model.yaml has a force without a name in its place." if d.with_it else ""
    return (
        "physid_drake inspect tries whether a unit or a convention of the recording is wrong; else it is physics that"
        f" the catalogue does not have: add an effect of your own.{without}"
    )


def _next(push: NextPush | None) -> str:
    if push is None:
        return "Record other pushes: faster or slower ones, of other headings."
    return (
        f"Make the push that tells them apart (with probability {chance(push.settles_with_probability)}): towards"
        f" {push.direction_deg:.0f} degrees at {1e3 * push.speed_mps:.0f} mm/s, {push.aim}."
    )


def _trust(d: Diagnosis) -> str:
    fit = d.fit
    before, after = fixed(1e3 * fit.position_before), fixed(1e3 * fit.position_after)
    turned = fixed(math.degrees(fit.rotation_before)), fixed(math.degrees(fit.rotation_after))
    if d.with_it:
        said = f"Pushes that were left out of the fit are missed by {after} mm instead of {before}"
        said += f", and {turned[1]} degrees instead of {turned[0]}" if math.isfinite(fit.rotation_before) else ""
    else:
        said = f"Pushes that were left out of the fit are missed by {before} mm"
        said += f" and {turned[0]} degrees" if math.isfinite(fit.rotation_before) else ""
    regimes = [r for r in fit.regimes if math.isfinite(r.gain)]
    if regimes:
        better = sum(r.gain > SURELY * r.standard_error for r in regimes)
        said += f"; surely better in {better} of {len(regimes)} tests on pushes of another kind"
    said += f". Left over: {d.left}."
    if d.warnings:
        count = len(d.warnings)
        said += f" {count} thing{'' if count == 1 else 's'} about the recording to read below."
    return said


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
