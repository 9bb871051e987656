"""Searches on functions with a known minimum, on the misfit of recorded pushes against peers, and their overhead.

    python benchmarks/search.py [--functions | --overhead | --push] [--seeds 5] [--budget 40] [--only NAME]

Peers are optional: ``pip install .[peers]``. One that is not installed is left out, with the reason.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses as dc
import importlib
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy: one search, one core
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import numpy as np
from peers.optimisers import PEERS, Optimise, Spent
from rich.console import Console
from rich.table import Table
from runs import COARSE, shipped_pushes

from physid_drake.belief import Belief
from physid_drake.pushes.config import ThetaConfig
from physid_drake.search import SEARCHES, Search, search_minimum, search_named
from physid_drake.space import Parameter, ParameterSpace
from physid_drake.validation.experiments.learning import Learner

Array = np.ndarray
FAVOURITE = 1.0 / np.e
REFINE = 5
TARGETS = (1.10, 1.01)  # times the least rms misfit
PUSH_CASES = {
    "two frictions": ["hand_friction", "support_friction"],
    "two frictions, centre of mass, inertia": [
        "hand_friction",
        "support_friction",
        "com_x",
        "com_y",
        "inertia_ratio",
    ],
}
BOUNDS = {"com_x": [-0.02, 0.02], "com_y": [-0.006, 0.006]}  # m: the eraser must stand on its nine points


def main() -> None:
    """Print the tables that are asked for, all if none."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--functions", action="store_true", help="greedy entropy search and the favourite")
    parser.add_argument("--overhead", action="store_true", help="10,000 candidates in 18 dimensions")
    parser.add_argument("--push", action="store_true", help="the misfit of three pushes, with peers")
    parser.add_argument("--seeds", type=int, default=5, metavar="N")
    parser.add_argument("--budget", type=int, default=40, metavar="N", help="trials of a search")
    parser.add_argument(
        "--only", default="", metavar="NAME", help="methods whose name contains one of these, with commas"
    )
    given = parser.parse_args()
    every = not (given.functions or given.overhead or given.push)
    console = Console(width=130)
    if given.functions or every:
        console.print(functions_table(given.seeds, given.budget))
    if given.overhead or every:
        console.print(overhead_table(given.budget))
    if given.push or every:
        for name, parameters in PUSH_CASES.items():
            console.print(push_table(console, name, parameters, given.seeds, given.budget, given.only))


# Functions with a known minimum over 400 candidates: is a rollout wasted on runners-up?


def cube(d: int) -> ParameterSpace:
    return ParameterSpace(
        parameters=tuple(Parameter(name=f"p{i}", unit="-", lower=0.0, upper=1.0, prior_mean=0.5) for i in range(d))
    )


def branin(seed: int) -> Callable[[Array], Array]:
    def function(u: Array) -> Array:
        a, b = 15.0 * u[:, 0] - 5.0, 15.0 * u[:, 1]
        bowl = (b - 5.1 / (4 * np.pi**2) * a**2 + 5 / np.pi * a - 6) ** 2
        return bowl + 10 * (1 - 1 / (8 * np.pi)) * np.cos(a) + 10

    return function


def hartmann(seed: int) -> Callable[[Array], Array]:
    widths = np.array([[3, 10, 30], [0.1, 10, 35], [3, 10, 30], [0.1, 10, 35]])
    places = 1e-4 * np.array([[3689, 1170, 2673], [4699, 4387, 7470], [1091, 8732, 5547], [381, 5743, 8828]])
    depths = np.array([1.0, 1.2, 3.0, 3.2])
    return lambda u: -(depths * np.exp(-((u[:, None] - places) ** 2 * widths).sum(-1))).sum(-1)


def log_bowl(d: int) -> Callable[[int], Callable[[Array], Array]]:
    """The logarithm of a bowl of unequal axes, as a misfit is; its minimum is drawn."""

    def made(seed: int) -> Callable[[Array], Array]:
        middle = np.random.default_rng([100, seed]).uniform(0.2, 0.8, d)
        return lambda u: 0.5 * np.log(1e-4 + ((u - middle) ** 2 * np.linspace(1.0, 0.1, d)).sum(1))

    return made


FUNCTIONS = {"Branin": (2, branin), "Hartmann 3": (3, hartmann), "log bowl 3": (3, log_bowl(3)),
             "log bowl 6": (6, log_bowl(6))}  # fmt: skip


class Watched:
    """Counts the trials before which an untried favourite above 1/e was passed over."""

    def __init__(self, search: Search) -> None:
        self._search, self.passed, self.tried = search, 0, 0

    def propose(self, belief: Belief, rng: np.random.Generator, batch: int = 1) -> np.ndarray:
        """As the search that is watched."""
        picks = self._search.propose(belief, rng, batch)
        favourite = int(np.argmax(belief.p_min))
        if belief.p_min[favourite] > FAVOURITE:
            if belief.tried[favourite]:
                self.tried += 1
            else:
                self.passed += bool(picks[0] != favourite)
        return picks


def functions_table(seeds: int, budget: int) -> Table:
    table = Table(title=f"400 candidates, {budget} trials, mean of {seeds} seeds", title_justify="left")
    for header in ("function", "search", "trials to the best candidate", "regret's area", "favourite passed over",
                   "trials after the favourite's"):  # fmt: skip
        table.add_column(header, justify="left" if header in ("function", "search") else "right")
    for name, (d, make) in FUNCTIONS.items():
        for method in SEARCHES:
            rows = np.array([_on_function(make(seed), d, method, budget, seed) for seed in range(seeds)])
            hit, area, passed, after = rows.mean(axis=0)
            table.add_row(name, method, f"{hit:.1f}", f"{area:.3f}", f"{passed:.2f}", f"{after:.1f}")
    return table


def _on_function(
    function: Callable[[Array], Array], d: int, method: str, budget: int, seed: int
) -> tuple[float, ...]:
    candidates = cube(d).sample(np.random.default_rng([50, seed]), 400, from_prior=False)
    values = function(candidates)
    watched = Watched(search_named(method))
    found = search_minimum(
        function, cube(d), candidates, watched, budget=budget, rng=np.random.default_rng(seed), entropy_tolerance=0.0
    )
    errors = found.belief.errors
    hits = np.flatnonzero(errors <= values.min() + 1e-12)
    regret = (np.minimum.accumulate(errors) - values.min()) / values.std()
    hit = float(hits[0] + 1 if len(hits) else budget + 1)
    return hit, float(regret.mean()), float(watched.passed), float(watched.tried)


# Overhead: time that is not the objective's.


def overhead_table(budget: int) -> Table:
    d, n = 18, 10_000
    middle, axes = np.random.default_rng(0).uniform(0.3, 0.7, d), np.linspace(1.0, 0.05, d)
    candidates = cube(d).sample(np.random.default_rng(1), n, from_prior=False)
    title = f"CPU time an iteration on one core, {n} candidates in {d} dimensions, {budget} trials [ms]"
    table = Table(title=title, title_justify="left")
    for header in ("search", "candidates", "mean", "median", "with a new fit (worst)", "least error"):
        table.add_column(header, justify="left" if header in ("search", "candidates") else "right")
    for method in SEARCHES:
        for refine in (0, REFINE):
            marks = [time.process_time()]
            found = search_minimum(
                lambda u: 0.5 * np.log(1e-2 + ((u - middle) ** 2 * axes).sum(1)), cube(d), candidates,
                search_named(method), budget=budget, rng=np.random.default_rng(2), entropy_tolerance=0.0,
                refine_every=refine, on_trial=lambda belief, marks=marks: marks.append(time.process_time()),
            )  # fmt: skip
            spent = 1e3 * np.diff(marks)
            table.add_row(method, "follow P_min" if refine else "fixed", f"{spent.mean():.0f}",
                          f"{np.median(spent):.0f}", f"{spent.max():.0f}", f"{found.error_best:.2f}")  # fmt: skip
    return table


# The misfit of pushes, as the identification searches it.


@dc.dataclass
class Counted:
    """The misfit of three shipped pushes; ends a method when its budget is spent.

    Attributes:
        learner: that simulates.
        budget: thetas.
        told: errors in their order.
        busy: CPU time in rollouts [s].
        total: CPU time of the run [s].
    """

    learner: Learner
    budget: int
    told: list[float] = dc.field(default_factory=list)
    busy: float = 0.0
    total: float = 0.0

    def residuals(self, theta: Array) -> Array:
        """All whitened residuals at theta (d,)."""
        if len(self.told) >= self.budget:
            raise Spent
        begin = time.process_time()
        one = self.learner
        residual = one.residuals(one.problems, theta)
        self.told.append(float(0.5 * np.log(np.mean(residual**2))))
        self.busy += time.process_time() - begin
        return residual

    def errors(self, thetas: Array) -> Array:
        """Logs (k,) of the rms misfit at thetas (k, d)."""
        told = []
        for theta in thetas:
            self.residuals(theta)
            told.append(self.told[-1])
        return np.array(told)


def _own(method: str, refine: int) -> Optimise:
    def optimise(errors: Callable[[Array], Array], residuals: object, space: ParameterSpace, budget: int,
                 seed: int) -> None:  # fmt: skip
        candidates = space.sample(np.random.default_rng([3, seed]), 1000, from_prior=True)
        search_minimum(
            errors, space, candidates, search_named(method), budget=budget, rng=np.random.default_rng([4, seed]),
            entropy_tolerance=0.0, refine_every=refine,
        )  # fmt: skip

    return optimise


OWN: dict[str, tuple[str, Optimise]] = {
    "greedy entropy, fixed": ("physid_drake", _own("greedy_entropy", 0)),
    "greedy entropy, follows P_min": ("physid_drake", _own("greedy_entropy", REFINE)),
    "entropy search, fixed": ("physid_drake", _own("entropy_search", 0)),
    "entropy search, follows P_min": ("physid_drake", _own("entropy_search", REFINE)),
    "random": ("physid_drake", _own("random", 0)),
}


def push_table(console: Console, name: str, parameters: list[str], seeds: int, budget: int, only: str) -> Table:
    theta = ThetaConfig(parameters=parameters, bounds=BOUNDS)
    learner = Learner(shipped_pushes(3), config=COARSE, theta=theta)
    least = _least(learner)
    runs: dict[str, list[Counted]] = {}
    for method, (module, optimise) in {**OWN, **PEERS}.items():
        if not any(part in method for part in only.split(",")):
            continue
        try:
            importlib.import_module(module)
        except ImportError as error:
            console.print(f"{method} is left out: {error}")
            continue
        runs[method] = [_run(learner, optimise, budget, seed) for seed in range(seeds)]
        console.print(f"{name}: {method} done")
    return _ranked(runs, least, f"{name}: {budget} trials, {seeds} seeds")


def _least(learner: Learner) -> float:
    """Log of the least rms misfit that a long run of least squares finds."""
    counted = _run(learner, PEERS["scipy least_squares, starts"][1], 40 * learner.thetas.space.dimension, 0)
    return min(counted.told)


def _run(learner: Learner, optimise: Optimise, budget: int, seed: int) -> Counted:
    counted = Counted(learner, budget)
    begin = time.process_time()
    with contextlib.suppress(Spent):
        optimise(counted.errors, counted.residuals, learner.thetas.space, budget, seed)
    counted.total = time.process_time() - begin
    return counted


def _ranked(runs: dict[str, list[Counted]], least: float, title: str) -> Table:
    table = Table(title=f"{title}; least rms misfit {np.exp(least):.3f} standard deviations", title_justify="left")
    columns = ["method", *(f"trials to {100 * (t - 1):.0f} % above the least" for t in TARGETS), "reached",
               "regret's area", "last / least", "overhead a trial / greedy's"]  # fmt: skip
    for header in columns:
        table.add_column(header, justify="left" if header == "method" else "right")
    overheads = {m: np.mean([(c.total - c.busy) / len(c.told) for c in several]) for m, several in runs.items()}
    unit = overheads.get("greedy entropy, fixed", next(iter(overheads.values())))
    for method, several in runs.items():
        curves = [np.minimum.accumulate(c.told) - least for c in several]
        cells, reached = [], []
        for target in TARGETS:
            hits = [np.flatnonzero(curve <= np.log(target)) for curve in curves]
            cells.append(
                f"{np.mean([h[0] + 1 if len(h) else len(c) + 1 for h, c in zip(hits, curves, strict=True)]):.1f}"
            )
            reached.append(str(sum(len(h) > 0 for h in hits)))
        area = np.mean([curve.mean() for curve in curves])
        last = np.mean([np.exp(curve[-1]) for curve in curves])
        table.add_row(method, *cells, " / ".join(reached), f"{area:.2f}", f"{last:.2f}",
                      f"{overheads[method] / unit:.2f}")  # fmt: skip
    return table


if __name__ == "__main__":
    main()
