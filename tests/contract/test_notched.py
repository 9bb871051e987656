"""An outline with notches in both integrators: pushed on faces, at corners, in a notch, and wedged into one."""

import dataclasses as dc
import math
from functools import cache

import numpy as np
import pytest
from test_twin_effects import STIFF
from twin import SIGMA, body_of, rms

from physid_drake.cell import Cell, HandPath, Outcome, Start
from physid_drake.cell.solid import solid_of
from physid_drake.cell.touch import Tip
from physid_drake.policies.planned_push import PlannedPush
from physid_drake.recording import Prism, polygon_centroid
from physid_drake.twin.twin import Twin, TwinPush

RADIUS = 0.008
AT_REST = Start(pose=(0.0, 0.0, 0.0))
BODY = body_of(0.4, 0.3)


def centred(corners):
    corners = np.asarray(corners, dtype=np.float64)
    return corners - polygon_centroid(corners)


TEE = centred([[-2, 1], [-2, 0], [-0.5, 0], [-0.5, -3], [0.5, -3], [0.5, 0], [2, 0], [2, 1]]) * 0.04
ELL = centred([[0, 0], [3, 0], [3, 1], [1, 1], [1, 4], [0, 4]]) * 0.03
SHAPES = {"tee": TEE, "ell": ELL}


@cache
def built(name):
    shape = Prism(polygon=tuple((x, y) for x, y in SHAPES[name].tolist()), height=0.03)
    twin = Twin(solid=solid_of(shape), hand_radius=RADIUS, points=STIFF.contact.support_points)
    return twin, Cell(shape, hand_radius=RADIUS, config=STIFF)


def both(name, path):
    """Poses (n, 3) of twin and cell, and where the hand is (n, 2)."""
    twin, cell = built(name)
    end = float(path.times[-1]) + 1.0
    times = np.linspace(0.0, end, 60)
    push = TwinPush(body=BODY, start=AT_REST, path=path, begin=0.0, end=end, times=times)
    motion = cell.rollout(BODY, start=AT_REST, path=path, begin=0.0, end=end)
    assert motion.outcome is Outcome.COMPLETED
    return twin.rollouts([push])[0].poses, motion.planar_at(times), path.positions(times)


@pytest.mark.parametrize(
    ("name", "direction", "offset"),
    [("tee", 0, 0.0), ("tee", 270, 0.0), ("tee", 0, -0.03), ("tee", 180, 0.05), ("ell", 90, 0.0), ("ell", 180, -0.06),
     ("ell", 45, 0.05), ("ell", 0, 0.05)],
)  # fmt: skip
def test_cell_and_twin_push_it_alike(name, direction, offset):
    push = PlannedPush(direction=math.radians(direction), speed=0.1, travel=0.06, contact_offset=offset)
    path = push.path((0.0, 0.0, 0.0), built(name)[0].solid.outline, RADIUS)
    twin, cell, _ = both(name, path)
    assert np.abs(cell[-1]).max() > 0.02
    assert rms((twin - cell) / SIGMA) < 0.1  # measured: at most .06


@pytest.mark.parametrize("direction", [225, 200, 250])
def test_a_tip_that_is_wedged_into_a_notch_carries_it_along(direction):
    """Two faces hold the tip: it stays in the corner, and neither face gives way."""
    ahead = np.array([math.cos(math.radians(direction)), math.sin(math.radians(direction))])
    corner = ELL[3]
    path = HandPath(
        times=np.array([0.2, 0.25, 0.8, 0.85]),
        velocities=np.outer([0.0, 0.1, 0.1, 0.0], ahead),
        start=corner + RADIUS - 0.03 * ahead,
    )
    poses = both("ell", path)
    tip = Tip(built("ell")[0].solid.outline, RADIUS)
    pushed = slice(25, 32)
    for motion in poses[:2]:
        gaps = [tip.gap(*pose, *hand)[0] for pose, hand in zip(motion, poses[2], strict=True)]
        assert min(gaps) > -2e-5
        for (x, y, yaw), hand in zip(motion[pushed], poses[2][pushed], strict=True):
            c, s = math.cos(yaw), math.sin(yaw)
            local = np.array([[c, s], [-s, c]]) @ (hand - [x, y])
            assert local == pytest.approx(corner + RADIUS, abs=2e-3)
    assert rms((poses[0] - poses[1]) / SIGMA) < 4.0  # the contact changes face with every time step


SHAPES_DRAWN = {8: "tee", 6: "ell", 12: "plus"}


def drawn(seed):
    from physid_drake.validation.worlds.scene import draw_scene

    return draw_scene(np.random.default_rng([seed, 7]), notched=True)


@pytest.mark.parametrize("seed", range(1, 7))
def test_the_feet_of_a_drawn_world_have_its_undersides_moments(seed):
    from physid_drake.validation.worlds.feet import feet_of
    from physid_drake.validation.worlds.shapes import plan_moments

    shape = drawn(seed).plan.shape
    feet, weights = feet_of(shape)
    assert len(shape.polygon) in SHAPES_DRAWN and 40 < len(feet) < 200
    assert weights @ feet == pytest.approx([0.0, 0.0], abs=1e-6)
    xx, yy, xy = plan_moments(shape)
    assert (weights * feet.T) @ feet == pytest.approx(np.array([[xx, xy], [xy, yy]]), rel=1e-6, abs=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3, 5])
def test_another_simulator_pushes_it_alike(seed):
    """MuJoCo's world of the proof, with two contacts where the tip has two, beside the twin's one."""
    pytest.importorskip("mujoco")
    from physid_drake.validation.worlds.strengths import simulate

    scene = drawn(seed)
    scene = dc.replace(scene, pushes=tuple(dc.replace(push, friction_factor=1.0) for push in scene.pushes[:8]))
    plan = scene.plan
    twin = Twin(solid=solid_of(plan.shape), hand_radius=plan.tip_radius, points=100)
    body = body_of(plan.mass, plan.support_friction, hand_friction=plan.hand_friction)
    apart = []
    for push, motion in zip(scene.pushes, simulate(scene, ()), strict=True):
        path = HandPath(times=push.path.times, velocities=push.path.velocities, start=np.asarray(push.path.start))
        rollout = TwinPush(
            body=body, start=Start(pose=push.pose), path=path, begin=0.0, end=float(motion.times[-1]),
            times=np.asarray(motion.times), hand_height=plan.tip_height,
        )  # fmt: skip
        apart.append(rms((twin.rollouts([rollout])[0].poses - motion.poses) / SIGMA))
    assert np.median(apart) < 0.1 and max(apart) < 0.4  # measured: .06 to .07, at most .23
