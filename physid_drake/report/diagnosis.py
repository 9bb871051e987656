"""``diagnosis.json`` and what a diagnosis prints: it reads, it never computes."""

from __future__ import annotations

import dataclasses as dc
import json
import math
from typing import Any

from rich.table import Table

from physid_drake.diagnose import Diagnosis
from physid_drake.diagnose.values import Detectable, EffectFinding, FitQuality, Location, Partly, Ranked
from physid_drake.effects import effect_named
from physid_drake.pushes.tracker_noise import UNKNOWN
from physid_drake.report.numbers import rounded
from physid_drake.report.pages import sigma_means
from physid_drake.report.terminal import narrow_table, numbers, words

FORMAT = "physid-diagnosis/1"
MOST_RANKED = 8  # rows of a terminal


def diagnosis_json(diagnosis: Diagnosis) -> str:
    """The file's text; the same diagnosis gives the same bytes."""
    d = diagnosis
    content: dict[str, Any] = {
        "format": FORMAT,
        "recording": d.recording,
        "verdict": d.verdict,
        "sentence": d.sentence,
        "p_value": d.p_value,
        "alpha": d.alpha,
        "effects": [_effect(e) for e in d.effects],
        "location": None if d.location is None else _location(d.location),
        "fit": {
            "unit": "tracker noise (sigma)",
            "held_out_rms_before": d.fit.rms_before,
            "held_out_rms_after": d.fit.rms_after,
            "held_out_rms_before_m": d.fit.position_before,
            "held_out_rms_after_m": d.fit.position_after,
            "held_out_rms_before_rad": d.fit.rotation_before,
            "held_out_rms_after_rad": d.fit.rotation_after,
            **_forces(d.fit),
            "log_likelihood_gain": d.fit.log_score_gain,
            "log_likelihood_gain_se": d.fit.log_score_gain_se,
            "per_push": [{"push": name, "before": b, "after": a} for name, b, a in d.fit.per_push],
            "regimes": [dc.asdict(r) for r in d.fit.regimes],
        },
        "theta": {
            name: {"value": t.value, "unit": t.unit, "ci90": t.ci90, "identifiable": t.identifiable,
                   "before": t.before}
            for name, t in d.theta.items()
        },
        "next_push": None if d.next_push is None else dc.asdict(d.next_push),
        "seed": d.seed,
        "pushes": d.pushes,
        "ranking": [_ranked(one) for one in d.ranking],
        "detectable": [_detectable(one) for one in d.detectable],
        "undetectable": list(d.undetectable),
        "remaining_misfit": d.left,
        "partial_explanation": None if d.partly is None else _partly(d.partly),
        "reduced_chi2_before": d.reduced_chi2_before,
        "reduced_chi2_after": d.reduced_chi2_after,
        "friction_scatter": d.friction_scatter,
        "noise": d.noise,
        "warnings": list(d.warnings),
    }  # fmt: skip
    return json.dumps(rounded(content), indent=2) + "\n"


def _effect(effect: EffectFinding) -> dict[str, Any]:
    parameters = {
        name: {"value": p.value, "unit": p.unit, "ci90": p.ci90, "null": p.null}
        for name, p in effect.parameters.items()
    }
    beyond = {name: parameters.pop(name) for name in effect_named(effect.name).beyond if name in parameters}
    return {
        "name": effect.name,
        "element": effect.element,
        "indistinguishable_from": list(effect.indistinguishable_from),
        "probability": effect.probability,
        "statement": effect.statement,
        "parameters": parameters,
        **({"beyond_the_catalogue": beyond} if beyond else {}),
    }


def _forces(fit: FitQuality) -> dict[str, Any]:
    """Where forces were compared."""
    if fit.force_before is None:
        return {}
    return {"held_out_rms_before_n": fit.force_before, "held_out_rms_after_n": fit.force_after}


def _ranked(one: Ranked) -> dict[str, Any]:
    return {
        "name": one.name, "linearised_gain": one.gain, "p_value": one.p_value, "held_out_gain": one.held_out_gain,
        "held_out_se": one.held_out_se, "why": one.why,
    }  # fmt: skip


def _detectable(one: Detectable) -> dict[str, Any]:
    return {
        "name": one.name, "parameter": one.parameter, "value": one.value, "unit": one.unit,
        "motion_sigma": one.sigmas,
    }  # fmt: skip


def _partly(partly: Partly) -> dict[str, Any]:
    return {
        "effects": list(partly.effects),
        "share": partly.share,
        "held_out_rms_m": partly.position,
        "held_out_rms_rad": partly.rotation,
    }


def _location(location: Location) -> dict[str, Any]:
    return {
        "statement": location.statement,
        "phase": list(location.phase),
        "dof": list(location.dof),
        "frame": location.frame,
        "windows": [
            {
                "push": w.push,
                "start_s": w.start,
                "end_s": w.end,
                "x_m": w.place[0],
                "y_m": w.place[1],
                "heading_rad": w.heading,
                "speed_mps": w.speed,
                "phase": w.phase,
            }
            for w in location.windows
        ],
    }


def findings_table(diagnosis: Diagnosis) -> Table:
    """The effects found, with their parameters."""
    alike = [
        f"{e.name} is indistinguishable from {', '.join(e.indistinguishable_from)}"
        for e in diagnosis.effects
        if e.indistinguishable_from
    ]
    table = narrow_table(
        f"missing physics in '{diagnosis.recording}'", words("effect"), words("parameter"), numbers("value"),
        words("90 % interval"), numbers("probability"), caption="; ".join(alike) or None,
    )  # fmt: skip
    for effect in diagnosis.effects:
        for k, (name, p) in enumerate(effect.parameters.items()):
            label, probability = (effect.name, f"{effect.probability:.2f}") if k == 0 else ("", "")
            table.add_row(label, name, _shown(p.value, p.unit), _interval(p.ci90), probability)
    return table


def _shown(value: Any, unit: str) -> str:
    if isinstance(value, list):
        return "\n".join(" ".join(f"{w:5.2f}" for w in row) for row in value)
    return f"{value:.4g} {'' if unit == '-' else unit}".strip()


def _interval(ci90: Any) -> str:
    if isinstance(ci90[0], list):
        return "in diagnosis.json"
    return f"{ci90[0]:.4g} to {ci90[1]:.4g}"


def parameters_table(diagnosis: Diagnosis) -> Table:
    """Friction, mass and the rest of theta with intervals, and whether they are identifiable from these pushes."""
    table = narrow_table(
        "parameters", words("parameter"), numbers("identified"), numbers("90 % interval"), words("identifiable")
    )
    for name, theta in diagnosis.theta.items():
        identifiable = "yes" if theta.identifiable else "no (interval is the prior)"
        table.add_row(name, _shown(theta.value, theta.unit), _interval(theta.ci90), identifiable)
    return table


def ranking_table(diagnosis: Diagnosis) -> Table:
    """The effects of the catalogue, best first, and why others were rejected."""
    title = "why other effects were rejected" if diagnosis.effects else "effects of the catalogue, best first"
    table = narrow_table(
        title, words("effect"), numbers("linearised\ngain"), numbers("p"), numbers("held-out\ngain"), words("why"),
        caption="gain: in log-likelihood",
    )  # fmt: skip
    for r in diagnosis.ranking[:MOST_RANKED]:
        unsure = "" if r.held_out_se is None else f" +- {r.held_out_se:.0f}"
        held_out = "-" if r.held_out_gain is None else f"{r.held_out_gain:.0f}{unsure}"
        table.add_row(r.name, f"{r.gain:.1f}", f"{r.p_value:.2g}", held_out, r.why)
    return table


def regime_table(diagnosis: Diagnosis) -> Table:
    """Whether a model that is fitted to one regime holds in another."""
    table = narrow_table(
        "generalisation across regimes", words("fitted to"), words("tested on"), numbers("log-likelihood\ngain")
    )
    for r in diagnosis.fit.regimes:
        table.add_row(r.fitted_on, r.tested_on, f"{r.gain:.0f} +- {r.standard_error:.0f}")
    return table


def noise_known(diagnosis: Diagnosis) -> bool:
    """Whether the tracker's noise was stated or seen at rest."""
    return not any(warning.startswith(UNKNOWN) for warning in diagnosis.warnings)


def fit_table(diagnosis: Diagnosis) -> Table:
    """How well held-out pushes are predicted, by the baseline model and with the effects found."""
    forced = diagnosis.fit.force_before is not None
    headings = ("mm", "deg", *(("N",) if forced else ()), "sigma", "reduced\nchi-square")
    known = noise_known(diagnosis)
    caption = sigma_means(known=known) + (" Reduced chi-square: 1 = noise only." if known else "")
    table = narrow_table(
        "prediction error of held-out pushes (root mean square)", words("model"), *map(numbers, headings),
        caption=caption,
    )  # fmt: skip
    for name, figures in held_out_figures(diagnosis):
        table.add_row(name, *(f"{value:.2f}" if math.isfinite(value) else "-" for value in figures))
    return table


def held_out_figures(diagnosis: Diagnosis) -> list[tuple[str, list[float]]]:
    """Errors on held-out pushes, of the baseline and the final model: mm, deg, N if known, sigma, chi-square."""
    d, fit = diagnosis, diagnosis.fit
    rows = [
        (
            "baseline model",
            fit.position_before,
            fit.rotation_before,
            fit.force_before,
            fit.rms_before,
            d.reduced_chi2_before,
        )
    ]
    if d.with_it is not None:
        after = (fit.position_after, fit.rotation_after, fit.force_after, fit.rms_after, d.reduced_chi2_after)
        rows.append((d.with_it, *after))
    return [
        (name, [1e3 * position, math.degrees(rotation), *([] if force is None else [force]), sigmas, chi2])
        for name, position, rotation, force, sigmas, chi2 in rows
    ]
