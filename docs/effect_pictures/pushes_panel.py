"""Right panels: pushes without and with an effect, from above or over time."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon

from physid_drake.effects.rollout import geometry_with
from physid_drake.report.svg import INK
from physid_drake.report.table_view import MM, draw_ground, placed

from .drawing import ASPECT, DASHED, PLAIN, WITH, curve, draw_landmarks, put_label
from .picture import Picture
from .scenes import BOX, TIP, Array, outline_of


def above(axes: Axes, picture: Picture, times: Array, plain: list[Array], others: list[Array]) -> None:
    """Seen from above: start, way of the tracked point, and the object at the end."""
    own = outline_of(geometry_with((picture.effect,), BOX))
    spots = draw_landmarks(axes, picture.effect)
    for one, before, after in zip(picture.pushes, plain, others, strict=True):
        start = placed(outline_of(BOX), before[0])
        ends = placed(outline_of(BOX), before[-1]), placed(own, after[-1])
        axes.add_patch(Polygon(start, closed=True, facecolor="#eef0f3", edgecolor="#c3c9d4", linewidth=0.6))
        grey = {"edgecolor": PLAIN, "linewidth": 1.2, "linestyle": DASHED, "zorder": 3}
        blue = {"edgecolor": WITH, "linewidth": 1.4, "zorder": 4}
        for end, style in zip(ends, (grey, blue), strict=True):
            axes.add_patch(Polygon(end, closed=True, facecolor="none", **style))
        curve(axes, MM * before[:, 0], MM * before[:, 1], plain=True)
        curve(axes, MM * after[:, 0], MM * after[:, 1])
        spots += [start, *ends]
        if one.path is not None:
            tip = MM * one.path.positions(times[::4])
            axes.plot(tip[:, 0], tip[:, 1], ":", color=INK, linewidth=1.2, zorder=5)
            axes.add_patch(Circle(tuple(tip[0]), MM * TIP, facecolor="none", edgecolor=INK, linewidth=0.8, zorder=5))
            spots.append(np.vstack([tip - MM * TIP, tip + MM * TIP]))
    low, high = np.vstack(spots).min(axis=0), np.vstack(spots).max(axis=0)
    pad = 0.04 * float((high - low).max())
    draw_ground(axes, (low[0] - pad, low[1] - pad, high[0] + pad, high[1] + pad), ASPECT)


def over_time(
    value: Callable[[Array], Array], up: str, names: Sequence[str] = (), *, hand: bool = True,
) -> Callable[[Axes, Picture, Array, list[Array], list[Array]], None]:  # fmt: skip
    """Draws a number of each pose over time.

    Args:
        value: the number (n,) of poses (n, 3).
        up: label of the axis.
        names: of the pushes, beside their ends.
        hand: whether to draw the tip's, too.
    """

    def shown(axes: Axes, picture: Picture, times: Array, plain: list[Array], others: list[Array]) -> None:
        for k, (one, before, after) in enumerate(zip(picture.pushes, plain, others, strict=True)):
            if hand and one.path is not None:
                tip = np.column_stack([one.path.positions(times), np.zeros(len(times))])
                axes.plot(times, value(tip), ":", color=INK, linewidth=1.2, zorder=2)
            curve(axes, times, value(before), plain=True)
            curve(axes, times, value(after))
            if names:
                put_label(axes, 1.02 * times[-1], value(after)[-1], names[k])
        axes.set(xlabel="time [s]", ylabel=up, xlim=(0.0, times[-1] * (1.24 if names else 1.0)))
        axes.grid()

    return shown


def along_x(poses: Array) -> Array:
    """Place along x [mm]."""
    return np.asarray(MM * poses[:, 0])


def heading(poses: Array) -> Array:
    """Yaw [deg]."""
    return np.asarray(np.degrees(poses[:, 2]))
