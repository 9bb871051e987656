"""Effects of the sensor that tracks the object."""

import math

import numpy as np
import pytest
from motions import BOX, MASS, MU, built, make, push_along_x
from twin import body_of

from physid_drake.cell import Start
from physid_drake.effects import effect_named
from physid_drake.effects.rollout import Rollout, roll, tracked


def test_a_late_tracker_reports_what_was():
    motion, _ = push_along_x(side=0.01)
    times = np.linspace(0.05, 0.6, 40)
    late = tracked(motion, times, (make("tracker_latency", delay=0.03),))
    assert np.array_equal(late, motion.planar_at(times - 0.03))


def test_a_biased_tracker_follows_a_point_of_the_object():
    motion, _ = push_along_x(side=0.01)
    bias = make("tracker_bias", x=0.01, y=-0.02, yaw=0.1)
    times = np.linspace(0.0, 0.6, 40)
    poses, seen = motion.planar_at(times), tracked(motion, times, (bias,))
    for (x, y, yaw), got in zip(poses, seen, strict=True):
        R = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
        np.testing.assert_allclose(got, [*([x, y] + R @ [0.01, -0.02]), yaw + 0.1], atol=1e-15)


def test_a_trackers_yaw_alone_does_not_move_a_round_object():
    poses = [
        effect_named("tracker_bias").at(np.array([0.01, -0.02, yaw]), None).true_pose((0.3, 0.2, 0.7))
        for yaw in (-0.3, 0.0, 0.4)
    ]
    np.testing.assert_allclose([p[:2] for p in poses], [poses[1][:2]] * 3, atol=1e-15)
    np.testing.assert_allclose([p[2] for p in poses], [1.0, 0.7, 0.3], atol=1e-15)


def test_a_scaled_tracker_multiplies_places_and_not_yaw():
    motion, _ = push_along_x(side=0.01)
    times = np.linspace(0.0, 0.6, 40)
    seen = tracked(motion, times, (make("tracker_scale", ratio=1.1),))
    np.testing.assert_allclose(seen, motion.planar_at(times) * [1.1, 1.1, 1.0], atol=1e-15)


@pytest.mark.parametrize("effects", [
    (make("tracker_bias", x=0.01, y=-0.02, yaw=0.1),),
    (make("tracker_scale", ratio=1.1),),
    (make("tracker_bias", x=0.01, yaw=-0.2), make("tracker_scale", ratio=0.9)),
    (make("tracker_scale", ratio=0.9), make("tracker_bias", x=0.01, yaw=-0.2)),
])  # fmt: skip
def test_the_first_tracked_pose_is_the_one_the_rollout_was_started_from(effects):
    start = Start(pose=(0.03, -0.02, 0.3))
    push = Rollout(start=start, path=None, begin=0.0, end=0.1, hand_height=None)
    motion = roll(lambda g: built(g, False), BOX, body_of(MASS, MU), push, effects)
    np.testing.assert_allclose(tracked(motion, np.zeros(1), effects)[0], start.pose, atol=1e-12)


@pytest.mark.parametrize("effects", [
    (make("tracker_bias", x=0.01, y=-0.02, yaw=0.1),),
    (make("tracker_bias", x=0.01, yaw=-0.2), make("tracker_scale", ratio=0.9)),
])  # fmt: skip
def test_a_spinning_objects_tracked_point_starts_with_the_velocity_that_was_seen(effects):
    start, times = Start(pose=(0.03, -0.02, 0.3), velocity=(0.2, -0.1, 5.0)), np.array([0.0, 2e-3, 4e-3])
    push = Rollout(start=start, path=None, begin=0.0, end=0.1, hand_height=None)
    motion = roll(lambda g: built(g, False), BOX, body_of(MASS, 1e-6), push, effects)
    seen = tracked(motion, times, effects)
    velocity = (4.0 * seen[1] - 3.0 * seen[0] - seen[2]) / 4e-3
    np.testing.assert_allclose(velocity, start.velocity, atol=2e-4)  # measured 4e-5
