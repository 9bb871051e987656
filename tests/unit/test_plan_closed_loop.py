"""Several pushes to a goal, each planned with what the last one taught."""

from dataclasses import replace

import numpy as np
import pytest
from plans import MODEL

from physid_drake.plan import MadePush, SimulatedRobot, Situation, Task, closed_loop, learned, open_loop
from physid_drake.plan.draws import uncertain_names, value_of
from physid_drake.plan.trajectory import path_of, trajectory_of
from physid_drake.policies import PlannedPush
from physid_drake.recording import Sensors

BELIEF = replace(MODEL, intervals={"theta.support_friction": [0.2, 0.36], "theta.hand_friction": [0.2, 0.24]})
HIDDEN = replace(MODEL, body=replace(MODEL.body, support_friction=np.array([0.31])))
PUSH = PlannedPush(direction=0.2, speed=0.35, travel=0.06)
START = (0.0, 0.0, 0.0)


def made_in(world, push=PUSH):
    path = path_of(BELIEF, push, START)
    end = trajectory_of(world, (push,), Situation(start=START), path=path).end
    return MadePush(planned=push, path=path, situation=Situation(start=START), end=tuple(end.tolist()))


def robot(seed=0, noise=0.0):
    return SimulatedRobot(
        HIDDEN, start=START, sensors=Sensors(object_position_std=noise or None), rng=np.random.default_rng(seed)
    )


def test_a_push_that_ends_short_teaches_a_larger_friction_and_how_well_it_is_known():
    after = learned(BELIEF, made_in(HIDDEN), noise=(1e-4, 1e-4, 1e-3))
    low, high = after.intervals["theta.support_friction"]
    assert low < 0.31 < high and high - low < 0.4 * 0.16
    assert value_of(after, "theta.support_friction") == pytest.approx(0.31, abs=0.008)
    assert after.intervals["theta.hand_friction"] == pytest.approx(BELIEF.intervals["theta.hand_friction"], abs=0.01)


def test_friction_that_scatters_teaches_less_of_theta():
    sure = learned(BELIEF, made_in(HIDDEN), noise=(1e-4, 1e-4, 1e-3)).intervals["theta.support_friction"]
    unsure = learned(BELIEF, made_in(HIDDEN), noise=(1e-4, 1e-4, 1e-3), friction_scatter=0.1).intervals[
        "theta.support_friction"
    ]
    assert np.ptp(unsure) > 1.5 * np.ptp(sure)


def test_what_is_known_already_is_confirmed():
    after = learned(BELIEF, made_in(BELIEF), noise=(1e-4, 1e-4, 1e-3))
    assert value_of(after, "theta.support_friction") == pytest.approx(0.27, abs=2e-3)


def test_a_model_without_intervals_learns_nothing():
    plain = replace(BELIEF, intervals={})
    assert learned(plain, made_in(HIDDEN), noise=(0.0, 0.0, 0.0)) is plain


def test_every_value_with_an_interval_is_found_by_its_name():
    assert [value_of(BELIEF, name) for name in uncertain_names(BELIEF)] == pytest.approx([0.27, 0.22])


@pytest.mark.slow
def test_looking_and_learning_reach_a_goal_that_a_wrong_model_misses():
    task = Task(goal=(0.2, 0.08), noise=(2e-4, 2e-4, 2e-3), budget=30)
    blind = [step.miss for step in open_loop(BELIEF, robot(), task, np.random.default_rng(1))]
    steps = list(closed_loop(BELIEF, robot(noise=2e-4), task, np.random.default_rng(1)))
    assert blind[0] > 0.015 and blind[-1] > 0.01  # the model thinks that it is there
    assert steps[-1].miss < 0.01 and steps[-1].miss < 0.5 * blind[-1]
    assert abs(value_of(steps[0].model, "theta.support_friction") - 0.31) < 0.02
