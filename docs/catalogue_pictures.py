"""The pictures of docs/effects.md: each effect's law, and what it does to pushes.

    python docs/catalogue_pictures.py [--out docs/images/effects] [NAME ...]

Laws are those of the package, evaluated; pushes are rolled out by the twin, those of a lying cylinder by the cell.
What each picture shows is in ``effect_pictures``, beside this file.
"""

from __future__ import annotations

import argparse
import io
import re
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from effect_pictures.picture import draw
from effect_pictures.table import PICTURES
from matplotlib.figure import Figure

from physid_drake.effects import SHIPPED
from physid_drake.report.svg import drawn


def svg_text(figure: Figure, salt: str) -> str:
    """The figure as a file that holds no date and no more digits than are seen."""
    mpl.rcParams["svg.hashsalt"] = salt
    file = io.BytesIO()
    figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = file.getvalue().decode()
    text = re.sub(r"<!--.*?-->|<metadata>.*?</metadata>|<!DOCTYPE.*?>", "", text, flags=re.S)
    text = re.sub(r' id="[a-zA-Z0-9.]+_\d+"(?=>)', "", text)  # of groups; a curve's own has no number
    text = text.replace("'DejaVu Sans'", "'DejaVu Sans', Verdana, sans-serif")
    return re.sub(r"\n\s*", "\n", re.sub(r"<[^<>]*>", _rounded, text)).strip() + "\n"


def _rounded(tag: re.Match[str]) -> str:
    """A tag with two digits after the point."""

    def number(found: re.Match[str]) -> str:
        return f"{float(found[0]) + 0.0:.2f}".rstrip("0").rstrip(".").replace("-0 ", "0 ")

    return re.sub(r"-?\d+\.\d{3,}", number, tag[0])


def write(names: Sequence[str], folder: Path) -> list[Path]:
    """Draw the pictures of some effects into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for name in names:
        with drawn():
            mpl.rcParams.update({"savefig.transparent": False, "path.simplify": False})
            files.append(folder / f"{name}.svg")
            files[-1].write_text(svg_text(draw(PICTURES[name]), f"effects {name}"), encoding="utf-8")
    return files


def main() -> None:
    """Draw those that are named, or all."""
    every = [kind.name for kind in SHIPPED]
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="of effects; default: all")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "images" / "effects")
    given = parser.parse_args()
    for file in write(given.names or every, given.out):
        print(f"{file} {file.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
