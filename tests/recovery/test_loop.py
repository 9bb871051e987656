"""Robot, identification and policy as one diagram: push, record, learn, plan, push."""

import dataclasses as dc
import math

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from runs import COARSE, shipped_pushes
from twin import body_of

from physid_drake.identify import OnlineIdentifier, SearchConfig
from physid_drake.identify.system import PUSH_PERIOD, IdentificationSystem
from physid_drake.model import Model
from physid_drake.plan import DistanceToGoal, SimulatedRobot, Situation, plan
from physid_drake.plan.system import PolicySystem, RobotSystem, identified_model
from physid_drake.plan.task import policy_for
from physid_drake.policies import PlannedPush
from physid_drake.pushes.config import ThetaConfig

pytestmark = pytest.mark.slow

START, GOAL = (0.0, 0.0, 0.0), (0.25, 0.0)


def test_a_robot_that_knows_nothing_learns_and_comes_nearer_to_the_goal_push_by_push():
    template = shipped_pushes(1)
    truth = body_of(0.054, 0.2, hand_friction=0.25)
    hidden = Model(
        recording="hidden", shape=template.object.shape, hand_radius=template.hand.radius,
        table=((-1.0, -1.0), (1.0, 1.0)), config=COARSE, body=truth,
    )  # fmt: skip
    learner = OnlineIdentifier(
        template, cell=COARSE, theta=ThetaConfig(parameters=["hand_friction", "support_friction"]),
        search=SearchConfig(jobs=1), seed=0, budget=5,
    )  # fmt: skip

    def planned(identification):
        model = identified_model(identification, identification.case.pool.spec, "believed")
        return plan(
            model, policy_for("push_speed", model, START, GOAL), DistanceToGoal(goal=GOAL),
            situation=Situation(start=START), rng=np.random.default_rng(0), budget=8, draws=0, sweep=0,
        )  # fmt: skip

    def robot(number):
        sensors = dc.replace(template.sensors, object_position_std=3e-4, object_rotation_std=3e-3)
        return SimulatedRobot(
            hidden, start=START, sensors=sensors, rng=np.random.default_rng([5, number]), pushes=number
        )

    builder = DiagramBuilder()
    arm = builder.AddSystem(RobotSystem(robot, first=PlannedPush(direction=0.0, speed=0.1, travel=0.04)))
    space = learner.thetas.space
    learning = builder.AddSystem(IdentificationSystem(learner, dimension=2, nominal=space.nominal))
    policy = builder.AddSystem(PolicySystem(planned, dimension=1))
    builder.Connect(arm.GetOutputPort("push.measured"), learning.GetInputPort("push.measured"))
    builder.Connect(
        learning.GetOutputPort("identification.estimated"), policy.GetInputPort("identification.estimated")
    )
    builder.Connect(policy.GetOutputPort("push.desired"), arm.GetInputPort("push.desired"))
    simulator = Simulator(builder.Build())
    # Learn from the first push, plan, push, learn: one system acts in each period.
    simulator.AdvanceTo(4.5 * PUSH_PERIOD)
    root = simulator.get_context()
    belief = learning.belief(learning.GetMyContextFromRoot(root))
    assert len(belief.pushes) == 2
    np.testing.assert_allclose(belief.theta[1], 0.2, rtol=0.03)
    ends = [push.object.planar[-1, :2] for push in belief.pushes]
    missed = [math.dist(end, GOAL) for end in ends]
    assert missed[0] > 0.15
    assert missed[1] < 0.05  # measured 0.033: the plan looks at eight speeds
