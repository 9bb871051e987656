"""``index.html`` of the main job: Meshcat's static page with the results beside it; it opens without a network."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from jinja2 import Environment, StrictUndefined

from physid_drake.diagnose import Examined
from physid_drake.identify import CellsTold
from physid_drake.identify.accuracy import accuracy_of
from physid_drake.identify.estimates import estimates_of
from physid_drake.plan import Hindsight, Plan
from physid_drake.report.cells import cells_figure, cells_verdict, combination_text
from physid_drake.report.pages import INDEX, nav
from physid_drake.report.panel import with_panel
from physid_drake.report.plan import plan_rows
from physid_drake.report.plan_page import caption_of, curve_svg
from physid_drake.report.tables import accuracy_cells, verdict

_PANEL = """
<div id="physid">{{ nav }}<details open><summary><b>{{ name }}</b></summary>
  {% if diagnosis %}<p><b>{{ diagnosis.verdict }}</b>. {{ diagnosis.sentence }} <a href="diagnosis.html">How sure, and
    where</a>; <a href="scene.html">in Meshcat</a>.</p>{% else %}<p>{{ verdict }}</p>{% endif %}
  <h2>theta{{ with_effects }}</h2>
  <table><tr><th>parameter</th><th>estimate</th><th>90 % interval</th><th>told</th></tr>
  {% for e in estimates %}<tr><td>{{ e.name }}</td><td>{{ "%.4g" % e.value }} {{ "" if e.unit == "-" else e.unit }}</td>
    <td>{{ "%.4g" % e.ci90[0] }} to {{ "%.4g" % e.ci90[1] }}</td>
    <td>{{ "no (prior)" if not e.identifiable else "at its bound" if e.at_bound else "yes" }}</td></tr>{% endfor %}
  </table>
  {% if cells %}<h2>what these pushes tell about the cells</h2>
  {{ cells.map }}
  <table><tr><th>combination of ln frictions</th><th>singular value</th><th>left</th><th>told</th></tr>
  {% for row in cells.rows %}<tr>{% for c in row %}<td>{{ c }}</td>{% endfor %}</tr>{% endfor %}</table>
  <p>{{ cells.verdict }}</p>{% endif %}
  <h2>error of prediction of each push, left out (root mean square)</h2>
  <table><tr><th></th><th>mm</th><th>deg</th><th>end mm</th><th>end deg</th><th>N</th><th>std</th></tr>
  {% for label, cells in accuracy %}<tr><td>{{ label }}</td>{% for c in cells %}<td>{{ c }}</td>{% endfor %}</tr>{% endfor %}
  </table>
  {% if plan %}<h2>{{ plan.title }}</h2>
  <table>{% for what, value in plan.rows %}<tr><td>{{ what }}</td><td>{{ value }}</td></tr>{% endfor %}</table>
  {{ plan.curve }}<p>{{ plan.caption }} Green: the plan; dashed: the tolerance.</p>{% endif %}
  <p><span class="dot" style="background:#f28c26"></span>recorded<span class="dot" style="background:#3373cc"></span>
    simulated, plain cell &nbsp; push: <select id="physid-push">{% for push, start in marks %}
    <option value="{{ start }}">{{ push }}</option>{% endfor %}</select></p>
  <p>{{ note }}</p>
</details></div>
<script>
  document.getElementById("physid-push").addEventListener("change", function (event) {
    viewer.animator.seek(parseFloat(event.target.value)); viewer.animator.play();
  });
</script>
"""


def result_page(
    html: str,
    examined: Examined,
    *,
    name: str,
    marks: list[tuple[str, float]],
    note: str,
    plan: Plan | None = None,
    hindsight: Hindsight | None = None,
    pages: Collection[str] = (),
) -> str:
    """Meshcat's static page with a panel of results.

    Args:
        html: what Meshcat wrote.
        examined: what was identified, and diagnosed if it was.
        name: of the recording.
        marks: name and start in the animation [s] of every push shown.
        note: one line on how it was made.
        plan: the plan made with what was found, whose curve is shown; None for none.
        hindsight: what a diagnosis says of the plan that was made before it.
        pages: that lie beside this one.
    """
    known, evidence = examined.known, examined.evidence
    fitter, fit = (known.fitter, known.fit) if evidence is None else (evidence.fitter, evidence.leaving)
    names = " and ".join(part.kind.name for part in fit.hypothesis.parts)
    rows = [
        ("before any push", known.before),
        ("before it was learned from", known.foreseen),
        ("plain cell", known.after),
        (f"with {names}", accuracy_of(known.case, evidence.errors_after) if evidence is not None and names else None),
    ]
    environment = Environment(undefined=StrictUndefined, autoescape=True)
    panel = environment.from_string(_PANEL).render(
        name=name,
        verdict=verdict(known),
        with_effects=f", with {names}" if names else ", plain cell",
        estimates=estimates_of(fitter, fit),
        accuracy=[(label, accuracy_cells(a)) for label, a in rows if a is not None],
        marks=marks,
        note=note,
        plan=None if plan is None else _shown_plan(plan, hindsight),
        diagnosis=examined.diagnosis,
        nav=nav(INDEX, pages),
        cells=None if known.cells is None else _shown_cells(known.cells),
    )
    return with_panel(html, panel)


def _shown_cells(cells: CellsTold) -> dict[str, Any]:
    rows = [
        (combination_text(cells, c.weights), f"{c.strength:.3g}", f"{100 * c.left:.0f} %", "yes" if c.told else "no")
        for c in cells.combinations
    ]
    return {"map": cells_figure(cells), "rows": rows, "verdict": cells_verdict(cells)}


def _shown_plan(plan: Plan, hindsight: Hindsight | None) -> dict[str, Any]:
    known = " and ".join(e.name for e in plan.model.effects) or "the identified theta"
    return {
        "title": f"plan: {plan.policy.name}, with {known}",
        "rows": plan_rows(plan, hindsight=hindsight),
        "curve": curve_svg(plan) if plan.sweep else "",
        "caption": caption_of(plan) if plan.sweep else "",
    }
