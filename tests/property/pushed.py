"""Objects, pushes and effects that the property tests draw; what turning and mirroring makes of them on the twin."""

import dataclasses as dc
import math
from functools import cache

import numpy as np
from drawn import generators, numbers, polygons
from hypothesis import strategies as st
from twin import body_of

from physid_drake.cell import HandPath, Outcome, Start
from physid_drake.cell.solid import solid_of
from physid_drake.effects import SHIPPED, Surroundings
from physid_drake.effects.rollout import Geometry, Rollout, geometry_with
from physid_drake.recording import Box, Cylinder, Prism
from physid_drake.twin.twin import Twin
from physid_drake.twin.with_effects import as_reported, push_with

HEIGHT, TIP = 0.03, 0.01  # m
SIZE = 0.1  # m, about, of an object
END = 0.7  # s
TIMES = np.linspace(0.0, END, 71)


def sides():
    return numbers(0.05, 0.12)


boxes = st.builds(lambda x, y: Box(size=(x, y, HEIGHT)), sides(), sides())
discs = st.builds(lambda r: Cylinder(radius=r, length=HEIGHT, axis="z"), numbers(0.03, 0.06))
prisms = st.builds(lambda corners: Prism(polygon=corners, height=HEIGHT), polygons())
shapes = boxes | discs | prisms


@st.composite
def bodies(draw, least_friction=0.1):
    mass, friction = draw(numbers(0.05, 2.0)), draw(numbers(least_friction, 0.6))
    return body_of(mass, friction, hand_friction=draw(numbers(0.05, 0.5)))


@st.composite
def rollouts(draw):
    """A push from any side at any speed, past the middle of an object that stands anywhere, which lets it go."""
    pose = (draw(numbers(-0.2, 0.2)), draw(numbers(-0.2, 0.2)), draw(numbers(-3.0, 3.0)))
    heading, aside, speed = draw(numbers(-3.0, 3.0)), draw(numbers(-0.03, 0.03)), draw(numbers(0.1, 0.5))
    along = np.array([math.cos(heading), math.sin(heading)])
    start = np.array(pose[:2]) - SIZE * along + aside * np.array([-along[1], along[0]])
    steady = 0.8 * SIZE / speed if speed > 0.2 else 0.4
    path = HandPath(
        times=np.array([0.0, 0.05, 0.05 + steady, 0.09 + steady]), velocities=np.outer([0, speed, speed, 0], along),
        start=start,
    )  # fmt: skip
    order = draw(st.integers(0, 3))
    return Rollout(start=Start(pose=pose), path=path, begin=0.0, end=END, hand_height=0.5 * HEIGHT, order=order)


@st.composite
def slides(draw):
    """An object that is let go with any speed and spin."""
    speed, heading = draw(numbers(0.05, 0.6)), draw(numbers(-3.0, 3.0))
    velocity = (speed * math.cos(heading), speed * math.sin(heading), draw(numbers(-8.0, 8.0)))
    pose = (draw(numbers(-0.1, 0.1)), draw(numbers(-0.1, 0.1)), draw(numbers(-3.0, 3.0)))
    start = Start(pose=pose, velocity=velocity)
    return Rollout(start=start, path=None, begin=0.0, end=END, hand_height=None, order=draw(st.integers(0, 3)))


AROUND = Surroundings(
    mass=0.35, friction=0.3, size=np.array([0.1, 0.08]), height=HEIGHT, region=np.array([[-0.2, -0.2], [0.2, 0.2]]),
    top_speed=0.4, pushes=4, has_hand=True, rolls=False,
)  # fmt: skip
PLANAR = tuple(kind for kind in SHIPPED if kind.applies(AROUND))
BY_NAME = {kind.name: kind for kind in PLANAR}


def point_of(kind, rng, most=8.0):
    """A point of an effect's chart, some steps away from where it is null, and within bounds."""
    chart, families = kind.chart(AROUND), kind.families(AROUND)
    family = families[rng.integers(len(families))]
    point = np.array(family.point)
    for k, c in enumerate(chart):
        size = most * family.size * c.step if k in family.free else min(c.std, 0.5 if c.log else 3.0 * c.step)
        least = 0.1 if point[k] == c.lower else -1.0
        point[k] = np.clip(point[k] + size * rng.uniform(least, 1.0), c.lower, c.upper)
    return point


def effects(*names):
    """Effects of these names, or of all, about as large as they are in recordings."""
    kinds = [BY_NAME[name] for name in names] if names else PLANAR
    return st.builds(lambda kind, rng: kind.at(point_of(kind, rng), AROUND), st.sampled_from(kinds), generators())


@cache
def twin_of(geometry):
    return Twin(solid=solid_of(geometry.shape), hand_radius=TIP, pressure=geometry.pressure, gravity=geometry.gravity)


def rolled(shape, body, push, some=(), times=TIMES):
    """What the tracker reports of an object on the twin."""
    plain = Geometry(shape=shape)
    twin = twin_of(geometry_with(some, plain))
    (trace,) = twin.rollouts([push_with(twin, plain, body, push, some, times)])
    assert trace.outcome is Outcome.COMPLETED
    return as_reported(trace, some)


def rotation(angle):
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


# What is fixed in the world turns and is mirrored with it. By effect: names of its places, axes and angles.
PLACED = ("friction_patch", "tether", "magnet")
ALONG = {"friction_gradient": ("slope_x", "slope_y"), "table_tilt": ("x", "y")}
IN_OBJECT = {"com_offset": ("y",), "tracker_bias": ("y", "yaw"), "anisotropic_object": ("angle",)}


def taken_along(effect, move):
    """An effect of the world once the world is moved; ``move(vector, is_place)`` moves a vector of it."""
    if effect.name in PLACED:
        x, y = move(np.array([effect.x, effect.y]), True).tolist()
        return dc.replace(effect, x=x, y=y)
    if effect.name in ALONG:
        first, second = ALONG[effect.name]
        vector = np.array([getattr(effect, first), getattr(effect, second)])
        tilt = effect.name == "table_tilt"  # sines of its angles are a vector
        moved = move(np.sin(vector) if tilt else vector, False)
        x, y = (np.arcsin(moved) if tilt else moved).tolist()
        return dc.replace(effect, **{first: x, second: y})
    if effect.name == "anisotropic_table":
        x, y = move(np.array([math.cos(effect.angle), math.sin(effect.angle)]), False).tolist()
        return dc.replace(effect, angle=math.atan2(y, x))
    return effect


def turned(push, some, angle, shift):
    """A push and effects in a world that is turned about its origin, and then shifted."""
    turn = rotation(angle)
    (x, y, yaw), (vx, vy, spin) = push.start.pose, push.start.velocity
    (x, y), (vx, vy) = (turn @ [x, y] + shift).tolist(), (turn @ [vx, vy]).tolist()
    path = push.path
    if path is not None:
        path = dc.replace(path, velocities=path.velocities @ turn.T, start=turn @ path.start + shift)
    moved = dc.replace(
        push, start=Start(pose=(x, y, yaw + angle), velocity=(vx, vy, spin)), path=path,
        hand_axes=turn @ push.hand_axes,
    )  # fmt: skip
    return moved, [taken_along(e, lambda v, place: turn @ v + (shift if place else 0.0)) for e in some]


def mirrored(push, some):
    """A push and effects in a mirror along y."""
    (x, y, yaw), (vx, vy, spin) = push.start.pose, push.start.velocity
    path, flip = push.path, np.array([1.0, -1.0])
    if path is not None:
        path = dc.replace(path, velocities=path.velocities * flip, start=path.start * flip)
    moved = dc.replace(
        push, start=Start(pose=(x, -y, -yaw), velocity=(vx, -vy, -spin)), path=path,
        hand_axes=flip[:, None] * push.hand_axes,
    )  # fmt: skip
    return moved, [_in_mirror(taken_along(e, lambda v, _: v * flip)) for e in some]


def _in_mirror(effect):
    """What is fixed in the object; the hand's axes are mirrored with it."""
    if effect.name == "uneven_support":
        return dc.replace(effect, weights=tuple(row[::-1] for row in effect.weights))
    return dc.replace(effect, **{name: -getattr(effect, name) for name in IN_OBJECT.get(effect.name, ())})


def mirror_of(shape):
    """A shape in a mirror along y."""
    if not isinstance(shape, Prism):
        return shape
    return dc.replace(shape, polygon=tuple((x, -y) for x, y in shape.polygon[::-1]))
