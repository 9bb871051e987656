"""How well pushes that were not learned from are predicted, against the number of trials and of training pushes.

Source: Zhu, Kimmel, Boularias, section IV.A.
"""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from physid_drake.progress import Progress
from physid_drake.pushes.problem import PushProblem
from physid_drake.validation.experiments.hidden_robot import ERASER, HiddenRobot, draw_world, record_pushes
from physid_drake.validation.experiments.learning import GREEDY, METHODS, EndErrors, Learner, Trials
from physid_drake.validation.experiments.values import (
    Panel,
    Record,
    Result,
    Series,
    Table,
    mean_and_deviation,
    series_of,
)

SPEEDS = (0.05, 0.4)  # m/s
FRICTIONS = (0.12, 0.4)


@dc.dataclass(frozen=True, kw_only=True)
class MotionPrediction:
    """Sizes of the experiment.

    Attributes:
        seed: of everything random.
        repetitions: each with a world and pushes of its own.
        pushes: random pushes recorded in a world.
        training, testing: how many of them.
        subsets: numbers of training pushes that are compared; what is neither for training nor for testing is
            tested on too.
        budget: trials of a method, one of them a rollout of all training pushes.
        time_step_s: of the cell [s].
    """

    seed: int
    repetitions: int = 10
    pushes: int = 15
    training: int = 6
    testing: int = 3
    subsets: tuple[int, ...] = (1, 3, 6)
    budget: int = 40
    time_step_s: float = 2e-3

    def repeat(self, index: int, progress: Progress) -> Record:
        """One world: every method on the same pushes."""
        draws, *streams = [np.random.default_rng(s) for s in np.random.SeedSequence([self.seed, index]).spawn(8)]
        world = draw_world(draws, ERASER, FRICTIONS)
        robot = HiddenRobot(world, rng=draws)
        progress("pushes in the hidden world", 0, 0)
        recording = robot.recording(record_pushes(robot, draws, self.pushes, speeds=SPEEDS))
        learner = Learner(recording, time_step_s=self.time_step_s)
        training, testing = learner.problems[: self.training], learner.problems[self.training :][: self.testing]
        methods = {}
        for method, rng in zip(METHODS, streams, strict=False):
            trials = learner.learn(
                method, training, budget=self.budget, rng=rng,
                on_trial=lambda count, method=method: progress(method, count, self.budget),  # type: ignore[misc]
            )  # fmt: skip
            methods[method] = self._against_budget(learner, trials, testing)
        truth = np.array([{"mass": world.mass, "support_friction": world.support_friction,
                           "hand_friction": world.hand_friction}[n] for n in learner.thetas.space.names])  # fmt: skip
        return {
            "truth": truth.tolist(),
            "methods": methods,
            "true_theta": _ends(learner.end_errors(testing, truth)),
            "nominal_theta": _ends(learner.end_errors(testing, np.asarray(learner.thetas.space.nominal))),
            "subsets": self._against_pushes(learner, streams[-1], progress),
        }

    def _against_budget(self, learner: Learner, trials: Trials, testing: Sequence[PushProblem]) -> Record:
        """Test errors of the best theta after each trial."""
        counts = range(1, self.budget + 1)
        known: dict[bytes, dict[str, float]] = {}
        rows = []
        for count in counts:
            theta = trials.best_after(count)
            if theta.tobytes() not in known:
                known[theta.tobytes()] = _ends(learner.end_errors(testing, theta))
            rows.append(known[theta.tobytes()])
        best = [float(trials.misfits[:count].min()) for count in counts]
        return {
            "theta": trials.best_after(self.budget).tolist(),
            "sigma": [math.exp(b) for b in best],
            "mm": [row["mm"] for row in rows],
            "deg": [row["deg"] for row in rows],
        }

    def _against_pushes(self, learner: Learner, rng: np.random.Generator, progress: Progress) -> Record:
        """Errors on all pushes that are never trained on, by the number of training pushes."""
        others, result = learner.problems[self.training :], {}
        for count, stream in zip(self.subsets, rng.spawn(len(self.subsets)), strict=True):
            progress(f"greedy entropy search on {count} of {self.training} training pushes", 0, 0)
            trials = learner.learn(GREEDY, learner.problems[:count], budget=self.budget, rng=stream)
            result[str(count)] = _ends(learner.end_errors(others, trials.best_after(self.budget)))
        return result

    def result(self, records: Sequence[Record]) -> Result:
        """Error against budget, and against training pushes."""
        methods = list(records[0]["methods"])
        subsets = [float(count) for count in self.subsets]
        truth = mean_and_deviation([r["true_theta"]["mm"] for r in records])[0]
        panels = tuple(
            Panel(
                title=title, x_label="trials", y_label=label,
                series=tuple(self._curve(records, method, unit) for method in methods),
                level=("true parameters in the cell", truth) if unit == "mm" else None,
            )
            for title, label, unit in (
                ("test pushes: place", "error of the end [mm]", "mm"),
                ("training pushes", "rms residual [sigma]", "sigma"),
            )
        )  # fmt: skip
        pushes = Panel(
            title="test pushes: place", x_label="training pushes", y_label="error of the end [mm]",
            series=(series_of(GREEDY, subsets, [[r["subsets"][str(c)]["mm"] for c in self.subsets]
                                                    for r in records]),),
        )  # fmt: skip
        return Result(
            setting=(
                f"{len(records)} hidden worlds (MuJoCo) with an eraser of {1e3 * ERASER.size[0]:.0f} x"
                f" {1e3 * ERASER.size[1]:.0f} mm, mass 0.1 to 0.9 kg, support friction {FRICTIONS[0]:g} to"
                f" {FRICTIONS[1]:g}, hand friction 0.15 to 0.4, friction scatter between pushes 2 %, noise 0.3 mm"
                " and 3 mrad."
                f" {self.pushes} random pushes each at {SPEEDS[0]:g} to {SPEEDS[1]:g} m/s, {self.training} for"
                f" training, {self.testing} for testing. Unknown: mass, support friction, hand friction."
            ),
            tables=(self._table(records, methods), self._subset_table(records)),
            panels=(*panels, pushes),
        )

    def _curve(self, records: Sequence[Record], method: str, unit: str) -> Series:
        counts = [float(k) for k in range(1, self.budget + 1)]
        return series_of(method, counts, [r["methods"][method][unit] for r in records])

    def _table(self, records: Sequence[Record], methods: Sequence[str]) -> Table:
        shown = sorted({min(self.budget, k) for k in (5, 10, 20, self.budget)})
        rows: list[tuple[Any, ...]] = []
        for method in methods:
            for count in shown:
                found = [r["methods"][method] for r in records]
                rows.append((method, count, *mean_and_deviation([f["mm"][count - 1] for f in found]),
                             *mean_and_deviation([f["deg"][count - 1] for f in found]),
                             *mean_and_deviation([f["sigma"][count - 1] for f in found])))  # fmt: skip
        for name, key in (("nominal parameters", "nominal_theta"), ("true parameters in the cell", "true_theta")):
            rows.append((name, None, *mean_and_deviation([r[key]["mm"] for r in records]),
                         *mean_and_deviation([r[key]["deg"] for r in records]), None, None))  # fmt: skip
        return Table(
            name="budget", title=f"{self.testing} test pushes, by trials (mean and deviation over worlds)",
            columns=("method", "trials", "mm", "+- mm", "deg", "+- deg", "training [sigma]", "+- [sigma]"),
            rows=tuple(rows),
        )  # fmt: skip

    def _subset_table(self, records: Sequence[Record]) -> Table:
        return Table(
            name="training_pushes",
            title=f"{self.pushes - self.training} other pushes, by training pushes ({self.budget} trials)",
            columns=("training pushes", "mm", "+- mm", "deg", "+- deg"),
            rows=tuple(
                (count, *mean_and_deviation([r["subsets"][str(count)]["mm"] for r in records]),
                 *mean_and_deviation([r["subsets"][str(count)]["deg"] for r in records]))
                for count in self.subsets
            ),
        )  # fmt: skip


def _ends(errors: EndErrors) -> dict[str, float]:
    """Mean distance and turn."""
    return {"mm": 1e3 * float(errors.positions.mean()), "deg": math.degrees(float(errors.rotations.mean()))}
