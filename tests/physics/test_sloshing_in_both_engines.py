"""A push of an object with liquid, in the cell and in MuJoCo, which has the liquid as a body on two slide joints."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from twin import body_of

from physid_drake.cell import Cell, HandPath, Start
from physid_drake.effects import effect_named
from physid_drake.effects.rollout import Geometry, Rollout, roll
from physid_drake.recording import Box, Cylinder
from physid_drake.validation.worlds import world_plan
from physid_drake.validation.worlds.effects import catalogue as fx
from physid_drake.validation.worlds.mujoco_world import PushWorld

MASS, MU, HAND, TIP = 0.3, 0.3, 0.2, 0.008
SLOSH = {"fraction": 0.3, "frequency": 2.5, "damping": 0.1}
POSE = (0.0, 0.0, 0.1)
BOX, CAN = Box(size=(0.127, 0.091, 0.030)), Cylinder(radius=0.033, length=0.115, axis="z")


def pushed(reach, side, speed, seconds):
    """Knots of a push along x with a release."""
    velocity = np.array([speed, 0.0])
    knots = np.cumsum([0.05, 0.03, seconds, 0.03])
    velocities = np.outer([0.0, 1.0, 1.0, 0.0], velocity)
    return {"times": knots, "start": np.array([-reach - TIP - 0.01, side]), "velocities": velocities}


def in_mujoco(shape, height, knots):
    plan = world_plan.Plan(
        shape=shape, mass=MASS, support_friction=MU, hand_friction=HAND, tip_radius=TIP, tip_height=height
    )
    motion = PushWorld(plan, [fx.Sloshing(**SLOSH)]).run(POSE, world_plan.HandPath(**knots))
    return motion.times, motion.poses


def in_the_cell(shape, height, knots, times):
    def build(g):
        return Cell(g.shape, hand_radius=TIP, gravity=g.gravity)

    push = Rollout(
        start=Start(pose=POSE), path=HandPath(**knots), begin=0.0, end=float(times[-1]), hand_height=height
    )  # fmt: skip
    body = body_of(MASS, MU, hand_friction=HAND)
    return roll(build, Geometry(shape=shape), body, push, [effect_named("sloshing")(**SLOSH)]).planar_at(times)


@pytest.mark.parametrize(
    ("shape", "height", "knots", "most"),
    [
        # Measured: 0.13 and 0.15 mm, at the end; without liquid 0.10 and 0.15 mm. Were the pressure that of the rigid
        # rest under the same friction, 2.5 and 3.3 mm.
        (BOX, 0.015, pushed(0.0635, 0.02, 0.25, 0.6), 3e-4),
        (CAN, 0.0575, pushed(0.033, 0.008, 0.3, 0.4), 4e-4),
    ],
    ids=["box", "can"],
)
def test_liquid_in_the_cell_moves_the_object_as_a_body_on_slide_joints_does(shape, height, knots, most):
    times, want = in_mujoco(shape, height, knots)
    got = in_the_cell(shape, height, knots, times)
    away = np.hypot(*(got - want)[:, :2].T)
    assert away.max() < most
    assert np.abs(got - want)[:, 2].max() < 0.01  # rad
