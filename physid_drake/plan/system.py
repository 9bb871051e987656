"""Planning as a Drake system, which plans with identifications as they arrive."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State

from physid_drake.identify import Identification
from physid_drake.identify.system import PUSH_PERIOD
from physid_drake.model import Correlation, Model
from physid_drake.optional import boxed, unboxed
from physid_drake.plan.config import PlanConfig
from physid_drake.plan.costs import DistanceToGoal
from physid_drake.plan.draws import scatter_freedom
from physid_drake.plan.pipeline import Plan, plan
from physid_drake.plan.robot import Robot
from physid_drake.plan.task import check_task, default_goal, policy_for
from physid_drake.plan.trajectory import Situation
from physid_drake.policies import PlannedPush, policy_named
from physid_drake.policies.policy import Reach
from physid_drake.progress import Progress
from physid_drake.pushes.problem import UNKNOWN_HAND, CellSpec, HandUse, PushProblem
from physid_drake.recording import Push

Array = NDArray[np.float64]
MakePlan = Callable[[Any], Plan]
_STREAM = 2  # of the run's seed; the identification takes the two before


class PolicySystem(LeafSystem):
    """Plans the next push with what was identified or diagnosed.

    Its state holds the theta of the latest plan, and the plan.

    .. pydrake_system::
        name: policy
        input_ports:
        - identification.estimated
        output_ports:
        - push.desired
        - settings.desired
    """

    def __init__(self, make_plan: MakePlan, *, dimension: int, begin: float = 0.0) -> None:
        """Prepare.

        Args:
            make_plan: called with what arrives at the port, an ``Identification`` or an ``Examined`` one; returns a
                plan.
            dimension: of the policy's settings; the output is NaN before the first plan.
            begin: time of the diagram [s] before which identifications are ignored, since they will soon be replaced.
        """
        LeafSystem.__init__(self)
        self.set_name("policy")
        self._make_plan, self._dimension = make_plan, dimension
        self.DeclareAbstractInputPort("identification.estimated", Value[object]())
        start: tuple[Array, Plan | None] = (np.zeros(0), None)
        self._memory = self.DeclareAbstractState(Value[object](start))
        own = {self.all_state_ticket()}  # so that a loop through a robot has no algebraic loop in it
        self.DeclareAbstractOutputPort("push.desired", Value[object], self._copy, own)
        self.DeclareVectorOutputPort("settings.desired", dimension, self._settings, own)
        self.DeclarePeriodicUnrestrictedUpdateEvent(PUSH_PERIOD, begin, self._receive)

    def plan(self, context: Context) -> Plan | None:
        """The latest plan, from the state; None before the first."""
        latest: Plan | None = context.get_abstract_state(self._memory).get_value()[1]
        return latest

    def _receive(self, context: Context, state: State) -> EventStatus:
        known, _ = context.get_abstract_state(self._memory).get_value()
        identification = unboxed(self.GetInputPort("identification.estimated").Eval(context))
        # Drake copies what goes through a port, so that identity would not tell a new one from an old one.
        if identification is not None and not np.array_equal(identification.theta, known):
            made = (identification.theta.copy(), self._make_plan(identification))
            state.get_mutable_abstract_state(self._memory).set_value(made)
        return EventStatus.Succeeded()

    def _copy(self, context: Context, output: AbstractValue) -> None:
        output.set_value(boxed(self.plan(context)))

    def _settings(self, context: Context, output: BasicVector) -> None:
        latest = self.plan(context)
        output.SetFromVector([math.nan] * self._dimension if latest is None else latest.settings)


class RobotSystem(LeafSystem):
    """Makes the first push of each new plan, with the object back at its start, and outputs the recording.

    Its state holds the number of pushes, the latest recording, and the settings with which it was planned. A robot is
    made anew for every push, from the push's number, so that nothing is kept outside of the Context.

    .. pydrake_system::
        name: robot
        input_ports:
        - push.desired
        output_ports:
        - push.measured
    """

    def __init__(self, make_robot: Callable[[int], Robot], *, first: PlannedPush) -> None:
        """Prepare.

        Args:
            make_robot: called with a push's number; returns a robot whose object is at its start.
            first: the push to make before there is a plan.
        """
        LeafSystem.__init__(self)
        self.set_name("robot")
        self._make_robot, self._first = make_robot, first
        self.DeclareAbstractInputPort("push.desired", Value[object]())
        start: tuple[int, Push | None, Array] = (0, None, np.zeros(0))
        self._memory = self.DeclareAbstractState(Value[object](start))
        self.DeclareAbstractOutputPort("push.measured", Value[object], self._copy, {self.all_state_ticket()})
        self.DeclarePeriodicUnrestrictedUpdateEvent(PUSH_PERIOD, 0.0, self._act)

    def _act(self, context: Context, state: State) -> EventStatus:
        count, _, done = context.get_abstract_state(self._memory).get_value()
        plan: Plan | None = unboxed(self.GetInputPort("push.desired").Eval(context))
        if plan is None:
            push, settings = (self._first, done) if count == 0 else (None, done)
        else:
            push, settings = plan.policy.pushes(plan.settings)[0], np.array(plan.settings)
        if push is not None and (count == 0 or not np.array_equal(settings, done)):
            made = dc.replace(self._make_robot(count).execute(push), name=f"pushes/{count + 1:03d}.csv")
            state.get_mutable_abstract_state(self._memory).set_value((count + 1, made, settings))
        return EventStatus.Succeeded()

    def _copy(self, context: Context, output: AbstractValue) -> None:
        output.set_value(boxed(context.get_abstract_state(self._memory).get_value()[1]))


@dc.dataclass(frozen=True, kw_only=True)
class Planner:
    """Makes the plans of ``run_cell``: with the identified parameters, and with what a diagnosis found.

    Attributes:
        config: of the plan.
        spec: of the cell.
        situation: where the object starts.
        goal: x, y in W [m].
        name: of the recording.
        seed: of the run.
        hand: how the recorded pushes used the hand.
    """

    config: PlanConfig
    spec: CellSpec
    situation: Situation
    goal: tuple[float, float]
    name: str
    seed: int
    hand: HandUse = UNKNOWN_HAND

    @property
    def dimension(self) -> int:
        """Number of the policy's settings."""
        return policy_named(self.config.policy, Reach(heading=0.0, travel=1.0, inner_radius=1.0)).space.dimension

    def run(self, result: Identification, progress: Progress | None = None) -> Plan:
        """Plan with the identified parameters and their intervals.

        Args:
            result: the identification.
            progress: called with the stage, steps done and steps in all.

        Raises:
            ConfigError: if the recording has no hand.
        """
        model = identified_model(result, self.spec, self.name, hand=self.hand)
        return self.with_model(
            model, friction_scatter=result.friction_scatter, pushes=len(result.pushes), progress=progress
        )

    def with_model(
        self, model: Model, *, friction_scatter: float, pushes: int, progress: Progress | None = None
    ) -> Plan:
        """Plan with a model, such as the one that a diagnosis exports.

        Args:
            model: with its intervals and effects.
            friction_scatter: relative standard deviation of friction between pushes [-].
            pushes: number of pushes from which the model was learned.
            progress: called with the stage, steps done and steps in all.

        Raises:
            ConfigError: if the model has no hand.
        """
        stream = np.random.SeedSequence(self.seed).spawn(_STREAM + 1)[_STREAM]
        return plan(
            model, policy_for(self.config.policy, model, self.situation.start, self.goal),
            DistanceToGoal(goal=self.goal), situation=self.situation, rng=np.random.default_rng(stream),
            budget=self.config.budget, draws=self.config.draws, sweep=self.config.sweep,
            tolerance=self.config.tolerance_m, friction_scatter=friction_scatter,
            scatter_freedom=scatter_freedom(pushes), progress=progress,
        )  # fmt: skip


def planner_of(config: PlanConfig, spec: CellSpec, problems: Sequence[PushProblem], name: str, seed: int) -> Planner:
    """The planner for a recording; the object starts where the configuration says, or where it was at first.

    Args:
        config: of the plan.
        spec: of the cell.
        problems: the recording's pushes; the start and the contact height of the first are used.
        name: of the recording.
        seed: of the run.

    Raises:
        ConfigError: if start or goal is not on the table, or they are too close to each other.
    """
    first = problems[0]
    start = first.start.pose
    if config.start_m:
        start = (config.start_m[0], config.start_m[1], math.radians(config.start_deg))
    goal = (config.goal_m[0], config.goal_m[1]) if config.goal_m else default_goal(start, spec.table)
    check_task(start, goal, spec.table)
    x, y, yaw = first.start_std[:3].tolist()  # as well as the recording's tracker sees an object at rest
    situation = Situation(
        start=start, order=len(problems), hand_height=first.hand_height, start_std=(x, y, yaw)
    )  # fmt: skip
    return Planner(
        config=config, spec=spec, situation=situation, goal=goal, name=name, seed=seed,
        hand=HandUse.of(problems),
    )  # fmt: skip


def identified_model(result: Identification, spec: CellSpec, name: str, *, hand: HandUse = UNKNOWN_HAND) -> Model:
    """The baseline model with the identified parameters, their intervals and their correlation.

    Args:
        result: the identification.
        spec: of its cell.
        name: of the recording.
        hand: how the recorded pushes used the hand.
    """
    intervals = {f"theta.{e.name}": list(e.ci90) for e in result.estimates}
    return Model(
        recording=name, shape=spec.shape, hand_radius=spec.hand_radius, table=spec.table, config=spec.config,
        body=result.case.thetas.body(result.theta), intervals=intervals,
        correlation=Correlation.of(tuple(intervals), result.correlation),
        tip_height=hand.tip_height, contact_height=hand.contact_height, top_speed=hand.top_speed,
    )  # fmt: skip
