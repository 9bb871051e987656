"""Pictures of a proof: confusion, power against size, and how stated probabilities came true."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from physid_drake.report.svg import AFTER, BEFORE, INK, MUTED
from physid_drake.validation.scoring.figures import NOT_CATALOGUED, NOTHING, Figures, Share
from physid_drake.validation.scoring.tables import size_words

FOUND, NAMED = BEFORE, AFTER
LAST = ("unexplained", "consistent", "underpowered", "failed")
"""What is said without a name: the last columns of the confusion."""

RIGHT = {NOTHING: "consistent", NOT_CATALOGUED: "unexplained"}
"""What is right where there is no name to be said."""


def confusion_picture(figures: Figures) -> Figure:
    """Worlds by truth (rows) and by the name that was given first, or the verdict without one (columns)."""
    rows, columns = _labels(figures)
    counts = np.array([[figures.confusion.get((row, column), 0) for column in columns] for row in rows])
    # A row's own share, so that kinds with few worlds are seen as well.
    totals = counts.sum(axis=1, keepdims=True)
    size = (2.6 + 0.3 * len(columns), 2.2 + 0.26 * len(rows))
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    axes.imshow(counts / np.maximum(totals, 1), cmap="Blues", vmin=0.0, vmax=1.3, aspect="auto")
    for i, j in np.argwhere(counts > 0).tolist():
        share = counts[i, j] / totals[i, 0]
        axes.text(j, i, str(counts[i, j]), ha="center", va="center", color="white" if share > 0.6 else INK)
    axes.set_xticks(range(len(columns)), [_spoken(c) for c in columns], rotation=60, ha="right")
    axes.set_yticks(range(len(rows)), [f"{_spoken(r)} ({n})" for r, n in zip(rows, totals[:, 0], strict=True)])
    axes.set_xlabel("first name of the diagnosis")
    axes.set_ylabel("truth (worlds)")
    for k, name in enumerate(rows):
        axes.add_patch(_frame(columns.index(RIGHT.get(name, name)), k))
    axes.tick_params(length=0)
    return figure


def _labels(figures: Figures) -> tuple[list[str], list[str]]:
    """Rows and columns: effects by name, then what has none."""
    true = {t for t, _ in figures.confusion}
    said = {s for _, s in figures.confusion}
    rows = sorted(true - {NOTHING, NOT_CATALOGUED}) + [r for r in (NOTHING, NOT_CATALOGUED) if r in true]
    names = sorted((said | set(rows)) - {NOTHING, NOT_CATALOGUED} - set(LAST))
    return rows or [NOTHING], names + list(LAST)


def _frame(column: int, row: int) -> Rectangle:
    return Rectangle((column - 0.5, row - 0.5), 1.0, 1.0, fill=False, edgecolor=INK, linewidth=0.8)


def power_picture(figures: Figures) -> Figure:
    """Share found and share named rightly against the effect's size, with 95 % intervals."""
    figure = Figure(figsize=(5.2, 2.9), layout="constrained")
    axes = figure.add_subplot()
    bins = figures.power
    _bars(axes, [p.found for p in bins], -0.2, FOUND, "found")
    _bars(axes, [p.right for p in bins], 0.2, NAMED, "named correctly, alone or in a class of two")
    axes.set_xticks(range(len(bins)), [f"{size_words(p.low, p.high)}\n({p.found.of})" for p in bins])
    axes.set_xlabel("motion that the effect causes [sigma] (number of worlds)")
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(0.0, 1.17), ncols=2)
    return figure


def _bars(axes: Axes, shares: Sequence[Share], shift: float, colour: str, label: str) -> None:
    known = [k for k, s in enumerate(shares) if s.of]
    heights = np.array([100.0 * shares[k].share for k in known])
    places = np.array(known, dtype=float) + shift
    axes.bar(places, heights, width=0.36, color=colour, label=label)
    axes.errorbar(places, heights, yerr=_reach(shares, known), fmt="none", ecolor=INK, elinewidth=0.8, capsize=2)
    axes.set_ylim(0.0, 104.0)
    axes.set_xlim(-0.6, len(shares) - 0.4)
    axes.set_ylabel("%")
    axes.grid(axis="y")


def _reach(shares: Sequence[Share], known: Sequence[int]) -> NDArray[np.float64]:
    """(2, n) how far the intervals reach below and above the shares [%]."""
    ends = np.array([shares[k].interval for k in known]).reshape(-1, 2)
    middle = np.array([shares[k].share for k in known])
    reach: NDArray[np.float64] = 100.0 * np.maximum(np.array([middle - ends[:, 0], ends[:, 1] - middle]), 0.0)
    return reach


def calibration_picture(figures: Figures) -> Figure:
    """Share of names that were right against the probability that was stated for them."""
    figure = Figure(figsize=(3.4, 3.1), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([0, 100], [0, 100], color=MUTED, linewidth=0.8, linestyle=":")
    bins = [b for b in figures.reliability if b.right.of]
    shares = [b.right for b in bins]
    stated = np.array([100.0 * b.stated for b in bins])
    right = np.array([100.0 * s.share for s in shares])
    reach = _reach(shares, range(len(shares)))
    axes.errorbar(
        stated, right, yerr=reach, fmt="o", color=NAMED, ecolor=INK, elinewidth=0.8, capsize=2, markersize=4
    )
    for x, y, share in zip(stated, right, shares, strict=True):
        axes.annotate(f"{share.of}", (x, y), xytext=(4, -9), textcoords="offset points", color=MUTED)
    axes.set_xlabel("stated probability [%]")
    axes.set_ylabel("correct names [%]")
    axes.set_xlim(-2.0, 104.0)
    axes.set_ylim(-2.0, 104.0)
    axes.grid()
    return figure


def _spoken(name: str) -> str:
    return name.replace("_", " ")
