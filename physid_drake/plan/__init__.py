"""A story: a model and a goal in, the best push out. The same search as the identification's, over a policy."""

from physid_drake.plan.config import PlanConfig as PlanConfig
from physid_drake.plan.costs import Cost as Cost
from physid_drake.plan.costs import DistanceToGoal as DistanceToGoal
from physid_drake.plan.costs import InsideRegion as InsideRegion
from physid_drake.plan.costs import WithinDisc as WithinDisc
from physid_drake.plan.robot import Robot as Robot
from physid_drake.plan.robot import SimulatedRobot as SimulatedRobot
from physid_drake.plan.story import Hindsight as Hindsight
from physid_drake.plan.story import Outcome as Outcome
from physid_drake.plan.story import Plan as Plan
from physid_drake.plan.story import Spread as Spread
from physid_drake.plan.story import SweepRow as SweepRow
from physid_drake.plan.story import caveat_of as caveat_of
from physid_drake.plan.story import caveats_of as caveats_of
from physid_drake.plan.story import outcome_under as outcome_under
from physid_drake.plan.story import plan as plan
from physid_drake.plan.task import policy_for as policy_for
from physid_drake.plan.teaching import Lesson as Lesson
from physid_drake.plan.teaching import most_informative_push as most_informative_push
from physid_drake.plan.trajectory import Ending as Ending
from physid_drake.plan.trajectory import Situation as Situation
from physid_drake.plan.trajectory import Trajectory as Trajectory
