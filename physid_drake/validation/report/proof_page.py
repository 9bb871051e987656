"""``index.html`` of a proof: one file that opens without a network."""

from __future__ import annotations

import math
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure

from physid_drake.report.svg import drawn, svg_of
from physid_drake.validation.report.proof import AT_BEST, HELD_OUT, MAIN, POWER, Proof, said_of, truth_of
from physid_drake.validation.report.proof_pictures import (
    calibration_picture,
    confusion_picture,
    power_picture,
)
from physid_drake.validation.scoring.tables import held_out_table, power_table, table


def proof_page(proof: Proof) -> str:
    """The page as HTML; the same proof gives the same bytes.

    Args:
        proof: what to show; the pages of its diagnoses are linked as ``diagnoses/<id>/diagnosis.html``.
    """
    with drawn():
        pictures = {
            "confusion": _picture(confusion_picture(proof.figures), "diagnosis against truth"),
            "power": _picture(power_picture(proof.figures), "power against the size of the effect"),
            "calibration": _picture(
                calibration_picture(proof.figures), "stated probabilities against the share that is correct"
            ),
        }
    environment = Environment(undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(_PAGE).render(_content(proof, pictures)) + "\n"


def _picture(figure: Figure, label: str) -> Markup:
    """The figure, no wider than it was drawn."""
    width = 96.0 * float(figure.get_figwidth())
    return Markup('<figure style="max-width: {:.0f}px">{}</figure>').format(width, svg_of(figure, label, label))


def _content(proof: Proof, pictures: dict[str, Markup]) -> dict[str, Any]:
    figures = proof.figures
    median, longest = figures.seconds
    return {
        "style": Markup(_CSS),
        "proof": proof,
        "worlds": figures.worlds,
        "pictures": pictures,
        "main": (MAIN, table(figures)),
        "power": (POWER, power_table(figures)),
        "held_out": (HELD_OUT, held_out_table(figures)),
        "at_best": AT_BEST,
        "brier": f"{figures.brier:.3f}" if math.isfinite(figures.brier) else "–",
        "seconds": f"{median:.0f} s median, {longest:.0f} s at most" if math.isfinite(median) else "not measured",
        "faults": [
            {"id": o.id, "fault": o.fault, "truth": truth_of(o), "size": f"{o.size:.1f}", "said": said_of(o),
             "page": None if o.failed else f"diagnoses/{o.id}/diagnosis.html"}
            for o in proof.faults
        ],
    }  # fmt: skip


_CSS = """
:root { --ink: #1c2330; --muted: #667085; --rule: #dfe3ea; }
* { box-sizing: border-box; }
body { margin: 0; color: var(--ink); background: #fff; overflow-wrap: break-word;
  font: 15px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 36px 28px 60px; }
h1 { font-size: 30px; line-height: 1.25; font-weight: 650; margin: 0 0 12px; }
h2 { font-size: 20px; font-weight: 650; margin: 48px 0 6px; padding-top: 18px; border-top: 1px solid var(--rule); }
p { max-width: 46em; margin: 6px 0 10px; } .note { color: var(--muted); font-size: 13px; }
code { font-size: 13px; overflow-wrap: anywhere; }
.wide { overflow-x: auto; margin: 10px 0; }
table { border-collapse: collapse; font-size: 14px; line-height: 1.4; font-variant-numeric: tabular-nums; }
th { text-align: left; color: var(--muted); font-weight: 500; font-size: 12.5px; vertical-align: bottom; }
th, td { padding: 6px 18px 6px 0; border-bottom: 1px solid var(--rule); vertical-align: top; }
td.part { padding-left: 18px; }
figure { margin: 12px 0; } svg { display: block; width: 100%; height: auto; }
.columns { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 24px; }
@media (max-width: 800px) { .columns { grid-template-columns: minmax(0, 1fr); } main { padding: 22px 16px; } }
"""

_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>Proof on sealed worlds</title><style>{{ style }}</style></head><body><main>
{% macro rows(found) %}
<div class="wide"><table><tr>{% for h in found[0] %}<th>{{ h }}</th>{% endfor %}</tr>
{% for row in found[1] %}
<tr>{% for cell in row %}
<td{% if loop.first and cell[:1] == " " %} class="part"{% endif %}>{{ cell }}</td>
{% endfor %}</tr>
{% endfor %}
</table></div>
{% endmacro %}
<h1>Diagnosis of worlds that it has not seen</h1>
<p>{{ proof.outcomes | length }} worlds
{{ "of " ~ proof.sealed ~ " that were sealed, " if (proof.outcomes | length) < proof.sealed }}of another simulator:
{{ worlds.none }} without an effect, {{ worlds.effect }}
with one of the catalogue, {{ worlds.pair }} with two, {{ worlds.other }} with one that is not in the catalogue.
Truth and recordings were made and sealed first; the diagnosis was given the recordings only.</p>
<p class="note">Seed {{ proof.seed }}. Seal, written down before the diagnosis: <code>sha256 {{ proof.seal }}</code>.
{% for name, version in proof.versions.items() %}{{ name }} {{ version }}{{ ". " if loop.last else ", " }}{% endfor %}
A diagnosis took {{ seconds }} on this machine.</p>
{{ rows(main) }}
<p class="note">Sigma: in units of tracker noise (one standard deviation); the size of an effect is the motion that it
causes. A world without a diagnosis counts as nothing found; without an effect, as a false alarm.</p>
<h2>Diagnosis against truth</h2>
{{ pictures.confusion }}
<p class="note">Worlds with one effect or none. Framed: the correct answer. Colour: share of the row.</p>
<h2>Power against the size of the effect</h2>
{{ pictures.power }}
{{ rows(power) }}
<h2>Stated probabilities</h2>
{{ pictures.calibration }}
<p class="note">Each dot: the names stated with such a probability, their number, and a 95 % interval.
Brier score {{ brier }}.</p>
<h2>Prediction of held-out pushes</h2>
{{ rows(held_out) }}
<p class="note">Root mean square. {{ at_best }}</p>
<h2>Wrong answers ({{ faults | length }})</h2>
<div class="wide"><table><tr><th>world</th><th>error</th><th>truth</th><th>size [sigma]</th><th>diagnosis</th></tr>
{% for f in faults %}
<tr><td>{% if f.page %}<a href="{{ f.page }}">{{ f.id }}</a>{% else %}{{ f.id }}{% endif %}</td><td>{{ f.fault }}</td>
<td>{{ f.truth }}</td><td>{{ f.size }}</td><td>{{ f.said }}</td></tr>
{% endfor %}
</table></div>
</main></body></html>
"""
