"""The law of an effect, drawn: friction over slip, its limit curve, a field of forces, the pressure underneath."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from matplotlib.path import Path

from physid_drake.diagnose.values import EffectFinding
from physid_drake.report.numbers import number
from physid_drake.report.svg import AFTER, BEFORE, CONTACT, INK, svg_of
from physid_drake.report.table_view import MM, Array, TableView, box_of, draw_ground, draw_recorded, map_axes

_Law = Callable[[Mapping[str, Any], TableView], "tuple[Figure, str] | None"]
_TICKS = " Marks on the axis: speeds of the object in these pushes."


def law_figure(effect: EffectFinding, k: int, view: TableView) -> tuple[Markup, str] | None:
    """The drawing of an effect's law and what it shows; None for effects that are just a number."""
    values = {name: p.value for name, p in effect.parameters.items()}
    wanted = _LAWS.get(effect.name)
    if wanted is None or not set(wanted[1]) <= set(values):
        return None
    if effect.name == "uneven_support":
        values["ci90"] = effect.parameters["weights"].ci90
    drawn = wanted[0](values, view)
    if drawn is None:
        return None
    return svg_of(drawn[0], f"law {k}", f"Law of {effect.name}"), drawn[1]


def _curve(view: TableView, fastest: float, across: str, up: str) -> tuple[Figure, Axes, Array]:
    """Axes over speed, with a time step at each speed that these pushes had; speeds (n,) [m/s]."""
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


def _stribeck(p: Mapping[str, Any], view: TableView) -> tuple[Figure, str]:
    mu = view.friction or 1.0
    up = "friction with the table" if view.friction else "friction relative to the baseline model"
    figure, axes, speeds = _curve(view, 3.0 * p["speed"], "slip speed [m/s]", up)
    axes.plot(speeds, mu * (1.0 + p["excess"] * np.exp(-((speeds / p["speed"]) ** 2))), color=AFTER, linewidth=1.8)
    axes.axhline(mu, color=BEFORE, linewidth=1.0, linestyle="--")
    axes.set_ylim(0.0, 1.15 * mu * (1.0 + max(0.0, p["excess"])))
    return figure, "Friction over slip speed; dashed: its value at high speed." + _ticks(view)


def _drag(power: int) -> _Law:
    """Drag in proportion to a power of speed."""

    def draw(p: Mapping[str, Any], view: TableView) -> tuple[Figure, str]:
        figure, axes, speeds = _curve(view, 0.1, "speed [m/s]", "drag [N]")
        axes.plot(speeds, p["coefficient"] * speeds**power, color=AFTER, linewidth=1.8)
        axes.set_ylim(bottom=0.0)
        return figure, "Drag over the object's speed." + _ticks(view)

    return draw


def _ellipse(frame: str) -> _Law:
    """The limit curve of friction: an ellipse about that of the baseline model, a circle."""

    def draw(p: Mapping[str, Any], view: TableView) -> tuple[Figure, str]:
        mu = view.friction or 1.0
        turn = np.linspace(0.0, 2.0 * math.pi, 121)
        low, high = mu / math.sqrt(p["ratio"]), mu * math.sqrt(p["ratio"])
        c, s = math.cos(p["angle"]), math.sin(p["angle"])
        x, y = low * np.cos(turn), high * np.sin(turn)
        figure = Figure(figsize=(3.5, 3.0))
        axes = figure.add_axes((0.17, 0.15, 0.79, 0.82))
        axes.plot(mu * np.cos(turn), mu * np.sin(turn), color=BEFORE, linewidth=1.0, linestyle="--")
        axes.plot(c * x - s * y, s * x + c * y, color=AFTER, linewidth=1.8)
        axes.plot([-c * low, c * low], [-s * low, s * low], color=AFTER, linewidth=0.8, linestyle=":")
        reach = 1.1 * max(low, high)
        draw_ground(axes, (-reach, -reach, reach, reach), 0.79 * 3.5 / (0.82 * 3.0))
        axes.set(xlabel=f"along x of the {frame}", ylabel=f"along y of the {frame}")
        return figure, "Friction by the direction of its force; dashed: isotropic; dotted: the low-friction axis."

    return draw


def _patch(p: Mapping[str, Any], view: TableView) -> tuple[Figure, str]:
    box, x, y, r = box_of(view, view.shown), MM * p["x"], MM * p["y"], MM * p["radius"]
    wide = (min(box[0], x - 0.5 * r), min(box[1], y - 0.5 * r), max(box[2], x + 0.5 * r), max(box[3], y + 0.5 * r))
    figure, axes = map_axes(wide, 3.5, 3.5)
    draw_recorded(axes, view, 0.12)
    colour = CONTACT if p["ratio"] > 1.0 else AFTER
    axes.add_patch(Circle((x, y), r, facecolor=colour, alpha=0.18, linewidth=0))
    axes.add_patch(Circle((x, y), r, facecolor="none", edgecolor=colour, linewidth=1.4))
    return figure, f"In the circle, friction is {number(p['ratio'])} times that of the rest of the table."


def _gradient(p: Mapping[str, Any], view: TableView) -> tuple[Figure, str]:
    box = box_of(view, view.shown)
    figure, axes = map_axes(box, 3.5, 3.5)
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    x, y = np.meshgrid(np.linspace(left, right, 9), np.linspace(low, high, 9))
    factor = 1.0 + (p["slope_x"] * x + p["slope_y"] * y) / MM
    if np.ptp(factor) > 0.0:
        axes.contourf(x, y, factor, levels=10, cmap="PuOr_r", alpha=0.5, zorder=0)
    draw_recorded(axes, view, 0.1)
    slope = np.array([p["slope_x"], p["slope_y"]])
    along = slope / max(float(np.hypot(*slope)), 1e-12)
    reach = 0.38 * min(right - left, high - low)
    for step in (-1.0, 0.0, 1.0):
        at = np.array([0.5 * (left + right), 0.5 * (low + high)]) + step * reach * along
        text = f"× {1.0 + float(slope @ at) / MM:.2f}"
        axes.text(at[0], at[1], text, ha="center", va="center", fontweight="bold", zorder=5)
    axes.set(xlim=(left, right), ylim=(low, high))
    return figure, "Friction relative to the table's origin."


def _field(axes: Axes, force: Callable[[Array], Array]) -> bool:
    """Arrows of a force on a grid; ``force`` takes places (n, 2) [m]. False where there is none."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    x, y = (np.linspace(a, b, 8)[:-1] + (b - a) / 14.0 for a, b in ((left, right), (low, high)))
    at = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    forces = force(at / MM)
    largest = float(np.hypot(*forces.T).max())
    if not largest > 0.0 or not math.isfinite(largest):
        return False
    axes.quiver(at[:, 0], at[:, 1], forces[:, 0], forces[:, 1], angles="xy", scale_units="xy",
                scale=largest / ((right - left) / 8.0), width=0.008, color=AFTER, pivot="middle")  # fmt: skip
    return True


def _tilt(p: Mapping[str, Any], view: TableView) -> tuple[Figure, str]:
    figure, axes = map_axes(box_of(view, view.shown), 3.5, 3.5)
    draw_recorded(axes, view, 0.12)
    slope = np.array([math.sin(p["x"]), math.sin(p["y"])])
    _field(axes, lambda at: np.tile(slope, (len(at), 1)))
    steep, towards = math.degrees(math.hypot(p["x"], p["y"])), math.degrees(math.atan2(p["y"], p["x"]))
    return figure, f"Arrows: downhill. Slope {number(steep)}°, towards {number(towards)}° from x."


def _spring(p: Mapping[str, Any], view: TableView) -> tuple[Figure, str]:
    rest = p.get("rest_length", 0.0)

    def force(at: Array) -> Array:
        away = np.array([p["x"], p["y"]]) - at
        distance = np.maximum(np.hypot(*away.T), 1e-9)
        return np.asarray((np.maximum(0.0, distance - rest) / distance)[:, None] * away)

    return _pull(p, view, force, "Force of the spring; the longest arrow is the strongest.")


def _magnet(p: Mapping[str, Any], view: TableView) -> tuple[Figure, str]:
    def force(at: Array) -> Array:
        away = np.array([p["x"], p["y"]]) - at
        square = (away**2).sum(axis=1)
        return np.asarray((1.0 / (square + p["core"] ** 2) / np.sqrt(np.maximum(square, 1e-12)))[:, None] * away)

    return _pull(p, view, force, "Force towards the point; the longest arrow is the strongest.")


def _pull(p: Mapping[str, Any], view: TableView, force: Callable[[Array], Array], caption: str) -> tuple[Figure, str]:
    """A pull towards a point, which is shown where it is not far off."""
    box, x, y = box_of(view, view.shown), MM * p["x"], MM * p["y"]
    reach = max(box[2] - box[0], box[3] - box[1])
    near = box[0] - reach < x < box[2] + reach and box[1] - reach < y < box[3] + reach
    pad = 0.06 * reach
    if near:
        box = (min(box[0], x - pad), min(box[1], y - pad), max(box[2], x + pad), max(box[3], y + pad))
    figure, axes = map_axes(box, 3.5, 3.5)
    draw_recorded(axes, view, 0.12)
    _field(axes, force)
    if near:
        axes.plot(x, y, "o", color=CONTACT, markersize=6, zorder=4)
        return figure, caption + " Dot: anchor."
    return figure, caption + f" Its anchor is outside the view, at ({number(p['x'])}, {number(p['y'])}) m."


def _support(p: Mapping[str, Any], view: TableView) -> tuple[Figure, str] | None:
    """The grid of weights under the object: rows along x of B, columns along y."""
    weights = np.asarray(p["weights"], dtype=np.float64)
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
    ends = np.asarray(p["ci90"], dtype=np.float64)
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


_LAWS: dict[str, tuple[_Law, tuple[str, ...]]] = {
    "stribeck_friction": (_stribeck, ("excess", "speed")),
    "viscous_drag": (_drag(1), ("coefficient",)),
    "quadratic_drag": (_drag(2), ("coefficient",)),
    "anisotropic_table": (_ellipse("table"), ("ratio", "angle")),
    "anisotropic_object": (_ellipse("object"), ("ratio", "angle")),
    "friction_patch": (_patch, ("ratio", "x", "y", "radius")),
    "friction_gradient": (_gradient, ("slope_x", "slope_y")),
    "table_tilt": (_tilt, ("x", "y")),
    "tether": (_spring, ("stiffness", "x", "y")),
    "magnet": (_magnet, ("strength", "x", "y", "core")),
    "uneven_support": (_support, ("weights",)),
}
