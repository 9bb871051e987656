"""Two pushes to a goal, each in the best of some random directions, with models that were learned in different ways.

Source: Zhu, Kimmel, Boularias, section IV.B.
"""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy import stats

from physid_drake.cell import Body
from physid_drake.model import Model
from physid_drake.plan import Ending, Situation
from physid_drake.plan.trajectory import trajectory_of
from physid_drake.policies import PlannedPush
from physid_drake.progress import Progress
from physid_drake.validation.experiments.hidden_robot import (
    ERASER,
    HiddenRobot,
    Pose,
    draw_start,
    draw_world,
    record_pushes,
)
from physid_drake.validation.experiments.learning import GREEDY, RANDOM, Learner
from physid_drake.validation.experiments.values import Array, Panel, Record, Result, Series, Table, mean_and_deviation

SLOW: Final = (0.05, 0.15)  # m/s, of the training pushes
FRICTIONS: Final = (0.12, 0.4)
PUSHES: Final = 2
SECTOR: Final = math.radians(45.0)  # of the directions, to each side of the way to the goal
OBLIQUE: Final = math.radians(30.0)
"""Of the way to the goal against the normal of the long face, to each side."""
NEAR: Final = 0.01  # m: a success
GRAVITY: Final = 9.81
NOMINAL, TRUTH = "nominal parameters", "true parameters in the cell"
COMPARED: Final = (GREEDY, RANDOM)


@dc.dataclass(frozen=True, kw_only=True)
class PushDirections:
    """Sizes of the experiment.

    Attributes:
        seed: of everything random.
        repetitions: trials, each in a world of its own.
        training: slow pushes that are learned from.
        budget: trials of a search.
        directions: candidates for each push.
        distance: of the goal [m].
        speed: of the hand [m/s].
        time_step_s: of the cell [s].
    """

    seed: int
    repetitions: int = 10
    training: int = 6
    budget: int = 20
    directions: int = 25
    distance: float = 0.2
    speed: float = 0.3
    time_step_s: float = 2e-3

    def repeat(self, index: int, progress: Progress) -> Record:
        """One world: learn, then push twice with each model."""
        draws, scatter, *streams = [
            np.random.default_rng(s) for s in np.random.SeedSequence([self.seed, index]).spawn(6)
        ]
        world = draw_world(draws, ERASER, FRICTIONS)
        robot = HiddenRobot(world, rng=draws)
        learner = Learner(
            robot.recording(record_pushes(robot, draws, self.training, speeds=SLOW)), time_step_s=self.time_step_s
        )  # fmt: skip
        space = learner.thetas.space
        truth = {"mass": world.mass, "support_friction": world.support_friction, "hand_friction": world.hand_friction}
        thetas = {NOMINAL: np.asarray(space.nominal), TRUTH: np.array([truth[name] for name in space.names])}
        for method, stream in zip(COMPARED, streams, strict=False):
            trials = learner.learn(
                method, learner.problems, budget=self.budget, rng=stream,
                on_trial=lambda count, method=method: progress(method, count, self.budget),  # type: ignore[misc]
            )  # fmt: skip
            thetas[method] = trials.best_after(self.budget)
        start = draw_start(draws)
        heading = start[2] + 0.5 * math.pi + float(draws.uniform(-OBLIQUE, OBLIQUE))
        goal = np.array(start[:2]) + self.distance * np.array([math.cos(heading), math.sin(heading)])
        # Every model meets the same noise, scatter and candidates.
        seeds = scatter.integers(2**63, size=2).tolist()
        ends = {}
        for name, theta in thetas.items():
            progress(f"pushes with {name}", 0, 0)
            attempt = HiddenRobot(world, rng=np.random.default_rng(seeds[0]), start=start)
            model = attempt.model(learner.config, learner.thetas.body(theta))
            ends[name] = self._distance(attempt, model, goal, np.random.default_rng(seeds[1]))
        return {"truth": truth, "thetas": {name: theta.tolist() for name, theta in thetas.items()}, "metres": ends}

    def _distance(self, robot: HiddenRobot, model: Model, goal: Array, rng: np.random.Generator) -> float:
        """Distance from the goal after all pushes [m]."""
        for left in range(PUSHES, 0, -1):
            pose = robot.see()
            way = (goal - np.array(pose[:2])) / left
            robot.execute(self._best(model, pose, way, rng))
            if robot.lost:
                break
        return float(np.linalg.norm(goal - np.array(robot.pose[:2])))

    def _best(self, model: Model, pose: Pose, way: Array, rng: np.random.Generator) -> PlannedPush:
        """The push that is predicted to end nearest to ``way`` (2,) from the object [m]."""
        heading = math.atan2(way[1], way[0])
        travel = _travel(float(np.linalg.norm(way)), self.speed, model.body)
        pushes = [
            PlannedPush(direction=heading + turn, speed=self.speed, travel=travel)
            for turn in rng.uniform(-SECTOR, SECTOR, self.directions).tolist()
        ]
        target = np.array(pose[:2]) + way
        misses = []
        for push in pushes:
            predicted = trajectory_of(model, (push,), Situation(start=pose))
            kept = predicted.ending is Ending.AT_REST
            misses.append(float(np.linalg.norm(predicted.end[:2] - target)) if kept else math.inf)
        return pushes[int(np.argmin(misses))]

    def result(self, records: Sequence[Record]) -> Result:
        """How often the object came near the goal, and how near."""
        rows = []
        names = [*COMPARED, NOMINAL, TRUTH]
        for name in names:
            found = [1e3 * r["metres"][name] for r in records]
            hits = sum(f <= 1e3 * NEAR for f in found)
            interval = stats.binomtest(hits, len(found)).proportion_ci(confidence_level=0.9, method="wilson")
            rows.append((name, hits, len(found), *mean_and_deviation(found), float(np.median(found)), max(found),
                         float(interval.low), float(interval.high)))  # fmt: skip
        cumulated = tuple(_share_within(name, [1e3 * r["metres"][name] for r in records]) for name in names)
        return Result(
            setting=(
                f"{len(records)} hidden worlds (MuJoCo) with an eraser, as in motion_prediction."
                f" {self.training} pushes at {SLOW[0]:g} to {SLOW[1]:g} m/s to learn mass, support friction and hand"
                f" friction from, with {self.budget} trials. Then {PUSHES} pushes at {self.speed:g} m/s to a goal"
                f" {self.distance:g} m away"
                " (within 30 degrees of the normal of the long face), each in the best of"
                f" {self.directions} random directions within 45 degrees; the second is planned from where the first"
                " has ended. All models meet the same noise and candidates."
            ),
            tables=(
                Table(
                    name="goal", title="distance from the goal after two pushes",
                    columns=("model", "within 1 cm", "trials", "mm", "+- mm", "median mm", "worst mm", "90 % low",
                             "90 % high"),
                    rows=tuple(rows),
                ),
            ),
            panels=(
                Panel(title="two pushes", x_label="distance from the goal [mm]", y_label="share of trials within",
                      series=cumulated),
            ),
        )  # fmt: skip


def _travel(distance: float, speed: float, body: Body) -> float:
    """Of the hand, so that the object slides the rest of a distance [m]."""
    slide = speed**2 / (2.0 * float(body.support_friction.mean()) * GRAVITY)
    return max(5e-3, distance - slide)


def _share_within(name: str, distances: Sequence[float]) -> Series:
    """The share of distances [mm] up to each of some."""
    places = [0.0, *np.linspace(1.0, 40.0, 40).tolist()]
    shares = [float(np.mean(np.asarray(distances) <= place)) for place in places]
    return Series(name=name, x=tuple(places), mean=tuple(shares), deviation=(math.nan,) * len(places))
