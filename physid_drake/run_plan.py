"""The ``plan`` command: a model and a goal in; ``plan.json``, the hand's path, a picture and a page out."""

from __future__ import annotations

import argparse
import dataclasses as dc
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from physid_drake.errors import ConfigError
from physid_drake.identify.polish import scatter_freedom
from physid_drake.model import Model
from physid_drake.model_reading import load_model
from physid_drake.plan import DistanceToGoal, Ending, Hindsight, Outcome, Plan, Situation, caveat_of, plan
from physid_drake.plan.draws import uncertain_names
from physid_drake.plan.story import outcome_under
from physid_drake.plan.task import Choices, policy_for
from physid_drake.plan.trajectory import tip_height_of
from physid_drake.policies import push_csv
from physid_drake.report.plan import plan_json, plan_table, push_files
from physid_drake.report.plan_page import plan_page, plan_png
from physid_drake.report.progress import progress_bar
from physid_drake.report.terminal import terminal
from physid_drake.run_folder import SETTINGS, RunFolder, named_after, settings_text

COMMAND = "plan"
FILES = ("plan.json", "push.csv", "push_1.csv", "push_2.csv")
FEWEST_TRIALS, TRIALS_PER_SETTING = 24, 16  # of a search


@dc.dataclass(frozen=True, kw_only=True)
class Learnt:
    """What a run's folder says beside its model.

    Attributes:
        caveat: what a diagnosis leaves open; empty if nothing.
        friction_scatter: of support friction from push to push [-].
        scatter_freedom: degrees of freedom with which it is known.
        pushes: in its recording.
    """

    caveat: str = ""
    friction_scatter: float = 0.0
    scatter_freedom: float = math.inf
    pushes: int = 0


def run(arguments: argparse.Namespace) -> int:
    """Run the command.

    Raises:
        PhysidError: one line that says what is wrong.
        KeyboardInterrupt: when interrupted; nothing is written.
    """
    model, learnt = _read(arguments)
    full = model
    if arguments.plain:
        model = model.plain()
    start, goal = _places(arguments, model)
    choices = Choices(
        speed=arguments.speed, travel=arguments.travel,
        direction=None if arguments.direction is None else _radians("--direction", arguments.direction),
    )  # fmt: skip
    policy = policy_for(arguments.policy, model, start, goal, choices)
    out = arguments.out or Path("plans") / named_after(model.recording)
    RunFolder.check(out, COMMAND, inputs=[one for one in (arguments.run_folder,) if one is not None])
    console = terminal()
    with progress_bar(console) as tick:
        made = plan(
            model, policy, DistanceToGoal(goal=goal), situation=Situation(start=start, order=learnt.pushes),
            rng=np.random.default_rng(_seed(arguments.seed)),
            budget=_budget(policy.space.dimension) if arguments.budget is None else arguments.budget,
            search=arguments.search, draws=arguments.draws, risk=arguments.risk, tolerance=arguments.tolerance,
            friction_scatter=learnt.friction_scatter, scatter_freedom=learnt.scatter_freedom, tick=tick,
        )  # fmt: skip
    if not math.isfinite(made.cost):
        raise ConfigError(f"model '{model.recording}': every rollout diverged, so that there is no push to make.")
    if made.predicted.ending is not Ending.AT_REST:
        raise ConfigError(
            f"model '{model.recording}': the best push that was found does not bring the object to rest on the table"
            f" ({made.predicted.ending.value}); nothing is written. Choose another start, goal or direction."
        )
    with_effects = outcome_under(made, full) if arguments.plain and full.effects else None
    hindsight = Hindsight(caveat=learnt.caveat) if learnt.caveat else None
    with RunFolder.open(out, COMMAND, settings_text(COMMAND, _settings(arguments)), name=SETTINGS) as folder:
        write(folder, made, seed=arguments.seed, with_effects=with_effects, hindsight=hindsight)
    console.print(plan_table(made, with_effects=with_effects, hindsight=hindsight))
    nothing = made.cost_function.at(np.array(start[:2]))
    if made.cost > nothing:
        console.print(f"No push at all would leave the object nearer: {1e3 * nothing:.1f} mm.")
    if made.spread is None and arguments.draws:
        console.print("The model has no intervals to draw from: no spread, no success rate.")
    names = ["plan.json", *push_files(made), "plan.png", "page.html"]
    console.print(f"written: {', '.join(names)} in {folder.path}")
    return 0


def _budget(settings: int) -> int:
    """Trials of a search over so many settings."""
    return max(FEWEST_TRIALS, TRIALS_PER_SETTING * settings)


def write(
    folder: RunFolder, made: Plan, *, seed: int, with_effects: Outcome | None = None,
    hindsight: Hindsight | None = None, page: str | None = "page.html",
) -> None:  # fmt: skip
    """Write ``plan.json``, the hand's paths, and with ``page`` the picture and the page.

    Raises:
        OutputError: if one cannot be written.
    """
    forget(folder)
    height = tip_height_of(made.model, made.situation)
    for name, path in zip(push_files(made), made.predicted.paths, strict=True):
        folder.write(name, push_csv(path, height))
    if page is not None:
        folder.write_bytes("plan.png", plan_png(made))
        folder.write(page, plan_page(made, seed=seed, with_effects=with_effects, hindsight=hindsight))
    # Last: where it is, all is.
    folder.write("plan.json", plan_json(made, seed=seed, with_effects=with_effects, hindsight=hindsight))


def forget(folder: RunFolder) -> None:
    """Drop an earlier plan: its push files may be more than a new one's."""
    for name in FILES:
        folder.forget(name)


def _read(arguments: argparse.Namespace) -> tuple[Model, Learnt]:
    folder: Path | None = arguments.run_folder
    if folder is None and arguments.model is None:
        raise ConfigError("plan: give the folder of a run or of a diagnosis, or --model FILE.")
    if folder is not None and not folder.is_dir():
        raise ConfigError(f"run '{folder}': there is no such folder.")
    if arguments.model is None and folder is not None and not (folder / "model.yaml").exists():
        raise ConfigError(f"run '{folder}': holds no model.yaml; run run_cell or diagnose into it, or give --model.")
    file = arguments.model or folder
    assert file is not None
    model = load_model(file)
    uncertain_names(model)
    return model, _learnt(folder or (file if file.is_dir() else file.parent))


def _learnt(folder: Path) -> Learnt:
    """Scatter and number of pushes: of the diagnosis that wrote the model, else of the identification.

    Raises:
        ConfigError: if a result is there and cannot be read.
    """
    for name in ("diagnosis.json", "result.json"):
        file = folder / name
        if not file.exists():
            continue
        try:
            content: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
            scatter, caveat = float(content["friction_scatter"]), ""
            if name == "diagnosis.json":
                fitted = len(content["fit"]["per_push"])
                pushes = int(content.get("pushes", fitted))
                alike = {e["name"]: e["indistinguishable_from"] for e in content["effects"]}
                caveat = caveat_of(content["verdict"], alike)
            else:
                fitted = len(content["training"]["pushes"])
                pushes = fitted + len(content["held_out"]["pushes"])
        except (OSError, UnicodeDecodeError, ValueError, KeyError, TypeError, OverflowError, AttributeError) as error:
            text = " ".join(str(error).split())
            raise ConfigError(f"'{file}': cannot be read: {type(error).__name__}: {text}.") from error
        if not 0.0 <= scatter < 1.0:
            raise ConfigError(f"'{file}': friction_scatter must be in [0, 1), but is {scatter:g}.")
        if pushes < 0:
            raise ConfigError(f"'{file}': pushes must be at least 0, but is {pushes}.")
        return Learnt(caveat=caveat, friction_scatter=scatter, scatter_freedom=scatter_freedom(fitted), pushes=pushes)
    return Learnt()


def _places(arguments: argparse.Namespace, model: Model) -> tuple[tuple[float, float, float], tuple[float, float]]:
    """The object's start, the middle of the table unless it is given, and the goal."""
    (x0, y0), (x1, y1) = model.table
    goal = (float(arguments.goal[0]), float(arguments.goal[1]))
    if arguments.start is None:
        start = (0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.0)
    else:
        start = (*arguments.start[:2], _radians("--start", arguments.start[2]))
    return start, goal


def _radians(flag: str, degrees: float) -> float:
    if not math.isfinite(degrees):
        raise ConfigError(f"{flag}: the angle must be finite, but is {degrees:g} degrees.")
    return math.radians(degrees)


def _seed(seed: int) -> int:
    if seed < 0:
        raise ConfigError(f"--seed must be at least 0, but is {seed}.")
    return seed


def _settings(arguments: argparse.Namespace) -> dict[str, Any]:
    """What the command was told, with its folders as text."""
    left_out = ("run", "out")
    return {k: str(v) if isinstance(v, Path) else v for k, v in vars(arguments).items() if k not in left_out}
