"""A bottle to the other side of the table by one fast push, learned from slow pushes, against learning by falling.

Source: Zhu, Kimmel, Boularias, section IV.C.
"""

from __future__ import annotations

import dataclasses as dc
import importlib
import math
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from scipy.interpolate import RectBivariateSpline

from physid_drake.model import Model
from physid_drake.plan import DistanceToGoal, Situation, plan
from physid_drake.policies.policy import PushSpeed, Reach
from physid_drake.progress import Progress
from physid_drake.recording import Push
from physid_drake.search import search_by_power
from physid_drake.validation.experiments.hidden_robot import (
    BOTTLE,
    FRICTION_SCATTER,
    NO_NOISE,
    Corners,
    HiddenRobot,
    draw_push,
    draw_world,
)
from physid_drake.validation.experiments.learning import GREEDY, Learner
from physid_drake.validation.experiments.values import (
    Array,
    Panel,
    Record,
    Result,
    Series,
    Table,
    mean_and_deviation,
    series_of,
)
from physid_drake.validation.worlds.world_plan import Plan

TABLE: Final[Corners] = ((-0.6, -0.4), (0.6, 0.4))
START, GOAL = (-0.5, 0.0, 0.0), (0.5, 0.0)
BAXTER_REACHES: Final = 0.109
"""x from which on Baxter reaches the middle of the table [m]; ``models/robots/reach.yaml``."""
MOTOMAN_REACHES: Final = -0.18
"""x up to which the Motoman does [m]."""
FRICTIONS: Final = (0.08, 0.17)
SLOW: Final = (0.1, 0.3)  # m/s, of the training pushes
FAST: Final = (0.2, 2.0)  # m/s, of the policy
TRAVEL: Final = 0.1  # m of the hand from the touch to the brake
LOST: Final = 1.0  # m: what PoWER and its peer are told of an object that fell
POWER, CMA = "PoWER", "CMA-ES"
POLISHED = f"{GREEDY}, polished"

_SPEED_KNOTS, _FACTOR_KNOTS = 8, (0.92, 1.0, 1.08)
_CHECKS = ((0.77, 0.97), (1.51, 1.03))  # m/s and friction factor


@dc.dataclass(frozen=True, kw_only=True)
class PushSpeeds:
    """Sizes of the experiment.

    Attributes:
        seed: of everything random.
        repetitions: each with a bottle of its own.
        slow_pushes: numbers of training pushes after which the model plans.
        budget: trials of the search for theta.
        polish_budget: trials of least squares after it, where the model is polished.
        plan_budget: speeds tried in simulation.
        rollouts, updates: of PoWER and its peer: real pushes of an update, and updates.
        time_step_s: of the cell [s].
    """

    seed: int
    repetitions: int = 10
    slow_pushes: tuple[int, ...] = (1, 2, 4)
    budget: int = 24
    polish_budget: int = 12
    plan_budget: int = 32
    rollouts: int = 5
    updates: int = 10
    time_step_s: float = 2e-3

    def repeat(self, index: int, progress: Progress) -> Record:
        """One bottle: plan with a model from slow pushes; learn by fast pushes alone."""
        draws, *streams = [np.random.default_rng(s) for s in np.random.SeedSequence([self.seed, index]).spawn(5)]
        world = draw_world(draws, BOTTLE, FRICTIONS)
        progress("the bottle's way against speed", 0, 0)
        bottle = FastPushes(world)
        record: Record = {
            "truth": {"mass": world.mass, "support_friction": world.support_friction},
            "interpolation_mm": bottle.worst_error_mm(),
            **self._model_based(world, bottle, draws, streams[0], progress),
            POWER: self._by_power(bottle, streams[1]),
        }
        if load_cma() is not None:
            record[CMA] = self._by_cma(bottle, streams[2])
        return record

    def _model_based(
        self,
        world: Plan,
        bottle: FastPushes,
        draws: np.random.Generator,
        rng: np.random.Generator,
        progress: Progress,
    ) -> Record:
        robot = HiddenRobot(world, rng=draws, start=START, table=TABLE)
        slow = _slow_pushes(robot, draws, max(self.slow_pushes))
        learner = Learner(robot.recording(slow), time_step_s=self.time_step_s)
        found: Record = {name: {"pushes": list(self.slow_pushes), "friction": [], "speed": [], "x": []}
                         for name in (GREEDY, POLISHED)}  # fmt: skip
        for count in self.slow_pushes:
            problems = learner.problems[:count]
            searched = learner.learn(
                GREEDY, problems, budget=self.budget, rng=rng,
                on_trial=lambda done, count=count: progress(f"{GREEDY} on {count} slow pushes", done, self.budget),  # type: ignore[misc]
            )  # fmt: skip
            polished = learner.polish(problems, searched, budget=self.polish_budget)
            for name, trials in ((GREEDY, searched), (POLISHED, polished)):
                body = learner.thetas.body(trials.best_after(len(trials.misfits)))
                speed = self._planned(robot.model(learner.config, body), rng)
                found[name]["friction"].append(float(body.support_friction[0]))
                found[name]["speed"].append(speed)
                found[name]["x"].append(bottle.end(speed, rng))
        return found

    def _planned(self, model: Model, rng: np.random.Generator) -> float:
        """The speed that a model plans [m/s]."""
        made = plan(
            model, _policy(), DistanceToGoal(goal=GOAL), situation=Situation(start=START), rng=rng,
            budget=self.plan_budget, draws=0, sweep=0,
        )  # fmt: skip
        return float(made.settings[0])

    def _by_power(self, bottle: FastPushes, rng: np.random.Generator) -> Record:
        ends: list[float] = []
        result = search_by_power(
            _told(bottle, ends, rng), _policy().space, rng=rng, rollouts=self.rollouts, updates=self.updates
        )  # fmt: skip
        return self._policies(bottle, ends, result.means[:, 0], rng)

    def _by_cma(self, bottle: FastPushes, rng: np.random.Generator) -> Record:
        """CMA-ES with PoWER's budget, start and spread. It needs two dimensions, so that a second does nothing."""
        space, ends = _policy().space, list[float]()
        told = _told(bottle, ends, rng)
        options = {"popsize": self.rollouts, "bounds": [0.0, 1.0], "verbose": -9, "seed": int(rng.integers(1, 2**31))}
        start = float(space.to_unit(space.nominal)[0])
        search = load_cma().CMAEvolutionStrategy([start, 0.5], 0.2, options)
        means = [space.nominal[0]]
        for _ in range(self.updates):
            points = search.ask()
            search.tell(points, told(space.from_unit(np.array(points)[:, :1])).tolist())
            means.append(float(space.from_unit(np.clip(np.asarray(search.mean)[:1], 0.0, 1.0))[0]))
        return self._policies(bottle, ends, np.array(means), rng)

    def _policies(self, bottle: FastPushes, ends: Sequence[float], means: Array, rng: np.random.Generator) -> Record:
        """One push with the policy at the start and after each update, which is not counted; falls while learning."""
        falls = np.cumsum([not _on_table(x) for x in ends])
        counts = [self.rollouts * k for k in range(self.updates + 1)]
        return {
            "pushes": counts, "speed": means.tolist(), "x": [bottle.end(float(v), rng) for v in means],
            "falls": [0 if not c else int(falls[c - 1]) for c in counts],
        }  # fmt: skip

    def result(self, records: Sequence[Record]) -> Result:
        """Distance and falls against the number of real pushes."""
        peers = [name for name in (POWER, CMA) if all(name in r for r in records)]
        names = [GREEDY, POLISHED, *peers]
        rows = []
        for name in names:
            for k, count in enumerate(records[0][name]["pushes"]):
                ends = [r[name]["x"][k] for r in records]
                learning = [r[name]["falls"][k] if "falls" in r[name] else 0 for r in records]
                rows.append((
                    name, count, *mean_and_deviation([_distance(x) for x in ends]),
                    float(np.median([_distance(x) for x in ends])), sum(not _on_table(x) for x in ends),
                    sum(BAXTER_REACHES <= x <= TABLE[1][0] for x in ends), *mean_and_deviation(learning),
                ))  # fmt: skip
        worst = max(r["interpolation_mm"] for r in records)
        return Result(
            setting=(
                f"{len(records)} hidden bottles (MuJoCo, standing, pushed at half their height): mass 0.1 to 0.9 kg,"
                f" support friction {FRICTIONS[0]:g} to {FRICTIONS[1]:g}, friction scatter between pushes 2 %."
                " Start at -0.5 m, goal at 0.5 m; the table ends at 0.6 m, and Baxter reaches it from 0.109 m on. The"
                f" model learns from slow pushes ({SLOW[0]:g} to {SLOW[1]:g} m/s, within the Motoman's reach, nobody"
                f" resets the bottle) with {self.budget} trials, and {self.polish_budget} more of least squares where"
                " it says polished; then one fast push is made. PoWER and its peer learn by fast pushes alone"
                f" ({self.rollouts} an update, reward exp(-2 distance), a fall counts as {LOST:g} m). Fast pushes are"
                f" read off a spline through {_SPEED_KNOTS * len(_FACTOR_KNOTS)} simulated ones of each bottle, by"
                f" speed and friction factor; its worst error in {2 * len(records)} checks is {worst:.1f} mm."
            ),
            tables=(
                Table(
                    name="pushes", title="the push of the policy, by real pushes made before it",
                    columns=("method", "pushes before", "distance mm", "+- mm", "median mm", "fell", "in reach",
                             "falls while learning", "+-"),
                    rows=tuple(rows),
                ),
            ),
            panels=(
                Panel(title="distance", x_label="real pushes", y_label="distance from the goal [mm]",
                      series=tuple(self._distances(records, name) for name in names)),
                Panel(title="falls while learning", x_label="real pushes", y_label="falls",
                      series=tuple(_falls(records, name) for name in names)),
            ),
            skipped=() if CMA in names else (
                "CMA-ES: pycma is not installed; pip install 'physid_drake[experiments]'.",),
        )  # fmt: skip

    def _distances(self, records: Sequence[Record], name: str) -> Series:
        return series_of(name, records[0][name]["pushes"], [[_distance(x) for x in r[name]["x"]] for r in records])


class FastPushes:
    """Where a bottle ends, by the speed of the hand and the friction factor of the push."""

    def __init__(self, world: Plan, speeds: int = _SPEED_KNOTS) -> None:
        """Simulate pushes at so many speeds, each with three friction factors, and lay a spline through them."""
        self._world = world
        knots = np.linspace(*FAST, speeds)
        ends = [[self._simulated(v, factor) for factor in _FACTOR_KNOTS] for v in knots.tolist()]
        self._spline = RectBivariateSpline(knots, _FACTOR_KNOTS, np.array(ends), kx=3, ky=2)

    def end(self, speed: float, rng: np.random.Generator) -> float:
        """Where along x a push with a drawn friction ends [m], beyond the table's edge if it falls."""
        low, high = _FACTOR_KNOTS[0], _FACTOR_KNOTS[-1]
        factor = float(np.clip(1.0 + FRICTION_SCATTER * rng.standard_normal(), low, high))
        return self._read(float(np.clip(speed, *FAST)), factor)

    def worst_error_mm(self) -> float:
        """Of the spline, against two simulated pushes."""
        return 1e3 * max(abs(self._read(v, f) - self._simulated(v, f)) for v, f in _CHECKS)

    def _read(self, speed: float, factor: float) -> float:
        return float(self._spline.ev(np.array([speed]), np.array([factor]))[0])

    def _simulated(self, speed: float, factor: float) -> float:
        # On an endless table, so that the spline has no edge in it.
        world = dc.replace(self._world, support_friction=factor * self._world.support_friction)
        robot = HiddenRobot(
            world, rng=np.random.default_rng(0), start=START, table=((-9.0, -9.0), (9.0, 9.0)), sensors=NO_NOISE,
            friction_scatter=0.0,
        )  # fmt: skip
        robot.execute(_policy().pushes(np.array([speed]))[0])
        return robot.pose[0]


def load_cma() -> Any:
    """The module ``cma``, or None where it is not installed."""
    try:
        return importlib.import_module("cma")
    except ImportError:
        return None


def _slow_pushes(robot: HiddenRobot, rng: np.random.Generator, count: int) -> tuple[Push, ...]:
    """Pushes towards the middle of what the Motoman reaches, so that nobody resets the bottle."""
    middle = np.array([0.5 * (TABLE[0][0] + MOTOMAN_REACHES), 0.0])
    pushes = []
    for _ in range(count):
        way = middle - np.array(robot.pose[:2])
        heading = math.atan2(way[1], way[0])
        pushes.append(robot.execute(draw_push(rng, BOTTLE, 0.0, speeds=SLOW, direction=heading)))
        if robot.lost:
            robot.put(START)
    return tuple(pushes)


def _told(bottle: FastPushes, ends: list[float], rng: np.random.Generator) -> Callable[[Array], Array]:
    """Errors (k,) [m] of speeds (k, 1), each by a real push that is written down."""

    def errors(speeds: Array) -> Array:
        made = [bottle.end(float(v), rng) for v in speeds[:, 0]]
        ends.extend(made)
        return np.array([_distance(x) * 1e-3 if _on_table(x) else LOST for x in made])

    return errors


def _policy() -> PushSpeed:
    reach = Reach(heading=0.0, travel=TRAVEL, inner_radius=BOTTLE.radius, speeds=FAST, speed=FAST[1])
    return PushSpeed(reach=reach)


def _on_table(x: float) -> bool:
    return x <= TABLE[1][0]


def _distance(x: float) -> float:
    """From the goal [mm]; a fall counts as ``LOST``."""
    return 1e3 * abs(x - GOAL[0]) if _on_table(x) else 1e3 * LOST


def _falls(records: Sequence[Record], name: str) -> Series:
    pushes = records[0][name]["pushes"]
    return series_of(name, pushes, [r[name].get("falls", [0] * len(pushes)) for r in records])
