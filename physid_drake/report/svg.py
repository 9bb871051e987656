"""Colours and style of all figures, and figures as SVG that stands in a page."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
from markupsafe import Markup
from matplotlib.figure import Figure

INK, MUTED, RULE, PAPER = "#1c2330", "#667085", "#dfe3ea", "#f6f7f9"
BEFORE, AFTER = "#98a1b0", "#2563c9"
CONTACT, FREE = "#b4540a", "#45b8a8"

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "text.color": INK,
    "text.parse_math": False,
    "axes.edgecolor": "#c3c9d4",
    "axes.labelcolor": MUTED,
    "axes.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": RULE,
    "grid.linewidth": 0.5,
    "xtick.color": "#c3c9d4",
    "ytick.color": "#c3c9d4",
    "xtick.labelcolor": MUTED,
    "ytick.labelcolor": MUTED,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "savefig.transparent": True,
    "svg.hashsalt": "physid_drake",  # so that ids repeat
}


@contextmanager
def drawn() -> Iterator[None]:
    """Draw in this style while the block runs, whatever the user's own is."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        yield


def png_of(figure: Figure) -> bytes:
    """A figure as a picture file."""
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=150)
    return file.getvalue()


def svg_of(figure: Figure, salt: str, label: str) -> Markup:
    """A figure as inline SVG that scales with its column; ``salt`` keeps its ids apart from the others'."""
    mpl.rcParams["svg.hashsalt"] = salt
    file = io.BytesIO()
    figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = file.getvalue().decode()
    text = text[text.index("<svg") :]
    text = re.sub(r"<!--.*?-->|<metadata>.*?</metadata>|<style .*?</style>", "", text, flags=re.S)
    text = re.sub(r'<g id="[^"]*">', "<g>", text).replace("xlink:href", "href")
    box = re.search(r'viewBox="[^"]*"', text)
    assert box is not None
    body = text[text.index(">") + 1 :]
    body = re.sub(r"\n\s*", "\n", body).strip()
    return Markup('<svg {} role="img" aria-label="{}">\n{}').format(Markup(box[0]), label, Markup(body))
