"""Left panels of effects of the object itself: its size, its mass and how it stands."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from physid_drake.cell.solid import solid_of
from physid_drake.effects.rollout import geometry_with
from physid_drake.report.svg import INK, MUTED
from physid_drake.report.table_view import MM

from .drawing import PLAIN, WITH, curve, curve_id, draw_model, draw_outline, object_axes, put_label
from .laws import facts
from .picture import Picture
from .scenes import BODY, BOX, outline_of


def grid_of_weights(axes: Axes, picture: Picture) -> None:
    """The weights under the object."""
    grid = picture.effect.pressure()
    assert grid is not None
    weights, corners = np.array(grid.weights), MM * outline_of(BOX)
    low, high = corners.min(axis=0), corners.max(axis=0)
    xs, ys = (np.linspace(a, b, n + 1) for a, b, n in zip(low, high, weights.shape, strict=True))
    for i, j in np.ndindex(*weights.shape):
        cell = [(xs[i], ys[j]), (xs[i + 1], ys[j]), (xs[i + 1], ys[j + 1]), (xs[i], ys[j + 1])]
        share = weights[i, j] / weights.max()
        axes.add_patch(
            Polygon(cell, closed=True, facecolor=WITH, alpha=0.08 + 0.5 * share, edgecolor="white", linewidth=1.0)
        )
        middle = 0.5 * (xs[i] + xs[i + 1]), 0.5 * (ys[j] + ys[j + 1])
        axes.text(*middle, f"{weights[i, j]:g}", ha="center", va="center", fontsize=8.5, color=INK)
    axes.add_patch(Polygon(corners, closed=True, facecolor="none", edgecolor=INK, linewidth=1.0))
    object_axes(axes, (*(low - 8.0), *(high + 8.0)))


def centre_of_mass(axes: Axes, picture: Picture) -> None:
    """The outline with the two centres."""
    corners = MM * outline_of(BOX)
    draw_model(axes, corners)
    x, y = (MM * picture.effect.body(BODY, facts()).p_BBcm).tolist()
    axes.plot(0.0, 0.0, "+", color=PLAIN, markersize=10, markeredgewidth=2.0)
    axes.plot(x, y, "o", color=WITH, markersize=6, gid=curve_id(axes, False))
    put_label(axes, 0.0, -9.0, "centre of the shape", color=MUTED, ha="center")
    put_label(axes, x, y + 9.0, "centre of mass", color=WITH, ha="center")
    object_axes(axes, (-64.0, -46.0, 64.0, 46.0))


def radii_of_gyration(axes: Axes, picture: Picture) -> None:
    """Circles in which the mass might sit for the same moment of inertia."""
    corners = MM * outline_of(BOX)
    draw_model(axes, corners)
    turn = np.linspace(0.0, 2.0 * math.pi, 73)
    for body, plain in ((BODY, True), (picture.effect.body(BODY, facts()), False)):
        radius = MM * math.sqrt(body.inertia_ratio * solid_of(BOX.shape).gyration[2])
        curve(axes, radius * np.cos(turn), radius * np.sin(turn), plain=plain)
        put_label(axes, 0.0, radius - 8.0, f"{radius:.0f} mm", color=MUTED if plain else WITH, ha="center")
    object_axes(axes, (-80.0, -60.0, 80.0, 60.0))


def two_sizes(axes: Axes, picture: Picture) -> None:
    """The outline of the model, and of the object."""
    for geometry, plain in ((BOX, True), (geometry_with((picture.effect,), BOX), False)):
        draw_outline(axes, MM * outline_of(geometry), plain=plain)
    put_label(axes, 0.0, 34.0, "model", color=MUTED, ha="center")
    put_label(axes, 0.0, 49.5, "object", color=WITH, ha="center")
    object_axes(axes, (-66.0, -54.0, 66.0, 54.0))
