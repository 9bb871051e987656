"""A rollout with effects: hand path, cell, poses, tracker; each effect acts at its seams and nowhere else."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import Body, Cell, HandPath, Motion, Outcome, Start
from physid_drake.cell.diagram import GRAVITY
from physid_drake.cell.forces import FrictionLaw, Frictions
from physid_drake.cell.soft_tip import Mount
from physid_drake.cell.solid import Solid
from physid_drake.cell.support import PressureGrid
from physid_drake.effects.catalogue import known_effects
from physid_drake.effects.effect import Effect, Pose, PushFacts
from physid_drake.recording import Cylinder, Shape

Array = NDArray[np.float64]

LEAST_FRICTION = 0.02  # of theta's bounds
FARTHEST = 1.0  # m beyond the hand's way: a slide is hardly ever longer
FURTHER = 4.0  # times: a bounce doubles the speed, a tilt takes three quarters of the friction
WIDENINGS = 3  # at most: each brings another friction to a push that left the region thought of
SHORT = 1e-4  # s: for differences


@dc.dataclass(frozen=True, kw_only=True)
class Geometry:
    """What a cell is built from, and effects may change: the shape, the pressure under it, gravity [m/s^2]."""

    shape: Shape
    pressure: PressureGrid | None = None
    gravity: float = GRAVITY


@dc.dataclass(frozen=True, kw_only=True)
class Rollout:
    """A push to simulate: start, path, times [s], contact height [m], number in the recording, axes of P in W."""

    start: Start
    path: HandPath | None
    begin: float
    end: float
    hand_height: float | None
    order: int = 0
    hand_axes: Array = dc.field(default_factory=lambda: np.eye(2))


def geometry_with(effects: Sequence[Effect], geometry: Geometry) -> Geometry:
    """The geometry with what effects change of it; null effects change nothing."""
    for effect in effects:
        if not effect.is_null:
            pressure = effect.pressure()
            geometry = Geometry(
                shape=effect.reshaped(geometry.shape), pressure=geometry.pressure if pressure is None else pressure,
                gravity=effect.heaviness() * geometry.gravity,
            )  # fmt: skip
    return geometry


def roll(
    build: Callable[[Geometry], Cell], geometry: Geometry, body: Body, push: Rollout, effects: Sequence[Effect]
) -> Motion:
    """Simulate a push with effects.

    Args:
        build: gives the cell for a geometry; keeps it between calls.
        geometry: of the plain object.
        body: plain parameters.
        push: what is simulated.
        effects: the physics that is added; at their null values not a bit changes.
    """
    present = [effect for effect in effects if not effect.is_null]
    cell = build(geometry_with(present, geometry))
    facts = facts_of(cell, body, _region(cell, body, push, present), push.order, push.hand_axes)
    body = body_with(present, body, facts)
    facts = dc.replace(facts, region=_region(cell, body, push, present))  # less friction leads further
    start = true_start(present, push.start)
    path = push.path
    if path is not None:
        for effect in present:
            path = effect.hand(path, facts)
    for _ in range(WIDENINGS):
        motion = cell.rollout(
            body,
            start=start,
            path=path,
            begin=push.begin,
            end=push.end,
            hand_height=contact_height(cell.solid, geometry, push.hand_height),
            laws=[law for effect in present for law in effect.laws(facts)],
            frictions=frictions_of(present, facts),
            mount=mount_of(present, facts),
        )
        if motion.outcome is Outcome.DIVERGED:  # perhaps before its first pose
            break
        # Forces may lead further than the hand's speed would, onto a patch beyond.
        wider = dc.replace(facts, region=_reached(cell, motion, facts.region))
        if _as_rough(frictions_of(present, wider), frictions_of(present, facts)):
            break
        facts = wider
    return motion


def _as_rough(these: Sequence[FrictionLaw], others: Sequence[FrictionLaw]) -> bool:
    """Whether two regions have the same laws, and the contact holds the same friction."""
    return len(these) == len(others) and Frictions(tuple(these)).largest == Frictions(tuple(others)).largest


def contact_height(solid: Solid, plain: Geometry, height: float | None) -> float | None:
    """That of an object whose size effects change: a lying cylinder at its axis, others no higher than they are."""
    radius = solid.rolling_radius
    if height is None or radius is None or not isinstance(plain.shape, Cylinder):
        return None if height is None else min(height, solid.height)
    return height * radius / plain.shape.radius


def aimed(effects: Sequence[Effect], path: HandPath, facts: PushFacts) -> HandPath:
    """The path to command, so that the tip begins where ``path`` does although it is not where it is told to be."""
    start = path.start.copy()
    for effect in effects:
        if not effect.is_null:
            start = start + path.start - effect.hand(path, facts).start
    return dc.replace(path, start=start)


def true_pose(effects: Sequence[Effect], pose: Pose) -> Pose:
    """Pose of B for a pose that the tracker reports."""
    for effect in reversed(_as_listed(effects)):
        if not effect.is_null:
            pose = effect.true_pose(pose)
    return pose


def _as_listed(effects: Sequence[Effect]) -> list[Effect]:
    """Effects in the order of the catalogue: a frame is beside the centre before its place is measured wrongly."""
    order = {kind: k for k, kind in enumerate(known_effects())}
    return sorted(effects, key=lambda effect: order.get(type(effect), len(order)))


def true_start(effects: Sequence[Effect], start: Start) -> Start:
    """State of B for one that the tracker reports: a tracked point beside the centre has another velocity, too."""

    def pose_at(time: float) -> Array:
        x, y, yaw = np.array(start.pose) + time * np.array(start.velocity)
        return np.array(true_pose(effects, (float(x), float(y), float(yaw))))

    if all(type(effect).true_pose is Effect.true_pose for effect in effects):
        return start
    pose = pose_at(0.0)
    velocity = (pose_at(SHORT) - pose_at(-SHORT)) / (2.0 * SHORT) if any(start.velocity) else np.zeros(3)
    (x, y, yaw), (vx, vy, spin) = pose.tolist(), velocity.tolist()
    return dc.replace(start, pose=(x, y, yaw), velocity=(vx, vy, spin))


def facts_of(cell: Cell, body: Body, region: Array, order: int, hand_axes: Array | None = None) -> PushFacts:
    """What effects may know of a push that comes within a region (2, 2) [m]; without ``hand_axes`` P is as W."""
    return PushFacts(
        order=order, mass=body.mass, polar=cell.scene.support.polar,
        rolling_radius=cell.solid.rolling_radius, region=region,
        hand_axes=np.eye(2) if hand_axes is None else hand_axes,
    )  # fmt: skip


def body_with(effects: Sequence[Effect], body: Body, facts: PushFacts) -> Body:
    """The body with what effects change of it."""
    for effect in effects:
        body = effect.body(body, facts)
    return body


def frictions_of(effects: Sequence[Effect], facts: PushFacts) -> list[FrictionLaw]:
    """The effects' friction laws."""
    return [law for effect in effects for law in effect.frictions(facts)]


def mount_of(effects: Sequence[Effect], facts: PushFacts) -> Mount | None:
    """What holds the tip; None where no effect makes it give way."""
    mounts = [mount for effect in effects if (mount := effect.mount(facts)) is not None]
    return mounts[-1] if mounts else None


def tracked(motion: Motion, times: Array, effects: Sequence[Effect]) -> Array:
    """What the tracker reports (n, 3), x, y, yaw, at times (n,) [s]."""
    return reported(motion.planar_at(times - lateness_of(effects)), effects)


def lateness_of(effects: Sequence[Effect]) -> float:
    """By how much the tracker is late [s]."""
    return sum(effect.lateness() for effect in effects if not effect.is_null)


def reported(poses: Array, effects: Sequence[Effect]) -> Array:
    """What the tracker reports (n, 3) for poses (n, 3) of B, x, y, yaw, when it comes to them."""
    for effect in _as_listed(effects):
        if not effect.is_null:
            poses = effect.tracked(poses)
    return poses


def _reached(cell: Cell, motion: Motion, region: Array) -> Array:
    """A region (2, 2) with all places to which the object's points came."""
    x0, y0, x1, y1 = cell.solid.underside.extent()
    margin, places = math.hypot(x1 - x0, y1 - y0), motion.poses[:, 4:6]
    return np.array([
        np.minimum(region[0], places.min(axis=0) - margin), np.maximum(region[1], places.max(axis=0) + margin)
    ])  # fmt: skip


def _region(cell: Cell, body: Body, push: Rollout, effects: Sequence[Effect]) -> Array:
    """Lower and upper corner (2, 2) of where the object's points may come [m].

    Several effects carry it further than the baseline model would: beyond a tilt or a bounce there may be a patch.
    """
    places = np.array([push.start.pose[:2]])
    speed = float(np.hypot(*push.start.velocity[:2]))
    if push.path is not None:
        places = np.concatenate([places, push.path.knot_positions()])
        speed = max(speed, float(np.sqrt((push.path.velocities**2).sum(axis=1).max())))
    slide = speed**2 / (2.0 * GRAVITY * max(float(np.min(body.support_friction)), LEAST_FRICTION))
    slide *= FURTHER if len(effects) > 1 else 1.0
    slide = FARTHEST if cell.solid.rolling_radius is not None else min(slide, FARTHEST)
    x0, y0, x1, y1 = cell.solid.underside.extent()
    margin = math.hypot(x1 - x0, y1 - y0) + slide
    return np.array([places.min(axis=0) - margin, places.max(axis=0) + margin])
