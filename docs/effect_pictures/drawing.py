"""What the panels are drawn with: their places, colours, lines and words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon

from physid_drake.effects import Effect
from physid_drake.report.svg import INK
from physid_drake.report.table_view import MM, draw_ground

from .scenes import Array

PLAIN, WITH = "#8a9099", "#1d4fb8"
DASHED = (0, (4, 2.2))
WIDTH, HEIGHT = 7.0, 2.8  # inches
LEFT, RIGHT = (0.1, 0.165, 0.375, 0.665), (0.59, 0.165, 0.39, 0.665)  # of the figure
ASPECT = RIGHT[2] * WIDTH / (RIGHT[3] * HEIGHT)
LEFT_ASPECT = LEFT[2] * WIDTH / (LEFT[3] * HEIGHT)


def curve(axes: Axes, x: Array | Sequence[float], y: Array | Sequence[float], *, plain: bool = False) -> None:
    """A line of one of the two kinds."""
    style = {"color": PLAIN, "linestyle": DASHED} if plain else {"color": WITH}
    axes.plot(x, y, linewidth=1.6, zorder=3 if plain else 4, gid=curve_id(axes, plain), **style)


def curve_id(axes: Axes, plain: bool) -> str:
    """What a curve is called in the file."""
    return f"{axes.get_label()}-{'plain' if plain else 'with'}-{len(axes.lines)}"


def put_label(
    axes: Axes, x: float, y: float, text: str, *, color: str = INK, ha: str = "left", va: str = "center"
) -> None:
    """Words at a place of the panel."""
    axes.text(x, y, text, fontsize=7.5, color=color, ha=ha, va=va, zorder=6)


def draw_landmarks(axes: Axes, effect: Effect) -> list[Array]:
    """What an effect has at a place of the table, drawn; points about it [mm]."""
    if effect.name not in ("friction_patch", "tether", "magnet"):
        return []
    at = MM * np.array([effect.x, effect.y])  # type: ignore[attr-defined]
    if effect.name == "magnet":
        axes.plot(*at, "o", color=INK, markersize=4, zorder=6)
        return [at[None, :]]
    radius = MM * (effect.radius if effect.name == "friction_patch" else effect.rest_length)  # type: ignore[attr-defined]
    if effect.name == "friction_patch":
        axes.add_patch(Circle(tuple(at), radius, facecolor="#b9c9ea", zorder=0.5, linewidth=0))
    else:
        axes.plot(*at, "o", color=INK, markersize=4, zorder=6)
        axes.add_patch(
            Circle(tuple(at), radius, facecolor="none", edgecolor=INK, linewidth=0.8, linestyle="-.", zorder=5)
        )
    return [np.array([at - radius, at + radius])]


def object_axes(axes: Axes, box: tuple[float, float, float, float]) -> None:
    """Axes in the frame of the object; ``box`` is x and y from, x and y to [mm]."""
    draw_ground(axes, box, LEFT_ASPECT)
    axes.set(xlabel="x of the object [mm]", ylabel="y of the object [mm]")


def draw_outline(axes: Axes, corners: Array, *, plain: bool) -> None:
    """An outline (n, 2) [mm] as one of the two kinds of lines."""
    style = {"edgecolor": PLAIN, "linestyle": DASHED} if plain else {"edgecolor": WITH}
    axes.add_patch(Polygon(corners, closed=True, facecolor="none", linewidth=1.6, **style))


def draw_model(axes: Axes, corners: Array) -> None:
    """The outline of the model's object, filled."""
    axes.add_patch(Polygon(corners, closed=True, facecolor="#f6f7f9", edgecolor=INK, linewidth=1.0))
