"""An experiment's result as tables, text, JSON and a figure."""

from __future__ import annotations

import csv
import io
import itertools
import json
import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.table import Column
from rich.table import Table as RichTable

from physid_drake.report.svg import AFTER, BEFORE, CONTACT, FREE, INK, MUTED
from physid_drake.report.terminal import narrow_table, words
from physid_drake.validation.experiments.values import Entry, Panel, Result, Table

COLOURS = (AFTER, BEFORE, CONTACT, FREE, INK)


def table_csv(table: Table) -> str:
    """A table as CSV; what is not known is left empty."""
    file = io.StringIO(newline="")
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows([["" if _unknown(v) else v for v in row] for row in table.rows])
    return file.getvalue()


def rich_table(table: Table) -> RichTable:
    """A table for a terminal."""
    first, *others = table.columns
    shown = narrow_table(table.title, words(first), *(Column(o, justify="right", overflow="fold") for o in others))
    for row in table.rows:
        shown.add_row(*[_text(v) for v in row])
    return shown


def result_markdown(result: Result, name: str, command: str) -> str:
    """Everything but the figure, as Markdown."""
    lines = [f"# {name}", "", f"    {command}", "", result.setting]
    for table in result.tables:
        lines += ["", f"**{table.title}**", "", _markdown_row(table.columns),
                  _markdown_row(["---"] * len(table.columns))]  # fmt: skip
        lines += [_markdown_row([_text(v) for v in row]) for row in table.rows]
    lines += ["", *[f"Skipped: {reason}" for reason in result.skipped]] if result.skipped else []
    return "\n".join(lines) + "\n"


def result_json(result: Result, name: str, command: str, versions: dict[str, str]) -> str:
    """All numbers, those of the curves too."""
    content = {
        "format": "physid-experiment/1",
        "experiment": name,
        "command": command,
        "versions": versions,
        "setting": result.setting,
        "skipped": list(result.skipped),
        "tables": [
            {"name": t.name, "title": t.title, "rows": [dict(zip(t.columns, row, strict=True)) for row in t.rows]}
            for t in result.tables
        ],
        "panels": [
            {
                "title": p.title, "x": p.x_label, "y": p.y_label,
                "series": [{"name": s.name, "x": list(s.x), "mean": list(s.mean), "deviation": list(s.deviation)}
                           for s in p.series],
            }
            for p in result.panels
        ],
    }  # fmt: skip
    return json.dumps(_known(content), indent=2, allow_nan=False) + "\n"


def result_figure(result: Result) -> Figure:
    """The panels side by side; bands and bars are one standard deviation over repetitions."""
    figure = Figure(figsize=(3.3 * len(result.panels), 3.0), layout="constrained")
    for panel, axes in zip(result.panels, figure.subplots(1, len(result.panels), squeeze=False)[0], strict=True):
        _draw(panel, axes)
    # One legend for all panels: names are long, and most panels share them.
    labelled = [axes.get_legend_handles_labels() for axes in figure.axes]
    named = {label: handle for handles, labels in labelled for handle, label in zip(handles, labels, strict=True)}
    figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=len(result.panels),
                  frameon=False, fontsize=7.0)  # fmt: skip
    return figure


def _draw(panel: Panel, axes: Axes) -> None:
    for colour, series in zip(itertools.cycle(COLOURS), panel.series, strict=False):
        mean, spread = list(series.mean), [0.0 if math.isnan(d) else d for d in series.deviation]
        if len(series.x) > 12:
            low, high = (
                [m - d for m, d in zip(mean, spread, strict=True)],
                [m + d for m, d in zip(mean, spread, strict=True)],
            )
            axes.plot(series.x, mean, color=colour, linewidth=1.2, label=series.name)
            axes.fill_between(series.x, low, high, color=colour, alpha=0.14, linewidth=0.0)
        else:
            axes.errorbar(series.x, mean, yerr=spread, color=colour, linewidth=1.2, marker="o", markersize=3.0,
                          capsize=2.0, elinewidth=0.7, label=series.name)  # fmt: skip
    if panel.level is not None:
        axes.axhline(panel.level[1], color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)), label=panel.level[0])
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]) if _negative(panel) else 0.0)
    axes.set_title(panel.title, fontsize=8.0, loc="left")
    axes.set_xlabel(panel.x_label)
    axes.set_ylabel(panel.y_label)
    axes.grid(visible=True)


def _negative(panel: Panel) -> bool:
    return any(m < 0.0 for s in panel.series for m in s.mean)


def _unknown(value: Entry) -> bool:
    return value is None or (isinstance(value, float) and not math.isfinite(value))


def _text(value: Entry) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "-"
    return f"{value:.3g}" if isinstance(value, float) and abs(value) < 100.0 else (
        f"{value:.0f}" if isinstance(value, float) else str(value)
    )  # fmt: skip


def _markdown_row(cells: Any) -> str:
    return "| " + " | ".join(str(c) for c in cells) + " |"


def _known(value: Any) -> Any:
    """JSON has no infinities."""
    if isinstance(value, dict):
        return {k: _known(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_known(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
