"""The table from above: what a diagnosis draws on it, and the axes on which it is drawn."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from physid_drake.diagnose.localise import MissingWrench
from physid_drake.report.svg import INK

Array = NDArray[np.float64]
Box = tuple[float, float, float, float]  # x and y from, x and y to [mm]

MOST_POINTS = 160  # of a path
MM = 1e3


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class ShownPush:
    """One push, recorded and predicted while it was left out of the fit.

    Attributes:
        name: of the push.
        times: (n,) [s].
        recorded: (n, 3) x, y [m], yaw [rad].
        before: (n, 3) predicted by the baseline model.
        after: (n, 3) predicted with what is missing, None where nothing was found.
        released: when the hand lets go [s], None where it is not known.
    """

    name: str
    times: Array
    recorded: Array
    before: Array
    after: Array | None
    released: float | None


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class TableView:
    """What the drawings share: the outline (n, 2) in B [m], pushes, missing wrenches, friction with the table."""

    outline: Array | None
    shown: Sequence[ShownPush]
    wrenches: Sequence[MissingWrench]
    friction: float | None

    def name(self, push: int) -> str:
        """Of a push by its index."""
        return self.shown[push].name if 0 <= push < len(self.shown) else f"push {push + 1}"


def placed(outline: Array | None, pose: Array) -> Array:
    """The outline at a pose (n, 2) [mm]; the pose's point alone where there is no outline."""
    if outline is None:
        return MM * pose[None, :2]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return np.asarray(MM * (outline @ np.array([[c, s], [-s, c]]) + pose[:2]))


def thinned(poses: Array) -> Array:
    """The finite rows of a path (n, 3), thinned to what a drawing shows."""
    finite = poses[np.isfinite(poses).all(axis=1)]
    step = max(1, math.ceil(len(finite) / MOST_POINTS))
    return np.vstack([finite[:-1:step], finite[-1:]])


def box_of(view: TableView, pushes: Sequence[ShownPush], margin: float = 0.04) -> Box:
    """What of the table to show: the recorded objects, and the simulated ones while they are near."""
    real, simulated = [], []
    for push in pushes:
        path = thinned(push.recorded)
        real += [MM * path[:, :2], *(placed(view.outline, p) for p in path[-1:])]
        for other in (push.before, push.after):
            simulated += [] if other is None else [placed(view.outline, p) for p in thinned(other)[-1:]]
    if not any(len(points) for points in real):
        return -100.0, -100.0, 100.0, 100.0
    low, high = np.vstack(real).min(axis=0), np.vstack(real).max(axis=0)
    near = 0.4 * (high - low)
    every = np.clip(np.vstack(real + simulated), low - near, high + near)
    low, high = every.min(axis=0), every.max(axis=0)
    pad = margin * float((high - low).max())
    return float(low[0] - pad), float(low[1] - pad), float(high[0] + pad), float(high[1] + pad)


def map_axes(box: Box, width: float, tallest: float = 6.0) -> tuple[Figure, Axes]:
    """Empty axes on the table from above, in mm, as high as the box asks for; ``width`` in inches."""
    left, right, bottom, top = 0.62, 0.08, 0.42, 0.1
    inner = width - left - right
    height = min(tallest, max(0.45 * width, inner * (box[3] - box[1]) / (box[2] - box[0])))
    figure = Figure(figsize=(width, height + bottom + top))
    whole = height + bottom + top
    axes = figure.add_axes((left / width, bottom / whole, inner / width, height / whole))
    draw_ground(axes, box, inner / height)
    return figure, axes


def draw_ground(axes: Axes, box: Box, aspect: float) -> None:
    """The table from above: the box, widened to the axes' aspect, so that a mm is as long along x as along y."""
    x, y = 0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])
    half = 0.5 * max(box[3] - box[1], (box[2] - box[0]) / aspect)
    axes.set(xlim=(x - aspect * half, x + aspect * half), ylim=(y - half, y + half), xlabel="x [mm]", ylabel="y [mm]")
    axes.locator_params(nbins=6)
    axes.grid()


def draw_motion(axes: Axes, view: TableView, poses: Array, colour: str, *, width: float, alpha: float) -> None:
    """A path, and the object at its end."""
    path = thinned(poses)
    if not len(path):
        return
    axes.plot(MM * path[:, 0], MM * path[:, 1], color=colour, linewidth=width, alpha=alpha, solid_capstyle="round")
    end = placed(view.outline, path[-1])
    if len(end) > 1:
        axes.add_patch(Polygon(end, closed=True, facecolor="none", edgecolor=colour, linewidth=width, alpha=alpha))


def draw_recorded(axes: Axes, view: TableView, alpha: float = 0.25) -> None:
    """All recorded motions, faintly, as a ground for other things."""
    for push in view.shown:
        draw_motion(axes, view, push.recorded, INK, width=0.6, alpha=alpha)
        axes.lines[-1].set_alpha(0.45)
