"""The least that any prediction leaves of pushes whose friction it is not told."""

import math

import numpy as np
import pytest

from physid_drake.recording import PoseStream, Push
from physid_drake.validation.worlds.floor import WINDOWS, floor_of

RATE, STILL, MOVING = 100.0, 20, 140
DEVIATIONS = np.array([1e-3, 1e-3, 1e-2])


def poses(length=0.1, turn=0.5):
    """Rest, an even motion, and rest (n, 3)."""
    share = np.concatenate([np.zeros(STILL), np.linspace(0.0, 1.0, MOVING + 1)[1:], np.ones(2 * STILL)])
    return np.outer(share, [length, 0.0, turn])


def push(rows):
    zeros = np.zeros(len(rows))
    return Push(
        name="pushes/001.csv", hand=None, force=None,
        object=PoseStream(
            times=np.arange(len(rows)) / RATE, positions=np.column_stack([rows[:, :2], zeros]),
            quaternions=np.column_stack([np.cos(rows[:, 2] / 2), zeros, zeros, np.sin(rows[:, 2] / 2)]),
        ),
    )  # fmt: skip


def test_a_true_prediction_without_noise_leaves_nothing():
    floor = floor_of([push(poses())], [poses()], RATE, DEVIATIONS)
    assert floor == pytest.approx({"rms": 0.0, "position_m": 0.0, "rotation_rad": 0.0}, abs=1e-12)


def test_a_constant_error_is_left_as_it_is():
    error = np.array([3e-3, 4e-3, 0.02])
    floor = floor_of([push(poses() + error)], [poses()], RATE, DEVIATIONS)
    assert floor["position_m"] == pytest.approx(5e-3)
    assert floor["rotation_rad"] == pytest.approx(0.02)
    assert floor["rms"] == pytest.approx(math.sqrt((9 + 16 + 4) / 3))


def test_noise_is_averaged_within_windows():
    rng = np.random.default_rng(0)
    pushes = [push(poses() + DEVIATIONS * rng.standard_normal(poses().shape)) for _ in range(200)]
    floor = floor_of(pushes, [poses()] * 200, RATE, DEVIATIONS)
    # Fourteen windows of ten samples, and the rest of forty; the motion ends with the sample that arrives.
    want = (WINDOWS / (MOVING / WINDOWS) + 1 / (2 * STILL)) / (WINDOWS + 1)
    assert floor["rms"] ** 2 == pytest.approx(want, rel=0.03)


def test_a_short_motion_has_fewer_windows_as_in_a_diagnosis():
    rng = np.random.default_rng(0)
    share = np.concatenate([np.zeros(STILL), np.linspace(0.0, 1.0, 19)[1:], np.ones(2 * STILL)])
    rows = np.outer(share, [0.1, 0.0, 0.5])
    pushes = [push(rows + DEVIATIONS * rng.standard_normal(rows.shape)) for _ in range(300)]
    want = (9 / 2 + 1 / (2 * STILL)) / 10  # nine windows of two samples
    assert floor_of(pushes, [rows] * 300, RATE, DEVIATIONS)["rms"] ** 2 == pytest.approx(want, rel=0.05)


def test_a_world_that_rests_earlier_stays_there_and_whole_turns_are_none():
    short = poses()[: -2 * STILL + 1]
    floor = floor_of([push(poses())], [short + np.array([0.0, 0.0, 4.0 * math.pi])], RATE, DEVIATIONS)
    assert floor["rms"] == pytest.approx(0.0, abs=1e-9)
