"""Left panels of effects of the hand and of the tracker."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes

from physid_drake.cell.impact import routh_impulse
from physid_drake.cell.solid import solid_of
from physid_drake.report.svg import INK, MUTED
from physid_drake.report.table_view import MM, draw_ground, placed

from .drawing import LEFT_ASPECT, PLAIN, WITH, curve, curve_id, draw_model, object_axes, put_label
from .laws import facts
from .picture import Picture
from .pushes_panel import along_x
from .scenes import BODY, BOX, FRICTION, HAND_FRICTION, MASS, TIP, WEIGHT, outline_of, reports


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
        curve(axes, approaches, away, plain=plain)
    axes.set(xlabel="speed of the tip at the touch [m/s]", ylabel="speed of separation [m/s]", xlim=(0.0, 0.5))
    axes.grid()


def deflection(axes: Axes, picture: Picture) -> None:
    """How far the tip gives way at rest."""
    mount = picture.effect.mount(facts())
    assert mount is not None
    forces = np.linspace(0.0, 2.0, 41)
    curve(axes, forces, np.zeros(len(forces)), plain=True)
    curve(axes, forces, MM * forces / mount.stiffness)
    axes.axvline(FRICTION * WEIGHT, color=INK, linewidth=0.8, linestyle="-.")
    put_label(axes, FRICTION * WEIGHT + 0.04, 0.6, "friction with the table")
    axes.set(xlabel="force of the contact [N]", ylabel="deflection of the tip [mm]", xlim=(0.0, 2.0))
    axes.grid()


def lagging_tip(axes: Axes, picture: Picture) -> None:
    """Speed of the tip, commanded and true."""
    path = picture.pushes[0].path
    assert path is not None
    times = np.linspace(0.0, 0.6, 121)
    for one, plain in ((path, True), (picture.effect.hand(path, facts()), False)):
        curve(axes, times, np.interp(times, one.times, one.velocities[:, 0]), plain=plain)
    put_label(axes, 0.1, 0.33, "as recorded", color=MUTED)
    put_label(axes, 0.36, 0.2, "true", color=WITH)
    axes.set(xlabel="time [s]", ylabel="speed of the tip [m/s]", xlim=(0.0, 0.6), ylim=(-0.01, 0.37))
    axes.grid()


def shifted_tip(axes: Axes, picture: Picture) -> None:
    """Where the tip is recorded, and where it is."""
    one = picture.pushes[0]
    assert one.path is not None
    y = one.start.pose[1]
    corners = placed(outline_of(BOX), np.array(one.start.pose))
    draw_model(axes, corners)
    for path, plain in ((one.path, True), (picture.effect.hand(one.path, facts()), False)):
        turn = np.linspace(0.0, 2.0 * math.pi, 49)
        at = MM * path.start
        curve(axes, at[0] + MM * TIP * np.cos(turn), at[1] + MM * TIP * np.sin(turn), plain=plain)
        text, va = ("recorded", "top") if plain else ("true", "bottom")
        put_label(
            axes, at[0], at[1] + (-13.0 if plain else 13.0), text, color=MUTED if plain else WITH, ha="center", va=va
        )
    draw_ground(axes, (-100.0, MM * y - 46.0, 60.0, MM * y + 46.0), LEFT_ASPECT)


def late_report(axes: Axes, picture: Picture) -> None:
    """True and reported place over time, of one rollout."""
    times = np.linspace(0.0, 0.6, 121)
    true, late = (reports(picture.pushes[:1], times, *e)[0] for e in ((), (picture.effect,)))
    curve(axes, times, along_x(true), plain=True)
    curve(axes, times, along_x(late))
    put_label(axes, 0.25, 70.0, "true", color=MUTED, ha="right")
    put_label(axes, 0.35, 50.0, "reported", color=WITH)
    axes.set(xlabel="time [s]", ylabel="x of the object [mm]", xlim=(0.0, 0.6))
    axes.grid()


def tracked_frame(axes: Axes, picture: Picture) -> None:
    """The frame at the centre of the shape, and the one that the tracker follows."""
    corners = MM * outline_of(BOX)
    draw_model(axes, corners)
    true = np.zeros((1, 3))
    for pose, plain in ((true[0], True), (picture.effect.tracked(true)[0], False)):
        x, y, yaw = MM * pose[0], MM * pose[1], pose[2]
        for turn in (0.0, 0.5 * math.pi):
            far = 24.0 * np.array([math.cos(yaw + turn), math.sin(yaw + turn)])
            curve(axes, [x, x + far[0]], [y, y + far[1]], plain=plain)
            color = MUTED if plain else WITH
            put_label(axes, x + 1.14 * far[0], y + 1.14 * far[1], "y" if turn else "x", color=color, ha="center")
    put_label(axes, 0.0, -7.0, "at the centre of the shape", color=MUTED, ha="center")
    put_label(axes, MM * picture.effect.x + 12.0, MM * picture.effect.y + 14.0, "tracked", color=WITH)  # type: ignore[attr-defined]
    object_axes(axes, (-64.0, -46.0, 64.0, 46.0))


def scaled_places(axes: Axes, picture: Picture) -> None:
    """Places on the table, and where they are reported."""
    x, y = np.meshgrid(np.linspace(-240.0, 240.0, 7), np.linspace(-160.0, 160.0, 5))
    true = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    seen = picture.effect.tracked(true)
    axes.plot(true[:, 0], true[:, 1], "s", color=PLAIN, markersize=4, fillstyle="none", gid=curve_id(axes, True))
    axes.plot(seen[:, 0], seen[:, 1], "o", color=WITH, markersize=3.5, gid=curve_id(axes, False))
    between = np.stack([true[:, :2], seen[:, :2], np.full((len(true), 2), np.nan)], axis=1).reshape(-1, 2)
    axes.plot(between[:, 0], between[:, 1], color=WITH, linewidth=0.8)
    axes.plot(0.0, 0.0, "+", color=INK, markersize=11, markeredgewidth=1.6)
    put_label(axes, 8.0, 22.0, "origin of W")
    draw_ground(axes, (-290.0, -200.0, 290.0, 200.0), LEFT_ASPECT)
