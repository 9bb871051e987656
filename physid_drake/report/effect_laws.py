"""The law of an effect, drawn: friction over slip, its limit curve, a field of forces, the pressure underneath.

What is drawn are values of the effect's own laws (`physid_drake.effects.law_values`).
"""

from __future__ import annotations

import cmath
import dataclasses as dc
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from matplotlib.path import Path

from physid_drake.cell.object_state import Complex
from physid_drake.diagnose.values import EffectFinding
from physid_drake.effects import Effect, PushFacts, effect_named
from physid_drake.effects.law_values import force_on, friction_factors, object_at
from physid_drake.report.numbers import number
from physid_drake.report.svg import AFTER, BEFORE, CONTACT, INK, svg_of
from physid_drake.report.table_view import MM, Array, TableView, box_of, draw_ground, draw_recorded, map_axes

_Law = Callable[[Any, TableView], "tuple[Figure, str]"]
_TICKS = " Marks on the axis: speeds of the object in these pushes."
_FACTS = PushFacts(order=0, mass=1.0, polar=0.0)  # that no law drawn here depends on: of tilt, only the direction is
_DIRECTIONS = np.exp(1j * np.linspace(0.0, 2.0 * math.pi, 361))


def law_figure(effect: EffectFinding, k: int, view: TableView) -> tuple[Markup, str] | None:
    """The drawing of an effect's law and what it shows; None for effects that are just a number."""
    wanted = _LAWS.get(effect.name)
    if effect.name == "uneven_support":
        drawn = _support(effect, view)
    elif wanted is None:
        return None
    else:
        values = {name: p.value for name, p in effect.parameters.items()}
        drawn = wanted(effect_named(effect.name)(**values), view)
    return None if drawn is None else (svg_of(drawn[0], f"law {k}", f"Law of {effect.name}"), drawn[1])


def _factors(effect: Effect, slips: Complex) -> Complex:
    """Friction (n,) over that of the baseline model at slips (n,), x + iy [m/s]."""
    return np.concatenate([friction_factors(object_at(velocity=v), effect, _FACTS) for v in slips.tolist()])


def _curve(view: TableView, fastest: float, across: str, up: str) -> tuple[Figure, Axes, Array]:
    """Axes over speed, with a mark at each speed that these pushes had; speeds (n,) [m/s]."""
    seen = [w.speed for w in view.wrenches if math.isfinite(w.speed)]
    top = 1.05 * max([fastest, *seen])
    figure = Figure(figsize=(3.5, 2.4))
    axes = figure.add_axes((0.17, 0.19, 0.79, 0.76))
    axes.set(xlabel=across, ylabel=up, xlim=(0.0, top))
    axes.grid()
    axes.plot(seen, np.full(len(seen), 0.015), "|", color=CONTACT, alpha=0.6, markersize=6,
              transform=axes.get_xaxis_transform())  # fmt: skip
    return figure, axes, np.linspace(0.0, top, 90)


def _ticks(view: TableView) -> str:
    return _TICKS if view.wrenches else ""


def _stribeck(effect: Any, view: TableView) -> tuple[Figure, str]:
    mu = view.friction or 1.0
    up = "friction with the table" if view.friction else "friction relative to the baseline model"
    figure, axes, speeds = _curve(view, 3.0 * effect.speed, "slip speed [m/s]", up)
    friction = mu * _factors(effect, speeds.astype(np.complex128)).real
    axes.plot(speeds, friction, color=AFTER, linewidth=1.8)
    axes.axhline(mu, color=BEFORE, linewidth=1.0, linestyle="--")
    axes.set_ylim(0.0, 1.15 * max(mu, float(friction.max())))
    return figure, "Friction over slip speed; dashed: its value at high speed." + _ticks(view)


def _drag(effect: Any, view: TableView) -> tuple[Figure, str]:
    figure, axes, speeds = _curve(view, 0.1, "speed [m/s]", "drag [N]")
    drag = [-force_on(object_at(velocity=complex(v)), effect, _FACTS).real for v in speeds.tolist()]
    axes.plot(speeds, drag, color=AFTER, linewidth=1.8)
    axes.set_ylim(bottom=0.0)
    return figure, "Drag over the object's speed." + _ticks(view)


def _ellipse(frame: str) -> _Law:
    """The limit curve of friction: an ellipse about that of the baseline model, a circle."""

    def draw(effect: Any, view: TableView) -> tuple[Figure, str]:
        mu = view.friction or 1.0
        forces = mu * _factors(effect, _DIRECTIONS) * _DIRECTIONS
        along = cmath.exp(1j * effect.angle)
        least = mu * abs(_factors(effect, np.array([along]))[0])
        figure = Figure(figsize=(3.5, 3.0))
        axes = figure.add_axes((0.17, 0.15, 0.79, 0.82))
        axes.plot(mu * _DIRECTIONS.real, mu * _DIRECTIONS.imag, color=BEFORE, linewidth=1.0, linestyle="--")
        axes.plot(forces.real, forces.imag, color=AFTER, linewidth=1.8)
        ends = least * np.array([-along, along])
        axes.plot(ends.real, ends.imag, color=AFTER, linewidth=0.8, linestyle=":")
        reach = 1.1 * max(mu, float(np.abs(forces).max()))
        draw_ground(axes, (-reach, -reach, reach, reach), 0.79 * 3.5 / (0.82 * 3.0))
        axes.set(xlabel=f"along x of the {frame}", ylabel=f"along y of the {frame}")
        return figure, "Friction by the direction of its force; dashed: isotropic; dotted: the low-friction axis."

    return draw


def _patch(effect: Any, view: TableView) -> tuple[Figure, str]:
    box, x, y, r = box_of(view, view.shown), MM * effect.x, MM * effect.y, MM * effect.radius
    wide = (min(box[0], x - 0.5 * r), min(box[1], y - 0.5 * r), max(box[2], x + 0.5 * r), max(box[3], y + 0.5 * r))
    figure, axes = map_axes(wide, 3.5, 3.5)
    draw_recorded(axes, view, 0.12)
    colour = CONTACT if effect.ratio > 1.0 else AFTER
    axes.add_patch(Circle((x, y), r, facecolor=colour, alpha=0.18, linewidth=0))
    axes.add_patch(Circle((x, y), r, facecolor="none", edgecolor=colour, linewidth=1.4))
    return figure, f"In the circle, friction is {number(effect.ratio)} times that of the rest of the table."


def _gradient(effect: Any, view: TableView) -> tuple[Figure, str]:
    box = box_of(view, view.shown)
    figure, axes = map_axes(box, 3.5, 3.5)
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    x, y = np.meshgrid(np.linspace(left, right, 9), np.linspace(low, high, 9))
    facts = dc.replace(_FACTS, region=np.array([[left, low], [right, high]]) / MM)  # within which the law is said

    def factors(places: Complex) -> Array:
        return friction_factors(object_at(points=places / MM), effect, facts).real

    factor = factors((x + 1j * y).ravel()).reshape(x.shape)
    if np.ptp(factor) > 0.0:
        axes.contourf(x, y, factor, levels=10, cmap="PuOr_r", alpha=0.5, zorder=0)
    draw_recorded(axes, view, 0.1)
    slope = complex(effect.slope_x, effect.slope_y)
    middle, along = complex(left + right, low + high) / 2.0, slope / max(abs(slope), 1e-12)
    labelled = middle + 0.38 * min(right - left, high - low) * along * np.array([-1.0, 0.0, 1.0])
    for at, value in zip(labelled.tolist(), factors(labelled).tolist(), strict=True):
        axes.text(at.real, at.imag, f"× {value:.2f}", ha="center", va="center", fontweight="bold", zorder=5)
    axes.set(xlim=(left, right), ylim=(low, high))
    return figure, "Friction relative to the table's origin."


def _field(axes: Axes, effect: Effect) -> None:
    """Arrows of an effect's force at places of a grid, the strongest as long as the grid is wide."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    x, y = (np.linspace(a, b, 8)[:-1] + (b - a) / 14.0 for a, b in ((left, right), (low, high)))
    at = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    forces = np.array([force_on(object_at(place=complex(*p)), effect, _FACTS) for p in (at / MM).tolist()])
    largest = float(np.abs(forces).max())
    if largest > 0.0 and math.isfinite(largest):
        axes.quiver(
            at[:, 0], at[:, 1], forces.real, forces.imag, angles="xy", scale_units="xy",
            scale=largest / ((right - left) / 8.0), width=0.008, color=AFTER, pivot="middle",
        )  # fmt: skip


def _tilt(effect: Any, view: TableView) -> tuple[Figure, str]:
    figure, axes = map_axes(box_of(view, view.shown), 3.5, 3.5)
    draw_recorded(axes, view, 0.12)
    _field(axes, effect)
    steep, towards = math.degrees(math.hypot(effect.x, effect.y)), math.degrees(math.atan2(effect.y, effect.x))
    return figure, f"Arrows: downhill. Slope {number(steep)}°, towards {number(towards)}° from x."


def _pull(caption: str) -> _Law:
    """A pull towards a point, which is shown where it is not far off."""

    def draw(effect: Any, view: TableView) -> tuple[Figure, str]:
        box, x, y = box_of(view, view.shown), MM * effect.x, MM * effect.y
        reach = max(box[2] - box[0], box[3] - box[1])
        near = box[0] - reach < x < box[2] + reach and box[1] - reach < y < box[3] + reach
        pad = 0.06 * reach
        if near:
            box = (min(box[0], x - pad), min(box[1], y - pad), max(box[2], x + pad), max(box[3], y + pad))
        figure, axes = map_axes(box, 3.5, 3.5)
        draw_recorded(axes, view, 0.12)
        _field(axes, effect)
        if near:
            axes.plot(x, y, "o", color=CONTACT, markersize=6, zorder=4)
            return figure, caption + " Dot: anchor."
        return figure, caption + f" Its anchor is outside the view, at ({number(effect.x)}, {number(effect.y)}) m."

    return draw


def _support(finding: EffectFinding, view: TableView) -> tuple[Figure, str] | None:
    """The grid of weights under the object: rows along x of B, columns along y."""
    weights = np.asarray(finding.parameters["weights"].value, dtype=np.float64)
    if weights.ndim != 2 or weights.size < 2:
        return None
    outline = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    if view.outline is not None:
        outline = MM * view.outline
    low, high = outline.min(axis=0), outline.max(axis=0)
    x, y = (np.linspace(a, b, n + 1) for a, b, n in zip(low, high, weights.shape, strict=True))
    pad = 0.08 * (high - low)
    figure, axes = map_axes((*(low - pad), *(high + pad)), 3.8, 3.6)
    axes.grid(visible=False)
    middles = _middles(outline, x, y)
    ends = np.asarray(finding.parameters["weights"].ci90, dtype=np.float64)
    # Over the mean of what lies under the object: pushes say nothing of the other cells.
    under = float(weights[np.isfinite(middles[..., 0])].mean())
    weights, ends = weights / under, ends / under
    shown = np.ma.masked_where(np.isnan(middles[..., 0]), weights)
    mesh = axes.pcolormesh(x, y, shown.T, cmap="Blues", vmin=0.0, vmax=1.35 * float(shown.max()), edgecolors="white")
    mesh.set_clip_path(axes.add_patch(Polygon(outline, closed=True, facecolor="none", edgecolor=INK, linewidth=1.0)))
    for i, j in np.argwhere(np.isfinite(middles[..., 0])):
        at = (middles[i, j, 0], middles[i, j, 1])
        dark = "white" if weights[i, j] > 0.8 * shown.max() else INK
        axes.annotate(
            f"{weights[i, j]:.2f}", at, (0, 1), textcoords="offset points", ha="center", fontsize=9, color=dark
        )
        if ends.shape == (2, *weights.shape):
            text = f"{ends[0, i, j]:.2f} to {ends[1, i, j]:.2f}"
            axes.annotate(text, at, (0, -9), textcoords="offset points", ha="center", fontsize=6.5, color=dark)
    axes.set(xlabel="x of the object [mm]", ylabel="y of the object [mm]")
    caption = "Stiffness of the support under each part of the object, relative to the mean, with 90 % intervals."
    return figure, caption + " The pressure is this, tilted until it balances the weight."


def _middles(outline: Array, x: Array, y: Array) -> Array:
    """Middle (n, m, 2) of what each cell covers of the object, edges at x (n + 1,), y (m + 1,); NaN of nothing."""
    inside = Path(outline)
    parts = (np.arange(9) + 0.5) / 9.0
    middles = np.full((len(x) - 1, len(y) - 1, 2), np.nan)
    for i, j in np.ndindex(len(x) - 1, len(y) - 1):
        axes = np.meshgrid(x[i] + parts * (x[i + 1] - x[i]), y[j] + parts * (y[j + 1] - y[j]))
        places = np.column_stack([axis.ravel() for axis in axes])
        covered = places[inside.contains_points(places)]
        if len(covered):
            middles[i, j] = covered.mean(axis=0)
    return middles


_LAWS: dict[str, _Law] = {
    "stribeck_friction": _stribeck,
    "viscous_drag": _drag,
    "quadratic_drag": _drag,
    "anisotropic_table": _ellipse("table"),
    "anisotropic_object": _ellipse("object"),
    "friction_patch": _patch,
    "friction_gradient": _gradient,
    "table_tilt": _tilt,
    "tether": _pull("Force of the spring; the longest arrow is the strongest."),
    "magnet": _pull("Force towards the point; the longest arrow is the strongest."),
}
