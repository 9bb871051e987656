"""What a recording does not show: motion before its first pose, and a hand that is lost on its way."""

import math
from dataclasses import replace

import numpy as np
import pytest
from problems import QUIET
from runs import shipped_pushes

from physid_drake.errors import RecordingError
from physid_drake.pushes.frame_checks import (
    check_moved_by_something,
    check_one_push,
    hand_seen_until,
    moved_by_nothing,
    unseen_motion,
)
from physid_drake.pushes.problem import problems_of
from physid_drake.pushes.push_checks import refusals
from physid_drake.pushes.push_warnings import doubts
from physid_drake.recording import PoseStream

SIGMA = 3e-4


@pytest.fixture(scope="module")
def recording():
    return shipped_pushes(4)


def cut(stream, kept):
    return PoseStream(
        times=stream.times[kept], positions=stream.positions[kept], quaternions=stream.quaternions[kept]
    )


def with_first(recording, change):
    first, *others = recording.pushes
    return replace(recording, pushes=(change(first), *others))


def test_whole_pushes_show_all_that_moves(recording):
    assert unseen_motion(recording, SIGMA) == ()


def test_an_object_that_is_seen_too_late_already_moves(recording):
    def late(push):
        way = np.linalg.norm(push.object.positions[:, :2] - push.object.positions[0, :2], axis=1)
        return replace(push, object=cut(push.object, way > 0.3 * way.max()))

    (said,) = unseen_motion(with_first(recording, late), SIGMA)
    assert said.startswith("the object already moves") and said.endswith(f": {recording.pushes[0].name}")


@pytest.mark.parametrize("every", [1, 2, 4], ids=["100 Hz", "50 Hz", "25 Hz"])
def test_a_slow_tracker_sees_it_too(recording, every):
    def thinned(push):
        return replace(push, object=cut(push.object, slice(None, None, every)))

    whole = replace(recording, pushes=tuple(thinned(push) for push in recording.pushes))
    assert unseen_motion(whole, SIGMA) == ()

    def late(push):
        way = np.linalg.norm(push.object.positions[:, :2] - push.object.positions[0, :2], axis=1)
        return replace(push, object=cut(push.object, way > 0.3 * way.max()))

    (said,) = unseen_motion(with_first(whole, late), SIGMA)
    assert said.startswith("the object already moves")


def test_a_hand_that_is_lost_on_its_way_is_said(recording):
    def lost(push):
        way = np.linalg.norm(push.hand.positions[:, :2] - push.hand.positions[0, :2], axis=1)
        return replace(push, hand=cut(push.hand, way < 0.6 * way.max()))

    (said,) = unseen_motion(with_first(recording, lost), SIGMA)
    assert said.startswith("the hand's stream ends while it moves")


def test_poses_after_a_hand_was_lost_beside_the_object_are_not_compared(recording):
    """Where it goes on pushing, a simulation whose hand stops there would be wrong by centimetres."""
    push = recording.pushes[0]
    times = push.object.times
    moved = np.linalg.norm(push.object.planar[:, :2] - push.object.planar[0, :2], axis=1)
    when = float(times[np.argmax(moved > 0.3 * moved.max())])
    lost = replace(push, hand=cut(push.hand, push.hand.times <= when))
    assert hand_seen_until(recording, push) == math.inf
    seen = hand_seen_until(recording, lost)
    assert when - 0.02 < seen <= when
    (problem, *others) = problems_of(with_first(recording, lambda _: lost), QUIET, 0.03)
    assert problem.end == seen and problem.times[-1] <= seen and len(problem.times) == len(problem.poses) > 10
    assert all(other.end == p.end_time for other, p in zip(others, recording.pushes[1:], strict=True))

    far = replace(lost.hand, positions=lost.hand.positions + np.array([0.5, 0.0, 0.0]))
    assert hand_seen_until(recording, replace(lost, hand=far)) == math.inf


def test_a_gap_in_which_the_hand_brakes_ends_what_is_compared(recording):
    push = recording.pushes[0]
    times, hand = push.hand.times, push.hand
    speeds = np.linalg.norm(np.gradient(hand.positions[:, :2], times, axis=0), axis=1)
    fast = np.flatnonzero(speeds > 0.7 * speeds.max())
    stop, middle = float(times[fast[-1]]), float(times[fast[len(fast) // 2]])
    for centre, lost in ((stop, True), (middle, False)):  # at the brake, and where it goes straight on
        gappy = replace(push, hand=cut(hand, np.abs(times - centre) > (0.075 if lost else 0.03)))
        assert (hand_seen_until(recording, gappy) < centre) is lost
        assert bool(unseen_motion(with_first(recording, lambda _, gappy=gappy: gappy), SIGMA)) is lost


def test_without_a_hand_nothing_sets_a_resting_object_moving(recording):
    bare = replace(recording, hand=None, pushes=tuple(replace(push, hand=None) for push in recording.pushes))
    assert moved_by_nothing(bare, SIGMA) == tuple(push.name for push in bare.pushes)
    line = "the pushes have no hand, but their object starts from rest and moves; is the hand's stream missing"
    with pytest.raises(RecordingError, match=line):
        check_moved_by_something(bare, SIGMA)
    assert (
        len(refusals(bare)) == 1 and line in refusals(bare)[0] and not any("no hand" in one for one in doubts(bare))
    )


def test_one_that_slides_from_the_beginning_was_pushed_before(recording):
    """Of several, those that start from rest are doubted: a push that nobody recorded may be among others."""

    def sliding(push):
        way = np.linalg.norm(push.object.positions[:, :2] - push.object.positions[0, :2], axis=1)
        return replace(push, object=cut(push.object, way > 0.3 * way.max()))

    bare = replace(recording, hand=None, pushes=tuple(replace(push, hand=None) for push in recording.pushes))
    free = replace(bare, pushes=tuple(map(sliding, bare.pushes)))
    assert moved_by_nothing(free, SIGMA) == () and not any("hand" in one for one in (*refusals(free), *doubts(free)))
    mixed = replace(free, pushes=(bare.pushes[0], *free.pushes[1:]))
    (said,) = [one for one in doubts(mixed) if "hand" in one]
    assert said.startswith(
        "some pushes have no hand, but their object starts from rest and moves: pushes/001.csv; is the hand's stream"
    )
    assert refusals(mixed) == ()


def a_log_of(count, push):
    """A push whose hand goes to and fro, and stands in between."""
    hand, span = push.hand, push.hand.times[-1] - push.hand.times[0] + 0.01
    places = [hand.positions, hand.positions[::-1]]
    return replace(push, hand=PoseStream(
        times=np.concatenate([hand.times + k * span for k in range(count)]),
        positions=np.concatenate([places[k % 2] for k in range(count)]),
        quaternions=np.concatenate([hand.quaternions] * count),
    ))  # fmt: skip


def test_a_log_of_many_pushes_in_one_table_is_refused_before_its_path_is_fitted(recording):
    check_one_push(a_log_of(4, recording.pushes[0]))
    long = a_log_of(40, recording.pushes[0])
    with pytest.raises(RecordingError, match=r"the hand stands still \d+ times in \d+ s; cut the table"):
        check_one_push(long)
    with pytest.raises(RecordingError, match="cut the table"):
        problems_of(replace(recording, pushes=(long,)), QUIET, 0.03)
