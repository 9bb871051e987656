"""Long streams are made short, and what is short is not touched."""

import dataclasses as dc

import numpy as np
import pytest

from physid_drake.recording import ForceStream, PoseStream, planar_poses, read_recording, thinned
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
    for kept, whole in ((short.object, push.object), (short.hand, push.hand), (short.force, push.force)):
        assert len(kept) <= 1000 and np.array_equal(kept.times, whole.times[::step])


def test_of_a_long_log_the_motion_stays_and_half_a_second_of_rest(recording):
    plain = recording.pushes[0]
    push = longer(plain, 30.0, 40.0, 100.0)
    short = thinned(dc.replace(recording, pushes=(push,))).pushes[0]
    assert len(push.object) > 7000 and len(short.object) < 1000
    assert np.median(np.diff(short.object.times)) == pytest.approx(0.01)
    away = [
        np.linalg.norm(plain.object.positions[:, :2] - end, axis=1) for end in plain.object.positions[[0, -1], :2]
    ]
    first, last = plain.object.times[np.argmax(away[0] > 3e-3)], plain.object.times[np.argmax(away[1] < 3e-3)]
    assert first - 1.2 < short.start_time < first - 0.3
    assert last + 0.3 < short.end_time < last + 1.2
    assert short.hand.times[0] == short.object.times[0]
