"""Published pushes of a real robot: cross-validated errors beside those of the published quasi-static models.

A push is slow (10 or 20 mm/s) and only its end points are known, so that mass and the level of the support friction
cancel. What is left to learn is the hand's friction; how far out the object presses on the table, which says how much
it resists turning; and where the tip is, since its frame and the tracker's were calibrated apart.

Source: Yu, Bauza, Fazeli, Rodriguez, IROS 2016 (pushes); Zhou, Paolini, Bagnell, Mason, ICRA 2016 (models).
"""

from __future__ import annotations

import csv
import dataclasses as dc
import io
import math
import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import CellConfig, SolverConfig
from physid_drake.cell.solid import solid_of
from physid_drake.cell.support import FrictionGrid, support_of
from physid_drake.effects.body import UnevenSupport
from physid_drake.effects.hand import HandOffset
from physid_drake.errors import ConfigError
from physid_drake.files import read_text
from physid_drake.progress import Progress
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.problem import PushProblem
from physid_drake.pushes.rollouts import predict
from physid_drake.recording import Recording
from physid_drake.recording.adapters import convert_mit
from physid_drake.space import Parameter, ParameterSpace
from physid_drake.validation.experiments.learning import (
    GREEDY,
    LEAST_SQUARES,
    RANDOM,
    Learner,
    Trials,
    plain_task,
    search_trials,
)
from physid_drake.validation.experiments.values import (
    Entry,
    Panel,
    Record,
    Result,
    Table,
    mean_and_deviation,
    series_of,
)

Array = NDArray[np.float64]

MAIN: Final = "rect1_v10"
OTHERS: Final = (
    "rect1_v20", "rect2_v10", "rect3_v10", "tri1_v10", "tri2_v10", "tri3_v10", "ellip1_v10", "ellip2_v10",
    "ellip3_v10", "hex_v10",
)  # fmt: skip
LEFT_OUT: Final = ("butter: it is not convex, and its outline is not known here.",)
WHERE: Final = (
    "the published end points lie at GitHub robinzhoucmu/PlanarManipulationToolBox, as one CSV file"
    " abs_<shape>_v<mm/s>.csv for each shape and speed"
)
MODELS: Final = {"quadratic": "published, ellipsoidal limit surface", "poly4": "published, 4th-order limit surface"}
FRICTION, ALL = "hand friction", "friction, pressure, offset"
TRIED: Final = ((FRICTION, GREEDY), (ALL, GREEDY), (ALL, RANDOM), (ALL, LEAST_SQUARES))
OTHERS_TRIED: Final = ((FRICTION, GREEDY), (ALL, LEAST_SQUARES))
FRICTION_BUDGET: Final = 6
"""Trials that are enough where the hand's friction alone is unknown."""

PLAYED_SPEED: Final = 0.03
"""m/s at which a slow push is played: friction alone decides, and it does not know the speed."""
TIME_STEP: Final = 4e-3  # s
SUPPORT_FRICTION: Final = 0.15  # documented; it hardly matters
DIVERGED: Final = 1.0  # m and rad: error of a rollout that did
SMALLEST_SIZE: Final = 2e-4  # m
SETTLING: Final = 0.04  # s after the hand has stopped

_HAND_FRICTION = Parameter(
    name="hand_friction", unit="-", lower=0.05, upper=0.6, prior_mean=0.25, scale="log",
    description="friction between the rod and the object",
)  # fmt: skip
_PRESSURE = Parameter(
    name="ends", unit="-", lower=-5.0, upper=5.0, prior_mean=0.0, prior_std=2.0,
    description="log of the pressure in the middle of an edge over that at the centre",
)  # fmt: skip
_OFFSETS = tuple(
    Parameter(name=f"offset_{axis}", unit="m", lower=-4e-3, upper=4e-3, prior_mean=0.0, prior_std=1.5e-3,
              description=f"of the rod along {axis} of W against where it is said to be")
    for axis in "xy"
)  # fmt: skip
SPACES: Final = {
    FRICTION: ParameterSpace(parameters=(_HAND_FRICTION,)),
    ALL: ParameterSpace(parameters=(_HAND_FRICTION, _PRESSURE, *_OFFSETS)),
}


@dc.dataclass(frozen=True, kw_only=True)
class MitPushes:
    """Sizes of the experiment.

    Attributes:
        seed: of everything random.
        folder: with the published tables.
        pushes, folds: of the main table; every fold is a repetition.
        training: pushes of the other folds that theta is learned from, drawn at random; the rollouts of all would
            take hours.
        budget: trials of a method, one of them a rollout of the training pushes.
        other_pushes, other_folds, other_budget: of every other table.
        others: names of these tables.
    """

    seed: int
    folder: Path
    pushes: int = 200
    folds: int = 10
    training: int = 20
    budget: int = 16
    other_pushes: int = 24
    other_folds: int = 2
    other_budget: int = 12
    others: tuple[str, ...] = OTHERS

    def __post_init__(self) -> None:
        missing = [name for name in (MAIN, *self.others) if not _table(self.folder, name).is_file()]
        if missing:
            raise ConfigError(f"mit_pushes: '{_table(self.folder, missing[0])}' is missing; {WHERE}.")

    @property
    def repetitions(self) -> int:
        """The folds of the main table, then the other tables."""
        return self.folds + len(self.others)

    def repeat(self, index: int, progress: Progress) -> Record:
        """One fold of the main table, or all folds of another."""
        if index < self.folds:
            return self._fold(MAIN, index, self.pushes, self.folds, self.budget, TRIED, progress)
        name = self.others[index - self.folds]
        folds = [
            self._fold(name, k, self.other_pushes, self.other_folds, self.other_budget, OTHERS_TRIED, progress)
            for k in range(self.other_folds)
        ]
        return {"folds": folds}

    def _fold(
        self,
        name: str,
        fold: int,
        pushes: int,
        folds: int,
        budget: int,
        tried: Sequence[tuple[str, str]],
        progress: Progress,
    ) -> Record:
        """Learn from pushes outside a fold, and predict those inside."""
        table = PublishedPushes(self.folder, name, pushes, self.seed)
        order = np.random.default_rng([self.seed, 1]).permutation(len(table.problems))
        parts = np.array_split(order, folds)
        rng = np.random.default_rng([self.seed, 2, fold])
        outside = np.concatenate([part for k, part in enumerate(parts) if k != fold])
        training = [table.problems[k] for k in rng.permutation(outside)[: self.training]]
        testing = parts[fold].tolist()
        record: Record = {"methods": {}, "published": {}}
        for published in MODELS:
            record["published"][published] = _lists(table.published[published][testing])
        for (unknown, method), stream in zip(tried, rng.spawn(len(tried)), strict=True):
            space, total = SPACES[unknown], min(budget, FRICTION_BUDGET) if unknown == FRICTION else budget
            stage = f"{name}, fold {fold + 1}: {method} for {unknown}"
            trials = search_trials(
                method,
                lambda theta, space=space: table.roots(table.errors(training, space.as_dict(theta))),  # type: ignore[misc]
                table.misfit, space, budget=total, rng=stream,
                on_trial=lambda count, stage=stage, total=total: progress(stage, count, total),  # type: ignore[misc]
            )  # fmt: skip
            record["methods"][f"{method}: {unknown}"] = self._tested(table, space, trials, testing, budget)
        return record

    def _tested(
        self, table: PublishedPushes, space: ParameterSpace, trials: Trials, testing: Sequence[int], budget: int
    ) -> Record:
        """Errors of the test pushes with the best theta after some numbers of trials."""
        known: dict[bytes, list[list[float]]] = {}
        result: Record = {}
        for count in counts(budget):
            theta = trials.best_after(count)
            if theta.tobytes() not in known:
                problems = [table.problems[k] for k in testing]
                known[theta.tobytes()] = _lists(table.errors(problems, space.as_dict(theta)))
            result[str(count)] = known[theta.tobytes()]
        result["theta"] = trials.best_after(budget).tolist()
        return result

    def result(self, records: Sequence[Record]) -> Result:
        """Errors against budget, and all tables beside the published models."""
        main, others = records[: self.folds], records[self.folds :]
        columns = ("model", "trials", "mm", "+- mm", "deg", "+- deg", "median mm", "median deg")
        rows: list[tuple[Entry, ...]] = []
        for (unknown, _), method in zip(TRIED, main[0]["methods"], strict=True):
            for count in counts(self.budget):
                # The best theta stays the best where no more trials were made.
                made = min(count, FRICTION_BUDGET) if unknown == FRICTION else count
                if not rows or rows[-1][:2] != (method, made):
                    rows.append((method, made, *_row([r["methods"][method][str(count)] for r in main])))
        for published, words in MODELS.items():
            rows.append((words, None, *_row([r["published"][published] for r in main])))
        title = (
            f"{MAIN}: {self.pushes} pushes, {self.folds} folds (mean and deviation over folds; medians over pushes)"
        )
        tables = [Table(name=MAIN, title=title, columns=columns, rows=tuple(rows)), self._thetas(main)]
        if others:
            tables.append(self._others(others))
        return Result(
            setting=(
                f"Pushes of the MIT dataset on ABS, 50 mm long. Each fold learns from {self.training} pushes drawn"
                " from the other folds. Errors are of the object's last pose. The objective is the mean size of"
                " the error, with rotations multiplied by the radius of gyration. Pushes are played at"
                f" {1e3 * PLAYED_SPEED:.0f} mm/s with time steps of"
                f" {1e3 * TIME_STEP:.0f} ms."
            ),
            tables=tuple(tables),
            panels=tuple(self._panel(main, k) for k in range(2)),
            skipped=LEFT_OUT,
        )

    def _panel(self, records: Sequence[Record], unit: int) -> Panel:
        shown = counts(self.budget)
        series = [
            series_of(method, [float(c) for c in shown],
                      [[_mean_errors(r["methods"][method][str(c)])[unit] for c in shown] for r in records])
            for method in records[0]["methods"]
        ]  # fmt: skip
        best = min(
            (mean_and_deviation([_mean_errors(r["published"][m])[unit] for r in records])[0], m) for m in MODELS
        )
        return Panel(
            title=("place", "turn")[unit], x_label="trials", y_label=("error of the end [mm]", "error [deg]")[unit],
            series=tuple(series), level=(MODELS[best[1]], best[0]),
        )  # fmt: skip

    def _thetas(self, records: Sequence[Record]) -> Table:
        rows = []
        for unknown, method in TRIED:
            found = np.array([r["methods"][f"{method}: {unknown}"]["theta"] for r in records])
            for k, parameter in enumerate(SPACES[unknown].parameters):
                factor, unit = (1e3, "mm") if parameter.unit == "m" else (1.0, "-")
                values = (factor * found[:, k]).tolist()
                rows.append((f"{method}: {unknown}", parameter.name, unit, *mean_and_deviation(values)))
        return Table(
            name="theta", title=f"{MAIN}: what was learned (mean and deviation over folds)",
            columns=("model", "parameter", "unit", "mean", "+-"), rows=tuple(rows),
        )  # fmt: skip

    def _others(self, records: Sequence[Record]) -> Table:
        rows = []
        last = str(self.other_budget)
        for name, record in zip(self.others, records, strict=True):
            folds = record["folds"]
            for unknown, method in OTHERS_TRIED:
                found = [push for f in folds for push in f["methods"][f"{method}: {unknown}"][last]]
                rows.append((name, f"{method}: {unknown}", *_mean_errors(found)))
            for published, words in MODELS.items():
                rows.append((name, words, *_mean_errors([push for f in folds for push in f["published"][published]])))
        return Table(
            name="other_tables",
            title=f"others: {self.other_pushes} pushes, {self.other_folds} folds, at most {self.other_budget} trials",
            columns=("table", "model", "mm", "deg"), rows=tuple(rows),
        )  # fmt: skip


class PublishedPushes:
    """Pushes drawn from a published table, played faster, beside the published predictions.

    Attributes:
        problems: the pushes.
        published: errors (n, 3) of each published model, in the order of the pushes [m, m, rad].
    """

    def __init__(self, folder: Path, name: str, limit: int, seed: int) -> None:
        source = _table(folder, name)
        with tempfile.TemporaryDirectory() as place:
            recording = convert_mit(source, Path(place) / "recording", limit=limit, seed=seed)
        theta = ThetaConfig(parameters=["hand_friction"], nominal={"support_friction": SUPPORT_FRICTION})
        config = CellConfig(solver=SolverConfig(time_step_s=TIME_STEP, slide_time_step_s=TIME_STEP))
        learner = Learner(recording, theta=theta, config=config)
        self._spec, self._thetas = learner.case.pool.spec, learner.thetas
        self.problems = tuple(played(problem, PLAYED_SPEED) for problem in learner.problems)
        self.published = _published(source, recording)
        support = support_of(solid_of(recording.object.shape).underside, FrictionGrid(), 100)
        self._gyration = math.sqrt(float(support.weights @ (support.points**2).sum(axis=1)))

    def errors(self, problems: Sequence[PushProblem], values: dict[str, float]) -> Array:
        """Errors (n, 3) of the last poses [m, m, rad], by the values of a space in ``SPACES``."""
        effects = (
            pressed(values.get("ends", 0.0)), HandOffset(x=values.get("offset_x", 0.0), y=values.get("offset_y", 0.0))
        )  # fmt: skip
        theta = np.array([values["hand_friction"]])
        rows = []
        for problem in problems:
            task = dc.replace(plain_task(problem, theta), effects=effects)
            found = predict(self._spec, self._thetas, task)
            rows.append(np.full(3, DIVERGED) if found is None else found.poses[-1] - problem.poses[-1])
        return np.array(rows)

    def roots(self, errors: Array) -> Array:
        """Residuals (3 n,) [m^1/2] of errors (n, 3) whose squares sum to the errors' sizes.

        A turn counts with the radius of gyration. Some pushes come close to a corner, where a hair decides which way
        the object turns: sizes, not their squares, keep these few from deciding everything.
        """
        rows = errors * [1.0, 1.0, self._gyration]
        sizes = np.maximum(np.linalg.norm(rows, axis=1), SMALLEST_SIZE)
        return np.asarray((rows / np.sqrt(sizes)[:, None]).ravel())

    def misfit(self, roots: Array) -> float:
        """Log of the mean size of the errors behind residuals (3 n,) [ln m]."""
        return math.log(float((roots**2).sum()) / (len(roots) // 3))


def played(problem: PushProblem, speed: float) -> PushProblem:
    """A slow push with end points alone, played at another speed [m/s]."""
    path = problem.path
    assert path is not None
    factor = speed / float(np.linalg.norm(path.velocities, axis=1).max())
    end = problem.end / factor + SETTLING
    return dc.replace(
        problem, begin=problem.begin / factor, end=end, times=np.array([end]),
        path=dc.replace(path, times=path.times / factor, velocities=path.velocities * factor),
    )  # fmt: skip


def pressed(ends: float) -> UnevenSupport:
    """A pressure whose log is ``ends`` (x^2 + y^2), x and y from -1 to 1 over a grid of 3 by 3."""
    x, y = np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0], indexing="ij")
    weights = np.exp(ends * (x**2 + y**2))
    return UnevenSupport(weights=tuple(map(tuple, (weights / weights.mean()).tolist())))


def counts(budget: int) -> list[int]:
    """Numbers of trials at which predictions are tested."""
    return sorted({min(budget, k) for k in (4, 8, budget)})


def _table(folder: Path, name: str) -> Path:
    return folder / f"abs_{name}.csv"


def _published(source: Path, recording: Recording) -> dict[str, Array]:
    """Errors (n, 3) of the published predictions of a recording's pushes; each note says which row it was."""
    rows = list(csv.DictReader(io.StringIO(read_text(source), newline="")))
    chosen = []
    for push in recording.pushes:
        found = re.search(r"row (\d+)", push.note)
        assert found is not None
        chosen.append(rows[int(found[1]) - 2])
    ends = {
        kind: np.array([[float(row[f"{kind}end_object_{c}"]) for c in ("x_m", "y_m", "yaw_rad")] for row in chosen])
        for kind in ("", *(f"{m}_" for m in MODELS))
    }
    result = {}
    for model in MODELS:
        error = ends[f"{model}_"] - ends[""]
        error[:, 2] = (error[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
        result[model] = error
    return result


def _lists(errors: Array) -> list[list[float]]:
    """Distances [mm] and turns [deg] (n, 2) of errors (n, 3)."""
    rows = np.column_stack([1e3 * np.hypot(*errors[:, :2].T), np.degrees(np.abs(errors[:, 2]))])
    return [[float(place), float(turn)] for place, turn in rows]


def _mean_errors(rows: Sequence[Sequence[float]]) -> tuple[float, float]:
    place, turn = np.array(rows).mean(axis=0).tolist()
    return place, turn


def _row(folds: Sequence[Sequence[Sequence[float]]]) -> tuple[float, ...]:
    means = np.array([_mean_errors(rows) for rows in folds])
    places, turns = (mean_and_deviation(column) for column in means.T.tolist())
    middle = np.median(np.concatenate([np.array(rows) for rows in folds]), axis=0).tolist()
    return (*places, *turns, *middle)
