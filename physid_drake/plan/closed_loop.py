"""Several pushes to a goal: after each, the object is seen, the model updated and the next push planned."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Iterator

import numpy as np

from physid_drake.model import Model
from physid_drake.plan.costs import DistanceToGoal
from physid_drake.plan.learning import MadePush, learned
from physid_drake.plan.pipeline import TOLERANCE, Plan, plan
from physid_drake.plan.robot import Robot
from physid_drake.plan.task import NEAREST, policy_for
from physid_drake.plan.trajectory import Situation, path_of

Point = tuple[float, float]
Pose = tuple[float, float, float]


@dc.dataclass(frozen=True, kw_only=True)
class Task:
    """A goal, and how it is to be reached.

    Attributes:
        goal: x, y in W [m].
        pushes: largest number of pushes.
        tolerance: distance from the goal at which no further push is made [m].
        policy: name in ``policies.POLICIES`` of a family of single pushes.
        budget: settings that are tried for each plan.
        noise: standard deviations of the tracker, x, y [m] and yaw [rad].
        friction_scatter: relative standard deviation of friction between pushes [-].
        order: number of pushes that were made before the first, for effects that depend on it.
    """

    goal: Point
    pushes: int = 3
    tolerance: float = 0.5 * TOLERANCE
    policy: str = "push"
    budget: int = 48
    noise: Pose = (0.0, 0.0, 0.0)
    friction_scatter: float = 0.0
    order: int = 0


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Step:
    """One push, with what was learned from it.

    Attributes:
        plan: of the push; None where no push was made.
        seen: where the object was seen after it, x, y [m], yaw [rad].
        miss: distance from the goal, as seen [m].
        model: with what was learned.
    """

    plan: Plan | None
    seen: Pose
    miss: float
    model: Model


def closed_loop(model: Model, robot: Robot, task: Task, rng: np.random.Generator) -> Iterator[Step]:
    """See, plan, push and learn, until the object is within the tolerance of the goal or all pushes are made.

    Args:
        model: whose intervals are the belief that the pushes update.
        robot: sees and pushes the object.
        task: the goal.
        rng: random numbers of the plans.

    Raises:
        ConfigError: if goal or object is not on the table, or the model has no hand.
        RobotError: if the robot cannot push.
    """
    seen = robot.see()
    for number in range(task.pushes):
        if _miss(seen, task) <= max(task.tolerance, NEAREST):
            return
        made = _planned(model, seen, task, rng, number)
        push = made.policy.pushes(made.settings)[0]
        path = path_of(model, push, seen)
        robot.execute(push, aim=seen)
        before, seen = seen, robot.see()
        one = MadePush(
            planned=push, path=path, situation=Situation(start=before, order=task.order + number), end=seen
        )
        model = learned(model, one, noise=task.noise, friction_scatter=task.friction_scatter)
        yield Step(plan=made, seen=seen, miss=_miss(seen, task), model=model)


def open_loop(model: Model, robot: Robot, task: Task, rng: np.random.Generator) -> Iterator[Step]:
    """The same pushes without feedback: each is planned from where the model predicts that the last one ended.

    No push is made where the object is predicted to be within the tolerance already. Arguments as of ``closed_loop``.

    Raises:
        ConfigError: if the goal is not on the table, or the model has no hand.
        RobotError: if the robot cannot push.
    """
    thought = robot.see()
    for number in range(task.pushes):
        made = None
        if _miss(thought, task) > max(task.tolerance, NEAREST):
            made = _planned(model, thought, task, rng, number)
            robot.execute(made.policy.pushes(made.settings)[0], aim=thought)
            x, y, yaw = made.predicted.end.tolist()
            thought = (x, y, yaw)
        seen = robot.see()
        yield Step(plan=made, seen=seen, miss=_miss(seen, task), model=model)


def _planned(model: Model, pose: Pose, task: Task, rng: np.random.Generator, number: int) -> Plan:
    return plan(
        model, policy_for(task.policy, model, pose, task.goal), DistanceToGoal(goal=task.goal),
        situation=Situation(start=pose, order=task.order + number), rng=rng, budget=task.budget, draws=0, sweep=0,
        tolerance=task.tolerance,
    )  # fmt: skip


def _miss(pose: Pose, task: Task) -> float:
    return math.hypot(pose[0] - task.goal[0], pose[1] - task.goal[1])
