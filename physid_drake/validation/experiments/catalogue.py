"""The experiments by name, each in its full and its quick size."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from physid_drake.errors import ConfigError
from physid_drake.validation.experiments.closed_loop import ClosedLoops
from physid_drake.validation.experiments.corrected_plan import CorrectedPlans
from physid_drake.validation.experiments.mit_pushes import OTHERS, WHERE, MitPushes
from physid_drake.validation.experiments.motion_prediction import MotionPrediction
from physid_drake.validation.experiments.next_push import NextPush
from physid_drake.validation.experiments.push_direction import PushDirections
from physid_drake.validation.experiments.push_speed import PushSpeeds
from physid_drake.validation.experiments.values import Experiment


@dc.dataclass(frozen=True, kw_only=True)
class Wish:
    """What a person asks for: ``seed``, ``quick`` sizes, and the folder of published pushes where one is read."""

    seed: int
    quick: bool
    pushes: Path | None


def _motion_prediction(wish: Wish) -> Experiment:
    if wish.quick:
        return MotionPrediction(seed=wish.seed, repetitions=2, budget=12, time_step_s=4e-3)
    return MotionPrediction(seed=wish.seed)


def _mit_pushes(wish: Wish) -> Experiment:
    if wish.pushes is None:
        raise ConfigError(f"mit_pushes: give the folder of the published pushes with --data; {WHERE}.")
    if wish.quick:
        return MitPushes(
            seed=wish.seed, folder=wish.pushes, pushes=30, folds=3, training=10, budget=10, other_pushes=10,
            other_folds=2, other_budget=6, others=OTHERS[:2],
        )  # fmt: skip
    return MitPushes(seed=wish.seed, folder=wish.pushes)


def _push_direction(wish: Wish) -> Experiment:
    if wish.quick:
        return PushDirections(seed=wish.seed, repetitions=3, budget=10, training=3, directions=15, time_step_s=4e-3)
    return PushDirections(seed=wish.seed)


def _push_speed(wish: Wish) -> Experiment:
    if wish.quick:
        return PushSpeeds(
            seed=wish.seed, repetitions=2, slow_pushes=(1, 3), budget=12, polish_budget=8, plan_budget=24
        )  # fmt: skip
    return PushSpeeds(seed=wish.seed)


def _next_push(wish: Wish) -> Experiment:
    if wish.quick:
        return NextPush(seed=wish.seed, repetitions=2, pushes=3, candidates=5, testing=3, budget=7, time_step_s=4e-3)
    return NextPush(seed=wish.seed)


def _closed_loop(wish: Wish) -> Experiment:
    if wish.quick:
        return ClosedLoops(seed=wish.seed, repetitions=2, budget=24)
    return ClosedLoops(seed=wish.seed)


def _corrected_plan(wish: Wish) -> Experiment:
    if wish.quick:
        return CorrectedPlans(seed=wish.seed, repetitions=3, budget=24)
    return CorrectedPlans(seed=wish.seed)


EXPERIMENTS: Final[Mapping[str, Callable[[Wish], Experiment]]] = {
    "motion_prediction": _motion_prediction,
    "mit_pushes": _mit_pushes,
    "push_direction": _push_direction,
    "push_speed": _push_speed,
    "next_push": _next_push,
    "corrected_plan": _corrected_plan,
    "closed_loop": _closed_loop,
}


def experiment_named(name: str, wish: Wish) -> Experiment:
    """The experiment of a name.

    Raises:
        ConfigError: if there is none, or what it reads is missing.
    """
    if name not in EXPERIMENTS:
        raise ConfigError(f"experiment '{name}' is unknown; known are {', '.join(EXPERIMENTS)}.")
    if wish.pushes is not None and name != "mit_pushes":
        raise ConfigError(f"--data is for mit_pushes; {name} makes its own pushes.")
    return EXPERIMENTS[name](wish)
