"""What plans make small."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from plans import GOAL, MODEL, START
from twin import body_of

from physid_drake.cell import Outcome
from physid_drake.errors import ConfigError
from physid_drake.plan import DistanceToGoal, Ending, InsideRegion, Situation
from physid_drake.plan.costs import cost_of, loss_of
from physid_drake.plan.trajectory import _ending, trajectory_of
from physid_drake.policies import PlannedPush
from physid_drake.recording import Box, Cylinder


def test_the_distance_is_zero_at_the_goal_and_grows_with_it():
    cost = DistanceToGoal(goal=GOAL)
    assert cost.at(np.array(GOAL)) == 0.0
    assert cost.at(np.array([0.28, 0.04])) == pytest.approx(0.05)


def test_a_region_is_free_inside_and_has_no_kink_at_its_edge():
    cost = InsideRegion(lower=(0.1, -0.1), upper=(0.3, 0.1), softness=0.01)
    assert cost.at(np.array([0.2, 0.05])) == 0.0 and cost.at(np.array([0.3, 0.1])) == 0.0
    step = 1e-5
    assert cost.at(np.array([0.3 + step, 0.0])) < 1e-2 * step
    assert cost.at(np.array([0.8, 0.0])) == pytest.approx(0.49, abs=1e-3)
    with pytest.raises(ConfigError, match="region"):
        InsideRegion(lower=(0.1, 0.0), upper=(0.0, 0.1))


def test_a_lost_object_costs_something_where_the_whole_table_is_in_reach():
    cost = InsideRegion(lower=(-1.0, -1.0), upper=(1.0, 1.0))
    assert loss_of(cost, MODEL.table) > 0.5 * math.hypot(1.0, 0.8)
    goal = DistanceToGoal(goal=(0.0, 0.0))  # whose farthest corners are as far
    assert loss_of(goal, MODEL.table) == pytest.approx(loss_of(cost, MODEL.table))


def fall(speed=1.0):
    push = PlannedPush(direction=0.0, speed=speed, travel=0.45)
    return trajectory_of(MODEL, (push,), Situation(start=START))


def test_an_object_pushed_over_the_edge_falls_and_costs_more_than_any_place_on_the_table():
    trajectory = fall()
    assert trajectory.ending is Ending.FELL and trajectory.lost
    cost = DistanceToGoal(goal=GOAL)
    grid = [np.array([x, y]) for x in np.linspace(-0.5, 0.5, 11) for y in np.linspace(-0.4, 0.4, 9)]
    assert cost_of(cost, trajectory, MODEL.table) == loss_of(cost, MODEL.table) > max(cost.at(p) for p in grid)


def test_a_rollout_that_diverged_is_no_answer():
    trajectory = replace(fall(), ending=Ending.DIVERGED)
    assert cost_of(DistanceToGoal(goal=GOAL), trajectory, MODEL.table) == math.inf


def test_a_tall_object_that_is_tipped_over_is_lost():
    tall = replace(MODEL, shape=Box(size=(0.03, 0.05, 0.25)), body=body_of(0.3, 0.9))
    push = PlannedPush(direction=0.0, speed=0.5, travel=0.2)
    trajectory = trajectory_of(tall, (push,), Situation(start=START, hand_height=0.24))
    assert trajectory.ending is Ending.TOPPLED and trajectory.lost


def test_an_object_that_rolls_on_has_no_end_to_be_near_the_goal():
    rolling = replace(MODEL, shape=Cylinder(radius=0.03, length=0.1, axis="y"), table=((-9.0, -9.0), (9.0, 9.0)))
    push = PlannedPush(direction=0.0, speed=0.05, travel=0.03)
    trajectory = trajectory_of(rolling, (push,), Situation(start=START))
    cost = DistanceToGoal(goal=(float(trajectory.end[0]), float(trajectory.end[1])))
    assert trajectory.ending is Ending.MOVING and not trajectory.lost
    assert cost_of(cost, trajectory, rolling.table) == loss_of(cost, rolling.table)


@pytest.mark.parametrize(("height", "ending"), [(None, Ending.TOPPLED), (0.02, Ending.AT_REST)])
def test_a_push_touches_where_the_recorded_ones_did(height, ending):
    """A box of 0.15 m topples where friction times the height of the push is more than half its depth."""
    tall = replace(MODEL, shape=Box(size=(0.05, 0.1, 0.15)), body=body_of(0.3, 0.4), contact_height=height)
    push = PlannedPush(direction=0.0, speed=0.05, travel=0.1)
    assert trajectory_of(tall, (push,), Situation(start=START)).ending is ending


@pytest.mark.parametrize(("spin", "ending"), [(0.5, Ending.MOVING), (0.005, Ending.AT_REST)])
def test_an_object_that_still_turns_is_not_at_rest(spin, ending):
    times = np.array([0.0, 0.05])
    half = 0.5 * spin * times
    upright = np.column_stack(
        [np.cos(half), 0.0 * half, 0.0 * half, np.sin(half), np.zeros((2, 2)), 0.0 * half + 0.015]
    )
    motion = SimpleNamespace(
        outcome=Outcome.COMPLETED, poses=upright, times=times,
        planar_at=lambda at: np.column_stack([0.0 * at, 0.0 * at, spin * at]),
    )  # fmt: skip
    assert _ending(MODEL, motion) is ending
