"""``scene.html``: Meshcat's static page of a diagnosis, with what its colours mean."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from jinja2 import Environment, StrictUndefined

from physid_drake.diagnose.localise import MissingWrench
from physid_drake.diagnose.values import Diagnosis
from physid_drake.report.pages import SCENE, nav
from physid_drake.report.panel import with_panel
from physid_drake.report.stage import ARROW, MISSING, NOTHING, RECORDED, SIMULATED

_PANEL = """
<div id="physid">{{ nav }}<details open><summary><b>{{ name }}</b></summary>
  <p>{{ sentence }}</p>
  {% for colour, what in legend %}<div><span class="dot" style="background: rgb({{ colour }})"></span>{{ what }}</div>
  {% endfor %}
  {% if unit_force %}<p>An arrow of {{ "%.0f" % (1e3 * arrow) }} mm is {{ "%.2g" % unit_force }} N.</p>{% endif %}
</details></div>
"""


def scene_page(
    html: str, diagnosis: Diagnosis, wrenches: Sequence[MissingWrench], unit_force: float, pages: Collection[str] = ()
) -> str:
    """Meshcat's static page with a legend.

    Args:
        html: what Meshcat wrote.
        diagnosis: whose scene it is.
        wrenches: those drawn.
        unit_force: that is drawn as long as ``ARROW`` [N].
        pages: that lie beside this one.
    """
    legend = [
        (_css(RECORDED), "object as recorded, and its paths"),
        (_css(SIMULATED), "as simulated with model.yaml"),
    ]
    if any(w.stands_out for w in wrenches):
        legend.append((_css(MISSING), "force that the plain cell lacks"))
    if any(not w.stands_out for w in wrenches):
        legend.append((_css(NOTHING), "force that is within two standard deviations of nothing"))
    panel = Environment(undefined=StrictUndefined, autoescape=True).from_string(_PANEL).render(
        name=diagnosis.recording, sentence=diagnosis.sentence, legend=legend, arrow=ARROW,
        unit_force=unit_force if wrenches else None, nav=nav(SCENE, pages),
    )  # fmt: skip
    return with_panel(html, panel)


def _css(colour: Iterable[float]) -> str:
    red, green, blue, *_ = (round(255 * part) for part in colour)
    return f"{red}, {green}, {blue}"
