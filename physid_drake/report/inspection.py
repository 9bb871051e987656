"""What a recording holds, as a table in the terminal and as a plot of all pushes from above."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from rich.table import Table

from physid_drake.recording.rounding import rounding_std
from physid_drake.recording.statistics import NoiseEstimate, PushSummary, estimate_noise, summarise
from physid_drake.recording.values import Array, Recording
from physid_drake.report.outline import outline_of, shape_in_words
from physid_drake.report.terminal import narrow_table, numbers, words
from physid_drake.wording import alike

MOST_KINDS = 8
"""Lines of warnings for a recording."""

_MANY_PUSHES = 12


def inspection_table(recording: Recording) -> Table:
    """One row for each push, speeds at their largest, and the noise of all in the caption."""
    steps = _rounding(recording)
    headings = (
        "poses", "time\n[s]", "hand\n[mm/s]", "object\n[mm/s]", "moved\n[mm]", "turned\n[deg]", "gaps", "noise\n[mm]",
        "noise\n[deg]", "warnings",
    )  # fmt: skip
    table = narrow_table(
        recording.name, words("push"), *map(numbers, headings),
        caption=f"object: {shape_in_words(recording.object.shape)}\n{_noise_line(estimate_noise(recording), steps)}",
    )  # fmt: skip
    for push in recording.pushes:
        table.add_row(_short(push.name), *_cells(summarise(push), steps, push.object.rotation != "none"))
    return table


def _short(name: str) -> str:
    """A push's name without the folder and the ending that all have."""
    return name.removeprefix("pushes/").removesuffix(".csv")


def log_table(name: str, rows: Sequence[tuple[str, ...]]) -> Table:
    """What a foreign log holds: a row for each column or topic."""
    headings = ("samples", "rate\n[Hz]", "least", "largest")
    table = narrow_table(name, words("column or topic"), *map(numbers, headings))
    for row in rows:
        table.add_row(*row)
    return table


def warning_lines(recording: Recording) -> list[str]:
    """Every warning of every push, one line each."""
    return [f"{push.name}: {warning}" for push in recording.pushes for warning in push.warnings]


def warnings_by_kind(recording: Recording) -> list[str]:
    """Warnings that are alike but for their numbers, as one line each: the first of them, and how many more."""
    kinds: dict[str, list[str]] = {}
    for push in recording.pushes:
        for warning in push.warnings:
            alike = re.sub(r"rows? [^:]*:", "", warning)
            kinds.setdefault(re.sub(r"[-+.\d]+(e[-+]\d+)?", "", alike), []).append(f"{push.name}: {warning}")
    lines = []
    for said in kinds.values():
        pushes = len({line.partition(":")[0] for line in said})
        where = f"in {pushes} pushes" if pushes > 1 else "in this push"
        lines.append(
            said[0] if len(said) == 1 else f"{said[0].rstrip('.')} ({len(said) - 1} similar warnings, {where})."
        )
    hidden = len(lines) - MOST_KINDS + 1
    return lines if hidden <= 1 else [*lines[: MOST_KINDS - 1], f"and {hidden} more kinds of warnings."]


def alike_as_one(lines: Sequence[str], pushes: Sequence[str]) -> list[str]:
    """Lines that are alike but for a push's name and numbers, as the first of them and how many more there are."""
    return [
        said[0] if len(said) == 1 else f"{said[0]} (and {len(said) - 1} more pushes)" for said in alike(lines, pushes)
    ]


def draw_pushes(recording: Recording) -> Figure:
    """All pushes from above, in m: outline at start (faint) and end, path of object and hand.

    Args:
        recording: what to draw.

    Returns:
        A figure that belongs to no window; save it with ``savefig``.
    """
    figure = Figure(figsize=(8.0, 8.0), layout="constrained")
    axes = figure.add_subplot()
    outline = outline_of(recording.object.shape)
    many = len(recording.pushes) > _MANY_PUSHES
    width = 0.5 if many else 1.2
    for push in recording.pushes:
        planar = push.object.planar
        if outline is not None:
            _draw_outline(axes, outline, planar[0], 0.08 if many else 0.35, width)
            _draw_outline(axes, outline, planar[-1], 0.3 if many else 1.0, width)
        axes.plot(planar[:, 0], planar[:, 1], color="tab:blue", linewidth=1.5 * width)
        axes.plot(*planar[-1, :2], ".", color="tab:blue", markersize=3 if many else 6)
    paths = [push.hand.positions[:, :2] for push in recording.pushes if push.hand is not None]
    axes.add_collection(LineCollection(paths, colors="tab:orange", linewidths=2.0 * width, zorder=3))
    for path in paths:
        axes.plot(*path[-1], ".", color="tab:orange", markersize=3 if many else 6, zorder=3)
    _finish(axes, recording)
    return figure


def _draw_outline(axes: Axes, outline: Array, pose: Array, alpha: float, width: float) -> None:
    c, s = np.cos(pose[2]), np.sin(pose[2])
    corners = outline @ np.array([[c, s], [-s, c]]) + pose[:2]
    closed = np.vstack([corners, corners[:1]])
    axes.plot(closed[:, 0], closed[:, 1], color="tab:blue", alpha=alpha, linewidth=width)


def _finish(axes: Axes, recording: Recording) -> None:
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    count = len(recording.pushes)
    # A name with a $ would be read as mathematics.
    title = f"{recording.name}: {count} push{'es' if count != 1 else ''} from above"
    axes.set_title(f"{title}\n{shape_in_words(recording.object.shape)}", parse_math=False)
    handles = [
        Line2D([], [], color="tab:blue", alpha=0.3, label="object at start"),
        Line2D([], [], color="tab:blue", label="object at end, and its path"),
    ]
    if recording.hand is not None:
        handles.append(Line2D([], [], color="tab:orange", label="hand path (dot: end)"))
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, -0.07), ncols=3, frameon=False)
    axes.grid(linewidth=0.3)


def _rounding(recording: Recording) -> tuple[float, float]:
    """Standard deviation of the rounding of the object's places [m] and yaw [rad]; 0 where none is seen."""
    planar = [push.object.planar for push in recording.pushes]
    return rounding_std([one[:, :2] for one in planar]), rounding_std([one[:, 2:] for one in planar])


def _at_least(noise: float | None, step: float) -> float | None:
    """A stream that stands still on its grid is no better than that."""
    return max(noise or 0.0, step) if step > 0.0 else noise


def _cells(summary: PushSummary, steps: tuple[float, float], turns: bool) -> list[str]:
    return [
        str(summary.samples),
        f"{summary.duration:.2f}",
        _scaled(summary.hand_speed, 1e3, ".1f"),
        _scaled(summary.object_speed, 1e3, ".1f"),
        f"{summary.displacement * 1e3:.1f}",
        f"{np.rad2deg(summary.turn):.1f}" if turns else "-",
        str(summary.gaps),
        _scaled(_at_least(summary.position_noise, steps[0]), 1e3, ".3f"),
        _scaled(_at_least(summary.rotation_noise, steps[1]) if turns else None, 180.0 / np.pi, ".3f"),
        str(summary.warnings),
    ]


def _scaled(value: float | None, factor: float, form: str) -> str:
    return "-" if value is None else format(value * factor, form)


def _noise_line(noise: NoiseEstimate, steps: tuple[float, float]) -> str:
    grid = ", ".join(
        f"{said} to {scale * math.sqrt(12.0) * step:.3g} {unit}"
        for said, step, scale, unit in (("places", steps[0], 1e3, "mm"), ("yaw", steps[1], 180.0 / np.pi, "deg"))
        if step > 0.0
    )
    rounded = f"; rounded: {grid}, which is a noise of step / sqrt(12) or more" if grid else ""
    return _seen_line(noise, steps) + rounded


def _seen_line(noise: NoiseEstimate, steps: tuple[float, float]) -> str:
    if noise.object_position_std is None or noise.object_rotation_std is None:
        return "noise: unknown, because the object is never recorded at rest"
    place, turn = max(noise.object_position_std, steps[0]), max(noise.object_rotation_std, steps[1])
    parts = [
        f"noise at rest: object {place * 1e3:.3f} mm, {np.rad2deg(turn):.3f} deg"
        f" (one standard deviation, {noise.samples} samples)"
    ]
    if noise.position_autocorrelation is not None:
        parts.append(f"correlation of successive samples {noise.position_autocorrelation:.2f}")
    if noise.force_std is not None:
        parts.append(f"force {noise.force_std:.3f} N")
    return "; ".join(parts)
