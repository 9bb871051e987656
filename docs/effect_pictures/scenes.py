"""The object, the hand and the pushes of the pictures, and what becomes of a push."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import Body, Cell, CellConfig, HandPath, Start
from physid_drake.cell.diagram import GRAVITY
from physid_drake.cell.outline import Polygon
from physid_drake.cell.solid import solid_of
from physid_drake.effects import Effect
from physid_drake.effects.rollout import Geometry, Rollout, geometry_with, roll, tracked
from physid_drake.recording import Box, Cylinder
from physid_drake.report.table_view import MM, placed
from physid_drake.twin.twin import Twin
from physid_drake.twin.with_effects import as_reported, push_with

Array = NDArray[np.float64]

MASS, FRICTION, HAND_FRICTION, TIP = 0.4, 0.25, 0.3, 0.01
WEIGHT = MASS * GRAVITY
BOX = Geometry(shape=Box(size=(0.10, 0.08, 0.06)))
LYING = Geometry(shape=Cylinder(radius=0.033, length=0.10, axis="y"))
BODY = Body(
    mass=MASS, p_BBcm=np.zeros(2), inertia_ratio=1.0, hand_friction=HAND_FRICTION,
    support_friction=np.array([FRICTION]),
)  # fmt: skip
RAMP, BRAKE, GAP = 0.05, 0.04, 0.004  # s, s, m
EVERYWHERE = np.array([[-0.3, -0.3], [0.3, 0.3]])


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
    assert isinstance(outline, Polygon)
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
