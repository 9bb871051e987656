"""A world without effects, drawn at random: object, friction, sensors, pushes as people make them. SI units."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np

from physid_drake.errors import RecordingError
from physid_drake.recording import Box, Cylinder, Prism, is_convex, outline_distance, polygon_centroid
from physid_drake.validation.worlds.feet import friction_that_lifts
from physid_drake.validation.worlds.shapes import Array, Solid, height_of, outline_of
from physid_drake.validation.worlds.world_plan import GRAVITY, HandPath, Plan, Pose

Rng: TypeAlias = np.random.Generator

LEAD: Final = 0.2
"""s of rest before the hand moves."""
SPREAD: Final = 0.15
"""m; start places are within this of the origin, along x and y."""
TABLE_SIZE: Final = (1.6, 1.4)
_SPEEDS: Final = (0.05, 0.5)
_SHORTEST_PUSH: Final = 0.15  # s from the touch to the brake
_LONGEST_PUSH: Final = 0.8
_RESTS: Final = (0.2, 0.6)  # s


@dataclass(frozen=True, kw_only=True)
class DrawnPush:
    """One push.

    Attributes:
        pose: of B at the start.
        path: what the recording says of the tip.
        friction_factor: its own, on the support friction.
        rest: how long it is recorded once hand and object are still [s]; drawn, or it told a late tracker.
    """

    pose: Pose
    path: HandPath
    friction_factor: float
    rest: float


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Standard deviations of one sample, and how streams fail.

    Attributes:
        position: of the object [m].
        rotation: of the object [rad].
        hand: of the tip [m].
        correlation: of object noise from sample to sample.
        force: N; None where it is not measured.
        jitter: a stamp differs from the true time by up to this [s].
        dropout: share of object samples that are missing.
        friction_scatter: relative, from push to push.
    """

    position: float
    rotation: float
    hand: float
    correlation: float
    force: float | None
    jitter: float
    dropout: float
    friction_scatter: float


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A world without effects, and how it is recorded.

    Attributes:
        plan: the baseline model.
        pushes: in order.
        noise: of the sensors.
        rate: of samples [Hz].
        commanded: whether the hand columns are said to be commanded.
        sensors_stated: whether the recording states its sensors' deviations.
        stated_mass: what a scale said [kg]; None: unknown.
    """

    plan: Plan
    pushes: tuple[DrawnPush, ...]
    noise: Noise
    rate: float
    commanded: bool
    sensors_stated: bool
    stated_mass: float | None


def draw_scene(rng: Rng, *, notched: bool = False) -> Scene:
    """A world without effects; its object may be one with notches."""
    shape, mass = _draw_notched(rng) if notched else _draw_object(rng)
    most = min(0.5, 0.9 * friction_that_lifts(shape))
    plan = Plan(
        shape=shape,
        mass=mass,
        support_friction=float(rng.uniform(0.15, most)),
        hand_friction=float(rng.uniform(0.1, 0.5)),
        tip_radius=float(rng.uniform(0.005, 0.012)),
        tip_height=height_of(shape) / 2.0,
    )
    noise = _draw_noise(rng)
    rate = float(rng.choice([100.0, 200.0]))
    scale = float(1.0 + 0.01 * rng.standard_normal())
    stated_mass = round(mass * scale, 5) if rng.random() < 0.8 else None
    commanded, sensors_stated = bool(rng.random() < 0.5), bool(rng.random() < 0.5)
    pushes = tuple(_draw_push(rng, plan, noise.friction_scatter) for _ in range(int(rng.integers(8, 21))))
    return Scene(
        plan=plan,
        pushes=pushes,
        noise=noise,
        rate=rate,
        commanded=commanded,
        sensors_stated=sensors_stated,
        stated_mass=stated_mass,
    )


def _draw_object(rng: Rng) -> tuple[Solid, float]:
    """Shape and mass [kg] of one whose base stays loaded at a friction of 0.2 at least."""
    while True:
        kind = rng.choice(["eraser", "box", "book", "disc", "triangle", "pentagon"])
        mass = float(np.exp(rng.uniform(math.log(0.05), math.log(1.0))))
        shape: Solid
        if kind == "eraser":
            shape, mass = Box(size=(0.127, 0.051, 0.030)), 0.054
        elif kind == "box":
            shape = Box(size=(0.10, 0.08, 0.06))
        elif kind == "book":
            shape = Box(size=(0.22, 0.15, 0.03))
        elif kind == "disc":
            radius = round(float(rng.uniform(0.033, 0.05)), 4)
            shape = Cylinder(radius=radius, length=round(radius * float(rng.uniform(0.8, 1.5)), 4), axis="z")
        else:
            shape = _draw_prism(rng, 3 if kind == "triangle" else 5)
        if friction_that_lifts(shape) > 0.22:
            return shape, mass


def _draw_notched(rng: Rng) -> tuple[Solid, float]:
    """A T, an L or a plus and its mass [kg]."""
    while True:
        mass = float(np.exp(rng.uniform(math.log(0.05), math.log(1.0))))
        wide, thick, long = (float(rng.uniform(*of)) for of in ((0.09, 0.15), (0.025, 0.04), (0.05, 0.09)))
        half, arm = 0.5 * wide, 0.5 * thick
        outlines = {
            "tee": [(-half, thick), (-half, 0), (-arm, 0), (-arm, -long), (arm, -long), (arm, 0), (half, 0),
                    (half, thick)],
            "ell": [(0, 0), (wide, 0), (wide, thick), (thick, thick), (thick, thick + long), (0, thick + long)],
            "plus": [(arm, -half), (arm, -arm), (half, -arm), (half, arm), (arm, arm), (arm, half), (-arm, half),
                     (-arm, arm), (-half, arm), (-half, -arm), (-arm, -arm), (-arm, -half)],
        }  # fmt: skip
        polygon = np.round(np.array(outlines[str(rng.choice(list(outlines)))]), 4)
        polygon = np.round(polygon - polygon_centroid(polygon), 6)
        shape = Prism(
            polygon=tuple((x, y) for x, y in polygon.tolist()), height=round(float(rng.uniform(0.02, 0.04)), 3)
        )
        if friction_that_lifts(shape) > 0.22:
            return shape, mass


def _draw_prism(rng: Rng, corners: int) -> Prism:
    while True:
        angles = 2.0 * math.pi * (np.arange(corners) + rng.uniform(-0.18, 0.18, corners)) / corners
        radii = rng.uniform(0.05, 0.075, corners) if corners == 3 else rng.uniform(0.045, 0.06) * np.ones(corners)
        polygon = np.round(radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]), 4)
        polygon = np.round(polygon - polygon_centroid(polygon), 6)
        if not is_convex(polygon):
            continue
        try:
            return Prism(polygon=tuple((x, y) for x, y in polygon.tolist()), height=round(rng.uniform(0.03, 0.05), 3))
        except RecordingError:
            continue


def _draw_noise(rng: Rng) -> Noise:
    level = float(rng.uniform())
    turned = min(1.0, max(0.0, level + 0.25 * float(rng.standard_normal())))
    correlated, forced, jittery, lossy = rng.random(4) < [1.0 / 3.0, 0.25, 0.25, 0.25]
    correlation, dropout = float(rng.uniform(0.3, 0.9)), float(rng.uniform(0.01, 0.05))
    return Noise(
        position=1e-4 * 10.0**level,
        rotation=1e-3 * 10.0**turned,
        hand=float(rng.uniform(3e-5, 1e-4)),
        correlation=correlation if correlated else 0.0,
        force=0.02 if forced else None,
        jitter=5e-4 if jittery else 0.0,
        dropout=dropout if lossy else 0.0,
        friction_scatter=float(rng.uniform(0.01, 0.05)),
    )


def _draw_push(rng: Rng, plan: Plan, scatter: float) -> DrawnPush:
    """Rest, ramp, touch, constant speed that may turn a little, brake, rest."""
    place, yaw = rng.uniform(-SPREAD, SPREAD, 2), float(rng.uniform(-math.pi, math.pi))
    factor = max(0.5, 1.0 + scatter * float(rng.standard_normal()))
    brake = float(rng.uniform(0.03, 0.08))
    slowest = _SPEEDS[0]
    if rng.random() < 0.75:  # to be released: the brake is harder than friction's
        brake = min(brake, 0.45 / (1.3 * plan.support_friction * GRAVITY))
        slowest = max(slowest, 1.3 * plan.support_friction * GRAVITY * brake)
    speed = float(np.exp(rng.uniform(math.log(slowest), math.log(max(slowest, _SPEEDS[1])))))
    touch, inward = _draw_contact(rng, plan)
    heading = math.radians(rng.uniform(-25.0, 25.0))
    bend = math.radians(rng.uniform(-25.0, 25.0)) if rng.random() < 0.3 else 0.0
    run_up = float(rng.uniform(0.008, 0.020)) / math.cos(heading)
    ramp = min(2.0 * float(rng.uniform(0.5, 0.9)) * run_up / speed, 0.15)
    length = float(rng.uniform(0.03, 0.10))
    contact = min(_LONGEST_PUSH, max(_SHORTEST_PUSH, length / speed))
    first = (run_up - speed * ramp / 2.0) / speed
    angle = math.atan2(inward[1], inward[0]) + heading + yaw
    ahead, bent = (np.array([math.cos(a), math.sin(a)]) for a in (angle, angle + bend))
    c, s = math.cos(yaw), math.sin(yaw)
    at_touch = place + np.array([[c, -s], [s, c]]) @ touch
    path = HandPath(
        times=np.cumsum([LEAD, ramp, first, contact, brake]),
        start=at_touch - run_up * ahead,
        velocities=speed * np.array([[0.0, 0.0], ahead, ahead, bent, [0.0, 0.0]]),
    )
    pose = float(place[0]), float(place[1]), yaw
    return DrawnPush(pose=pose, path=path, friction_factor=factor, rest=float(rng.uniform(*_RESTS)))


def _draw_contact(rng: Rng, plan: Plan) -> tuple[Array, Array]:
    """Place of the tip's centre at the touch, and the inward normal there (2,), in B."""
    if isinstance(plan.shape, Cylinder):
        angle = float(rng.uniform(-math.pi, math.pi))
        inward = np.array([math.cos(angle), math.sin(angle)])
        return -(plan.shape.radius + plan.tip_radius) * inward, inward
    corners = outline_of(plan.shape)
    edges = np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(*edges.T)
    while True:
        k = int(rng.choice(len(corners), p=lengths / lengths.sum()))
        inward = np.array([-edges[k, 1], edges[k, 0]]) / lengths[k]
        aim = corners[k] + (0.5 + 0.3 * float(rng.uniform(-1.0, 1.0))) * edges[k]
        touch = aim - plan.tip_radius * inward
        if is_convex(corners) or _is_free(corners, touch, inward, plan.tip_radius):
            return touch, inward


def _is_free(corners: Array, touch: Array, inward: Array, radius: float) -> bool:
    """Whether a tip comes to its touch without meeting another face, by whatever heading and run-up."""
    base = math.atan2(inward[1], inward[0])
    ways = base + np.radians([-25.0, -12.0, 0.0, 12.0, 25.0])
    back = np.linspace(0.004, 0.030, 14)
    places = touch - back[:, None, None] * np.stack([np.cos(ways), np.sin(ways)], axis=1)
    return bool((outline_distance(corners, places.reshape(-1, 2)) > radius + 5e-4).all())
