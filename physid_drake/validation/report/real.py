"""What a proof on real recordings shows: tables, ``real.json``, pressure maps from above."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from physid_drake.report.terminal import narrow_table, words
from physid_drake.validation.scoring.real_score import NEAR, Pressure, RealOutcome
from physid_drake.validation.scoring.tables import decimals

FORMAT = "physid-proof-real/1"
COLUMNS = ("case", "pushes", "chi2 baseline", "chi2 diagnosed", "verdict", "names", "held-out mm", "held-out deg",
           "held-out N", "unseen mm", "unseen deg", "ellipsoid mm", "ellipsoid deg", "4th order mm", "4th order deg",
           "weight near the points", "mean arm of the weight mm")  # fmt: skip
_LEG, _CORNER = 150.0, 50.0  # mm


def real_rows(outcomes: Sequence[RealOutcome]) -> list[tuple[str, ...]]:
    """One row for each case, as `COLUMNS`; what was left out says why."""
    return [_row(o) for o in outcomes]


def _row(outcome: RealOutcome) -> tuple[str, ...]:
    o = outcome
    if o.skipped is not None:
        return (o.case.name, str(o.pushes or "-"), "-", "-", o.skipped, *("-",) * (len(COLUMNS) - 5))
    published = o.published or {}
    models = [_errors(published.get(name, (math.nan, math.nan))) for name in ("quadratic", "poly4")]
    return (
        o.case.name, str(o.pushes), decimals(o.chi2[0]), decimals(o.chi2[1]), o.verdict,
        " + ".join(" or ".join(names) for names in o.classes) or "-",
        _change([1e3 * v for v in o.position]), _change([math.degrees(v) for v in o.rotation]),
        _change(o.force) if math.isfinite(o.force[0]) else "-",
        *_errors(o.fresh), *models[0], *models[1], _near(o), _arm(o),
    )  # fmt: skip


def _errors(errors: tuple[float, float]) -> tuple[str, str]:
    return decimals(1e3 * errors[0]), decimals(math.degrees(errors[1]))


def _change(values: Sequence[float]) -> str:
    return " to ".join(decimals(v) for v in values)


NOTES = (
    "Held-out: each diagnosed push, predicted by a model that was fitted to the others; baseline model to model with"
    " the effects found. Unseen: end points of pushes that the diagnosis did not get."
    " Ellipsoid, 4th order: the publishers' models"
    f" on the diagnosed pushes. Weight near the points: share of the pressure found within {1e3 * NEAR:g} mm of the"
    " points that the object stood on. Mean arm of the weight about the centre of mass: it sets the friction torque."
    " All errors are root mean squares. chi2: reduced chi-square, with a noise as large as the errors of the baseline"
    " model (only the cube's recording shows its own noise), so that 1 or less does not mean that no physics is"
    " missing."
)


def _near(outcome: RealOutcome) -> str:
    if outcome.pressure is None or not outcome.pressure.points:
        return "-"
    return f"{100 * outcome.pressure.near:.0f} % (even: {100 * outcome.pressure.even:.0f} %)"


def _arm(outcome: RealOutcome) -> str:
    if outcome.pressure is None:
        return "-"
    found, points, even = outcome.pressure.arm
    known = f"points: {1e3 * points:.0f}, " if math.isfinite(points) else ""
    return f"{1e3 * found:.0f} ({known}even: {1e3 * even:.0f})"


def real_markdown(outcomes: Sequence[RealOutcome]) -> str:
    """The table for a reader of plain text."""
    lines = [COLUMNS, ("---",) * len(COLUMNS), *real_rows(outcomes)]
    rows = ["| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines]
    return "# Real recordings\n\n" + "\n".join(rows) + f"\n\n{NOTES}\n"


def real_table(outcomes: Sequence[RealOutcome]) -> Table:
    """The columns that fit a terminal."""
    shown = [0, 1, 2, 3, 4, 5, 6, 7, 8]
    table = narrow_table("real recordings", *(words(COLUMNS[k]) for k in shown))
    for row in real_rows(outcomes):
        table.add_row(*(row[k] for k in shown))
    return table


def real_json(outcomes: Sequence[RealOutcome]) -> str:
    """The file's text."""
    content = {"format": FORMAT, "cases": [_case(o) for o in outcomes]}
    return json.dumps(content, indent=2) + "\n"


def _case(outcome: RealOutcome) -> dict[str, Any]:
    o = outcome
    pressure = o.pressure
    return {
        "name": o.case.name,
        "id": o.case.id,
        "pushes": o.pushes,
        "skipped": o.skipped,
        "verdict": o.verdict or None,
        "classes": [list(names) for names in o.classes],
        "reduced_chi2": _numbers(o.chi2),
        "held_out_m": _numbers(o.position),
        "held_out_rad": _numbers(o.rotation),
        "held_out_n": _numbers(o.force),
        "fresh": _numbers(o.fresh),
        "published": None if o.published is None else {name: _numbers(e) for name, e in o.published.items()},
        "weight_near_points": None
        if pressure is None or not pressure.points
        else {"found": pressure.near, "even": pressure.even},
        "mean_arm_m": None
        if pressure is None
        else dict(zip(("found", "points", "even"), _numbers(pressure.arm), strict=True)),
        "seconds": _numbers((o.seconds,))[0],
    }


def _numbers(values: Sequence[float]) -> list[float | None]:
    return [float(f"{v:.6g}") if math.isfinite(v) else None for v in values]


def pressure_picture(pressure: Pressure, title: str) -> Figure:
    """The pressure under the CMU triangle, seen from above, with the points that it stood on."""
    figure = Figure(figsize=(4.2, 3.6), layout="constrained")
    axes = figure.add_subplot()
    ticks = np.arange(0.5, _LEG, 1.0)
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    shown = np.ma.masked_where(x + y > _LEG, pressure.map)
    ends = (-_CORNER, _LEG - _CORNER)
    image = axes.imshow(shown.T, origin="lower", extent=(*ends, *ends), cmap="Blues", vmin=0.0)
    figure.colorbar(image, label="pressure over its mean")
    points = 1e3 * np.array(pressure.points).reshape(-1, 2)
    axes.plot(points[:, 0], points[:, 1], "o", markersize=9, markerfacecolor="none", color="#b42318")
    axes.set_xlabel("x of the object [mm]")
    axes.set_ylabel("y of the object [mm]")
    axes.set_title(title, parse_math=False)
    return figure
