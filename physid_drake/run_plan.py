"""The ``plan`` command: a model and a goal in; ``plan.json``, the hand's path, a picture and a page out."""

from __future__ import annotations

import argparse
import dataclasses as dc
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from physid_drake.errors import ConfigError
from physid_drake.files import FileError, read_json
from physid_drake.model import Model
from physid_drake.model_reading import load_model
from physid_drake.plan import DistanceToGoal, Ending, Hindsight, Outcome, Plan, Situation, caveat_of, plan
from physid_drake.plan.costs import Cost
from physid_drake.plan.draws import scatter_freedom, uncertain_names
from physid_drake.plan.pipeline import outcome_under
from physid_drake.plan.reach import goal_within
from physid_drake.plan.task import Choices, policy_for
from physid_drake.plan.trajectory import tip_height_of
from physid_drake.policies import Policy, push_csv
from physid_drake.report.acts import acts_of_plan, setting_of_plan
from physid_drake.report.pages import INDEX, PLAN, SCENE, index_page
from physid_drake.report.plan import plan_json, plan_rows, plan_table, push_files, title_of
from physid_drake.report.plan_page import plan_page, plan_png
from physid_drake.report.progress import progress_bar
from physid_drake.report.scene_page import scene_page
from physid_drake.report.terminal import terminal
from physid_drake.run_folder import SETTINGS, RunFolder, named_after_model, settings_text
from physid_drake.wording import shown

WIDER = {"push_speed": ("push", "two_pushes"), "push_direction": ("push", "two_pushes"), "push": ("two_pushes",)}
"""Policies that reach more than one does, in the order in which they are tried."""
COMMAND = "plan"
PAGES = (INDEX, SCENE, PLAN)
FILES = ("plan.json", "push.csv", "push_1.csv", "push_2.csv", "plan.png", PLAN)
FEWEST_TRIALS, TRIALS_PER_SETTING = 24, 16  # of a search
MOST_PUSHES = 1_000_000  # of a recording


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
    if arguments.baseline:
        model = model.baseline()
    start, goal, cost = _places(arguments, model)
    choices = Choices(
        speed=arguments.speed, travel=arguments.travel,
        direction=None if arguments.direction is None else _radians("--direction", arguments.direction),
    )  # fmt: skip
    policy = policy_for(arguments.policy, model, start, goal, choices)
    # Like a diagnosis, not after the name in recording.yaml, which recordings of one data set may share.
    out = arguments.out or Path("plans") / named_after_model(arguments.run_folder or arguments.model)
    RunFolder.check(out, COMMAND, inputs=[one for one in (arguments.run_folder,) if one is not None])
    console = terminal()
    with progress_bar(console) as progress:
        made = plan(
            model, policy, cost, situation=Situation(start=start, order=learnt.pushes),
            rng=np.random.default_rng(_seed(arguments.seed)),
            budget=_trials(arguments, policy),
            search=arguments.search, draws=arguments.draws, risk=arguments.risk, tolerance=arguments.tolerance,
            friction_scatter=learnt.friction_scatter, scatter_freedom=learnt.scatter_freedom, progress=progress,
        )  # fmt: skip
    if not math.isfinite(made.cost):
        raise ConfigError(f"model '{model.recording}': every rollout diverged: no push was found.")
    if made.predicted.ending is not Ending.AT_REST:
        raise ConfigError(
            f"model '{model.recording}': the best push does not bring the object to rest on the table"
            f" ({made.predicted.ending.value}); nothing is written. Choose another start, goal or direction."
        )
    with_effects = outcome_under(made, full) if arguments.baseline and full.effects else None
    hindsight = Hindsight(caveat=learnt.caveat) if learnt.caveat else None
    settings = settings_text(COMMAND, _settings(arguments))
    with RunFolder.open(out, COMMAND, settings, name=SETTINGS) as folder:
        if folder.holds(FILES[0]):
            console.print(f"Replaces the earlier plan in {out}.")
        write(folder, made, seed=arguments.seed, with_effects=with_effects, hindsight=hindsight)
    console.print(plan_table(made, with_effects=with_effects, hindsight=hindsight))
    if made.cost > made.tolerance:
        console.print(_miss(made, arguments, model, choices, goal, console))
    nothing = made.cost_function.at(np.array(start[:2]))
    if made.cost > nothing:
        console.print(f"Without any push the object is nearer: {1e3 * nothing:.1f} mm.")
    if made.spread is None and arguments.draws:
        console.print("The model has no intervals to sample from: no expected miss, no success rate.")
    names = ["plan.json", *push_files(made), "plan.png"]
    console.print(f"written: {', '.join(names)} and pages; open {folder.path / INDEX}")
    return 0


def _miss(
    made: Plan,
    arguments: argparse.Namespace,
    model: Model,
    choices: Choices,
    goal: tuple[float, float],
    console: Console,
) -> str:
    """That the best push misses the goal, and which other policy reaches it: those of more settings are tried."""
    situation = made.situation
    said = f"The best push misses the goal by {1e3 * made.cost:.1f} mm; the tolerance is {1e3 * made.tolerance:g} mm."
    nearest: tuple[float, str] = made.cost, ""
    for name in WIDER.get(arguments.policy, ()):
        policy = policy_for(name, model, situation.start, goal, dc.replace(choices, direction=None))
        with progress_bar(console) as progress:
            other = plan(
                model, policy, made.cost_function, situation=situation,
                rng=np.random.default_rng(_seed(arguments.seed)), budget=_trials(arguments, policy), draws=0, sweep=0,
                tolerance=made.tolerance, progress=progress,
            )  # fmt: skip
        if other.predicted.ending is Ending.AT_REST and other.cost < nearest[0]:
            nearest = other.cost, name
        if nearest[0] <= made.tolerance:
            break
    cost, name = nearest
    if not name:
        return f"{said} No other policy comes nearer: choose a nearer goal, or push again from there."
    reaches = "reaches it" if cost <= made.tolerance else "comes nearer"
    return f"{said} --policy {name} {reaches}: miss {1e3 * cost:.1f} mm."


def _trials(arguments: argparse.Namespace, policy: Policy) -> int:
    """Of a search: as many as were asked for, else by the policy's settings."""
    return _budget(policy.space.dimension) if arguments.budget is None else int(arguments.budget)


def _budget(settings: int) -> int:
    """Trials of a search over so many settings."""
    return max(FEWEST_TRIALS, TRIALS_PER_SETTING * settings)


def write(
    folder: RunFolder, made: Plan, *, seed: int, with_effects: Outcome | None = None,
    hindsight: Hindsight | None = None, pages: Sequence[str] | None = None,
) -> None:  # fmt: skip
    """Write ``plan.json``, the hand's paths, the picture and the page.

    Args:
        folder: where.
        made: the plan.
        seed: of the run.
        with_effects: what the push does under the model with its effects, where it was planned without them.
        hindsight: what a diagnosis leaves open.
        pages: of a folder whose index somebody else writes; None: these alone, and it is written here.

    Raises:
        OutputError: if one cannot be written.
    """
    forget(folder)
    height = tip_height_of(made.model, made.situation)
    for name, path in zip(push_files(made), made.predicted.paths, strict=True):
        folder.write(name, push_csv(path, height))
    folder.write_bytes("plan.png", plan_png(made))
    folder.write(
        PLAN, plan_page(made, seed=seed, with_effects=with_effects, hindsight=hindsight, pages=pages or PAGES)
    )
    if pages is None:
        setting, acts = setting_of_plan(made), acts_of_plan(made)
        corrected = "with " + " and ".join(e.name for e in made.model.effects)
        folder.write(SCENE, scene_page(setting, acts, name=title_of(made), corrected=corrected, pages=PAGES))
        lines = [f"{what}: {value}." for what, value in plan_rows(made, with_effects=with_effects)[:6]]
        files = ("plan.json", *push_files(made), "plan.png", *PAGES)
        folder.write(INDEX, index_page(f"Plan: {title_of(made)}", lines, files))
    # Last: where it is, all is.
    folder.write("plan.json", plan_json(made, seed=seed, with_effects=with_effects, hindsight=hindsight))


def forget(folder: RunFolder) -> None:
    """Drop an earlier plan: its push files may be more than a new one's."""
    for name in FILES:
        folder.forget(name)


def _read(arguments: argparse.Namespace) -> tuple[Model, Learnt]:
    folder: Path | None = arguments.run_folder
    if folder is None and arguments.model is None:
        raise ConfigError("plan: give the folder of a run or a diagnosis, or --model FILE.")
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
            return _learnt_from(read_json(file), of_diagnosis=name == "diagnosis.json")
        except FileError as error:
            raise ConfigError(f"'{file}': {error}.") from error
        except ConfigError as error:
            raise ConfigError(f"'{file}': {error}") from error
    return Learnt()


def _learnt_from(content: Any, *, of_diagnosis: bool) -> Learnt:
    """What a result says.

    Raises:
        ConfigError: naming the key and the rule.
    """
    scatter = _value(content, "friction_scatter", int, float)
    if not 0.0 <= scatter < 1.0:
        raise ConfigError(f"friction_scatter must be in [0, 1), but is {shown(scatter)}.")
    if of_diagnosis:
        fitted = len(_value(content, "fit.per_push", list, dict))
        pushes = _value(content, "pushes", int) if "pushes" in content else fitted
        found = _value(content, "effects", list)
        rivals = [[str(rival) for rival in _value(e, "indistinguishable_from", list)] for e in found]
        alike = {_value(e, "name", str): names for e, names in zip(found, rivals, strict=True)}
        caveat = caveat_of(_value(content, "verdict", str), alike)
    else:
        fitted, caveat = len(_value(content, "training.pushes", list, dict)), ""
        pushes = _value(content, "pushes", int) if "pushes" in content else fitted
    if not 0 <= pushes <= MOST_PUSHES:
        raise ConfigError(f"pushes must be from 0 to {MOST_PUSHES}, but is {shown(pushes)}.")
    return Learnt(
        caveat=caveat, friction_scatter=float(scatter), scatter_freedom=scatter_freedom(fitted), pushes=pushes
    )


def _value(content: Any, path: str, *kinds: type) -> Any:
    """The value at a dotted path, of one of these kinds.

    Raises:
        ConfigError: if it is missing, or of another kind.
    """
    value = content
    for key in path.split("."):
        if not isinstance(value, dict) or key not in value:
            raise ConfigError(f"key '{path}' is missing; run its command again.")
        value = value[key]
    if not isinstance(value, kinds) or isinstance(value, bool):
        words = " or ".join(_WORDS[kind] for kind in kinds)
        raise ConfigError(f"key '{path}' must be {words}, but is {shown(value)}; run its command again.")
    return value


_WORDS = {int: "a whole number", float: "a number", str: "text", list: "a list", dict: "a mapping"}


def _places(
    arguments: argparse.Namespace, model: Model
) -> tuple[tuple[float, float, float], tuple[float, float], Cost]:
    """The object's start, the middle of the table unless it is given, the goal, and what it costs to miss it."""
    (x0, y0), (x1, y1) = model.table
    if arguments.start is None:
        start = (0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.0)
    else:
        start = (*arguments.start[:2], _radians("--start", arguments.start[2]))
    if arguments.goal is None:
        cost, goal = goal_within(arguments.reach, model.table, start[:2])
        return start, goal, cost
    goal = (float(arguments.goal[0]), float(arguments.goal[1]))
    return start, goal, DistanceToGoal(goal=goal)


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
