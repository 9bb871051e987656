"""Figures of a diagnosis: motions from above, their errors, the missing wrench over time and place, the next push."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle

from physid_drake.diagnose.localise import MissingWrench
from physid_drake.diagnose.values import Diagnosis, NextPush, Window
from physid_drake.recording import Recording
from physid_drake.report.numbers import number
from physid_drake.report.svg import AFTER, BEFORE, CONTACT, FREE, INK, MUTED, PAPER, svg_of
from physid_drake.report.table_view import (
    MM,
    MOST_POINTS,
    Array,
    Box,
    ShownPush,
    TableView,
    box_of,
    draw_ground,
    draw_motion,
    draw_recorded,
    map_axes,
)

MOST_DRAWN = 40  # strips in all, so that the page stays small
MANY_PUSHES = 12


def views_from_above(view: TableView) -> list[tuple[str, Markup]]:
    """The table from above: all pushes before, and after where something was found."""
    if not view.shown:
        return []
    box = box_of(view, view.shown)
    alpha = 0.7 if len(view.shown) > MANY_PUSHES else 0.9
    views = []
    for kind, colour, title in (("before", BEFORE, "baseline model"), ("after", AFTER, "with the effects found")):
        motions = [push.before if kind == "before" else push.after for push in view.shown]
        if all(m is None for m in motions):
            continue
        figure, axes = map_axes(box, 5.2)
        for push, motion in zip(view.shown, motions, strict=True):
            if motion is not None:
                draw_motion(axes, view, motion, colour, width=2.6, alpha=0.55 * alpha)
            draw_motion(axes, view, push.recorded, INK, width=0.7, alpha=alpha)
        views.append((title, svg_of(figure, f"view {kind}", f"Table from above: recorded and simulated, {title}")))
    return views


def error_figure(view: TableView, k: int, noise: Mapping[str, Any]) -> tuple[str, Markup]:
    """One push: from above, and the errors of x, y and yaw over time."""
    push = view.shown[k]
    figure = Figure(figsize=(3.3, 5.0))
    above = figure.add_axes((0.22, 0.6, 0.75, 0.39))
    for motion, colour in ((push.before, BEFORE), (push.after, AFTER)):
        if motion is not None:
            draw_motion(above, view, motion, colour, width=2.2, alpha=0.6)
    draw_motion(above, view, push.recorded, INK, width=0.7, alpha=0.9)
    box = box_of(view, [push], margin=0.06)
    draw_ground(above, box, 0.75 * 3.3 / (0.39 * 5.0))
    above.yaxis.set_label_coords(-0.215, 0.5)
    scales = (
        ("Δx [mm]", MM, "position_m"),
        ("Δy [mm]", MM, "position_m"),
        ("Δyaw [°]", math.degrees(1.0), "rotation_rad"),
    )
    for row, (label, scale, key) in enumerate(scales):
        axes = figure.add_axes((0.22, 0.365 - 0.145 * row, 0.75, 0.125))
        if key in noise:
            _draw_error(axes, push, row, scale, 2.0 * scale * float(noise[key]))
        else:
            axes.text(0.5, 0.5, "not measured", ha="center", va="center", transform=axes.transAxes, color="#5b6472")
        axes.set_ylabel(label)
        axes.set_xlabel("time [s]" if row == 2 else "")
        axes.tick_params(labelbottom=row == 2)
    return push.name, svg_of(figure, f"error {k}", f"Error over time of {push.name}")


def _draw_error(axes: Axes, push: ShownPush, column: int, scale: float, band: float) -> None:
    """Simulated minus recorded, with the noise's band."""
    if math.isfinite(band):
        axes.axhspan(-band, band, color="#eef0f4", linewidth=0.0, zorder=0)
    axes.axhline(0.0, color="#c3c9d4", linewidth=0.6, zorder=1)
    step = max(1, math.ceil(len(push.times) / MOST_POINTS))
    for motion, colour in ((push.before, BEFORE), (push.after, AFTER)):
        if motion is not None:
            error = scale * (motion[::step, column] - push.recorded[::step, column])
            axes.plot(push.times[::step], error, color=colour, linewidth=1.3, marker=".", markersize=3.0)
    if push.released is not None:
        axes.axvline(push.released, color=FREE, linewidth=0.8, linestyle=(0, (2, 2)))
    axes.locator_params(axis="y", nbins=4)
    axes.margins(x=0.03, y=0.12)
    axes.yaxis.set_label_coords(-0.215, 0.5)


def strip_figures(diagnosis: Diagnosis, view: TableView) -> list[tuple[str, Markup]]:
    """The missing wrench over time, one figure per push, on the same scales."""
    if not view.wrenches:
        return []
    scale = np.array([1.0, 1.0, MM])
    reach = 1.2 * np.max([np.abs(np.nan_to_num(w.wrench)) for w in view.wrenches], axis=0) * scale
    most = set() if diagnosis.location is None else {(w.push, w.start) for w in diagnosis.location.windows}
    figures = []
    marked = {owner for owner, _ in most}
    every = sorted({w.push for w in view.wrenches}, key=lambda push: (view.name(push) not in marked, push))
    for push in sorted(every[:MOST_DRAWN]):
        name = view.name(push)
        mine = [w for w in view.wrenches if w.push == push]
        figure = Figure(figsize=(3.3, 3.1))
        for row, label in enumerate(("along [N]", "across [N]", "torque [N mm]")):
            axes = figure.add_axes((0.22, 0.715 - 0.285 * row, 0.75, 0.25))
            _draw_strip(axes, mine, row, scale[row], {start for owner, start in most if owner == name})
            axes.set(ylabel=label, ylim=(-(reach[row] or 1.0), reach[row] or 1.0))
            axes.set_xlabel("time [s]" if row == 2 else "")
            axes.tick_params(labelbottom=row == 2)
        figures.append((name, svg_of(figure, f"strip {push}", f"Missing wrench over time in {name}")))
    return figures


def _draw_strip(axes: Axes, windows: Sequence[MissingWrench], row: int, scale: float, most: set[float]) -> None:
    """One component: a bar per window, with two standard deviations; a mark at the windows that stand out."""
    axes.axhline(0.0, color="#c3c9d4", linewidth=0.6, zorder=1)
    for w in windows:
        colour = FREE if w.phase == "free_slide" else CONTACT
        value, std = scale * float(w.wrench[row]), scale * float(w.std[row])
        axes.axvspan(w.start, w.end, color=colour, alpha=0.07, linewidth=0.0, zorder=0)
        span = w.end - w.start
        alpha = 0.85 if abs(value) > 2.0 * std else 0.35
        axes.add_patch(
            Rectangle((w.start + 0.1 * span, 0.0), 0.8 * span, value, color=colour, alpha=alpha, linewidth=0)
        )
        middle = 0.5 * (w.start + w.end)
        axes.errorbar(middle, value, 2.0 * std, color=MUTED, elinewidth=0.7, capsize=1.6, capthick=0.7)
        if row == 0 and w.start in most:
            axes.plot(middle, 0.94, marker="v", markersize=4.0, color=INK, transform=axes.get_xaxis_transform())
    start, end = min(w.start for w in windows), max(w.end for w in windows)
    axes.set_xlim(start - 0.03 * (end - start), end + 0.03 * (end - start))
    axes.locator_params(axis="y", nbins=4)
    axes.locator_params(axis="x", nbins=6)
    axes.yaxis.set_label_coords(-0.215, 0.5)


def arrow_figure(view: TableView, most: Sequence[Window] = ()) -> Markup | None:
    """The missing force as arrows on the table; faint where it is within two standard deviations.

    Args:
        view: the table.
        most: windows that are numbered, from 1.
    """
    places = [w for w in view.wrenches if np.isfinite(w.wrench).all()]
    forces = np.array([_turned(w.wrench[:2], w.heading) for w in places])
    largest = float(np.hypot(*forces.T).max()) if places else 0.0
    if largest == 0.0:
        return None
    box = box_of(view, view.shown) if view.shown else _around(places)
    figure, axes = map_axes(box, 5.2)
    draw_recorded(axes, view)
    scale = largest / (0.25 * max(box[2] - box[0], box[3] - box[1]))  # N per mm of arrow
    for phase, colour in (("contact", CONTACT), ("free_slide", FREE)):
        for sure in (False, True):
            chosen = [k for k, w in enumerate(places) if (w.phase == phase, w.stands_out) == (True, sure)]
            if chosen:
                at = MM * np.array([places[k].place for k in chosen])
                axes.quiver(
                    at[:, 0], at[:, 1], forces[chosen, 0], forces[chosen, 1], angles="xy", scale_units="xy",
                    scale=scale, width=0.0055, color=colour, alpha=0.95 if sure else 0.28, zorder=3,
                )  # fmt: skip
    for number_, window in enumerate(most, start=1):
        axes.annotate(
            f"{number_}", (MM * window.place[0], MM * window.place[1]), (0, 9), textcoords="offset points",
            ha="center", va="center", fontsize=8.5, fontweight="bold", color=INK, zorder=6,
            bbox={"boxstyle": "circle,pad=0.18", "facecolor": "white", "edgecolor": INK, "linewidth": 0.8},
        )  # fmt: skip
    _draw_key(axes, _round_number(0.4 * largest), scale)
    return svg_of(figure, "arrows", "Missing force on the table from above")


def _turned(force: Array, heading: float) -> Array:
    """From along and across the motion to W."""
    c, s = math.cos(heading), math.sin(heading)
    return np.array([c * force[0] - s * force[1], s * force[0] + c * force[1]])


def _around(places: Sequence[MissingWrench]) -> Box:
    at = MM * np.array([w.place for w in places])
    low, high = at.min(axis=0) - 50.0, at.max(axis=0) + 50.0
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _round_number(value: float) -> float:
    """The next 1, 2 or 5 times a power of ten below."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(m for m in (1.0, 2.0, 5.0) if m <= value / power + 1e-9) * power


def _draw_key(axes: Axes, force: float, scale: float) -> None:
    """How long an arrow of a round force is, on a plate in the upper left."""
    left, right = axes.get_xlim()
    reach = force / scale / (right - left)
    axes.add_patch(
        Rectangle((0.015, 0.9), max(reach + 0.04, 0.14), 0.09, transform=axes.transAxes, color="white", alpha=0.85,
                  linewidth=0, zorder=4)
    )  # fmt: skip
    arrow = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.0, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", (0.03 + reach, 0.92), (0.03, 0.92), "axes fraction", "axes fraction", arrow, zorder=5)
    axes.text(0.03, 0.94, f"{number(force)} N", transform=axes.transAxes, fontsize=8, zorder=5)


def next_push_figure(push: NextPush, recording: Recording, view: TableView) -> Markup | None:
    """The proposed push: the object with its axes along the table's, the tip, and where it goes."""
    if view.outline is None:
        return None
    angle = math.radians(push.direction_deg)
    ahead, aside = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    tip = MM * (0.005 if recording.hand is None else recording.hand.radius)
    outline = MM * view.outline
    size = float(np.abs(outline).max())
    back = float((-outline @ ahead).max()) + tip + 0.3 * size
    start = MM * push.contact_offset_m * aside - back * ahead
    end = start + (back + 0.9 * size) * ahead
    corners = np.vstack([outline, start - tip, start + tip, end])
    low, high = corners.min(axis=0) - 0.15 * size, corners.max(axis=0) + 0.15 * size
    figure, axes = map_axes((float(low[0]), float(low[1]), float(high[0]), float(high[1])), 3.3, 3.0)
    axes.add_patch(Polygon(outline, closed=True, facecolor=PAPER, edgecolor=INK, linewidth=1.0))
    axes.plot(0.0, 0.0, "+", color=MUTED, markersize=6)
    axes.add_patch(Circle((float(start[0]), float(start[1])), tip, color=CONTACT))
    arrow = {"arrowstyle": "-|>", "color": CONTACT, "linewidth": 1.4, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", end.tolist(), start.tolist(), arrowprops=arrow)
    return svg_of(figure, "next push", "The most informative next push")
