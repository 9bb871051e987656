"""``diagnosis.html``: one file that opens without a network, read from top to bottom.

It reads and draws what was computed; the statistics are all made before. The template is ``diagnosis_page.html``.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined

from physid_drake.diagnose import Evidence
from physid_drake.diagnose.evidence import predicted
from physid_drake.diagnose.localise import MissingWrench
from physid_drake.diagnose.location import number_of
from physid_drake.diagnose.values import (
    Detectable,
    Diagnosis,
    EffectFinding,
    ParameterEstimate,
    Ranked,
    ThetaEstimate,
)
from physid_drake.diagnose.wrench_patterns import SAID
from physid_drake.effects import effect_named
from physid_drake.recording import Recording
from physid_drake.report.answers import answers, is_unconfirmed
from physid_drake.report.diagnosis import held_out_figures, noise_known
from physid_drake.report.diagnosis_figures import (
    arrow_figure,
    error_figure,
    next_push_figure,
    strip_figures,
    views_from_above,
)
from physid_drake.report.effect_laws import law_figure
from physid_drake.report.numbers import (
    chance,
    digits_between,
    fixed,
    interval,
    number,
    quantity,
    share,
    tenths,
    tiny,
)
from physid_drake.report.outline import outline_of
from physid_drake.report.pages import BASELINE_MEANS, DIAGNOSIS, HELD_OUT_MEANS, SCENE, nav, sigma_means
from physid_drake.report.svg import AFTER, BEFORE, CONTACT, FREE, INK, MUTED, drawn
from physid_drake.report.table_view import MM, ShownPush, TableView

__all__ = ["ShownPush", "diagnosis_page"]

_TEMPLATE = Path(__file__).with_name("diagnosis_page.html")

BADGES = {
    "consistent": "#1d7a46",
    "explained": "#1f5fbf",
    "ambiguous": "#a15c00",
    "unexplained": "#b42318",
    "underpowered": "#5d6475",
}
MEANING = {
    "consistent": "There is no evidence against the baseline model.",
    "explained": "One model explains the errors of the baseline model.",
    "ambiguous": "More than one effect explains these pushes; all of them are named.",
    "unexplained": "The mismatch is significant, and no effect of the catalogue reduces it to noise.",
    "underpowered": "These pushes are too few, or move too little, to show an effect of ordinary size.",
}
UNCONFIRMED = "The baseline model is unlikely, but no effect is confirmed by held-out pushes."
DOFS = {"along_motion": "along the motion", "across_motion": "across the motion", "rotation": "in rotation"}
MOST_ERRORS, MOST_STRIPS, MOST_RANKED = 4, 8, 8  # shown before the reader asks for more


def shown_pushes(diagnosis: Diagnosis, evidence: Evidence) -> list[ShownPush]:
    """All pushes, recorded and as the models before and after predict them, fitted to the others."""
    case, pushes = evidence.case, []
    for i, problem in enumerate(case.problems):
        free = (w.start for w in evidence.wrenches if w.push == i and w.phase == "free_slide")
        pushes.append(
            ShownPush(
                name=problem.name,
                times=case.features[i].middles,
                recorded=case.features[i].poses(case.features[i].recorded),
                before=predicted(evidence, evidence.errors_before, i),
                after=None if evidence.best is None else predicted(evidence, evidence.errors_after, i),
                released=next(free, None),
            )
        )
    return pushes


def diagnosis_page(
    diagnosis: Diagnosis,
    recording: Recording,
    shown: Sequence[ShownPush],
    wrenches: Sequence[MissingWrench],
    *,
    pages: Collection[str] = (),
) -> str:
    """The page as HTML; the same arguments give the same bytes.

    Args:
        diagnosis: what to show.
        recording: what it was made from.
        shown: its pushes, in the recording's order.
        wrenches: what is missing from the baseline model, window by window.
        pages: that lie beside this one.
    """
    friction = diagnosis.theta.get("support_friction")
    view = TableView(
        outline=outline_of(recording.object.shape),
        shown=shown,
        wrenches=wrenches,
        friction=None if friction is None else friction.value,
    )
    with drawn():
        scene = SCENE if SCENE in pages else None
        content = {"scene": scene, "nav": nav(DIAGNOSIS, pages), **_content(diagnosis, recording, view)}
    environment = Environment(undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["number_of"] = number_of
    environment.filters["in_degrees"] = lambda angle: math.degrees(angle) % 360.0
    environment.filters["degrees"] = lambda angle: fixed(math.degrees(angle))
    environment.filters.update(number=number, fixed=fixed, quantity=quantity, chance=chance, tiny=tiny)
    return environment.from_string(_TEMPLATE.read_text("utf-8")).render(content) + "\n"


def _share(some: int, every: int) -> str:
    """How many pushes were looked at, and of how many where not all were."""
    return f"{some}" if some >= every else f"{some} of {every}"


def _content(diagnosis: Diagnosis, recording: Recording, view: TableView) -> dict[str, Any]:
    """What the template is filled with."""
    order = _most_changed(diagnosis, view.shown)
    strips = strip_figures(diagnosis, view)
    return {
        "d": diagnosis,
        "colours": {"ink": INK, "before": BEFORE, "after": AFTER, "contact": CONTACT, "free": FREE},
        "badge": BADGES.get(diagnosis.verdict, MUTED),
        "meaning": UNCONFIRMED if is_unconfirmed(diagnosis) else MEANING.get(diagnosis.verdict, ""),
        "pushes": _share(len(recording.pushes), diagnosis.pushes),
        "found": [_finding(e, k, view) for k, e in enumerate(diagnosis.effects)],
        "phases": [] if diagnosis.location is None else [SAID.get(p, p) for p in diagnosis.location.phase],
        "dofs": [] if diagnosis.location is None else [DOFS.get(x, x) for x in diagnosis.location.dof],
        "frame": "" if diagnosis.location is None else _frame(diagnosis.location.frame),
        "views": views_from_above(view),
        "errors": [error_figure(view, k, diagnosis.noise) for k in order[:MOST_ERRORS]],
        "lets_go": any(view.shown[k].released is not None for k in order[:MOST_ERRORS]),
        "arrows": arrow_figure(view, () if diagnosis.location is None else diagnosis.location.windows),
        "answers": answers(diagnosis),
        "baseline_means": BASELINE_MEANS,
        "held_out_means": HELD_OUT_MEANS,
        "sigma_means": sigma_means(known=noise_known(diagnosis)),
        "strips": strips[:MOST_STRIPS],
        "more_strips": strips[MOST_STRIPS:],
        "not_drawn": len({w.push for w in view.wrenches}) - len(strips),
        "fits": _fits(diagnosis),
        "bars": _bars(diagnosis),
        "regimes": _regimes(diagnosis),
        "ranking": _ranking(diagnosis)[:MOST_RANKED],
        "more_ranking": _ranking(diagnosis)[MOST_RANKED:],
        "theta": [_theta_row(name, t) for name, t in diagnosis.theta.items()],
        "next_push": None if diagnosis.next_push is None else next_push_figure(diagnosis.next_push, recording, view),
        "noise": _noise(diagnosis),
        "noise_known": noise_known(diagnosis),
        "detectable": [_detectable_row(one) for one in diagnosis.detectable],
        "undetectable": diagnosis.undetectable,
        "warnings": diagnosis.warnings,
    }


def _most_changed(diagnosis: Diagnosis, shown: Sequence[ShownPush]) -> list[int]:
    """Indices of the pushes, those first whose error changes most; where nothing was found, the largest errors."""
    errors = {name: (before, after) for name, before, after in diagnosis.fit.per_push}
    changes = []
    for k, push in enumerate(shown):
        before, after = errors.get(push.name, (0.0, 0.0))
        change = before if push.after is None else abs(before - after)
        changes.append((-change if math.isfinite(change) else -math.inf, k))
    return [k for _, k in sorted(changes)]


def _finding(effect: EffectFinding, k: int, view: TableView) -> dict[str, Any]:
    law = law_figure(effect, k, view)
    return {
        "name": effect.name,
        "element": effect.element,
        "statement": effect.statement,
        "alike": effect.indistinguishable_from,
        "probability": chance(effect.probability),
        "width": f"{share(effect.probability, 1.0):.1f}",
        "parameters": [_parameter_row(name, p) for name, p in effect.parameters.items()],
        "figure": None if law is None else law[0],
        "caption": "" if law is None else law[1],
    }


def _parameter_row(name: str, p: ParameterEstimate) -> tuple[str, str, str, str]:
    """Name, value, interval, null."""
    if isinstance(p.value, list | tuple):
        shape = f"{len(p.value)} × {len(p.value[0])} values"
        return name, shape, "in the figure", "even"
    null = "–" if p.null is None else quantity(p.null, p.unit)
    beside = [*([] if p.null is None else [p.null]), *(p.ci90 or ())]
    digits = digits_between(p.value, beside)
    return name, quantity(p.value, p.unit, digits), interval(p.ci90, p.unit, digits), null


def _detectable_row(one: Detectable) -> tuple[str, str, str, str]:
    """Effect, parameter, the smallest value that would have shown, motion."""
    # A coordinate that is no parameter, as of the weights of an underside, is 0 where nothing is missing.
    null = getattr(effect_named(one.name)(), one.parameter, 0.0)
    digits = digits_between(one.value, [null])
    value = quantity(one.value, one.unit, digits)
    return one.name, one.parameter, value, number(one.sigmas, 2)


def _frame(frame: str) -> str:
    return "none" if frame == "none" else f"of the {frame.replace('_', ' ')}"


def _fits(diagnosis: Diagnosis) -> list[tuple[str, list[str]]]:
    """Rows of the table of held-out errors."""
    return [(name, [fixed(value) for value in figures]) for name, figures in held_out_figures(diagnosis)]


def _bars(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Per push: the errors before and after, and how long their bars are [%]."""
    rows = diagnosis.fit.per_push
    longest = max((v for _, b, a in rows for v in (b, a) if math.isfinite(v)), default=1.0) or 1.0
    return [
        {
            "name": name,
            "bars": [
                (kind, f"{share(value, longest):.1f}", fixed(value))
                for kind, value in (("before", before), ("after", after))
                if kind == "before" or diagnosis.with_it is not None
            ],
        }
        for name, before, after in rows
    ]


def _regimes(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    """What was fitted to, what was tested on, and the gain."""
    return [
        (r.fitted_on, r.tested_on, f"{tenths(r.gain)} ± {tenths(r.standard_error)}") for r in diagnosis.fit.regimes
    ]


def _gain(r: Ranked) -> str:
    """On held-out pushes, with its spread where the effect was fitted."""
    if r.held_out_gain is None:
        return "–"
    return tenths(r.held_out_gain) + ("" if r.held_out_se is None else f" ± {tenths(r.held_out_se)}")


def _ranking(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    best = max((r.gain for r in diagnosis.ranking if math.isfinite(r.gain)), default=1.0) or 1.0
    return [
        {
            "name": r.name,
            "gain": tenths(r.gain),
            "width": f"{share(r.gain, best):.1f}",
            "p": tiny(r.p_value),
            "held_out": _gain(r),
            "why": r.why,
            "found": r.name in {e.name for e in diagnosis.effects},
        }
        for r in diagnosis.ranking
    ]


def _theta_row(name: str, theta: ThetaEstimate) -> dict[str, Any]:
    return {
        "name": name.replace("_", " "),
        "before": quantity(theta.before, theta.unit),
        "after": quantity(theta.value, theta.unit),
        "interval": interval(theta.ci90, theta.unit),
        "identifiable": theta.identifiable,
    }


def _noise(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """What is known of the noise, in words."""
    noise = diagnosis.noise
    rows = [
        ("position", "position_m", MM, " mm"),
        ("rotation", "rotation_rad", math.degrees(1.0), "°"),
        ("jitter of time stamps", "jitter_s", MM, " ms"),
        ("hand", "hand_m", MM, " mm"),
        ("correlation time (hand)", "hand_correlation_time_s", MM, " ms"),
        ("force", "force_n", 1.0, " N"),
    ]
    known = [(name, f"{number(scale * noise[key])}{unit}") for name, key, scale, unit in rows if key in noise]
    times = noise.get("correlation_time_s")
    if times:
        known.append(("correlation time (position, rotation)", ", ".join(number(MM * t) for t in times) + " ms"))
    known.append(("friction scatter between pushes", f"{number(100.0 * diagnosis.friction_scatter)} %"))
    return known
