"""An object to a goal by several pushes: seen and learned from after each one, against the same pushes made blindly.

In hidden worlds; the paper plans single pushes and leaves feedback to later.
"""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np

from physid_drake.identify.identify import identified, with_prior
from physid_drake.model import Model
from physid_drake.plan import Robot, SimulatedRobot, Step, Task, closed_loop, open_loop
from physid_drake.plan.draws import value_of
from physid_drake.plan.system import identified_model
from physid_drake.progress import Progress
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.problem import HandUse
from physid_drake.validation.experiments.hidden_robot import (
    ERASER,
    FRICTION_SCATTER,
    SENSORS,
    HiddenRobot,
    Pose,
    draw_world,
    record_pushes,
)
from physid_drake.validation.experiments.values import (
    Entry,
    Panel,
    Record,
    Result,
    Series,
    Table,
    mean_and_deviation,
    series_of,
)

SPEEDS: Final = (0.05, 0.4)  # m/s, of the training pushes
FRICTIONS: Final = (0.12, 0.4)
DISTANCE: Final = 0.25  # m of the goal
TRAINING: Final = 1  # pushes, so that the model is not sure
OPEN, CLOSED = "open loop", "closed loop"
SIMULATED, HIDDEN = "simulated robot (Drake)", "hidden robot (MuJoCo)"
LOOPS: Final[dict[str, Callable[[Model, Robot, Task, np.random.Generator], Iterator[Step]]]] = {
    OPEN: open_loop,
    CLOSED: closed_loop,
}


@dc.dataclass(frozen=True, kw_only=True)
class ClosedLoops:
    """Sizes of the experiment.

    Attributes:
        seed: of everything random.
        repetitions: each with an eraser of its own.
        pushes: to the goal, at most.
        budget: settings that each plan tries.
    """

    seed: int
    repetitions: int = 10
    pushes: int = 3
    budget: int = 48

    def repeat(self, index: int, progress: Progress) -> Record:
        """One eraser: identify it from a push, then bring it to a goal, blindly and not, in both worlds."""
        draws = np.random.default_rng([self.seed, index, 7])
        world = draw_world(draws, ERASER, FRICTIONS)
        robot = HiddenRobot(world, rng=draws)
        recording = robot.recording(record_pushes(robot, draws, TRAINING, speeds=SPEEDS))
        progress("identification", 0, 0)
        case = case_of(recording, cell_config(recording), ThetaConfig(nominal={"mass": world.mass}))
        known = with_prior(identified(case, seed=self.seed))
        model = identified_model(known, case.pool.spec, "hidden", hand=HandUse.of(case.problems))
        heading, start = float(draws.uniform(-math.pi, math.pi)), (0.0, 0.0, float(draws.uniform(-math.pi, math.pi)))
        task = Task(
            goal=(DISTANCE * math.cos(heading), DISTANCE * math.sin(heading)), pushes=self.pushes, budget=self.budget,
            noise=_noise(), friction_scatter=FRICTION_SCATTER, order=TRAINING,
        )  # fmt: skip
        record: Record = {"truth": world.support_friction, "believed": value_of(model, "theta.support_friction")}
        truth = dc.replace(
            model.baseline(), body=dc.replace(
                model.body, mass=world.mass, hand_friction=world.hand_friction,
                support_friction=np.full_like(model.body.support_friction, world.support_friction),
            ),
        )  # fmt: skip
        seed = int(draws.integers(2**63))
        for where in (SIMULATED, HIDDEN):
            record[where] = {}
            for name, loop in LOOPS.items():
                progress(f"{where}, {name}", 0, 0)
                rng = np.random.default_rng(seed)
                arm: Robot = SimulatedRobot(truth, start=start, sensors=SENSORS, rng=rng)
                if where == HIDDEN:
                    arm = HiddenRobot(world, rng=rng, start=start)
                steps = list(loop(model, arm, task, np.random.default_rng([self.seed, index, 8])))
                record[where][name] = _told(steps, self.pushes)
        return record

    def result(self, records: Sequence[Record]) -> Result:
        """Misses after each push."""
        counts = [float(k) for k in range(1, self.pushes + 1)]
        rows: list[tuple[Entry, ...]] = []
        panels = []
        for where in (SIMULATED, HIDDEN):
            series: list[Series] = []
            for name in LOOPS:
                misses = [record[where][name]["mm"] for record in records]
                for k in range(self.pushes):
                    column = [row[k] for row in misses]
                    rows.append((where, name, k + 1, *mean_and_deviation(column), float(np.median(column))))
                series.append(series_of(name, counts, misses))
            panels.append(Panel(title=where, x_label="pushes", y_label="miss of the goal [mm]", series=tuple(series)))
        errors = np.array([_errors(record) for record in records])
        before, after = np.median(errors, axis=0).tolist()
        return Result(
            setting=(
                f"{len(records)} erasers, each identified from {TRAINING} recorded push (its mass is known), are"
                f" brought to a goal {1e3 * DISTANCE:.0f} mm away by at most {self.pushes} pushes of the policy push"
                f" ({self.budget} candidates evaluated for each). Open loop: each push begins where the model"
                " predicts that the last one ended. Closed loop: the object is observed, the parameters are updated"
                " and the next push is planned with them; within 5 mm of the goal it is left there. In the closed"
                " loop of the hidden robot"
                f" the median error of support friction is {before:.1f} % before the first push and {after:.1f} %"
                " after the last one."
            ),
            tables=(
                Table(
                    name="misses", title="miss of the goal by number of pushes [mm]",
                    columns=("robot", "control", "pushes", "mean", "std", "median"), rows=tuple(rows),
                ),
            ),
            panels=tuple(panels),
        )  # fmt: skip


def _errors(record: Record) -> tuple[float, float]:
    """Of support friction before the first push and after the last one of the hidden closed loop [%]."""
    believed = (record["believed"], record[HIDDEN][CLOSED]["friction"])
    before, after = (100.0 * abs(friction / record["truth"] - 1.0) for friction in believed)
    return before, after


def _noise() -> Pose:
    x, y, yaw = SENSORS.object_std.tolist()
    return x, y, yaw


def _told(steps: Sequence[Step], pushes: int) -> Record:
    """Misses after each push [mm], the last one's where no more was needed; the friction that is believed then."""
    misses = [1e3 * step.miss for step in steps]
    return {
        "mm": misses + misses[-1:] * (pushes - len(misses)),
        "friction": value_of(steps[-1].model, "theta.support_friction"),
        "made": sum(step.plan is not None for step in steps),
    }  # fmt: skip
