"""Which means of recorded forces are compared: not those of touches, strikes and rests."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from problems import QUIET
from runs import shipped_pushes

from physid_drake.cell import HandPath
from physid_drake.cell.hand_path import straight_path
from physid_drake.pushes import force_windows
from physid_drake.pushes.force_windows import SHARE, _resting, _standing, _touching
from physid_drake.pushes.problem import problems_of
from physid_drake.recording import ForceStream, PoseStream


@pytest.fixture(scope="module")
def recording():
    return shipped_pushes(3)


def first(recording):
    return problems_of(recording, QUIET, 0.03)[0]


def with_forces(recording, force_of, rate=100.0):
    def add(push):
        times = np.arange(push.hand.times[0], push.hand.times[-1], 1.0 / rate)
        return replace(push, force=ForceStream(times=times, forces=force_of(times - times[0])))

    return replace(recording, pushes=tuple(add(push) for push in recording.pushes))


def test_forces_are_means_over_windows(recording):
    # Loaded from the start, so that no window is that of a touch.
    problem = first(with_forces(recording, lambda t: np.column_stack([10.0 * t, 0.0 * t + 20.0, 0.0 * t + 9.0])))
    middles = problem.force_times
    np.testing.assert_allclose(middles - middles[0], 0.1 * np.arange(len(middles)), atol=0.006)
    start = with_forces(recording, lambda t: np.zeros((len(t), 3))).pushes[0].force.times[0]
    np.testing.assert_allclose(problem.forces[:, 0], 10.0 * (problem.force_times - start), atol=1e-9)
    np.testing.assert_allclose(problem.forces[:, 1], 20.0)
    largest = np.linalg.norm(problem.forces, axis=1).max()
    np.testing.assert_allclose(problem.force_std[0], np.hypot(0.02 / np.sqrt(10), SHARE * largest), rtol=0.01)


def test_a_window_of_one_sample_is_left_out(recording):
    assert first(with_forces(recording, lambda t: np.zeros((len(t), 3)), rate=9.0)).force_times.size == 0


MIDDLES = 0.05 + 0.1 * np.arange(90)
SLOW = straight_path(np.zeros(2), np.array([0.02, 0.0]), 0.0, 10.0)  # 2 mm/s: half a millimetre in 0.25 s


def touched_after(time):
    return np.column_stack([np.where(time < MIDDLES, 4.0, 0.0), np.zeros(90)])


def test_a_slow_touch_whose_time_the_tracker_does_not_tell_is_left_out():
    unsure = _touching(SLOW, MIDDLES, touched_after(3.0), np.full(90, 0.2), 5e-4)
    # Three standard deviations are 0.75 s, and half a window, on both sides of the touch at 3.05 s.
    np.testing.assert_array_equal(unsure, np.abs(MIDDLES - 3.05) < 0.79)


def test_of_a_touch_that_the_tracker_tells_only_its_own_window_is_left_out():
    struck = _touching(SLOW, MIDDLES, touched_after(3.0), np.full(90, 0.2), 1e-5)
    np.testing.assert_array_equal(np.flatnonzero(struck), [30])  # of the touch at 3.05 s
    assert not _touching(SLOW, MIDDLES, touched_after(0.0), np.full(90, 0.2), 5e-4).any()  # from the start


def test_the_peak_of_a_strike_is_no_measure_of_the_force_that_follows(recording):
    def struck(peak):
        return first(
            with_forces(
                recording,
                lambda t: np.column_stack(
                    [2.0 * (t > t[0] + 0.2) + peak * (abs(t - t[0] - 0.25) < 0.03), 0 * t, 0 * t]
                ),
            )
        )

    plain, hard = struck(0.0), struck(50.0)
    np.testing.assert_allclose(hard.force_std, plain.force_std)
    np.testing.assert_allclose(hard.forces, plain.forces)


def test_without_forces_there_are_no_windows(recording):
    problem = first(recording)
    assert problem.forces.shape == (0, 2)
    assert problem.force_std.shape == problem.force_times.shape == (0,)


def of_a_stop(recording, *, last_rests):
    """The first push, the object standing still in the last half second or not."""
    push = recording.pushes[0]
    times = push.object.times
    moving = np.minimum(times, times[-1] - 0.5) if last_rests else times
    positions = np.column_stack([0.1 * (moving - times[0]), 0 * times, 0 * times + 0.03])
    positions[:, :2] += 3e-4 * np.random.default_rng(0).standard_normal((len(times), 2))
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1))
    return replace(push, object=PoseStream(times=times, positions=positions, quaternions=upright))


def test_the_force_on_an_object_at_rest_is_left_out(recording):
    """A hand that leans against it may hold any force that friction bears."""
    stopped, moving = (of_a_stop(recording, last_rests=rests) for rests in (True, False))
    times = stopped.object.times
    middles = np.arange(times[0] + 0.05, times[-1], 0.1)
    assert not _resting(moving, middles).any()
    resting = middles[_resting(stopped, middles)]
    assert len(resting) in (5, 6)
    assert resting.min() == pytest.approx(times[-1] - 0.5, abs=0.1)


def test_the_force_of_a_hand_that_stands_is_left_out():
    """Whether or not the tracker sees the object rest: one that stops against it leans on it with any force."""
    stops = straight_path(np.zeros(2), np.array([0.02, 0.0]), 1.0, 4.97)
    unseen = SimpleNamespace(endpoint_only=True, object=SimpleNamespace(times=np.array([0.0, 9.0])))
    np.testing.assert_array_equal(_standing(unseen, stops, MIDDLES), (MIDDLES < 1.0) | (MIDDLES > 5.93))


def test_a_hand_that_came_fast_and_pushes_slowly_does_not_stand(monkeypatch):
    """0.3 m/s until the object moves at 1 s, and 10 mm/s from there to 6 s."""
    monkeypatch.setattr(force_windows, "motion_span", lambda push: (1.0, 6.0))
    times, speeds = np.array([0.8, 0.99, 1.0, 6.0]), np.array([0.3, 0.3, 0.01, 0.01])
    path = HandPath(times=times, velocities=np.outer(speeds, [1.0, 0.0]), start=np.zeros(2))
    standing = _standing(None, path, MIDDLES)
    np.testing.assert_array_equal(standing[(MIDDLES > 1.0) & (MIDDLES < 5.9)], False)
    np.testing.assert_array_equal(standing[MIDDLES > 6.0], True)


@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_windows_with_a_strike_are_left_out(recording, rate):
    """Of a strike of five milliseconds a sensor sees one sample or none, or its own filter."""

    def struck(seconds, size=30.0):
        def force(t):
            strike = size * (np.abs(t - t[0] - 0.55) < 0.5 * seconds)
            return np.column_stack([2.0 + strike, 0 * t, 0 * t])

        return first(with_forces(recording, force, rate=rate))

    plain, once, long = struck(0.0), struck(0.004), struck(0.08, 4.0)
    lost = set(np.round(plain.force_times, 3)) - set(np.round(once.force_times, 3))
    assert len(lost) == 1
    np.testing.assert_allclose(once.forces, 2.0 * np.eye(2)[[0] * len(once.forces)])
    assert len(long.force_times) == len(plain.force_times)  # a hard push that lasts is a force


def test_one_sample_in_a_tenth_of_a_second_is_no_mean_however_its_stamp_is_rounded():
    times = np.array([round(0.1 * k, 9) for k in range(40)])
    assert force_windows.windows_of(times) == []
