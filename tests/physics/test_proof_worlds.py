"""The plain worlds of the proof against closed forms. Measured errors stand beside the tolerances."""

import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco")

from proof_pushes import DISC, MASS, MU, PLAN, SHAPES, central_push, push, slide, spin_angle, with_shape
from reference import planar

from physid_drake.recording import Cylinder
from physid_drake.validation.worlds.effects import catalogue as fx
from physid_drake.validation.worlds.feet import feet_of
from physid_drake.validation.worlds.mujoco_world import PushWorld
from physid_drake.validation.worlds.scene import draw_scene
from physid_drake.validation.worlds.shapes import distance_outside, height_of, outline_of, plan_moments
from physid_drake.validation.worlds.world_plan import GRAVITY

shapes = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)


@shapes
@pytest.mark.parametrize("speed", [0.1, 0.5, 1.0])
def test_stopping_distance_is_v_squared_over_two_mu_g(shape, speed):
    # Measured: -0.61 to -0.86 % at 0.1 m/s, -0.06 % at 1 m/s; -v dt / 2 is most of it.
    x, y, yaw = slide(velocity=(speed, 0.0, 0.0), plan=with_shape(shape))
    assert x == pytest.approx(speed**2 / 2 / MU / GRAVITY, rel=0.01)
    assert abs(y) < 1e-5
    assert abs(yaw) < 1e-4


@pytest.mark.parametrize("heading", [0.3, 1.1, 2.5])
def test_friction_is_the_same_in_every_direction(heading):
    x, y, _ = slide(velocity=(0.5 * math.cos(heading), 0.5 * math.sin(heading), 0.0))
    assert math.atan2(y, x) == pytest.approx(heading, abs=1e-4)
    assert math.hypot(x, y) == pytest.approx(0.25 / 2 / MU / GRAVITY, rel=0.003)


@shapes
def test_feet_have_the_moments_of_the_underside(shape):
    feet, weights = feet_of(shape)
    moments = plan_moments(shape)
    assert weights.sum() == pytest.approx(1)
    np.testing.assert_allclose(weights @ feet, 0, atol=1e-9)
    assert weights @ (feet**2).sum(axis=1) == pytest.approx(moments[:2].sum(), rel=1e-9)
    np.testing.assert_allclose(weights @ feet**2, moments[:2], rtol=0.02)
    assert distance_outside(shape, feet).max() < 0


@shapes
def test_spin_down_is_that_of_uniform_pressure(shape):
    # Measured -0.24, -0.78 (disc) and -0.08 %.
    reference = planar.PlanarObject(
        name="", height=0.03, mass=MASS, polygon=None if shape is DISC else outline_of(shape), radius=0.04
    )
    points, weights = reference.support(4000)
    arm = float(weights @ np.hypot(*points.T))
    yaw = slide(velocity=(0.0, 0.0, 12.0), plan=with_shape(shape))[2]
    assert yaw == pytest.approx(spin_angle(shape, 12.0, arm), rel=0.01)


def test_half_slippery_underside_turns_to_the_side_that_holds():
    # Left of the motion holds: it turns left.
    patch = fx.FrictionPatch(ratio=2.0, x=0.0, y=10.0, radius=10.0)
    assert slide(patch)[2] > 0.03
    assert slide(replace(patch, y=-10.0))[2] == pytest.approx(-slide(patch)[2], rel=0.01)


@pytest.mark.parametrize("seed", range(3))
def test_drawn_pushes_follow_the_planar_reference(seed):
    # Measured on 84 pushes of 14 scenes: rms 0.02 mm and 0.4 mrad, no sample further off than 2 mrad.
    scene = draw_scene(np.random.default_rng([seed]))
    plan, shape = scene.plan, scene.plan.shape
    round_one = isinstance(shape, Cylinder)
    body = planar.PlanarObject(
        name="",
        height=height_of(shape),
        mass=plan.mass,
        polygon=None if round_one else outline_of(shape),
        radius=shape.radius if round_one else 0.0,
    )
    for drawn in scene.pushes[:4]:
        motion = PushWorld(plan).run(drawn.pose, drawn.path, sample_time=0.01)
        path = planar.HandPath(times=drawn.path.times, p0=drawn.path.start, velocities=drawn.path.velocities)
        hand = planar.Hand(path=path, radius=plan.tip_radius, height=plan.tip_height, friction=plan.hand_friction)
        expected = planar.simulate_planar(
            body,
            plan.support_friction,
            motion.times,
            hand=hand,
            pose=drawn.pose,
            support=body.support(600),
            time_step=5e-5,
        )
        error = np.sqrt(((motion.poses - expected.poses) ** 2).mean(axis=0))
        assert motion.rested
        assert error[:2].max() < 1e-4
        assert error[2] < 2e-3


def test_the_same_push_gives_the_same_bits():
    world = PushWorld(PLAN)
    first, again = (world.run((0.0, 0.0, 0.1), central_push()) for _ in range(2))
    assert np.array_equal(first.poses, again.poses)
    assert np.array_equal(first.poses, PushWorld(PLAN).run((0.0, 0.0, 0.1), central_push()).poses)


def test_hand_carries_what_friction_takes():
    # A central push; measured 1e-6.
    motion = push(path=central_push(speed=0.2, seconds=0.3), sample_time=0.005)
    cruise = (motion.times > 0.25) & (motion.times < 0.36)
    assert motion.forces[cruise, 0].mean() == pytest.approx(MU * MASS * GRAVITY, rel=0.001)
    assert abs(motion.forces[motion.times < 0.1]).max() == 0


def test_a_hand_that_stops_slowly_leans_on_at_rest():
    lag = fx.ActuatorLag(time_constant=0.03)
    motion = push(lag, path=central_push(speed=0.03, seconds=0.8), sample_time=0.005, rest=0.1)
    still = motion.forces[-10:, 0]  # of the time that is no longer simulated
    assert motion.rested
    assert still[0] == still[-1]
    assert 0.1 * MU * MASS * GRAVITY < still[0] < 1.001 * MU * MASS * GRAVITY
