"""The pages of a folder of results: one name for each kind, links between them, and the one that leads."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

INDEX: Final = "index.html"
DIAGNOSIS: Final = "diagnosis.html"
SCENE: Final = "scene.html"
PLAN: Final = "plan.html"

TITLES: Final = {INDEX: "Overview", DIAGNOSIS: "Diagnosis", SCENE: "In 3D", PLAN: "Plan"}
TELLS: Final = {
    DIAGNOSIS: "the missing physics, how certain it is, where it acts, and what it changes",
    SCENE: "the pushes in three dimensions: recorded, simulated and planned",
    PLAN: "the push that brings the object to its goal, and its predicted results",
}
"""What each page says, for the one that leads."""
BASELINE_MEANS: Final = (
    "Baseline model: the Drake cell with identified parameters and without any effect of the catalogue."
)
HELD_OUT_MEANS: Final = "Held-out push: predicted by a model that was fitted to all other pushes."


def sigma_means(*, known: bool) -> str:
    """What sigma is, where the tracker's noise is known and where it is not."""
    if known:
        return "Sigma: in units of tracker noise (one standard deviation)."
    return "Sigma: the tracker noise is unknown, and taken to be as large as the errors of the baseline model."


_NAV = """<nav aria-label="pages" style="font: 13px/1.4 system-ui, sans-serif; margin: 0 0 12px">
{%- for file, title in pages %}
{%- if file == here %}<b style="margin-right: 16px">{{ title }}</b>
{%- else %}<a href="{{ file }}" style="margin-right: 16px">{{ title }}</a>{% endif %}
{%- endfor %}</nav>"""

_PAGE = """<!doctype html>
<html lang="en-GB"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ title }}</title>
<style>
body { margin: 0; color: #1c2330; background: #fff;
  font: 15px/1.55 system-ui, "Segoe UI", Roboto, Arial, sans-serif; }
main { max-width: 46em; margin: 0 auto; padding: 36px 28px 60px; overflow-wrap: anywhere; }
h1 { font-size: 24px; line-height: 1.3; margin: 0 0 14px; } a { color: #2563c9; }
li { margin: 8px 0; } ul { padding-left: 20px; } .note { color: #667085; font-size: 13px; }
h2 { font-size: 17px; margin: 30px 0 6px; } svg { display: block; width: 100%; height: auto; margin: 8px 0; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-size: 14px; font-variant-numeric: tabular-nums; }
th { text-align: left; font-weight: 500; color: #667085; } th, td { padding: 4px 18px 4px 0; }
tr + tr th, tr + tr td { border-top: 1px solid #dfe3ea; }
@media print { * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
</style></head><body><main>
{{ nav }}
<h1>{{ title }}</h1>
{% for line in lines %}
<p>{{ line }}</p>
{% endfor %}
{{ body }}
<ul>
{% for file, name, tells in pages %}
<li><a href="{{ file }}">{{ name }}</a>: {{ tells }}.</li>
{% endfor %}
</ul>
<p class="note">Other files: {{ files | join(", ") }}.</p>
</main></body></html>
"""


def nav(here: str, files: Collection[str]) -> Markup:
    """Links to the pages among some files, the page itself in bold; nothing where there is no other.

    Args:
        here: the page that the links are in.
        files: of the folder.
    """
    pages = [(file, title) for file, title in TITLES.items() if file in files or file == here]
    if len(pages) < 2:
        return Markup("")
    return Markup(_environment().from_string(_NAV).render(pages=pages, here=here))  # escaped by Jinja


def index_page(title: str, lines: Collection[str], files: Collection[str], body: Markup | None = None) -> str:
    """The page that leads: what came of it, and what each other page tells.

    Args:
        title: of it.
        lines: sentences.
        files: of the folder.
        body: between the sentences and the links.
    """
    pages = [(file, TITLES[file], tells) for file, tells in TELLS.items() if file in files]
    others = [file for file in files if file not in TITLES]
    return _environment().from_string(_PAGE).render(
        title=title, lines=lines, pages=pages, files=others, nav=nav(INDEX, files), body=body or ""
    ) + "\n"  # fmt: skip


def _environment() -> Environment:
    return Environment(undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
