"""Pushes and free slides in the proof's worlds, for tests: frames are W and B, units SI."""

from dataclasses import replace

import numpy as np

from physid_drake.recording import Box, Cylinder, Prism
from physid_drake.validation.worlds.mujoco_world import PushWorld
from physid_drake.validation.worlds.shapes import gyration_squared, height_of
from physid_drake.validation.worlds.world_plan import GRAVITY, HandPath, Plan

MASS, MU = 0.2, 0.3
ERASER = Box(size=(0.127, 0.051, 0.030))
DISC = Cylinder(radius=0.04, length=0.05, axis="z")
TRIANGLE = Prism(polygon=((-0.05, -0.03), (0.07, -0.03), (-0.02, 0.06)), height=0.03)
SHAPES = {"box": ERASER, "disc": DISC, "triangle": TRIANGLE}
PLAN = Plan(shape=ERASER, mass=MASS, support_friction=MU, hand_friction=0.2, tip_radius=0.008, tip_height=0.015)


def slide(*effects, velocity=(0.5, 0.0, 0.0), pose=(0.0, 0.0, 0.0), plan=PLAN, **more):
    """Where a free slide ends, less where it began."""
    motion = PushWorld(plan, effects, pushes=5).run(pose, None, velocity=velocity, **more)
    assert motion.rested
    return motion.poses[-1] - motion.poses[0]


def with_shape(shape):
    return replace(PLAN, shape=shape, tip_height=height_of(shape) / 2)


def straight_path(start, velocity, seconds, ramp=0.04, lead=0.05):
    velocity = np.array(velocity)
    knots = np.cumsum([lead, ramp, seconds, ramp])
    return HandPath(
        times=knots, start=np.array(start), velocities=np.array([0 * velocity, velocity, velocity, 0 * velocity])
    )


def central_push(speed=0.3, offset=0.0, seconds=0.2):
    """Along x, onto the eraser's short face."""
    return straight_path((-0.0635 - 0.008 - 0.015, offset), (speed, 0.0), seconds)


def push(*effects, path=None, pose=(0.0, 0.0, 0.0), plan=PLAN, **more):
    return PushWorld(plan, effects).run(pose, path or central_push(), **more)


def spin_angle(shape, spin, arm):
    return spin**2 * gyration_squared(shape) / (2 * MU * GRAVITY * arm)
