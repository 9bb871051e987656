"""A recording made ready for a diagnosis: what of it is used, and what is said of the rest."""

import dataclasses as dc

import numpy as np
import pytest
from scipy import stats

from physid_drake.diagnose.next_push import LONGEST_TIME_STEP, _chance, _problem, brisk_pool
from physid_drake.errors import RecordingError
from physid_drake.model import turned
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import ForceStream, Recording, read_recording
from physid_drake.resources import shipped

UNUSED = "none of the recorded forces"


@pytest.fixture(scope="module")
def recording():
    return read_recording(shipped("recordings") / "eraser_reference").subset(range(3))


def case(recording: Recording):
    return case_of(recording, cell_config(recording), ThetaConfig(), jobs=1)


def with_forces(recording: Recording, keep: int) -> Recording:
    """Forces as long as the hand's stream, of which one in ``keep`` is there."""
    pushes = []
    for push in recording.pushes:
        times = push.hand.times[::keep]
        forces = 0.3 * (push.hand.positions[::keep] - push.hand.positions[0])
        pushes.append(dc.replace(push, force=ForceStream(times=times, forces=forces)))
    return dc.replace(recording, pushes=tuple(pushes))


def slowed(recording: Recording, factor: float) -> Recording:
    pushes = [
        dc.replace(
            push,
            hand=dc.replace(push.hand, times=factor * push.hand.times),
            object=dc.replace(push.object, times=factor * push.object.times),
        )
        for push in recording.pushes
    ]
    return dc.replace(recording, pushes=tuple(pushes))


def test_forces_that_are_too_far_apart_in_time_are_said_to_be_unused(recording):
    few = case(with_forces(recording, 20))
    assert not any(len(problem.force_times) for problem in few.problems)
    assert any(w.startswith(UNUSED) for w in few.warnings)


def test_forces_that_are_compared_or_were_not_recorded_need_no_word(recording):
    for known in (recording, with_forces(recording, 1)):
        assert not any(w.startswith(UNUSED) for w in case(known).warnings)


def test_the_next_push_of_a_slow_recording_is_simulated_on_ticks_for_a_fast_hand(recording):
    slow = case(slowed(recording, 100.0))
    assert slow.pool.spec.config.solver.time_step_s > 5.0 * LONGEST_TIME_STEP
    assert brisk_pool(slow).spec.config.solver.time_step_s == pytest.approx(LONGEST_TIME_STEP)
    usual = case(recording)
    assert brisk_pool(usual).spec == usual.pool.spec


def test_pushes_that_cannot_be_simulated_are_left_out_and_said(recording):
    whole = case(recording)
    rest = whole.without([1])
    assert (
        [p.name for p in rest.problems]
        == [p.name for p in rest.recording.pushes]
        == ["pushes/001.csv", "pushes/003.csv"]
    )
    assert [p.order for p in rest.problems] == [0, 2]  # a drift goes on meanwhile
    assert len(rest.features) == len(rest.nuisances) == 2
    assert not any("skipped" in w for w in whole.warnings)
    assert [w for w in rest.warnings if "skipped" in w and "002" in w]
    assert not any("equal distances" in w for w in rest.warnings)
    with pytest.raises(RecordingError, match="single push"):
        rest.without([0, 1])


def test_what_the_reader_left_out_is_said_in_the_answer(recording):
    lost = dc.replace(recording.pushes[1], warnings=("object: row 4: track lost (all zeros), left out.",))
    some = dc.replace(recording, pushes=(recording.pushes[0], lost, recording.pushes[2]))
    assert "pushes/002.csv: object: row 4: track lost (all zeros), left out" in case(some).warnings


@pytest.mark.parametrize(("x", "chance"), [(0.0, 1.0), (0.30, -np.inf)])
def test_a_push_that_may_lose_the_object_is_not_proposed(recording, x, chance):
    small = dc.replace(recording, table=dc.replace(recording.table, centre=(0.0, 0.0), size=(0.6, 0.6)))
    one = case(small)
    ends = [np.array([x, 0.0, 0.1]), np.array([x - 0.2, 0.0, 0.1])]
    assert _chance(one, ends, one.problems[0]) == pytest.approx(chance)


@pytest.mark.parametrize("direction", [0.0, 2.0])
def test_the_hand_of_the_next_push_turns_as_those_of_the_recording_do(recording, direction):
    """Beside a hand that faces where it pushes, its offset turns, too."""
    usual = case(recording)
    faces = (dc.replace(problem, hand_axes=turned(problem.path.heading)) for problem in usual.problems)
    facing = dc.replace(usual, problems=tuple(faces))
    push = _problem(facing, direction, 0.2, 0.0)
    np.testing.assert_allclose(push.hand_axes, turned(push.path.heading), atol=1e-6)
    fixed = _problem(usual, direction, 0.2, 0.0)
    np.testing.assert_allclose(fixed.hand_axes, usual.problems[0].hand_axes, atol=1e-6)


def test_three_models_are_harder_to_tell_than_two(recording):
    one = case(recording)
    pose = np.array(one.problems[0].start.pose)
    step = 2.0 * one.noise.sigmas[0] * np.array([1.0, 0.0, 0.0])
    two, three = (_chance(one, [pose + k * step for k in range(n)], one.problems[0]) for n in (2, 3))
    assert two == pytest.approx(stats.norm.cdf(1.0), rel=0.01)
    # Of the one in the middle; the others' noise grows with their way.
    assert three == pytest.approx(1.0 - 2.0 * stats.norm.sf(1.0), rel=0.02)


def test_steps_of_effects_are_in_proportion_to_the_friction_that_theta_starts_from(recording):
    config = cell_config(recording)
    slippery = case_of(recording, config, ThetaConfig(nominal={"support_friction": 0.1}), jobs=1)
    assert slippery.around.friction == 0.1
    assert slippery.around.slight == pytest.approx(case(recording).around.slight / 3.0)
