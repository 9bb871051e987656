"""Whether a plan keeps its word: the success rate that it states, against pushes in worlds that it never saw.

    python benchmarks/confidence.py [--worlds N] [--seed S] [--state FILE] [--without PART ...]

Every world of the planar integrator draws an object, both frictions, friction scatter between pushes, and a
goal. Three to five pushes with the tracker's noise are identified and a push is planned. The world makes it several
times: each time friction is drawn anew, and the object stands where the tracker sees it but for the tracker's error.
What the plan states is drawn last; ``--without`` leaves a part of the belief out of it. With ``--state`` worlds are
kept, so that an interrupted run goes on.
"""

import argparse
import dataclasses as dc
import itertools
import json
import math
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "recovery"))

from reference.planar import Hand, HandPath, simulate_planar
from reference.scenes import OBJECTS, draw_theta
from twin import config_of
from worlds import POINTS, POSITION_STD, ROTATION_STD, TIME_STEP, pushes_of, recorded

from physid_drake.cell import HandPath as CellPath
from physid_drake.identify import Identification, Identifier, SearchConfig
from physid_drake.model import Model
from physid_drake.model_reading import load_model
from physid_drake.plan import DistanceToGoal, Situation, plan
from physid_drake.plan.draws import draws_of, scatter_freedom
from physid_drake.plan.pipeline import Spread, spread_of
from physid_drake.plan.system import identified_model
from physid_drake.plan.task import policy_for
from physid_drake.pushes.config import ThetaConfig

NAMES = ("eraser", "box", "book")
RADIUS, AFTER = 0.010, 2.0  # m; s
TRIALS, DRAWS, MADE = 24, 32, 20
# Twice the usual time steps; fewer points under the object would turn slow pushes by 20 mrad and bias the frictions.
CELL = config_of("point", time_step_s=2e-3, slide_time_step_s=4e-3)
PARTS = ("correlation", "freedom", "start")
SEEN = 20  # samples of the object at rest, over which its start is averaged
START_STD = np.array([POSITION_STD, POSITION_STD, ROTATION_STD]) / math.sqrt(SEEN)
TOLERANCE = 0.01
BINS = (0.0, 0.5, 0.75, 0.9, 1.0)
RESAMPLES = 2000
Row = dict[str, Any]


class World:
    """An object, its frictions and their scatter; a goal that its face looks to."""

    def __init__(self, seed: int, number: int) -> None:
        self.rng = np.random.default_rng([seed, number])
        self.body = OBJECTS[NAMES[number % len(NAMES)]]
        self.theta = draw_theta(self.rng, self.body)
        self.scatter = float(self.rng.uniform(0.01, 0.05))
        self.count = int(self.rng.integers(3, 6))
        heading, aside = self.rng.uniform(-math.pi, math.pi), self.rng.uniform(-0.2, 0.2)
        distance = self.rng.uniform(0.2, 0.4)
        self.goal = (float(distance * math.cos(heading + aside)), float(distance * math.sin(heading + aside)))
        self.start = (0.0, 0.0, float(heading))

    def identified(self) -> tuple[Model, Identification]:
        """Theta from the training pushes."""
        changes = self.scatter * self.rng.standard_normal(self.count)
        pushes = pushes_of(self.body, self.count, int(self.rng.integers(2**31)))
        recording = recorded(
            self.body, self.theta, pushes, int(self.rng.integers(2**31)), friction_changes=changes.tolist()
        )
        identifier = Identifier(
            recording, cell=CELL, theta=ThetaConfig(parameters=["support_friction", "hand_friction"]),
            search=SearchConfig(candidates=64, budget=8, jobs=1), seed=0,
        )  # fmt: skip
        result = identifier.run()
        return identified_model(result, identifier.case.pool.spec, self.body.name), result

    def ends(self, path: CellPath) -> np.ndarray:
        """Where the hand's path leaves the object (MADE, 2), each time with another friction and start [m]."""
        hand = HandPath(times=path.times, p0=path.start, velocities=path.velocities)
        ends = []
        for _ in range(MADE):
            friction = self.theta.support_friction * (1.0 + self.scatter * self.rng.standard_normal())
            motion = simulate_planar(
                self.body, friction, np.array([0.0, float(path.times[-1]) + AFTER]),
                pose=tuple(np.array(self.start) + START_STD * self.rng.standard_normal(3)), time_step=TIME_STEP,
                hand=Hand(path=hand, radius=RADIUS, height=0.5 * self.body.height, friction=self.theta.hand_friction),
                support=self.body.support(POINTS),
            )  # fmt: skip
            ends.append(motion.poses[-1, :2])
        return np.array(ends)


def made_in(world: World) -> Row:
    """What was identified and planned in a world, and where its pushes ended."""
    model, result = world.identified()
    goal = DistanceToGoal(goal=world.goal)
    made = plan(
        model, policy_for("push", model, world.start, world.goal), goal, situation=Situation(start=world.start),
        rng=np.random.default_rng(0), budget=TRIALS, draws=0, sweep=0,
    )  # fmt: skip
    return {
        "object": world.body.name, "pushes": world.count, "scatter": world.scatter, "goal": world.goal,
        "start": world.start, "model": model.dump(), "scatter_found": result.friction_scatter,
        "theta": {e.name: [getattr(world.theta, e.name), e.value, *e.ci90] for e in result.estimates},
        "settings": made.settings.tolist(), "cost": made.cost, "ends": world.ends(made.predicted.paths[0]).tolist(),
    }  # fmt: skip


def hits(row: Row) -> np.ndarray:
    """Which pushes ended within the tolerance (MADE,)."""
    return np.hypot(*(np.array(row["ends"]) - row["goal"]).T) <= TOLERANCE


def stated(row: Row, without: Sequence[str]) -> Spread:
    """What the belief says of a row's planned push."""
    model = load_text(row["model"])
    if "correlation" in without:
        model = dc.replace(model, correlation=None)
    std = (0.0, 0.0, 0.0) if "start" in without else tuple(START_STD.tolist())
    situation = Situation(start=tuple(row["start"]), start_std=std)
    draws = draws_of(
        model, situation, DRAWS, np.random.default_rng(0), friction_scatter=row["scatter_found"],
        scatter_freedom=math.inf if "freedom" in without else scatter_freedom(row["pushes"]),
    )  # fmt: skip
    pushes = policy_for("push", model, situation.start, tuple(row["goal"])).pushes(np.array(row["settings"]))
    return spread_of(draws, pushes, DistanceToGoal(goal=tuple(row["goal"])), model=model, situation=situation)


def load_text(text: str) -> Model:
    """A model from the text of its file."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "model.yaml").write_text(text)
        return load_model(folder)


def covered(row: Row, spread: Spread) -> np.ndarray:
    """Which ends lie in the region that holds 90 % of the draws (MADE,): an ellipse of their covariance."""
    draws = spread.ends[:, :2]
    middle, inverse = draws.mean(axis=0), np.linalg.inv(np.cov(draws.T) + 1e-12 * np.eye(2))

    def far(points: np.ndarray) -> np.ndarray:
        return np.einsum("ni,ij,nj->n", points - middle, inverse, points - middle)

    return far(np.array(row["ends"])) <= np.quantile(far(draws), 0.9)


def interval_of(values: np.ndarray) -> str:
    """A mean over worlds with its 90 % bootstrap interval: pushes in one world share its estimates' error."""
    means = values[np.random.default_rng(0).integers(len(values), size=(RESAMPLES, len(values)))].mean(axis=1)
    low, high = np.quantile(means, [0.05, 0.95])
    return f"{values.mean():.2f} ({low:.2f} to {high:.2f})"


def show(rows: list[Row], spreads: list[Spread]) -> None:
    """Print the tables."""
    rates = np.array([s.success_rate(TOLERANCE)[0] for s in spreads])
    made = np.array([hits(r).mean() for r in rows])
    inside = np.array([covered(r, s).mean() for r, s in zip(rows, spreads, strict=True)])
    show_bins(f"{len(rows)} worlds, {MADE} pushes each, {DRAWS} draws", rates, made, inside)
    print("\n".join([brier_of(rates, made), *summary(rows)]))


def show_bins(title: str, rates: np.ndarray, made: np.ndarray, inside: np.ndarray) -> None:
    """Print stated against realised rates (n,), and the share (n,) of ends in the draws' region, in bins."""
    table = Table(title=title, title_justify="left")
    for header in ("stated, within 10 mm", "worlds", "stated", "realised (90 %)", "ends in the 90 % region (90 %)"):
        table.add_column(header, justify="right")
    parts = [(f"{low:g} to {high:g}", (rates >= low) & ((rates < high) | (high == 1.0)))
             for low, high in itertools.pairwise(BINS)]  # fmt: skip
    for name, part in [*parts, ("all", np.full(len(rates), True))]:
        if part.any():
            told = interval_of(made[part]), interval_of(inside[part])
            table.add_row(name, str(part.sum()), f"{rates[part].mean():.2f}", *told)
    Console(width=110).print(table)


def brier_of(rates: np.ndarray, made: np.ndarray) -> str:
    """The Brier score of stated rates (n,)."""
    brier, base = float(np.mean(made * (1.0 - rates) ** 2 + (1.0 - made) * rates**2)), float(made.mean())
    return f"Brier score {brier:.3f}; always stating the mean rate {base:.2f}: {base * (1.0 - base):.3f}"


def summary(rows: list[Row]) -> list[str]:
    """Whether what the statement rests on holds."""
    lines = []
    for name in rows[0]["theta"]:
        held = [low <= true <= high for true, _, low, high in (r["theta"][name] for r in rows)]
        lines.append(f"90 % intervals of {name} that hold the truth: {sum(held)} of {len(rows)}")
    ratio = np.array([r["scatter_found"] / r["scatter"] for r in rows])
    lines.append(f"scatter found over true: median {np.median(ratio):.2f}, {ratio.min():.2f} to {ratio.max():.2f}")
    return lines


def main() -> None:
    """Run the worlds and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--worlds", type=int, default=4, metavar="N")
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--state", type=Path, metavar="FILE", help="worlds so far, to go on from")
    parser.add_argument("--without", nargs="+", choices=PARTS, default=[], metavar="PART", help=", ".join(PARTS))
    arguments = parser.parse_args()
    kept: Path | None = arguments.state
    rows = [json.loads(line) for line in kept.read_text().splitlines()] if kept and kept.exists() else []
    for number in range(len(rows), arguments.worlds):
        rows.append(made_in(World(arguments.seed, number)))
        if kept is not None:
            with kept.open("a") as stream:
                stream.write(json.dumps(rows[-1]) + "\n")
    rows = rows[: arguments.worlds]
    show(rows, [stated(row, arguments.without) for row in rows])


if __name__ == "__main__":
    main()
