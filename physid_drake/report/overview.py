"""``index.html`` of the main job: what was identified, found and planned, in one screen or two."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from physid_drake.diagnose import Examined
from physid_drake.identify import IdentifiableCells
from physid_drake.identify.accuracy import accuracy_of
from physid_drake.identify.estimates import Estimate, estimates_of
from physid_drake.plan import Hindsight, Plan
from physid_drake.report.cells import cells_figure, cells_verdict, combination_text
from physid_drake.report.pages import BASELINE_MEANS, HELD_OUT_MEANS, index_page, sigma_means
from physid_drake.report.plan import plan_rows
from physid_drake.report.plan_page import caption_of, curve_svg
from physid_drake.report.tables import accuracy_cells, identifiable_text, verdict

_BODY = """
<p>{% if diagnosis %}<b>{{ diagnosis.verdict }}</b>. {{ diagnosis.sentence }}{% else %}{{ verdict }}{% endif %}</p>
<p class="note">{{ means }}</p>
<h2>parameters{{ with_effects }}</h2>
<div class="wide"><table>
<tr><th>parameter</th><th>identified</th><th>90 % interval</th><th>identifiable</th></tr>
{% for e in estimates %}
<tr>{% for cell in e %}<td>{{ cell }}</td>{% endfor %}</tr>
{% endfor %}
</table></div>
{% if cells %}
<h2>identifiability of the friction cells</h2>
{{ cells.map }}
<div class="wide"><table>
<tr><th>combination of log frictions</th><th>singular value</th><th>posterior / prior std</th>
<th>identifiable</th></tr>
{% for row in cells.rows %}
<tr>{% for c in row %}<td>{{ c }}</td>{% endfor %}</tr>
{% endfor %}
</table></div>
<p>{{ cells.verdict }}</p>
{% endif %}
<h2>prediction error of held-out pushes (root mean square)</h2>
<div class="wide"><table>
<tr><th></th><th>path mm</th><th>path deg</th><th>end mm</th><th>end deg</th><th>force N</th><th>path sigma</th></tr>
{% for label, cells in accuracy %}
<tr><th>{{ label }}</th>{% for c in cells %}<td>{{ c }}</td>{% endfor %}</tr>
{% endfor %}
</table></div>
{% if plan %}
<h2>{{ plan.title }}</h2>
<div class="wide"><table>
{% for what, value in plan.rows %}
<tr><th>{{ what }}</th><td>{{ value }}</td></tr>
{% endfor %}
</table></div>
{{ plan.curve }}<p class="note">{{ plan.caption }} Green: the plan; dashed: the tolerance.</p>
{% endif %}
<h2>pages</h2>
"""


def overview_page(
    examined: Examined,
    *,
    name: str,
    note: str,
    files: Collection[str],
    plan: Plan | None = None,
    hindsight: Hindsight | None = None,
) -> str:
    """The page that leads a run's folder.

    Args:
        examined: what was identified, and diagnosed if it was.
        name: of the recording.
        note: one line on how it was made.
        files: of the folder.
        plan: the plan made with what was found, whose curve is shown; None for none.
        hindsight: what a diagnosis says of the plan that was made before it.
    """
    known, evidence = examined.known, examined.evidence
    fitter, fit = (known.fitter, known.fit) if evidence is None else (evidence.fitter, evidence.corrected)
    names = " and ".join(part.kind.name for part in fit.hypothesis.parts)
    rows = [
        ("initial guess", known.before),
        ("next push, from earlier pushes", known.foreseen),
        ("baseline model", known.after),
        (f"with {names}", accuracy_of(known.case, evidence.errors_after) if evidence is not None and names else None),
    ]
    environment = Environment(undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    body = environment.from_string(_BODY).render(
        means=f"{BASELINE_MEANS} {HELD_OUT_MEANS} {sigma_means(known=known.case.noise.known)}",
        verdict=verdict(known),
        with_effects=f", with {names}" if names else ", baseline model",
        estimates=[_told(e) for e in estimates_of(fitter, fit)],
        accuracy=[(label, accuracy_cells(a)) for label, a in rows if a is not None],
        plan=None if plan is None else _shown_plan(plan, hindsight),
        diagnosis=examined.diagnosis,
        cells=None if known.cells is None else _shown_cells(known.cells),
    )
    return index_page(name, [note], files, Markup(body))  # escaped by Jinja


def _told(e: Estimate) -> tuple[str, str, str, str]:
    unit = "" if e.unit == "-" else f" {e.unit}"
    return e.name, f"{e.value:.4g}{unit}", f"{e.ci90[0]:.4g} to {e.ci90[1]:.4g}", identifiable_text(e)


def _shown_cells(cells: IdentifiableCells) -> dict[str, Any]:
    rows = [
        (
            combination_text(cells, c.weights),
            f"{c.strength:.3g}",
            f"{100 * c.left:.0f} %",
            "yes" if c.identifiable else "no",
        )
        for c in cells.combinations
    ]
    return {"map": cells_figure(cells), "rows": rows, "verdict": cells_verdict(cells)}


def _shown_plan(plan: Plan, hindsight: Hindsight | None) -> dict[str, Any]:
    known = " and ".join(e.name for e in plan.model.effects) or "the baseline model"
    return {
        "title": f"plan: {plan.policy.name}, with {known}",
        "rows": plan_rows(plan, hindsight=hindsight),
        "curve": curve_svg(plan) if plan.sweep else "",
        "caption": caption_of(plan) if plan.sweep else "",
    }
