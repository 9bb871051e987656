"""What a tracker does wrong: what is left out, what is kept, and what is said of it."""

import math
from functools import partial

import numpy as np
import pytest
from written import ROWS, write

from physid_drake.errors import RecordingError
from physid_drake.recording import read_recording


@pytest.fixture
def written(tmp_path):
    return partial(write, tmp_path)


def long_table(change, count=80, noise=0.0):
    rng = np.random.default_rng(0)
    x = 0.01 * np.maximum(0, np.arange(count) - 20) * 0.1 + noise * rng.standard_normal(count)
    poses = np.zeros((count, 8))
    poses[:, 0], poses[:, 1], poses[:, 4] = np.arange(count) * 0.01, 0.1 + x, 1.0
    poses = change(poses)
    return [f"{float(p[0])!r},0,0,0,{','.join(repr(float(v)) for v in p[1:])}" for p in poses]


def lose(poses):
    poses[[30, 31, 50], 1:] = 0.0
    return poses


def lose_with_a_quaternion(poses):
    poses[:, 3] += 0.02
    poses[[30, 31, 50], 1:4] = 0.0
    poses[[30, 31, 50], 4:] = [1.0, 0.0, 0.0, 0.0]
    return poses


def jump_for_two(poses):
    poses[40:42, 2] += 0.05
    return poses


def jump(poses):
    poses[40, 2] += 0.05
    return poses


def jump_in_yaw(poses):
    poses[40, 4:] = [math.cos(0.5), 0, 0, math.sin(0.5)]
    return poses


def leap_and_stay(poses):
    poses[40:, 2] += 0.05
    return poses


def leap_before_it_moves(poses):
    poses[10:, 2] += 0.05
    return poses


def leap_of_a_slow_tracker(poses):
    poses[:, 0] *= 10.0
    return leap_and_stay(poses)


def stall(poses):
    poses[40:50, 1:] = poses[40, 1:]
    return poses


def pause(poses):
    return np.delete(poses, slice(40, 50), axis=0)


@pytest.mark.parametrize(("rate", "left"), [(0.5, 40), (0.6, 48), (0.25, 20)])
def test_a_tracker_that_is_slower_than_the_log_shows_each_pose_once(written, rate, left):
    def held(poses):
        frame = np.floor(rate * np.arange(len(poses)) + 1e-9)
        first = np.searchsorted(frame, frame)
        poses[:, 1:] = poses[first, 1:]
        return poses

    push = read_recording(written(rows=long_table(held, noise=2e-4))).pushes[0]
    assert len(push.object) == left
    assert any("by a tracker slower than the log; repeats left out" in w for w in push.warnings)


def test_an_object_that_was_never_tracked_is_one_line(written):
    def never(poses):
        poses[:, 1:4], poses[:, 4:] = 0.0, 0.0
        return poses

    with pytest.raises(RecordingError, match="at least two object poses are needed"):
        read_recording(written(rows=long_table(never)))


@pytest.mark.parametrize("seed", range(5))
def test_a_camera_that_is_held_in_a_log_with_a_jittery_clock_loses_no_track(written, seed):
    """30 Hz in 125 Hz: the object is pushed at 0.5 m/s, and each frame is a leap between poses that are held."""

    def held(poses):
        rng = np.random.default_rng(seed)
        poses[:, 0] = 0.008 * np.arange(len(poses))
        poses[:, 1] = 0.1 + 0.5 * np.clip(poses[:, 0] - 0.3, 0.0, 0.6)
        frames = np.sort(np.arange(0.0, poses[-1, 0], 1 / 30) + 4e-3 * rng.standard_normal(len(poses) * 30 // 125))
        shown = np.maximum(np.searchsorted(frames, poses[:, 0]) - 1, 0)
        poses[:, 1] = (
            np.interp(frames[shown], poses[:, 0], poses[:, 1]) + 1e-5 * rng.standard_normal(len(frames))[shown]
        )
        return poses

    push = read_recording(written(rows=long_table(held, count=200))).pushes[0]
    assert np.ptp(push.object.positions[:, 0]) == pytest.approx(0.3, abs=1e-3)
    assert not any("left out" in w and "jumps" in w for w in push.warnings)


@pytest.mark.parametrize("noise", [0.0, 5e-4])
def test_a_rest_before_a_swap_is_not_taken_for_the_push(written, noise):
    def swapped_at_rest(poses):
        poses[60:, 2] += 0.05
        poses[:, 1] = 0.1 + 0.001 * np.clip(np.arange(len(poses)) - 80, 0, 60)
        poses[:, 1] += noise * np.random.default_rng(1).standard_normal(len(poses))
        return poses

    push = read_recording(written(rows=long_table(swapped_at_rest, count=200))).pushes[0]
    assert len(push.object) == 140


@pytest.mark.parametrize("step", [2e-5, 1e-4, 1e-3])
def test_rounded_poses_are_not_taken_for_those_of_a_slow_tracker(written, step):
    def rounded(poses):
        poses[:, 1] = step * np.round(poses[:, 1] / step)
        return poses

    assert len(read_recording(written(rows=long_table(rounded, noise=1e-5, count=400))).pushes[0].object) == 400


@pytest.mark.parametrize("turn", [0.0, 1.0])
@pytest.mark.parametrize("step", [0.005, 0.01, 0.02])
def test_steps_of_a_coarse_grid_are_no_leaps(written, step, turn):
    """In x many, in y one; the heading on a grid of 1 degree, too, where it turns."""

    def rounded(poses):
        way = np.clip((np.arange(len(poses)) - 60) / 90, 0.0, 1.0) ** 2
        poses[:, 1] = step * np.round(0.2 * way / step)
        poses[:, 2] = step * np.round(0.6 * way)
        half = 0.5 * np.radians(np.round(turn * 20.0 * way))
        poses[:, 4], poses[:, 7] = np.cos(half), np.sin(half)
        return poses

    push = read_recording(written(rows=long_table(rounded, count=200))).pushes[0]
    assert len(push.object) == 200 and not any("jumps" in w for w in push.warnings)


@pytest.mark.parametrize("noise", [0.0, 1e-5])
@pytest.mark.parametrize(
    ("change", "expected", "left"),
    [
        (lose, "object: rows 32-33, 52: track lost (all zeros), left out.", 77),
        (lose_with_a_quaternion, "object: rows 32-33, 52: track lost (all zeros), left out.", 77),
        (jump_for_two, "object: rows 42-43: jumps 0.05 m away and comes straight back, left out.", 78),
        (jump, "object: row 42: jumps 0.05 m away and comes straight back, left out.", 79),
        (jump_in_yaw, "object: row 42: jumps 0.001 m and 57 degrees away and comes straight back, left out.", 79),
        (leap_and_stay, "object: row 42: jumps 0.05 m and stays there; what comes after is left out.", 40),
        (leap_before_it_moves, "object: row 12: jumps 0.05 m and stays there; what comes before is left out.", 70),
        (leap_of_a_slow_tracker, "object: row 42: jumps 0.05 m and stays there, kept.", 80),
        (stall, "object: rows 42-51: stalls (same pose 10 times, then catches up), kept.", 80),
        (pause, "object: rows 41-42: gap of 0.11 s, kept.", 70),
    ],
)
def test_what_a_tracker_does_wrong_is_named_by_row(written, change, expected, left, noise):
    push = read_recording(written(rows=long_table(change, noise=noise))).pushes[0]
    warnings = [w for w in push.warnings if w.startswith("object")]
    assert warnings[0].startswith(expected[:22])
    if noise == 0.0:
        assert warnings[0].startswith(expected)
    assert len(push.object) == left


@pytest.mark.parametrize("noise", [0.0, 1e-5, 3e-4])
def test_a_clean_push_raises_no_warning(written, noise):
    rows = long_table(lambda poses: poses, count=400, noise=noise)
    assert read_recording(written(rows=rows)).pushes[0].warnings == ()


def test_a_bounce_is_no_jump(written):
    def bounce(poses):
        poses[:, 3] = np.abs(0.5 - 0.02 * np.arange(len(poses)))
        return poses

    assert read_recording(written(rows=long_table(bounce))).pushes[0].warnings == ()


@pytest.mark.parametrize("period", [2, 3])
def test_rests_of_a_slow_tracker_that_rounds_stay(written, period):
    """All poses of a rest are one: without them, nothing says how long it rested."""

    def slow(poses):
        times, count = poses[:, 0].copy(), len(poses)
        way = np.clip((np.arange(count) - 120) / 160, 0.0, 1.0)
        poses[:, 1] = np.round(0.1 * way**2 * (3 - 2 * way), 4)
        poses[:, 1:] = poses[period * (np.arange(count) // period), 1:]
        poses[:, 0] = times
        return poses

    push = read_recording(written(rows=long_table(slow, count=400))).pushes[0]
    assert len(push.object) == pytest.approx(400 / period, abs=4)
    assert np.diff(push.object.times).max() < 2.1 * period * np.diff(push.object.times).min()


@pytest.mark.parametrize(("size", "samples"), [(0.010, 9), (0.005, 8)])
def test_a_tap_is_no_jump(written, size, samples):
    def tap(poses):
        turn = np.clip((np.arange(len(poses)) - 60.0) / samples, 0.0, 1.0)
        poses[:, 1] = 0.5 * size * (1.0 - np.cos(2.0 * np.pi * turn))
        return poses

    push = read_recording(written(rows=long_table(tap, noise=5e-5, count=200))).pushes[0]
    assert not any("left out" in w for w in push.warnings) and len(push.object) == 200


def test_too_few_poses_left_after_track_loss_are_refused(written):
    rows = [ROWS[0], "0.1,,,,0,0,0,0,0,0,0", "0.2,,,,0,0,0,0,0,0,0"]
    with pytest.raises(RecordingError, match="at least two object poses"):
        read_recording(written(rows=rows))
