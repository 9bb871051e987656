"""Long streams are made short, and what is short is not touched."""

import dataclasses as dc

import numpy as np
import pytest

from physid_drake.recording import (
    ForceStream,
    PoseStream,
    estimate_noise,
    planar_poses,
    read_recording,
    rest_segments,
    thinned,
)
from physid_drake.resources import shipped


@pytest.fixture(scope="module")
def recording():
    return read_recording(shipped("recordings") / "eraser_reference").subset(range(2))


def longer(push, before, after, rate):
    """The push with rests of so many seconds before and after it, sampled at a rate [Hz]."""
    rng = np.random.default_rng(0)
    begin, end = push.start_time, push.end_time
    times = np.arange(begin - before, end + after, 1.0 / rate)
    planar = np.column_stack([np.interp(times, push.object.times, column) for column in push.object.planar.T])
    planar += rng.standard_normal(planar.shape) * [3e-4, 3e-4, 3e-3]
    hand = np.column_stack([np.interp(times, push.hand.times, column) for column in push.hand.positions.T])
    still = np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1))
    return dc.replace(
        push, object=planar_poses(times, planar, 0.015),
        hand=PoseStream(times=times, positions=hand, quaternions=still),
        force=ForceStream(times=times, forces=np.zeros((len(times), 3))),
    )  # fmt: skip


def test_what_is_short_is_left_as_it_is(recording):
    assert all(short is push for short, push in zip(thinned(recording).pushes, recording.pushes, strict=True))


def test_a_fast_log_keeps_every_so_manieth_sample(recording):
    push = longer(recording.pushes[0], 0.0, 0.0, 2000.0)
    short = thinned(dc.replace(recording, pushes=(push,)), most=1000).pushes[0]
    step = -(-len(push.object) // 1000)
    for kept, whole in ((short.object, push.object), (short.hand, push.hand)):
        assert len(kept) <= 1000 and np.array_equal(kept.times, whole.times[::step])
    assert short.force == push.force


def test_of_a_long_log_the_motion_stays_and_a_second_of_rest(recording):
    plain = recording.pushes[0]
    push = longer(plain, 30.0, 40.0, 100.0)
    short = thinned(dc.replace(recording, pushes=(push,))).pushes[0]
    assert len(push.object) > 7000 and len(short.object) < 1000
    assert np.median(np.diff(short.object.times)) == pytest.approx(0.01)
    away = [
        np.linalg.norm(plain.object.positions[:, :2] - end, axis=1) for end in plain.object.positions[[0, -1], :2]
    ]
    first, last = plain.object.times[np.argmax(away[0] > 3e-3)], plain.object.times[np.argmax(away[1] < 3e-3)]
    assert first - 1.7 < short.start_time < first - 0.8
    assert last + 0.8 < short.end_time < last + 1.7
    assert short.hand.times[0] == short.object.times[0]


@pytest.mark.parametrize(("speed", "rate"), [(2e-3, 100.0), (2e-3, 1000.0), (5e-3, 1000.0)])
def test_a_slow_push_keeps_its_motion_its_noise_and_its_start(recording, speed, rate):
    rng, still, way = np.random.default_rng(0), 5.0, 0.08
    times = np.arange(0.0, 2 * still + way / speed, 1.0 / rate)
    x = speed * np.clip(times - still, 0.0, way / speed)
    planar = np.column_stack([x, 0.0 * x, 0.0 * x]) + rng.standard_normal((len(times), 3)) * [2e-4, 2e-4, 2e-3]
    hand = planar_poses(times, np.column_stack([x - 0.06, 0.0 * x, 0.0 * x]), 0.015)
    push = dc.replace(recording.pushes[0], object=planar_poses(times, planar, 0.015), hand=hand)
    long = dc.replace(recording, pushes=(push,))
    short = thinned(long)
    (kept,) = short.pushes
    assert len(kept.object) <= 2000 < len(push.object)
    assert kept.start_time == pytest.approx(still - 1.0, abs=0.15)
    assert kept.end_time == pytest.approx(times[-1] - still + 1.0, abs=0.15)
    # Measured: 0.84 (of 68 samples) to 1.09 times it, and ends 0.06 s off.
    assert estimate_noise(short).object_position_std == pytest.approx(2e-4, rel=0.2)
    assert kept.object.planar[rest_segments(kept)[0]].mean(axis=0)[0] == pytest.approx(0.0, abs=1e-4)


def test_of_end_points_the_hands_motion_stays(recording):
    times = np.arange(0.0, 100.0, 0.01)
    x = 0.1 * np.clip(times - 50.0, 0.0, 0.5)
    hand = planar_poses(times, np.column_stack([x, 0.0 * x, 0.0 * x]), 0.015)
    ends = planar_poses([0.0, 100.0], [[0.0, 0.0, 0.0], [0.05, 0.0, 0.0]], 0.015)
    (kept,) = thinned(dc.replace(recording, pushes=(dc.replace(recording.pushes[0], object=ends, hand=hand),))).pushes
    assert kept.object == ends
    assert np.count_nonzero((kept.hand.times > 50.0) & (kept.hand.times < 50.5)) == 49


def test_a_hand_of_few_samples_keeps_those_about_the_motion(recording):
    push = longer(recording.pushes[0], 30.0, 30.0, 100.0)
    motion = recording.pushes[0].start_time
    times = np.array([motion - 20.0, motion - 2.0, motion + 0.4, motion + 20.0])
    hand = planar_poses(times, np.zeros((4, 3)), 0.015)
    (kept,) = thinned(dc.replace(recording, pushes=(dc.replace(push, hand=hand, force=None),))).pushes
    assert kept.hand.times.tolist() == times[1:].tolist()
