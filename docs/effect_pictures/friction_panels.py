"""Left panels of effects on the friction with the table."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes

from physid_drake.effects.law_values import friction_factors, object_at
from physid_drake.report.svg import INK
from physid_drake.report.table_view import MM, draw_ground

from .drawing import LEFT_ASPECT, PLAIN, WITH, curve, curve_id, put_label
from .laws import factor_at, facts
from .picture import Picture
from .scenes import BODY, FRICTION


def friction_over_slip(axes: Axes, picture: Picture) -> None:
    """Stribeck's curve."""
    slips = np.linspace(0.0, 0.5, 101)
    curve(axes, slips, [FRICTION] * len(slips), plain=True)
    curve(axes, slips, [FRICTION * factor_at(picture.effect, complex(v)).real for v in slips])
    axes.set(xlabel="slip [m/s]", ylabel="friction coefficient [-]", xlim=(0.0, 0.5), ylim=(0.0, 0.45))
    axes.grid()


def limit_curve(frame: str) -> Callable[[Axes, Picture], None]:
    """Friction forces of all directions of slip."""

    def law_of(axes: Axes, picture: Picture) -> None:
        slips = np.exp(1j * np.linspace(0.0, 2.0 * math.pi, 97))
        friction = np.array([-FRICTION * factor_at(picture.effect, complex(s)) * s for s in slips])
        curve(axes, FRICTION * slips.real, FRICTION * slips.imag, plain=True)
        curve(axes, friction.real, friction.imag)
        angle = picture.effect.angle  # type: ignore[attr-defined]
        easy = np.array([-0.44, 0.44])
        axes.plot(easy * math.cos(angle), easy * math.sin(angle), "-.", color=INK, linewidth=0.8)
        put_label(axes, 0.45 * math.cos(angle), 0.45 * math.sin(angle), "low-friction axis", va="bottom", ha="center")
        slip = complex(math.cos(math.radians(75)), math.sin(math.radians(75)))
        force = -FRICTION * factor_at(picture.effect, slip) * slip
        for arrow, color in ((0.3 * slip, INK), (force, WITH)):
            axes.annotate("", (arrow.real, arrow.imag), (0.0, 0.0), arrowprops={"arrowstyle": "-|>", "color": color})
        put_label(axes, 0.1 * slip.real - 0.02, 0.1 * slip.imag, "slip", ha="right")
        put_label(axes, force.real + 0.04, force.imag - 0.06, "friction", color=WITH)
        draw_ground(axes, (-0.42, -0.42, 0.42, 0.42), LEFT_ASPECT)
        axes.set(xlabel=f"force along x of the {frame} / weight", ylabel=f"force along y of the {frame} / weight")
        axes.yaxis.label.set_size(7.0)

    return law_of


def place_map(axes: Axes, picture: Picture) -> None:
    """Friction over the cell's, by place on the table."""
    patch = picture.effect.name == "friction_patch"
    draw_ground(axes, (-70.0, -140.0, 220.0, 120.0) if patch else (-150.0, -120.0, 150.0, 120.0), LEFT_ASPECT)
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    x, y = np.meshgrid(np.linspace(left, right, 61 if patch else 7), np.linspace(low, high, 43 if patch else 5))
    points = (x + 1j * y).ravel() / MM
    sliding = object_at(velocity=1.0 + 0j, points=points)
    factors = friction_factors(sliding, picture.effect, facts()).real.reshape(x.shape)
    if patch:
        highest = np.unravel_index(int(factors.argmax()), factors.shape)
        middle = 0.5 * (1.0 + float(factors.max()))
        axes.contourf(x, y, factors, levels=[middle, 10.0], colors=["#b9c9ea"])
        axes.contour(x, y, factors, levels=[middle], colors=[WITH], linewidths=1.4)
        inside = factors > middle
        put_label(axes, float(x[inside].mean()), float(y[inside].mean()), f"× {factors[highest]:g}", ha="center")
        put_label(axes, left + 14.0, high - 18.0, "× 1")
        return
    levels = np.round(np.arange(0.2, 2.01, 0.2), 1)
    axes.contourf(x, y, factors, levels=levels, cmap="Blues", alpha=0.75, zorder=0)
    lines = axes.contour(x, y, factors, levels=levels, colors=[WITH], linewidths=0.8)
    for level, segments in zip(lines.levels, lines.allsegs, strict=True):
        drawn = [s for s in segments if len(s)]
        if drawn:
            middle = 0.5 * (drawn[0][0] + drawn[0][-1])
            if 0.9 * left < middle[0] < 0.9 * right:
                put_label(axes, middle[0], middle[1], f"× {level:g}", ha="center")


def friction_over_pushes(axes: Axes, picture: Picture) -> None:
    """A drift."""
    orders = list(range(13))
    frictions = [float(picture.effect.body(BODY, facts(order)).support_friction[0]) for order in orders]
    axes.plot(orders, [FRICTION] * 13, "s", color=PLAIN, markersize=3.5, fillstyle="none", gid=curve_id(axes, True))
    axes.plot(orders, frictions, "o", color=WITH, markersize=4, gid=curve_id(axes, False))
    axes.set(xlabel="number of the push", ylabel="friction coefficient [-]", ylim=(0.0, 0.3))
    axes.grid()
