"""Pushes chosen for what they teach against random pushes: errors of theta and of prediction by number of pushes.

The paper leaves the choice of pushes for later (section V).
"""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np

from physid_drake.identify.baseline import baseline_hypothesis
from physid_drake.plan import most_informative_push
from physid_drake.policies import PlannedPush
from physid_drake.progress import Progress
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import Push, Recording
from physid_drake.validation.experiments.hidden_robot import (
    ERASER,
    HiddenRobot,
    Pose,
    draw_push,
    draw_start,
    draw_world,
    record_pushes,
)
from physid_drake.validation.experiments.learning import LEAST_SQUARES, Learner
from physid_drake.validation.experiments.values import (
    Array,
    Entry,
    Panel,
    Record,
    Result,
    Table,
    mean_and_deviation,
    series_of,
)

SPEEDS: Final = (0.05, 0.4)  # m/s
FRICTIONS: Final = (0.12, 0.4)
UNKNOWN: Final = ("support_friction", "hand_friction")
RANDOM, INFORMED = "random pushes", "informative pushes"

Offer = tuple[Pose, Sequence[PlannedPush]]
"""Where the object stands, and the pushes from which the next is chosen."""
Chooser = Callable[[Learner, Array, Array, Offer], tuple[int, Array]]
"""Learner, theta (d,), information (d, d) in the unit cube, offer -> index of the push to make, and with it the
information (d, d) as it is then expected to be."""


@dc.dataclass(frozen=True, kw_only=True)
class NextPush:
    """Sizes of the experiment.

    Attributes:
        seed: of everything random.
        repetitions: each with a world of its own.
        pushes: made one after the other; theta is learned again after each.
        candidates: random pushes from which the next is chosen.
        testing: random pushes that are predicted.
        budget: trials of each fit.
        time_step_s: of the cell [s].
    """

    seed: int
    repetitions: int = 10
    pushes: int = 5
    candidates: int = 10
    testing: int = 6
    budget: int = 10
    time_step_s: float = 2e-3

    def repeat(self, index: int, progress: Progress) -> Record:
        """One world: both ways of choosing meet the same candidates."""
        draws = np.random.default_rng([self.seed, index])
        world = draw_world(draws, ERASER, FRICTIONS)
        tester = HiddenRobot(world, rng=draws)
        tests = record_pushes(tester, draws, self.testing, speeds=SPEEDS)
        offers = [_offer(draws, self.candidates) for _ in range(self.pushes)]
        seed = int(draws.integers(2**63))
        record: Record = {"truth": {name: getattr(world, name) for name in UNKNOWN}}
        for name, choose in CHOOSERS.items():
            robot = HiddenRobot(world, rng=np.random.default_rng(seed))
            record[name] = self._learned(robot, choose, offers, tester.recording(tests), name, progress)
        return record

    def _learned(
        self,
        robot: HiddenRobot,
        choose: Chooser,
        offers: Sequence[Offer],
        tests: Recording,
        name: str,
        progress: Progress,
    ) -> Record:
        """Push, learn, choose, push."""
        config = ThetaConfig(parameters=list(UNKNOWN), nominal={"mass": robot.world.mass})
        tester = Learner(tests, time_step_s=self.time_step_s, theta=config)
        learner, made = tester, list[Push]()
        theta = np.asarray(tester.thetas.space.nominal)
        information = baseline_hypothesis(tester.case).precision
        found: dict[str, list[float]] = {"support_friction": [], "hand_friction": [], "mm": [], "deg": []}
        for number, offer in enumerate(offers):
            progress(f"{name}: push {number + 1}", number, len(offers))
            pose, pushes = offer
            chosen, information = choose(learner, theta, information, offer)
            robot.put(pose)
            made.append(robot.execute(pushes[chosen]))
            learner = Learner(robot.recording(tuple(made)), time_step_s=self.time_step_s, theta=config)
            trials = learner.learn(LEAST_SQUARES, learner.problems, budget=self.budget, rng=np.random.default_rng(0))
            theta = trials.best_after(self.budget)
            for parameter, value in learner.thetas.space.as_dict(theta).items():
                found[parameter].append(100.0 * abs(value / getattr(robot.world, parameter) - 1.0))
            errors = tester.end_errors(tester.problems, theta)
            found["mm"].append(1e3 * float(errors.positions.mean()))
            found["deg"].append(math.degrees(float(errors.rotations.mean())))
        return dict(found)

    def result(self, records: Sequence[Record]) -> Result:
        """Errors by number of pushes."""
        counts = [float(k) for k in range(1, self.pushes + 1)]
        kinds = {"support_friction": "support friction [%]", "hand_friction": "hand friction [%]",
                 "mm": "error of the end [mm]", "deg": "error [deg]"}  # fmt: skip
        rows: list[tuple[Entry, ...]] = []
        for name in CHOOSERS:
            for k in range(self.pushes):
                spreads = [mean_and_deviation([r[name][kind][k] for r in records]) for kind in kinds]
                rows.append((name, k + 1, *(value for spread in spreads for value in spread)))
        return Result(
            setting=(
                f"{len(records)} hidden worlds (MuJoCo) with an eraser, as in motion_prediction; the mass is known."
                f" Each push is chosen among {self.candidates} random ones, the same for both; the parameters are"
                " fitted by least squares from their nominal values after every push, and"
                f" {self.testing} other pushes are predicted."
            ),
            tables=(
                Table(
                    name="pushes", title="errors by pushes made (mean and deviation over worlds)",
                    columns=("chosen", "pushes", "support friction %", "+- support %", "hand friction %", "+- hand %",
                             "mm", "+- mm", "deg", "+- deg"),
                    rows=tuple(rows),
                ),
            ),
            panels=tuple(
                Panel(title=title, x_label="pushes", y_label=kinds[kind],
                      series=tuple(series_of(name, counts, [r[name][kind] for r in records]) for name in CHOOSERS))
                for kind, title in (("support_friction", "parameters"), ("hand_friction", "parameters"),
                                    ("mm", "test pushes"))
            ),
        )  # fmt: skip


def most_informative(learner: Learner, theta: Array, information: Array, offer: Offer) -> tuple[int, Array]:
    """The push that is expected to teach most."""
    pose, pushes = offer
    lesson = most_informative_push(pushes, case=learner.case, start=pose, thetas=theta, information=information)
    return lesson.best, information + lesson.informations[lesson.best]


def the_first(learner: Learner, theta: Array, information: Array, offer: Offer) -> tuple[int, Array]:
    """A random push: candidates come in random order."""
    del learner, theta, offer
    return 0, information


CHOOSERS: Final[Mapping[str, Chooser]] = {RANDOM: the_first, INFORMED: most_informative}


def _offer(rng: np.random.Generator, count: int) -> Offer:
    pose = draw_start(rng)
    return pose, [draw_push(rng, ERASER, pose[2], speeds=SPEEDS) for _ in range(count)]
