"""Hidden worlds and what is learned in them: MuJoCo makes the pushes, the cell explains them."""

import math

import numpy as np
import pytest

pytest.importorskip("mujoco")

from physid_drake.errors import RobotError
from physid_drake.policies import PlannedPush
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import Box, Hand, ObjectModel, PoseStream, Push, Recording, Sensors, Table
from physid_drake.validation.experiments.hidden_robot import (
    BOTTLE,
    ERASER,
    FRICTION_SCATTER,
    NO_NOISE,
    HiddenRobot,
    draw_push,
    draw_world,
    record_pushes,
)
from physid_drake.validation.experiments.learning import Learner, plain_task
from physid_drake.validation.experiments.mit_pushes import PLAYED_SPEED, TIME_STEP, played
from physid_drake.validation.experiments.motion_prediction import MotionPrediction
from physid_drake.validation.experiments.next_push import most_informative, the_first
from physid_drake.validation.experiments.push_direction import _share_within
from physid_drake.validation.experiments.push_speed import FAST, GOAL, LOST, FastPushes, _distance
from physid_drake.validation.experiments.repetitions import claim, run_all
from physid_drake.validation.run_experiment import write

SPEEDS = (0.1, 0.3)


def world_of(shape=ERASER, seed=0, frictions=(0.25, 0.25)):
    return draw_world(np.random.default_rng(seed), shape, frictions)


def truth_of(world, learner):
    return np.array([getattr(world, name) for name in learner.thetas.space.names])


def test_the_true_theta_predicts_what_the_hidden_robot_records():
    world, rng = world_of(), np.random.default_rng(1)
    robot = HiddenRobot(world, rng=rng, friction_scatter=0.0)
    learner = Learner(robot.recording(record_pushes(robot, rng, 3, speeds=SPEEDS)), time_step_s=2e-3)
    errors = learner.end_errors(learner.problems, truth_of(world, learner))
    assert errors.positions.max() < 2e-3
    assert np.degrees(errors.rotations.max()) < 2.0


def test_the_object_stays_where_a_push_leaves_it():
    robot = HiddenRobot(world_of(), rng=np.random.default_rng(0), sensors=NO_NOISE, friction_scatter=0.0)
    push = PlannedPush(direction=0.5 * math.pi, speed=0.2, travel=0.05)
    robot.execute(push)
    x, y, _ = robot.pose
    # The hand's travel, and the slide that its speed leaves.
    assert y == pytest.approx(0.05 + 0.2**2 / (2.0 * 0.25 * 9.81), rel=0.03)
    assert abs(x) < 1e-4
    robot.execute(push)
    assert robot.pose[1] == pytest.approx(2.0 * y, rel=0.03)


def test_an_object_that_left_the_table_must_be_put_back():
    robot = HiddenRobot(
        world_of(), rng=np.random.default_rng(0), table=((-0.1, -0.1), (0.1, 0.1)), sensors=NO_NOISE
    )  # fmt: skip
    push = PlannedPush(direction=0.0, speed=0.3, travel=0.12)
    robot.execute(push)
    assert robot.lost
    with pytest.raises(RobotError, match="put it back"):
        robot.execute(push)
    robot.put((0.0, 0.0, 0.0))
    assert not robot.lost


def test_random_pushes_meet_the_object():
    rng = np.random.default_rng(2)
    robot = HiddenRobot(world_of(), rng=rng)
    for _ in range(3):
        robot.put((0.0, 0.0, float(rng.uniform(-3.0, 3.0))))
        robot.execute(draw_push(rng, ERASER, robot.pose[2], speeds=SPEEDS))
        assert 0.01 < math.hypot(*robot.pose[:2]) < 0.2


def test_the_informative_push_is_one_that_turns_the_object():
    world, rng = world_of(), np.random.default_rng(3)
    robot = HiddenRobot(world, rng=rng)
    recording = robot.recording(record_pushes(robot, rng, 1, speeds=SPEEDS))
    learner = Learner(
        recording, time_step_s=4e-3, theta=ThetaConfig(parameters=["support_friction", "hand_friction"])
    )
    pushes = [
        PlannedPush(direction=0.5 * math.pi, speed=speed, travel=0.05, contact_offset=offset)
        for speed, offset in ((0.05, 0.0), (0.3, 0.02))
    ]
    offer = ((0.0, 0.0, 0.0), pushes)
    before = np.eye(2)
    chosen, after = most_informative(learner, truth_of(world, learner), before, offer)
    # A slow push through the middle moves the object as far as the hand goes, whatever the friction.
    assert chosen == 1
    assert np.linalg.eigvalsh(after - before).min() > -1e-6 * np.trace(after)
    assert the_first(learner, truth_of(world, learner), before, offer)[0] == 0


def slow_pushes(shape, speed=0.010):
    """Pushes of which only the ends are known, with a straight path of the rod on either side of the middle."""
    pushes = []
    for number, side in enumerate((-0.015, 0.008, 0.025)):
        times = np.linspace(0.0, 0.05 / speed, 100)
        path = np.column_stack([-0.055 + speed * times, np.full(100, side), np.full(100, 0.0065)])
        still = np.tile([1.0, 0.0, 0.0, 0.0], (100, 1))
        ends = np.array([[0.0, 0.0, 0.0065], [0.02, 0.0, 0.0065]])
        pushes.append(
            Push(
                name=f"{number}", force=None, hand=PoseStream(times=times, positions=path, quaternions=still),
                object=PoseStream(times=times[[0, -1]], positions=ends, quaternions=still[:2]),
            )
        )  # fmt: skip
    return Recording(
        name="slow", description="", object=ObjectModel(shape=shape, mass=0.8), table=Table(size=(1.0, 1.0)),
        hand=Hand(tip="cylinder", radius=0.00475, length=0.01), sensors=Sensors(), pushes=tuple(pushes),
    )  # fmt: skip


def test_a_slow_push_ends_where_it_does_played_faster():
    recording = slow_pushes(Box(size=(0.09, 0.09, 0.013)))
    config = ThetaConfig(parameters=["hand_friction"], nominal={"support_friction": 0.15})
    exact, coarse = (Learner(recording, time_step_s=time_step, theta=config) for time_step in (2e-3, TIME_STEP))
    theta = np.array([0.25])
    slow = np.array([r.poses[-1] for r in exact.case.pool.run([plain_task(p, theta) for p in exact.problems])])
    fast = [played(problem, PLAYED_SPEED) for problem in coarse.problems]
    ends = np.array([r.poses[-1] for r in coarse.case.pool.run([plain_task(p, theta) for p in fast])])
    # What they moved, and by how little the two differ.
    assert np.hypot(*slow[:, :2].T).min() > 0.01 and np.abs(slow[:, 2]).min() > 0.1
    assert np.hypot(*(ends - slow)[:, :2].T).max() < 1e-3
    assert np.degrees(np.abs(ends - slow)[:, 2]).max() < 1.0


@pytest.mark.slow
def test_the_bottle_slides_as_far_as_its_speed_and_friction_say():
    bottle = FastPushes(world_of(BOTTLE, frictions=(0.12, 0.12)), speeds=5)
    speed = 0.9
    slide = speed**2 / (2.0 * 0.12 * 9.81)
    ends = [bottle.end(speed, np.random.default_rng(seed)) for seed in range(40)]
    assert np.mean(ends) == pytest.approx(-0.5 + 0.1 + slide, abs=0.01)
    assert np.std(ends) == pytest.approx(FRICTION_SCATTER * slide, rel=0.4)
    assert bottle.worst_error_mm() < 2.0
    assert bottle.end(FAST[0], np.random.default_rng(0)) < bottle.end(FAST[1], np.random.default_rng(0))


def test_what_falls_off_the_far_edge_counts_as_lost():
    assert _distance(GOAL[0] + 0.05) == pytest.approx(50.0)
    assert _distance(0.6 + 1e-3) == 1e3 * LOST


def test_the_share_of_trials_within_a_distance_grows_to_one():
    series = _share_within("x", [5.0, 12.0, 39.0])
    assert series.mean[0] == 0.0 and series.mean[-1] == 1.0
    assert list(series.mean) == sorted(series.mean)


@pytest.mark.slow
def test_motion_prediction_runs_from_end_to_end_and_is_resumed(tmp_path):
    experiment = MotionPrediction(
        seed=0, repetitions=2, pushes=4, training=2, testing=1, subsets=(1, 2), budget=4, time_step_s=4e-3
    )  # fmt: skip
    with claim("motion_prediction", experiment, tmp_path) as folder:
        records = run_all(experiment, folder, jobs=1, progress=lambda stage, done, total: None)
        result = experiment.result(records)
        write(folder, result, "motion_prediction", "the command")
    names = {"command.txt", "figure.svg", "result.json", "result.md", "budget.csv", "training_pushes.csv"}
    assert names <= {file.name for file in tmp_path.iterdir()}
    for record in records:
        for method in record["methods"].values():
            assert all(np.diff(method["sigma"]) <= 1e-12)
        assert record["true_theta"]["mm"] < 5.0
    kept = (tmp_path / "repetitions" / "001.json").read_text()
    with claim("motion_prediction", experiment, tmp_path) as folder:
        again = run_all(experiment, folder, jobs=1, progress=lambda s, d, t: None)
    assert again == records and (tmp_path / "repetitions" / "001.json").read_text() == kept
