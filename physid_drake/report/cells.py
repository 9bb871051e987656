"""Which cells of a friction grid are identifiable from the pushes: a table, sentences, a figure."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.table import Table

from physid_drake.identify import IdentifiableCells
from physid_drake.report.svg import INK, drawn, svg_of
from physid_drake.report.terminal import narrow_table, numbers, words

Array = NDArray[np.float64]


def cells_table(cells: IdentifiableCells) -> Table:
    """Which combinations of the cells' frictions are identifiable, best first."""
    headings = ("singular\nvalue", "posterior /\nprior std", "identifiable")
    table = narrow_table(
        "identifiability of the friction cells", words("combination of log frictions"), *map(numbers, headings),
        caption=cells_verdict(cells),
    )  # fmt: skip
    for c in cells.combinations:
        table.add_row(combination_text(cells, c.weights), f"{c.strength:.3g}", f"{100 * c.left:.0f} %",
                      "yes" if c.identifiable else "no")  # fmt: skip
    return table


def combination_text(cells: IdentifiableCells, weights: Array) -> str:
    """The weights that matter, by the cells' places, largest first."""
    order = np.argsort(-np.abs(weights), kind="stable")
    shown = [k for k in order if abs(weights[k]) >= 0.1 * np.abs(weights).max()][:6]
    terms = [f"{weights[k]:+.2f} ({place_of(cells.names[k])})" for k in shown]
    return " ".join([*terms, "..."] if len(shown) < np.count_nonzero(np.abs(weights) > 1e-3) else terms)


def place_of(name: str) -> str:
    """The place of a cell in the grid: ``i,j`` along x and y of the object."""
    return ",".join(name.split("_")[-2:])


def cells_verdict(cells: IdentifiableCells) -> str:
    """In a sentence or two, which cells are identifiable and which neighbours are distinguishable."""
    count = len(cells.combinations)
    text = f"{cells.identifiable} of {count} combinations of the cells' frictions are identifiable"
    text += "; the others keep their prior." if cells.identifiable < count else "."
    if not cells.not_apart:
        return f"{text} All neighbouring cells are distinguishable." if cells.apart else text
    pairs = ", ".join(f"{place_of(a)} and {place_of(b)}" for a, b in cells.not_apart)
    return f"{text} Indistinguishable neighbours: {pairs}."


def cells_figure(cells: IdentifiableCells) -> Markup:
    """Friction of each cell, and its posterior over its prior standard deviation, from above in the object's axes."""
    with drawn():
        figure = Figure(figsize=(5.2, 2.2), layout="constrained")
        left, right = figure.subplots(1, 2)
        _draw_map(left, cells, cells.friction, "friction", "{:.3f}", None)
        _draw_map(right, cells, 100.0 * cells.left, "posterior / prior std [%]", "{:.0f}", (0.0, 100.0))
        return svg_of(figure, "cells", "Friction of the cells, and posterior over prior standard deviation")


def _draw_map(axes: Axes, cells: IdentifiableCells, values: Array, title: str, form: str,
              limits: tuple[float, float] | None) -> None:  # fmt: skip
    places = [[int(v) for v in place_of(name).split(",")] for name in cells.names]
    image = np.full(cells.grid, np.nan)
    for (i, j), value in zip(places, values, strict=True):
        image[i, j] = value
        axes.text(i, j, form.format(value), ha="center", va="center", color=INK)
    low, high = limits or (float(values.min()), float(values.max()))
    edges = [np.arange(n + 1) - 0.5 for n in cells.grid]
    axes.pcolormesh(*edges, image.T, cmap="Blues", vmin=low, vmax=low + 1.6 * (high - low + 1e-9), edgecolor="white")
    axes.set(title=title, aspect="equal", xlabel="x of the object", ylabel="y")
    axes.set(xticks=range(cells.grid[0]), yticks=range(cells.grid[1]))
