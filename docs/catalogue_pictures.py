"""The pictures of docs/effects.md: each effect's law, and what it does to pushes.

    python docs/catalogue_pictures.py [--out docs/images/effects] [NAME ...]

Laws are those of the package, evaluated; pushes are rolled out by the twin, those of a lying cylinder by the cell.
"""

from __future__ import annotations

import argparse
import dataclasses as dc
import io
import math
import re
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray

from physid_drake.cell import Body, Cell, CellConfig, HandPath, Start
from physid_drake.cell.diagram import GRAVITY
from physid_drake.cell.forces import ForceLaw, FrictionLaw
from physid_drake.cell.impact import routh_impulse
from physid_drake.cell.object_state import ObjectState, Underside
from physid_drake.cell.outline import Polygon as CornersOutline
from physid_drake.cell.solid import solid_of
from physid_drake.effects import SHIPPED, Effect, PushFacts, effect_named
from physid_drake.effects.rollout import Geometry, Rollout, geometry_with, roll, tracked
from physid_drake.recording import Box, Cylinder
from physid_drake.report.svg import INK, MUTED, drawn
from physid_drake.report.table_view import draw_ground, placed
from physid_drake.twin.twin import Twin
from physid_drake.twin.with_effects import as_reported, push_with

Array = NDArray[np.float64]

PLAIN, WITH = "#8a9099", "#1d4fb8"
DASHED = (0, (4, 2.2))
MM = 1e3
WIDTH, HEIGHT = 7.0, 2.8  # inches
LEFT, RIGHT = (0.1, 0.165, 0.375, 0.665), (0.59, 0.165, 0.39, 0.665)  # of the figure
ASPECT = RIGHT[2] * WIDTH / (RIGHT[3] * HEIGHT)
LEFT_ASPECT = LEFT[2] * WIDTH / (LEFT[3] * HEIGHT)

MASS, FRICTION, HAND_FRICTION, TIP = 0.4, 0.25, 0.3, 0.01
WEIGHT = MASS * GRAVITY
BOX = Geometry(shape=Box(size=(0.10, 0.08, 0.06)))
LYING = Geometry(shape=Cylinder(radius=0.033, length=0.10, axis="y"))
BODY = Body(
    mass=MASS, p_BBcm=np.zeros(2), inertia_ratio=1.0, hand_friction=HAND_FRICTION,
    support_friction=np.array([FRICTION]),
)  # fmt: skip
RAMP, BRAKE, GAP = 0.05, 0.04, 0.004  # s, s, m
DISC = 0.005  # m: of what one support point stands for, about that of a box on 100 points
EVERYWHERE = np.array([[-0.3, -0.3], [0.3, 0.3]])


# ------------------------------------------------------------------------------------------------------------ pushes


def push(
    heading: float, speed: float, length: float, *, at: tuple[float, float] = (0.0, 0.0), yaw: float = 0.0,
    aside: float = 0.0, gap: float = GAP, end: float = 1.0, order: int = 0, shape: Geometry = BOX,
) -> Rollout:  # fmt: skip
    """A straight push that ends with a brake, so that a fast one lets the object go.

    Args:
        heading: of the tip [deg].
        speed: of the tip [m/s].
        length: of its way [m].
        at: where the object is [m].
        yaw: of the object [deg].
        aside: of the tip's line from the object's middle, to the left [m].
        gap: between tip and object at the start [m].
        end: of the rollout [s].
        order: number of the push.
        shape: of the object.
    """
    along = np.array([math.cos(math.radians(heading)), math.sin(math.radians(heading))])
    left = np.array([-along[1], along[0]])
    pose = (*at, math.radians(yaw))
    back = -float(((placed(outline_of(shape), np.array(pose)) / MM - at) @ along).min()) + TIP + gap
    keep = length / speed - 0.5 * (RAMP + BRAKE)
    times = np.cumsum([0.0, RAMP, keep, BRAKE])
    path = HandPath(
        times=times, velocities=np.outer([0.0, speed, speed, 0.0], along),
        start=np.array(at) - back * along + aside * left,
    )  # fmt: skip
    return Rollout(start=Start(pose=pose), path=path, begin=0.0, end=end, hand_height=0.03, order=order)


def outline_of(geometry: Geometry) -> Array:
    """The object's outline (n, 2) in B [m]; of a lying cylinder, what is seen from above."""
    if isinstance(geometry.shape, Cylinder):
        x, y = geometry.shape.radius, 0.5 * geometry.shape.length
        return np.array([[-x, -y], [x, -y], [x, y], [-x, y]])
    outline = solid_of(geometry.shape).outline
    assert isinstance(outline, CornersOutline)
    return np.array(outline.vertices)


@cache
def cell_of(geometry: Geometry) -> Cell:
    """The cell that rolls."""
    return Cell(
        geometry.shape, hand_radius=TIP, config=CellConfig(), pressure=geometry.pressure, gravity=geometry.gravity
    )


def twin_of(geometry: Geometry) -> Twin:
    """The twin that slides."""
    return Twin(
        solid=solid_of(geometry.shape), hand_radius=TIP, pressure=geometry.pressure, gravity=geometry.gravity,
        points=200,
    )  # fmt: skip


def reports(pushes: Sequence[Rollout], times: Array, *effects: Effect, rolls: bool = False) -> list[Array]:
    """What the tracker reports (n, 3) of each push at times (n,)."""
    if rolls:
        return [tracked(roll(cell_of, LYING, BODY, one, effects), times, effects) for one in pushes]
    twin = twin_of(geometry_with(effects, BOX))
    asked = [push_with(twin, BOX, BODY, one, effects, times) for one in pushes]
    return [as_reported(trace, effects).poses for trace in twin.rollouts([one for one in asked if one is not None])]


# -------------------------------------------------------------------------------------------------------------- laws


def facts(order: int = 0, rolling_radius: float | None = None) -> PushFacts:
    """What effects know of a push of the box."""
    return PushFacts(
        order=order, mass=MASS, polar=twin_of(BOX).polar, rolling_radius=rolling_radius, region=EVERYWHERE
    )


def state(
    velocity: complex = 0j, *, place: complex = 0j, points: Sequence[complex] = (0j,), time: float = 0.0,
    span: float = 1e-4,
) -> ObjectState:  # fmt: skip
    """The object as a law sees it, on some support points."""
    count = len(points)
    underside = Underside(
        points=np.array(points, dtype=np.complex128), weights=np.full(count, 1.0 / count),
        friction=np.full(count, FRICTION), radii=np.full(count, DISC),
    )  # fmt: skip
    return ObjectState(
        time=time, span=span, p_WBo=place, v_WBo=velocity, p_BoBcm_W=0j, yaw=0.0, yaw_rate=0.0, mass=MASS,
        weight=WEIGHT, half_height=0.03, inertia=1e-3, underside=underside, lean=(0.0, 0.0, 0.0), stiffness=1e6,
        rolling_mass=1.5 * MASS,
    )  # fmt: skip


def force_of(law: ForceLaw, at: ObjectState) -> complex:
    """A law's force, x + iy [N]."""
    wrench = law.wrench(at)
    return complex(wrench.fx, wrench.fy)


def factor_at(law: FrictionLaw, velocity: complex) -> complex:
    """A law's friction over the cell's where one point slips."""
    return complex(law.ratio(state(velocity))[0])


# ---------------------------------------------------------------------------------------------------------- pictures


@dc.dataclass(frozen=True, kw_only=True)
class Picture:
    """What is drawn of an effect.

    Attributes:
        effect: with the values that the picture is of.
        law: draws the left panel.
        law_title: of that.
        pushes: of the right panel.
        pushes_title: of that.
        shown: draws the right panel.
        end: of the time that is shown [s].
        rolls: whether the object is a lying cylinder.
        hand: whether the right panel has the tip.
    """

    effect: Effect
    law: Callable[[Axes, Picture], None]
    law_title: str
    pushes: tuple[Rollout, ...]
    pushes_title: str
    shown: Callable[[Axes, Picture, Array, list[Array], list[Array]], None]
    end: float = 0.8
    rolls: bool = False
    hand: bool = True

    @property
    def values(self) -> str:
        """The parameters with their units, as the page says them."""
        return said(self.effect)


def said(effect: Effect) -> str:
    """Parameters and units of an effect."""
    parts = []
    for name, unit in effect.units().items():
        value = getattr(effect, name)
        number = "as drawn" if isinstance(value, tuple) else f"{value:.3g}"
        parts.append(f"{name} {number}" + ("" if unit == "-" else f" {unit}"))
    return ", ".join(parts)


def draw(picture: Picture) -> Figure:
    """The two panels."""
    figure = Figure(figsize=(WIDTH, HEIGHT), facecolor="white")
    left, right = figure.add_axes(LEFT, label="law"), figure.add_axes(RIGHT, label="pushes")
    times = np.linspace(0.0, picture.end, 101)
    plain = reports(picture.pushes, times, rolls=picture.rolls)
    others = reports(picture.pushes, times, picture.effect, rolls=picture.rolls)
    picture.law(left, picture)
    picture.shown(right, picture, times, plain, others)
    for box, title in ((LEFT, picture.law_title), (RIGHT, picture.pushes_title)):
        figure.text(box[0], 0.935, title, fontsize=8.5, fontweight="bold", color=INK)
    figure.text(LEFT[0], 0.86, picture.values, fontsize=8.0, color=INK)
    _legend(figure, picture.hand)
    return figure


def _legend(figure: Figure, hand: bool) -> None:
    """Placed by hand: what a legend's size depends on differs between machines."""
    keys = [
        ("baseline model", 0.13, {"color": PLAIN, "linestyle": "--"}),
        ("with the effect", 0.124, {"color": WITH}),
    ]
    if hand:
        keys.append(("tip", 0.05, {"color": INK, "linestyle": ":"}))
    x = RIGHT[0]
    for text, wide, style in keys:
        figure.add_artist(Line2D([x, x + 0.03], [0.873, 0.873], linewidth=1.6, **style))
        figure.text(x + 0.036, 0.86, text, fontsize=7.5, color=INK)
        x += 0.036 + wide


def _curve(axes: Axes, x: Array | Sequence[float], y: Array | Sequence[float], *, plain: bool = False) -> None:
    """A line of one of the two kinds."""
    style = {"color": PLAIN, "linestyle": DASHED} if plain else {"color": WITH}
    axes.plot(x, y, linewidth=1.6, zorder=3 if plain else 4, gid=_mark(axes, plain), **style)


def _mark(axes: Axes, plain: bool) -> str:
    """What a curve is called in the file."""
    return f"{axes.get_label()}-{'plain' if plain else 'with'}-{len(axes.lines)}"


def _label(
    axes: Axes, x: float, y: float, text: str, *, color: str = INK, ha: str = "left", va: str = "center"
) -> None:
    axes.text(x, y, text, fontsize=7.5, color=color, ha=ha, va=va, zorder=6)


def _path(tip: HandPath, times: Array) -> Array:
    return MM * tip.positions(times)


def above(axes: Axes, picture: Picture, times: Array, plain: list[Array], others: list[Array]) -> None:
    """Seen from above: start, way of the tracked point, and the object at the end."""
    own = outline_of(geometry_with((picture.effect,), BOX))
    spots = _landmarks(axes, picture.effect)
    for one, before, after in zip(picture.pushes, plain, others, strict=True):
        start = placed(outline_of(BOX), before[0])
        ends = placed(outline_of(BOX), before[-1]), placed(own, after[-1])
        axes.add_patch(Polygon(start, closed=True, facecolor="#eef0f3", edgecolor="#c3c9d4", linewidth=0.6))
        axes.add_patch(
            Polygon(
                ends[0],
                closed=True,
                facecolor="none",
                edgecolor=PLAIN,
                linewidth=1.2,
                linestyle=DASHED,
                zorder=3,
            )
        )
        axes.add_patch(Polygon(ends[1], closed=True, facecolor="none", edgecolor=WITH, linewidth=1.4, zorder=4))
        _curve(axes, MM * before[:, 0], MM * before[:, 1], plain=True)
        _curve(axes, MM * after[:, 0], MM * after[:, 1])
        spots += [start, *ends]
        if one.path is not None:
            tip = _path(one.path, times[::4])
            axes.plot(tip[:, 0], tip[:, 1], ":", color=INK, linewidth=1.2, zorder=5)
            axes.add_patch(Circle(tuple(tip[0]), MM * TIP, facecolor="none", edgecolor=INK, linewidth=0.8, zorder=5))
            spots.append(np.vstack([tip - MM * TIP, tip + MM * TIP]))
    low, high = np.vstack(spots).min(axis=0), np.vstack(spots).max(axis=0)
    pad = 0.04 * float((high - low).max())
    draw_ground(axes, (low[0] - pad, low[1] - pad, high[0] + pad, high[1] + pad), ASPECT)


def _landmarks(axes: Axes, effect: Effect) -> list[Array]:
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


def over_time(
    value: Callable[[Array], Array], label: str, names: Sequence[str] = (), *, hand: bool = True,
) -> Callable[[Axes, Picture, Array, list[Array], list[Array]], None]:  # fmt: skip
    """A number of each pose over time; ``hand`` adds that of the tip."""

    def shown(axes: Axes, picture: Picture, times: Array, plain: list[Array], others: list[Array]) -> None:
        for k, (one, before, after) in enumerate(zip(picture.pushes, plain, others, strict=True)):
            if hand and one.path is not None:
                tip = np.column_stack([one.path.positions(times), np.zeros(len(times))])
                axes.plot(times, value(tip), ":", color=INK, linewidth=1.2, zorder=2)
            _curve(axes, times, value(before), plain=True)
            _curve(axes, times, value(after))
            if names:
                _label(axes, 1.02 * times[-1], value(after)[-1], names[k])
        axes.set(xlabel="time [s]", ylabel=label, xlim=(0.0, times[-1] * (1.24 if names else 1.0)))
        axes.grid()

    return shown


def along_x(poses: Array) -> Array:
    """Place along x [mm]."""
    return np.asarray(MM * poses[:, 0])


def heading(poses: Array) -> Array:
    """Yaw [deg]."""
    return np.asarray(np.degrees(poses[:, 2]))


# ------------------------------------------------------------------------------------------------------- left panels


def _friction_law(effect: Effect) -> FrictionLaw:
    return effect.frictions(facts())[0]


def _force_law(effect: Effect, rolling_radius: float | None = None) -> ForceLaw:
    return effect.laws(facts(rolling_radius=rolling_radius))[0]


def friction_over_slip(axes: Axes, picture: Picture) -> None:
    """Stribeck's curve."""
    law, slips = _friction_law(picture.effect), np.linspace(0.0, 0.5, 101)
    _curve(axes, slips, [FRICTION] * len(slips), plain=True)
    _curve(axes, slips, [FRICTION * factor_at(law, complex(v)).real for v in slips])
    axes.set(xlabel="slip [m/s]", ylabel="friction coefficient [-]", xlim=(0.0, 0.5), ylim=(0.0, 0.45))
    axes.grid()


def drag_over_speed(axes: Axes, picture: Picture) -> None:
    """A drag, beside what dry friction takes."""
    law, speeds = _force_law(picture.effect), np.linspace(0.0, 0.6, 61)
    _curve(axes, speeds, np.zeros(len(speeds)), plain=True)
    _curve(axes, speeds, [-force_of(law, state(complex(v))).real for v in speeds])
    axes.axhline(FRICTION * WEIGHT, color=INK, linewidth=0.8, linestyle="-.")
    _label(axes, 0.01, FRICTION * WEIGHT + 0.05, "friction with the table")
    axes.set(xlabel="speed of the object [m/s]", ylabel="drag [N]", xlim=(0.0, 0.6), ylim=(-0.03, 1.25))
    axes.grid()


def limit_curve(frame: str) -> Callable[[Axes, Picture], None]:
    """Friction forces of all directions of slip."""

    def law_of(axes: Axes, picture: Picture) -> None:
        law, turn = _friction_law(picture.effect), np.linspace(0.0, 2.0 * math.pi, 97)
        slips = np.exp(1j * turn)
        friction = np.array([-FRICTION * factor_at(law, complex(s)) * s for s in slips])
        _curve(axes, FRICTION * slips.real, FRICTION * slips.imag, plain=True)
        _curve(axes, friction.real, friction.imag)
        angle = picture.effect.angle  # type: ignore[attr-defined]
        easy = np.array([-0.44, 0.44])
        axes.plot(easy * math.cos(angle), easy * math.sin(angle), "-.", color=INK, linewidth=0.8)
        _label(axes, 0.45 * math.cos(angle), 0.45 * math.sin(angle), "low-friction axis", va="bottom", ha="center")
        slip = complex(math.cos(math.radians(75)), math.sin(math.radians(75)))
        force = -FRICTION * factor_at(law, slip) * slip
        for arrow, color in ((0.3 * slip, INK), (force, WITH)):
            axes.annotate("", (arrow.real, arrow.imag), (0.0, 0.0), arrowprops={"arrowstyle": "-|>", "color": color})
        _label(axes, 0.1 * slip.real - 0.02, 0.1 * slip.imag, "slip", ha="right")
        _label(axes, force.real + 0.04, force.imag - 0.06, "friction", color=WITH)
        draw_ground(axes, (-0.42, -0.42, 0.42, 0.42), LEFT_ASPECT)
        axes.set(xlabel=f"force along x of the {frame} / weight", ylabel=f"force along y of the {frame} / weight")
        axes.yaxis.label.set_size(7.0)

    return law_of


def place_map(axes: Axes, picture: Picture) -> None:
    """Friction over the cell's, by place on the table."""
    law = _friction_law(picture.effect)
    patch = picture.effect.name == "friction_patch"
    draw_ground(axes, (-70.0, -140.0, 220.0, 120.0) if patch else (-150.0, -120.0, 150.0, 120.0), LEFT_ASPECT)
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    x, y = np.meshgrid(np.linspace(left, right, 61 if patch else 7), np.linspace(low, high, 43 if patch else 5))
    points = (x + 1j * y).ravel() / MM
    factors = np.asarray(law.ratio(state(1.0 + 0j, points=points))).real.reshape(x.shape)
    if patch:
        highest = np.unravel_index(int(factors.argmax()), factors.shape)
        middle = 0.5 * (1.0 + float(factors.max()))
        axes.contourf(x, y, factors, levels=[middle, 10.0], colors=["#b9c9ea"])
        axes.contour(x, y, factors, levels=[middle], colors=[WITH], linewidths=1.4)
        _label(
            axes,
            float(x[factors > middle].mean()),
            float(y[factors > middle].mean()),
            f"× {factors[highest]:g}",
            ha="center",
        )
        _label(axes, left + 14.0, high - 18.0, "× 1")
        return
    levels = np.round(np.arange(0.2, 2.01, 0.2), 1)
    axes.contourf(x, y, factors, levels=levels, cmap="Blues", alpha=0.75, zorder=0)
    lines = axes.contour(x, y, factors, levels=levels, colors=[WITH], linewidths=0.8)
    for level, segments in zip(lines.levels, lines.allsegs, strict=True):
        inside = [s for s in segments if len(s)]
        if inside:
            middle = 0.5 * (inside[0][0] + inside[0][-1])
            if 0.9 * left < middle[0] < 0.9 * right:
                _label(axes, middle[0], middle[1], f"× {level:g}", ha="center")


def friction_over_pushes(axes: Axes, picture: Picture) -> None:
    """A drift."""
    orders = list(range(13))
    bodies = [picture.effect.body(BODY, facts(order)) for order in orders]
    axes.plot(orders, [FRICTION] * 13, "s", color=PLAIN, markersize=3.5, fillstyle="none", gid=_mark(axes, True))
    axes.plot(
        orders, [float(b.support_friction[0]) for b in bodies], "o", color=WITH, markersize=4, gid=_mark(axes, False)
    )
    axes.set(xlabel="number of the push", ylabel="friction coefficient [-]", ylim=(0.0, 0.3))
    axes.grid()


def _arrows(axes: Axes, picture: Picture, box: tuple[float, float, float, float], arrow: float) -> None:
    """The force on the object at places of a grid; ``arrow`` is the longest, in mm."""
    law = _force_law(picture.effect)
    draw_ground(axes, box, LEFT_ASPECT)
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    x, y = np.meshgrid(np.linspace(left, right, 11)[1:-1], np.linspace(low, high, 8)[1:-1])
    forces = np.array([force_of(law, state(place=complex(p))) for p in ((x + 1j * y) / MM).ravel()])
    strongest = float(np.abs(forces).max())
    pulled = np.abs(forces) > 0.0
    axes.quiver(
        x.ravel()[pulled], y.ravel()[pulled], forces.real[pulled], forces.imag[pulled], angles="xy", scale_units="xy",
        scale=strongest / arrow, width=0.007, color=WITH, pivot="middle", gid=_mark(axes, False),
    )  # fmt: skip
    axes.plot(x.ravel()[~pulled], y.ravel()[~pulled], ".", color=PLAIN, markersize=2.5)
    _label(axes, left + 0.015 * (right - left), high - 0.055 * (high - low), f"longest arrow {strongest:.2f} N")
    axes.texts[-1].set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 1.0})


def field_of_tilt(axes: Axes, picture: Picture) -> None:
    """The same force everywhere."""
    _arrows(axes, picture, (-150.0, -110.0, 150.0, 110.0), 24.0)


def field_of_tether(axes: Axes, picture: Picture) -> None:
    """A pull that begins where the cable is taut."""
    _arrows(axes, picture, (-110.0, -130.0, 290.0, 190.0), 45.0)
    _landmarks(axes, picture.effect)


def pull_over_distance(axes: Axes, picture: Picture) -> None:
    """A magnet's pull."""
    law, magnet = _force_law(picture.effect), picture.effect
    away = np.linspace(0.0, 0.15, 101)
    at = complex(magnet.x, magnet.y)  # type: ignore[attr-defined]
    pulls = [abs(force_of(law, state(place=at - d))) for d in away]
    _curve(axes, MM * away, np.zeros(len(away)), plain=True)
    _curve(axes, MM * away[1:], pulls[1:])
    axes.axhline(FRICTION * WEIGHT, color=INK, linewidth=0.8, linestyle="-.")
    _label(axes, 150.0, FRICTION * WEIGHT + 0.06, "friction with the table", ha="right")
    axes.axvline(MM * magnet.core, color=INK, linewidth=0.8, linestyle=":")  # type: ignore[attr-defined]
    _label(axes, MM * magnet.core + 2.0, 0.08, "core")  # type: ignore[attr-defined]
    axes.set(xlabel="distance to the point [mm]", ylabel="pull [N]", xlim=(0.0, 150.0), ylim=(-0.03, 1.35))
    axes.grid()


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
    _object_axes(axes, (*(low - 8.0), *(high + 8.0)))


def _object_axes(axes: Axes, box: tuple[float, float, float, float]) -> None:
    draw_ground(axes, box, LEFT_ASPECT)
    axes.set(xlabel="x of the object [mm]", ylabel="y of the object [mm]")


def _outline(axes: Axes, corners: Array, *, plain: bool) -> None:
    style = {"edgecolor": PLAIN, "linestyle": DASHED} if plain else {"edgecolor": WITH}
    axes.add_patch(Polygon(corners, closed=True, facecolor="none", linewidth=1.6, **style))


def centre_of_mass(axes: Axes, picture: Picture) -> None:
    """The outline with the two centres."""
    corners = MM * outline_of(BOX)
    axes.add_patch(Polygon(corners, closed=True, facecolor="#f6f7f9", edgecolor=INK, linewidth=1.0))
    x, y = (MM * picture.effect.body(BODY, facts()).p_BBcm).tolist()
    axes.plot(0.0, 0.0, "+", color=PLAIN, markersize=10, markeredgewidth=2.0)
    axes.plot(x, y, "o", color=WITH, markersize=6, gid=_mark(axes, False))
    _label(axes, 0.0, -9.0, "centre of the shape", color=MUTED, ha="center")
    _label(axes, x, y + 9.0, "centre of mass", color=WITH, ha="center")
    _object_axes(axes, (-64.0, -46.0, 64.0, 46.0))


def radii_of_gyration(axes: Axes, picture: Picture) -> None:
    """Circles in which the mass might sit for the same moment of inertia."""
    corners = MM * outline_of(BOX)
    axes.add_patch(Polygon(corners, closed=True, facecolor="#f6f7f9", edgecolor=INK, linewidth=1.0))
    turn = np.linspace(0.0, 2.0 * math.pi, 73)
    for body, plain in ((BODY, True), (picture.effect.body(BODY, facts()), False)):
        radius = MM * math.sqrt(body.inertia_ratio * solid_of(BOX.shape).gyration[2])
        _curve(axes, radius * np.cos(turn), radius * np.sin(turn), plain=plain)
        _label(axes, 0.0, radius - 8.0, f"{radius:.0f} mm", color=MUTED if plain else WITH, ha="center")
    _object_axes(axes, (-80.0, -60.0, 80.0, 60.0))


def jolt(axes: Axes, picture: Picture) -> None:
    """The force of the swinging mass on an object that a jolt sets in motion at a constant speed."""
    speed, span = 0.3, 2e-3
    law, times = _force_law(picture.effect), np.arange(-100, 501) * span
    forces = []
    for time in times:
        moves = time >= 0.0
        here = state(speed if moves else 0j, place=complex(speed * max(time, 0.0)), time=time - times[0], span=span)
        forces.append(force_of(law, here).real)
    _curve(axes, times[::5], np.zeros(len(times[::5])), plain=True)
    _curve(axes, times[::5], forces[::5])
    axes.set(xlabel="time since the jolt [s]", ylabel="force on the object [N]", xlim=(-0.2, 1.0))
    axes.grid()


def rolling_force(axes: Axes, picture: Picture) -> None:
    """Coulomb's law of rolling."""
    law = _force_law(picture.effect, LYING.shape.radius)  # type: ignore[union-attr]
    speeds = np.concatenate([np.linspace(-0.3, -1e-3, 20), np.linspace(-1e-5, 1e-5, 9), np.linspace(1e-3, 0.3, 20)])
    forces = [force_of(law, state(complex(v), span=1e-3)).real for v in speeds]
    _curve(axes, speeds, np.zeros(len(speeds)), plain=True)
    _curve(axes, speeds, forces)
    axes.set(xlabel="rolling speed [m/s]", ylabel="braking force [N]", xlim=(-0.3, 0.3), ylim=(-0.16, 0.16))
    axes.grid()


def rebound(axes: Axes, picture: Picture) -> None:
    """Speed at which the object leaves the tip over that at which they meet, in the middle of a face."""
    approaches, box = np.linspace(0.0, 0.5, 51), solid_of(BOX.shape)
    for body, plain in ((BODY, True), (picture.effect.body(BODY, facts()), False)):
        away = []
        for speed in approaches:
            given = routh_impulse(
                lever_n=-0.05, lever_t=0.0, approach=-float(speed), slip=0.0, mass=MASS,
                inertia=MASS * box.gyration[2], friction=HAND_FRICTION, restitution=body.restitution,
            )  # fmt: skip
            away.append(given.normal / MASS - speed)
        _curve(axes, approaches, away, plain=plain)
    axes.set(xlabel="speed of the tip at the touch [m/s]", ylabel="speed of separation [m/s]", xlim=(0.0, 0.5))
    axes.grid()


def deflection(axes: Axes, picture: Picture) -> None:
    """How far the tip gives way at rest."""
    mount = picture.effect.mount(facts())
    assert mount is not None
    forces = np.linspace(0.0, 2.0, 41)
    _curve(axes, forces, np.zeros(len(forces)), plain=True)
    _curve(axes, forces, MM * forces / mount.stiffness)
    axes.axvline(FRICTION * WEIGHT, color=INK, linewidth=0.8, linestyle="-.")
    _label(axes, FRICTION * WEIGHT + 0.04, 0.6, "friction with the table")
    axes.set(xlabel="force of the contact [N]", ylabel="deflection of the tip [mm]", xlim=(0.0, 2.0))
    axes.grid()


def lagging_tip(axes: Axes, picture: Picture) -> None:
    """Speed of the tip, commanded and true."""
    path = picture.pushes[0].path
    assert path is not None
    times = np.linspace(0.0, 0.6, 121)
    for one, plain in ((path, True), (picture.effect.hand(path, facts()), False)):
        _curve(axes, times, np.interp(times, one.times, one.velocities[:, 0]), plain=plain)
    _label(axes, 0.1, 0.33, "as recorded", color=MUTED)
    _label(axes, 0.36, 0.2, "true", color=WITH)
    axes.set(xlabel="time [s]", ylabel="speed of the tip [m/s]", xlim=(0.0, 0.6), ylim=(-0.01, 0.37))
    axes.grid()


def shifted_tip(axes: Axes, picture: Picture) -> None:
    """Where the tip is recorded, and where it is."""
    one = picture.pushes[0]
    assert one.path is not None
    y = one.start.pose[1]
    corners = placed(outline_of(BOX), np.array(one.start.pose))
    axes.add_patch(Polygon(corners, closed=True, facecolor="#f6f7f9", edgecolor=INK, linewidth=1.0))
    for path, plain in ((one.path, True), (picture.effect.hand(one.path, facts()), False)):
        turn = np.linspace(0.0, 2.0 * math.pi, 49)
        at = MM * path.start
        _curve(axes, at[0] + MM * TIP * np.cos(turn), at[1] + MM * TIP * np.sin(turn), plain=plain)
        text, va = ("recorded", "top") if plain else ("true", "bottom")
        _label(
            axes, at[0], at[1] + (-13.0 if plain else 13.0), text, color=MUTED if plain else WITH, ha="center", va=va
        )
    draw_ground(axes, (-100.0, MM * y - 46.0, 60.0, MM * y + 46.0), LEFT_ASPECT)


def late_report(axes: Axes, picture: Picture) -> None:
    """True and reported place over time, of one rollout."""
    times = np.linspace(0.0, 0.6, 121)
    true, late = (reports(picture.pushes[:1], times, *e)[0] for e in ((), (picture.effect,)))
    _curve(axes, times, along_x(true), plain=True)
    _curve(axes, times, along_x(late))
    _label(axes, 0.25, 70.0, "true", color=MUTED, ha="right")
    _label(axes, 0.35, 50.0, "reported", color=WITH)
    axes.set(xlabel="time [s]", ylabel="x of the object [mm]", xlim=(0.0, 0.6))
    axes.grid()


def tracked_frame(axes: Axes, picture: Picture) -> None:
    """The frame at the centre of the shape, and the one that the tracker follows."""
    corners = MM * outline_of(BOX)
    axes.add_patch(Polygon(corners, closed=True, facecolor="#f6f7f9", edgecolor=INK, linewidth=1.0))
    true = np.zeros((1, 3))
    for pose, plain in ((true[0], True), (picture.effect.tracked(true)[0], False)):
        x, y, yaw = MM * pose[0], MM * pose[1], pose[2]
        for turn in (0.0, 0.5 * math.pi):
            far = 24.0 * np.array([math.cos(yaw + turn), math.sin(yaw + turn)])
            _curve(axes, [x, x + far[0]], [y, y + far[1]], plain=plain)
            _label(axes, x + 1.14 * far[0], y + 1.14 * far[1], "y" if turn else "x", color=MUTED if plain else WITH,
                   ha="center")  # fmt: skip
    _label(axes, 0.0, -7.0, "at the centre of the shape", color=MUTED, ha="center")
    _label(axes, MM * picture.effect.x + 12.0, MM * picture.effect.y + 14.0, "tracked", color=WITH)  # type: ignore[attr-defined]
    _object_axes(axes, (-64.0, -46.0, 64.0, 46.0))


def scaled_places(axes: Axes, picture: Picture) -> None:
    """Places on the table, and where they are reported."""
    x, y = np.meshgrid(np.linspace(-240.0, 240.0, 7), np.linspace(-160.0, 160.0, 5))
    true = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    seen = picture.effect.tracked(true)
    axes.plot(true[:, 0], true[:, 1], "s", color=PLAIN, markersize=4, fillstyle="none", gid=_mark(axes, True))
    axes.plot(seen[:, 0], seen[:, 1], "o", color=WITH, markersize=3.5, gid=_mark(axes, False))
    between = np.stack([true[:, :2], seen[:, :2], np.full((len(true), 2), np.nan)], axis=1).reshape(-1, 2)
    axes.plot(between[:, 0], between[:, 1], color=WITH, linewidth=0.8)
    axes.plot(0.0, 0.0, "+", color=INK, markersize=11, markeredgewidth=1.6)
    _label(axes, 8.0, 22.0, "origin of W")
    draw_ground(axes, (-290.0, -200.0, 290.0, 200.0), LEFT_ASPECT)


def two_sizes(axes: Axes, picture: Picture) -> None:
    """The outline of the model, and of the object."""
    for geometry, plain in ((BOX, True), (geometry_with((picture.effect,), BOX), False)):
        _outline(axes, MM * outline_of(geometry), plain=plain)
    _label(axes, 0.0, 34.0, "model", color=MUTED, ha="center")
    _label(axes, 0.0, 49.5, "object", color=WITH, ha="center")
    _object_axes(axes, (-66.0, -54.0, 66.0, 54.0))


# ----------------------------------------------------------------------------------------------------------- examples


THROWS = (push(0, 0.25, 0.06), push(0, 0.5, 0.08))
TWO_SPEEDS = ("0.25 m/s", "0.5 m/s")


@cache
def pictures() -> dict[str, Picture]:
    """By the name of the effect."""
    made = [
        Picture(
            effect=effect_named("stribeck_friction")(excess=0.5, speed=0.3),
            law=friction_over_slip, law_title="Friction over slip",
            pushes=THROWS, pushes_title="Two pushes that let go", shown=over_time(along_x, "x [mm]", TWO_SPEEDS),
        ),
        Picture(
            effect=effect_named("viscous_drag")(coefficient=1.0),
            law=drag_over_speed, law_title="Drag over speed",
            pushes=THROWS, pushes_title="Two pushes that let go", shown=over_time(along_x, "x [mm]", TWO_SPEEDS),
        ),
        Picture(
            effect=effect_named("quadratic_drag")(coefficient=2.5),
            law=drag_over_speed, law_title="Drag over speed",
            pushes=THROWS, pushes_title="Two pushes that let go", shown=over_time(along_x, "x [mm]", TWO_SPEEDS),
        ),
        Picture(
            effect=effect_named("anisotropic_table")(ratio=2.0, angle=0.5),
            law=limit_curve("table"), law_title="Limit curve of the friction force",
            pushes=(push(0, 0.5, 0.05, at=(0.06, 0.0)), push(90, 0.5, 0.05, at=(-0.06, -0.02), yaw=90)),
            pushes_title="Two pushes that let go, from above", shown=above,
        ),
        Picture(
            effect=effect_named("anisotropic_object")(ratio=2.0, angle=0.5),
            law=limit_curve("object"), law_title="Limit curve of the friction force",
            pushes=(push(0, 0.5, 0.05, at=(-0.16, 0.0)), push(0, 0.5, 0.05, at=(0.07, 0.0), yaw=90)),
            pushes_title="One push, two headings of the object", shown=above,
        ),
        Picture(
            effect=effect_named("friction_patch")(ratio=2.5, x=0.12, y=0.06, radius=0.05),
            law=place_map, law_title="Friction by place",
            pushes=(push(0, 0.5, 0.06, at=(0.0, 0.03)), push(0, 0.5, 0.06, at=(0.0, -0.09))),
            pushes_title="Two pushes that let go, from above", shown=above,
        ),
        Picture(
            effect=effect_named("friction_gradient")(slope_x=3.0, slope_y=1.5),
            law=place_map, law_title="Friction by place",
            pushes=(push(0, 0.5, 0.06, at=(0.0, 0.06)), push(180, 0.5, 0.06, at=(0.0, -0.06))),
            pushes_title="Two pushes that let go, from above", shown=above,
        ),
        Picture(
            effect=effect_named("friction_drift")(per_push=-0.04),
            law=friction_over_pushes, law_title="Friction over the number of the push",
            pushes=tuple(push(0, 0.5, 0.08, order=order) for order in (0, 6, 12)),
            pushes_title="One push, made three times",
            shown=over_time(along_x, "x [mm]", ("push 0", "push 6", "push 12")),
        ),
        Picture(
            effect=effect_named("table_tilt")(x=0.03, y=0.05),
            law=field_of_tilt, law_title="Force on the object",
            pushes=(push(0, 0.5, 0.05, at=(0.0, 0.05)), push(180, 0.5, 0.05, at=(0.05, -0.08))),
            pushes_title="Two pushes that let go, from above", shown=above,
        ),
        Picture(
            effect=effect_named("uneven_support")(weights=((0.2, 0.2, 0.2), (0.2, 6.0, 0.2), (0.2, 0.2, 0.2))),
            law=grid_of_weights, law_title="Weights under the object",
            pushes=(push(90, 0.5, 0.05, at=(-0.1, 0.0), aside=0.01), push(90, 0.3, 0.05, at=(0.1, 0.0), aside=-0.02)),
            pushes_title="Two pushes that let go, from above", shown=above,
        ),
        Picture(
            effect=effect_named("com_offset")(x=0.02, y=0.01),
            law=centre_of_mass, law_title="Centre of mass",
            pushes=(push(90, 0.1, 0.10, at=(-0.09, 0.0)), push(0, 0.1, 0.10, at=(0.06, 0.02))),
            pushes_title="Two slow pushes, from above", shown=above, end=1.2,
        ),
        Picture(
            effect=effect_named("rotational_inertia")(ratio=2.0),
            law=radii_of_gyration, law_title="Radius of gyration",
            pushes=(push(90, 0.5, 0.06, aside=-0.03), push(90, 0.25, 0.06, aside=0.03)),
            pushes_title="Two pushes off the centre",
            shown=over_time(heading, "yaw [deg]", ("0.5 m/s", "0.25 m/s"), hand=False),
            hand=False,
        ),
        Picture(
            effect=effect_named("sloshing")(fraction=0.4, frequency=3.0, damping=0.05),
            law=jolt, law_title="Force after a jolt to 0.3 m/s",
            pushes=(push(0, 0.25, 0.06), push(0, 0.5, 0.08)),
            pushes_title="Two pushes that let go", shown=over_time(along_x, "x [mm]", TWO_SPEEDS),
        ),
        Picture(
            effect=effect_named("rolling_resistance")(coefficient=8e-4),
            law=rolling_force, law_title="Braking force over speed",
            pushes=(push(0, 0.1, 0.05, shape=LYING, end=2.0), push(0, 0.2, 0.05, shape=LYING, end=2.0)),
            pushes_title="Two pushes of a lying cylinder", shown=over_time(along_x, "x [mm]", ("0.1 m/s", "0.2 m/s")),
            end=2.0, rolls=True,
        ),
        Picture(
            effect=effect_named("tether")(stiffness=6.0, x=0.0, y=0.1, rest_length=0.08),
            law=field_of_tether, law_title="Force on the object",
            pushes=(push(0, 0.5, 0.08, at=(0.0, -0.04)), push(180, 0.25, 0.08, at=(0.25, 0.08))),
            pushes_title="Two pushes, from above", shown=above,
        ),
        Picture(
            effect=effect_named("magnet")(strength=8e-4, x=0.13, y=0.06, core=0.03),
            law=pull_over_distance, law_title="Pull over distance",
            pushes=(push(0, 0.5, 0.06), push(0, 0.5, 0.06, at=(0.0, 0.12))),
            pushes_title="Two pushes that let go, from above", shown=above,
        ),
        Picture(
            effect=effect_named("restitution")(coefficient=0.4),
            law=rebound, law_title="Rebound at the touch",
            pushes=(push(0, 0.4, 0.042, gap=0.03), push(0, 0.2, 0.06, gap=0.015)),
            pushes_title="A tap and a long push", shown=over_time(along_x, "x [mm]", ("0.4 m/s", "0.2 m/s")), end=0.6,
        ),
        Picture(
            effect=effect_named("hand_compliance")(compliance=0.005, damping=0.3, share=0.2),
            law=deflection, law_title="Deflection of the tip at rest",
            pushes=(push(0, 0.1, 0.04), push(0, 0.3, 0.08)),
            pushes_title="Two pushes", shown=over_time(along_x, "x [mm]", ("0.1 m/s", "0.3 m/s")), end=0.6,
        ),
        Picture(
            effect=effect_named("actuator_lag")(time_constant=0.05),
            law=lagging_tip, law_title="Speed of the tip",
            pushes=(push(0, 0.3, 0.08), push(0, 0.1, 0.04)),
            pushes_title="Two pushes", shown=over_time(along_x, "x [mm]", ("0.3 m/s", "0.1 m/s")), end=0.6,
        ),
        Picture(
            effect=effect_named("hand_offset")(x=0.004, y=0.008),
            law=shifted_tip, law_title="Place of the tip",
            pushes=(
                push(0, 0.1, 0.09, at=(0.0, 0.07), gap=0.012),
                push(0, 0.1, 0.09, at=(0.0, -0.07), aside=-0.015, gap=0.012),
            ),
            pushes_title="Two slow pushes, from above", shown=above, end=1.2,
        ),
        Picture(
            effect=effect_named("tracker_latency")(delay=0.05),
            law=late_report, law_title="True and reported place",
            pushes=(push(0, 0.3, 0.08), push(0, 0.1, 0.04)),
            pushes_title="Two pushes, as reported",
            shown=over_time(along_x, "x [mm]", ("0.3 m/s", "0.1 m/s")), end=0.6,
        ),
        Picture(
            effect=effect_named("tracker_bias")(x=0.012, y=0.006, yaw=0.15),
            law=tracked_frame, law_title="Tracked frame",
            pushes=(
                push(0, 0.1, 0.09, at=(0.0, 0.07), gap=0.02),
                push(0, 0.1, 0.09, at=(0.0, -0.07), aside=-0.02, gap=0.02),
            ),
            pushes_title="Two slow pushes, as reported", shown=above, end=1.2,
        ),
        Picture(
            effect=effect_named("tracker_scale")(ratio=1.1),
            law=scaled_places, law_title="True and reported places",
            pushes=(push(0, 0.1, 0.09, at=(-0.2, 0.09)), push(90, 0.1, 0.09, at=(0.16, 0.02), aside=0.02)),
            pushes_title="Two slow pushes, as reported", shown=above, end=1.2,
        ),
        Picture(
            effect=effect_named("size_error")(ratio=1.1),
            law=two_sizes, law_title="Outline from above",
            pushes=(
                push(0, 0.1, 0.09, at=(0.0, 0.07), gap=0.012),
                push(0, 0.1, 0.09, at=(0.0, -0.07), aside=-0.02, gap=0.012),
            ),
            pushes_title="Two slow pushes, from above", shown=above, end=1.2,
        ),
    ]  # fmt: skip
    return {picture.effect.name: picture for picture in made}


# ------------------------------------------------------------------------------------------------------------- files


def svg_text(figure: Figure, salt: str) -> str:
    """The figure as a file that holds no date and no more digits than are seen."""
    mpl.rcParams["svg.hashsalt"] = salt
    file = io.BytesIO()
    figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = file.getvalue().decode()
    text = re.sub(r"<!--.*?-->|<metadata>.*?</metadata>|<!DOCTYPE.*?>", "", text, flags=re.S)
    text = re.sub(r' id="[a-zA-Z0-9.]+_\d+"(?=>)', "", text)  # of groups; a curve's own has no number
    text = text.replace("'DejaVu Sans'", "'DejaVu Sans', Verdana, sans-serif")
    return re.sub(r"\n\s*", "\n", re.sub(r"<[^<>]*>", _rounded, text)).strip() + "\n"


def _rounded(tag: re.Match[str]) -> str:
    """A tag with two digits after the point."""

    def number(found: re.Match[str]) -> str:
        return f"{float(found[0]) + 0.0:.2f}".rstrip("0").rstrip(".").replace("-0 ", "0 ")

    return re.sub(r"-?\d+\.\d{3,}", number, tag[0])


def write(names: Sequence[str], folder: Path) -> list[Path]:
    """Draw the pictures of some effects into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for name in names:
        with drawn():
            mpl.rcParams.update({"savefig.transparent": False, "path.simplify": False})
            files.append(folder / f"{name}.svg")
            files[-1].write_text(svg_text(draw(pictures()[name]), f"effects {name}"), encoding="utf-8")
    return files


def main() -> None:
    """Draw those that are named, or all."""
    every = [kind.name for kind in SHIPPED]
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="of effects; default: all")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "images" / "effects")
    given = parser.parse_args()
    for file in write(given.names or every, given.out):
        print(f"{file} {file.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
