"""What a plan gains by the effects that were found.

In hidden worlds with an effect, the push that is planned with them and the baseline model's are both made.
"""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from physid_drake.diagnose import Evidence, diagnose, model_of
from physid_drake.model import Model
from physid_drake.plan import DistanceToGoal, Plan, Situation, plan
from physid_drake.plan.system import identified_model
from physid_drake.plan.task import policy_for
from physid_drake.plan.trajectory import path_of
from physid_drake.progress import Progress
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.problem import HandUse
from physid_drake.recording import Recording
from physid_drake.validation.experiments.values import Array, Entry, Panel, Record, Result, Series, Table
from physid_drake.validation.worlds.make import DrawnWorld, draw_world, make_world
from physid_drake.validation.worlds.mujoco_world import PushWorld
from physid_drake.validation.worlds.world_plan import HandPath, Motion

ALPHA: Final = 0.01
DISTANCE: Final = 0.2  # m of the goal from the object
POLICY: Final = "push"
PATIENCE: Final = 4.0  # s after the hand in which an object may still move
BASELINE, CORRECTED = "baseline", "corrected"


@dc.dataclass(frozen=True, kw_only=True)
class CorrectedPlans:
    """Sizes of the experiment.

    Attributes:
        seed: of everything random.
        repetitions: each with a world of its own, effects in turn.
        budget: pushes that each plan tries in simulation.
    """

    seed: int
    repetitions: int = 40
    budget: int = 48

    def repeat(self, index: int, progress: Progress) -> Record:
        """One world: diagnose its recording, plan with both models, make both pushes there."""
        progress("a hidden world", 0, 0)
        world, _ = draw_world(index, self.seed, "effect")
        recording, truth = make_world(index, self.seed, "effect", name="hidden")
        case = case_of(recording, cell_config(recording), ThetaConfig())
        diagnosis, evidence = diagnose(case, seed=self.seed, alpha=ALPHA, progress=progress)
        draws = np.random.default_rng([self.seed, index, 60])
        start, goal = _task(draws, world, recording)
        record: Record = {
            "effect": [effect.name for effect in world.effects], "size_sigma": truth["size_sigma"],
            "verdict": diagnosis.verdict, "named": [effect.name for effect in diagnosis.effects],
            "without_push_mm": 1e3 * DISTANCE,
        }  # fmt: skip
        factor = 1.0 + 0.02 * float(draws.standard_normal())
        for name, model in _models(evidence).items():
            progress(f"the plan of the {name} model", 0, 0)
            made = self._planned(model, start, goal, len(recording.pushes), index)
            record[name] = _outcome(world, made, start, goal, factor)
        return record

    def _planned(self, model: Model, start: tuple[float, float, float], goal: Array, pushes: int, index: int) -> Plan:
        target = (float(goal[0]), float(goal[1]))
        return plan(
            model, policy_for(POLICY, model, start, target), DistanceToGoal(goal=target),
            situation=Situation(start=start, order=pushes), rng=np.random.default_rng([self.seed, index, 61]),
            budget=self.budget, draws=0, sweep=0,
        )  # fmt: skip

    def result(self, records: Sequence[Record]) -> Result:
        """Misses side by side, world by world, and their medians by what was said."""
        rows = [_row(record) for record in sorted(records, key=lambda r: str(r["effect"]))]
        said = {"all worlds": records}
        for right in (True, False):
            words = "effect named correctly, alone" if right else "other answers"
            said[words] = [r for r in records if (r["named"] == r["effect"]) is right]
        summary = [(words, len(some), *_summary(some)) for words, some in said.items() if some]
        ranks = tuple(float(k + 1) for k in range(len(records)))
        nothing = (math.nan,) * len(records)
        return Result(
            setting=(
                f"{len(records)} hidden worlds (MuJoCo), each with one effect of the catalogue in turn, with"
                " friction scatter between pushes. Each recording is diagnosed; a push to a goal"
                f" {1e3 * DISTANCE:.0f} mm away is planned with the corrected model and with the identified baseline"
                f" model (policy {POLICY}, {self.budget} candidates evaluated), and both are made in the hidden"
                " world."
            ),
            tables=(
                Table(
                    name="misses", title="distance from the goal at rest [mm]",
                    columns=("hidden effect", "diagnosis", "baseline", "corrected"), rows=tuple(rows),
                ),
                Table(
                    name="summary", title="by diagnosis [mm]",
                    columns=(
                        "", "worlds", "baseline, median", "corrected, median", "baseline, 90 %", "corrected, 90 %",
                        "corrected is nearer",
                    ),
                    rows=tuple(summary),
                ),
            ),
            panels=(
                Panel(
                    title="misses, sorted", x_label="world", y_label="mm",
                    series=tuple(
                        Series(name=name, x=ranks, mean=_sorted(records, name), deviation=nothing)
                        for name in (BASELINE, CORRECTED)
                    ),
                ),
            ),
        )  # fmt: skip


def _sorted(records: Sequence[Record], name: str) -> tuple[float, ...]:
    return tuple(sorted(record[name]["miss_mm"] for record in records))


def _models(evidence: Evidence) -> dict[str, Model]:
    """The identified baseline model, and the model that leaves; the same where nothing was found."""
    known = evidence.known
    hand = HandUse.of(known.case.problems)
    baseline = identified_model(known, known.case.pool.spec, known.case.recording.name, hand=hand)
    return {BASELINE: baseline, CORRECTED: model_of(evidence)}


def _task(
    rng: np.random.Generator, world: DrawnWorld, recording: Recording
) -> tuple[tuple[float, float, float], Array]:
    """Where the tracker sees an object that stands at the table's origin, turned anyhow, and a goal on the table."""
    pose = (0.0, 0.0, float(rng.uniform(-math.pi, math.pi)))
    seen = _world(world).run(pose, None, push=len(recording.pushes) - 1, duration=0.02).poses[0].tolist()
    heading = float(rng.uniform(-math.pi, math.pi))
    return (seen[0], seen[1], seen[2]), np.array(seen[:2]) + DISTANCE * np.array(
        [math.cos(heading), math.sin(heading)]
    )


def _world(world: DrawnWorld) -> PushWorld:
    return PushWorld(world.scene.plan, world.effects, pushes=len(world.scene.pushes))


def _outcome(world: DrawnWorld, made: Plan, start: tuple[float, float, float], goal: Array, factor: float) -> Record:
    """What comes of a plan in the hidden world."""
    path = path_of(made.model, made.policy.pushes(made.settings)[0], start)
    motion: Motion = _world(world).run(
        (0.0, 0.0, _true_yaw(world, start)), HandPath(times=path.times, start=path.start, velocities=path.velocities),
        push=len(world.scene.pushes) - 1, friction_factor=factor, patience=PATIENCE,
    )  # fmt: skip
    x, y, _ = motion.poses[-1].tolist()
    return {
        "miss_mm": 1e3 * math.hypot(x - float(goal[0]), y - float(goal[1])), "thought_mm": 1e3 * made.cost,
        "rested": bool(motion.rested), "speed": float(max(p.speed for p in made.policy.pushes(made.settings))),
    }  # fmt: skip


def _true_yaw(world: DrawnWorld, start: tuple[float, float, float]) -> float:
    """The yaw that the tracker reports as the start's; its error does not depend on the yaw."""
    bias = _world(world).run((0.0, 0.0, 0.0), None, duration=0.02).poses[0]
    return start[2] - float(bias[2])


def _row(record: Record) -> tuple[Entry, ...]:
    answer = " and ".join(record["named"]) or record["verdict"]
    return (
        " and ".join(record["effect"]), answer, record[BASELINE]["miss_mm"], record[CORRECTED]["miss_mm"],
    )  # fmt: skip


def _summary(records: Sequence[Record]) -> tuple[Entry, ...]:
    """Medians and 90 % quantiles of both, and in how many worlds the corrected plan came nearer."""
    misses = {name: np.array([r[name]["miss_mm"] for r in records]) for name in (BASELINE, CORRECTED)}
    nearer = int((misses[CORRECTED] < misses[BASELINE]).sum())
    quantiles = [float(np.quantile(misses[name], q)) for q in (0.5, 0.9) for name in (BASELINE, CORRECTED)]
    return (*quantiles, f"{nearer} of {len(records)}")
