"""What an effect is worth to a plan, on worlds of the planar integrator, which shares nothing with the cell."""

import math

import numpy as np
import pytest
from reference.planar import Hand, simulate_planar
from reference.planar import HandPath as ReferencePath
from reference.scenes import OBJECTS
from twin import body_of, config_of, shape_of

from physid_drake.cell import HandPath
from physid_drake.effects.fields import TableTilt
from physid_drake.model import Model
from physid_drake.plan import DistanceToGoal, Situation, plan
from physid_drake.plan.task import policy_for

pytestmark = pytest.mark.slow

OBJECT = OBJECTS["box"]
FRICTION, HAND_FRICTION, RADIUS, GRAVITY = 0.3, 0.25, 0.010, 9.81
START = (0.0, 0.0, 0.0)
TIME_STEP, POINTS = 1e-4, 150


def model(*effects: TableTilt) -> Model:
    """The true theta, with effects or without."""
    return Model(
        recording="box", shape=shape_of(OBJECT), hand_radius=RADIUS, table=((-1.0, -1.0), (1.0, 1.0)),
        config=config_of("point"), body=body_of(OBJECT.mass, FRICTION, hand_friction=HAND_FRICTION), effects=effects,
    )  # fmt: skip


def landed(path: HandPath, tilt: TableTilt) -> np.ndarray:
    """Where the hidden world leaves the object (2,) [m]."""
    hand = ReferencePath(times=path.times, p0=path.start, velocities=path.velocities)
    force = (OBJECT.mass * GRAVITY * math.sin(tilt.x), OBJECT.mass * GRAVITY * math.sin(tilt.y))
    motion = simulate_planar(
        OBJECT, FRICTION, np.array([0.0, float(path.times[-1]) + 2.0]), pose=START, force=force,
        hand=Hand(path=hand, radius=RADIUS, height=0.5 * OBJECT.height, friction=HAND_FRICTION),
        support=OBJECT.support(POINTS), time_step=TIME_STEP,
    )  # fmt: skip
    return motion.poses[-1, :2]


def planned_path(known: Model, goal: tuple[float, float], policy: str, budget: int, seed: int) -> HandPath:
    made = plan(
        known, policy_for(policy, known, START, goal), DistanceToGoal(goal=goal), situation=Situation(start=START),
        rng=np.random.default_rng(seed), budget=budget, draws=0, sweep=0,
    )  # fmt: skip
    return made.predicted.paths[0]


@pytest.mark.parametrize(("tilt", "goal"), [(0.04, (0.3, 0.0)), (0.04, (-0.3, 0.0))])
def test_a_speed_planned_with_the_tilt_lands_nearer_than_one_planned_without(tilt, goal):
    hidden = TableTilt(x=tilt)
    error = {
        name: math.dist(landed(planned_path(known, goal, "push_speed", 12, 0), hidden), goal)
        for name, known in (("with", model(hidden)), ("without", model()))
    }
    assert error["with"] < 4e-3
    # Coulomb: the slide is longer or shorter by the tilt's share of the friction, 13 %.
    assert error["without"] > 8e-3 and error["without"] > 3.0 * error["with"]


def test_a_push_across_the_slope_is_aimed_uphill():
    hidden, goal = TableTilt(y=0.04), (0.3, 0.0)
    paths = {
        name: planned_path(known, goal, "push", 30, 0)
        for name, known in (("with", model(hidden)), ("without", model()))
    }
    error = {name: math.dist(landed(path, hidden), goal) for name, path in paths.items()}
    assert error["with"] < 0.7 * error["without"]


def test_in_a_level_world_the_plain_plan_lands_at_its_goal():
    goal = (0.3, 0.0)
    path = planned_path(model(), goal, "push_speed", 12, 1)
    assert math.dist(landed(path, TableTilt()), goal) < 4e-3
