"""An outline with notches in both integrators: pushed on faces, at corners, in a notch, and wedged into one."""

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
    assert rms((poses[0] - poses[1]) / SIGMA) < 4.0  # the contact changes face with every tick
