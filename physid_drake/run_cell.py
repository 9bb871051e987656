"""The main job: read a recording, identify, diagnose, plan, show. ``python -m physid_drake.run_cell --help``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from rich.console import Console

from physid_drake.diagnose import Diagnosis, model_of
from physid_drake.door import DONE, Parser, enter, path
from physid_drake.errors import ConfigError
from physid_drake.identify import Identification, Identifier, OnlineIdentifier
from physid_drake.identify.system import PUSH_PERIOD, BatchLearner, IdentificationSystem, Learner, RecordingPlayer
from physid_drake.model import Model
from physid_drake.plan import Hindsight, Plan, caveat_of, outcome_under
from physid_drake.plan.system import Planner, PolicySystem, identified_model, planner_of
from physid_drake.progress import Progress
from physid_drake.pushes.case import case_of
from physid_drake.pushes.doubts import doubts
from physid_drake.pushes.kept_rollouts import KeptRollouts
from physid_drake.pushes.nuisance import nuisance_of
from physid_drake.pushes.problem import HandUse
from physid_drake.pushes.rollouts import simulate
from physid_drake.pushes.task import Task
from physid_drake.recording import Recording, digest_of, read_recording
from physid_drake.report.cells import cells_table
from physid_drake.report.inspection import warning_lines
from physid_drake.report.page import result_page
from physid_drake.report.plan import plan_table, push_files
from physid_drake.report.progress import progress_bar
from physid_drake.report.result import result_json
from physid_drake.report.stage import LOOPBACK, ShownMotion, Stage, served
from physid_drake.report.tables import accuracy_table, estimates_table, verdict
from physid_drake.report.terminal import terminal
from physid_drake.run_diagnose import ALPHA, STATE, recording_folder, run_case, show, write
from physid_drake.run_folder import RunFolder, made_with, named_after, versions
from physid_drake.run_plan import FILES as PLAN
from physid_drake.run_plan import forget as forget_plan
from physid_drake.run_plan import write as write_plan
from physid_drake.scenario import config_folders, dump_scenario, load_scenario
from physid_drake.scenario_schema import Scenario

COMMAND = "run_cell"
BELIEF = "belief.npz"  # of an interrupted identification
DIAGNOSIS_PAGE = "diagnosis.html"
DIAGNOSIS = ("diagnosis.json", DIAGNOSIS_PAGE, "scene.html")
RESULTS = ("result.json", "page.html", "model.yaml", *DIAGNOSIS, *PLAN)
MOST_WARNINGS = 5  # printed
SHOWN = 12  # pushes in the animation, held-out ones first


def main(argv: Sequence[str] | None = None) -> int:
    """Run the main job; returns the exit status: 0 done, 1 an error of the input or output, 130 interrupted."""

    def begin() -> int:
        run(_parser().parse_args(argv), terminal())
        return DONE

    return enter(begin, interrupted="interrupted; the same command goes on from what is kept, if anything is")


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="python -m physid_drake.run_cell", description=__doc__)
    parser.add_argument(
        "config", nargs="?", metavar="CONFIG",
        help="FILE or FILE:SCENARIO (default: sealed, which ships with the project; with --recording, the defaults)",
    )  # fmt: skip
    parser.add_argument("--recording", metavar="FOLDER", help="the pushes, instead of the scenario's")
    parser.add_argument(
        "--out", type=path, metavar="FOLDER",
        help="where results go (default: runs/<scenario>; with --recording and no CONFIG, runs/<recording>)",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, metavar="N", help="of everything random, instead of the scenario's")
    parser.add_argument("--set", dest="override", metavar="YAML", help="such as '{search: {budget: 20}}'")
    parser.add_argument("--no-diagnosis", action="store_true", help="identify and plan with the plain cell only")
    parser.add_argument("--no-plan", action="store_true", help="plan no push")
    parser.add_argument("--no-view", action="store_true", help="serve no live Meshcat while working")
    parser.add_argument(
        "--host", default=LOOPBACK, metavar="ADDRESS",
        help=f"where the live Meshcat listens (default {LOOPBACK}: this machine only; * for all its networks)",
    )  # fmt: skip
    return parser


def run(arguments: argparse.Namespace, console: Console) -> None:
    """The whole job.

    Raises:
        PhysidError: one line that says what is wrong.
    """
    name, scenario = load_scenario(
        arguments.config, arguments.override, recording=arguments.recording, seed=arguments.seed
    )
    source = recording_folder(scenario.recording)
    out = arguments.out or Path("runs") / named_after(name)
    # Everything that can be refused is refused before anything is written.
    RunFolder.check(out, COMMAND, inputs=config_folders(arguments.config), recordings=[source])
    recording = read_recording(source)
    identifier = _identifier(scenario, recording, out)
    planner = None if arguments.no_plan else _planner(scenario, recording, identifier, console)
    # A comment, so that the file is still a configuration that can be given to this command.
    made_by = f"{dump_scenario(name, scenario)}# of recording {digest_of(recording)}\n# by {made_with()}\n"
    stage = None if arguments.no_view else _live(recording, arguments.host, console)
    with RunFolder.open(out, COMMAND, made_by, state=(BELIEF, STATE), results=RESULTS) as folder:
        _refuse_to_drop(folder, arguments)
        stage = _fill(folder, identifier, planner, scenario, recording, stage, arguments, console)
    _keep_serving(arguments.no_view, stage, console)


def _refuse_to_drop(folder: RunFolder, arguments: argparse.Namespace) -> None:
    """A result of the same settings is not dropped by a flag that only says not to make it."""
    for flag, left_out, file in (
        ("--no-diagnosis", arguments.no_diagnosis, DIAGNOSIS[0]),
        ("--no-plan", arguments.no_plan, PLAN[0]),
    ):
        if left_out and folder.holds(file):
            raise ConfigError(
                f"'{folder.path / file}' would be dropped: leave {flag} out, or choose another --out to keep it."
            )


def _fill(
    folder: RunFolder, identifier: Identifier, planner: Planner | None, scenario: Scenario, recording: Recording,
    stage: Stage | None, arguments: argparse.Namespace, console: Console,
) -> Stage:  # fmt: skip
    """Identify, plan and diagnose; each result is written as soon as it is there."""
    folder.own(BELIEF)
    result, plan = _identify(identifier, planner, scenario, recording, console)
    hand = HandUse.of(identifier.problems)
    model = identified_model(result, identifier.pool.spec, recording.name, hand=hand)
    stage = stage or Stage(recording)
    marks = stage.play(_scenes(result, identifier, recording))
    note = f"{recording.description} Seed {scenario.seed}."
    html = stage.meshcat.StaticHtml()
    page = partial(result_page, html, result, name=recording.name, marks=marks, note=note)
    folder.write("page.html", page(plan=plan))
    folder.write("result.json", result_json(result, recording, scenario.seed, versions()))
    for stale in DIAGNOSIS:  # an earlier run's, of another model
        folder.forget(stale)
    folder.write("model.yaml", model.dump())
    _keep_plan(plan, scenario, folder)
    _show(result, identifier, recording, console)  # what is printed may go to a pipe that closes
    console.print(f"written: result.json, page.html and model.yaml in {folder.path}")
    _show_plan(plan, folder, console)
    if not arguments.no_diagnosis:
        diagnosis, found = _diagnose(scenario, recording, folder, console)
        page = partial(page, diagnosis=(diagnosis.verdict, diagnosis.sentence))
        folder.write("page.html", page(plan=plan))
        if planner is not None and plan is not None and (found.effects or _caveat(diagnosis)):
            plan, hindsight = _planned_again(planner, plan, diagnosis, found, console)
            _keep_plan(plan, scenario, folder, hindsight=hindsight)
            folder.write("page.html", page(plan=plan, hindsight=hindsight))
            _show_plan(plan, folder, console, hindsight=hindsight)
        folder.forget(STATE)
    folder.forget(BELIEF)
    return stage


def _show(result: Identification, identifier: Identifier, recording: Recording, console: Console) -> None:
    console.print()
    console.print(estimates_table(result, recording.name))
    if result.cells is not None:
        console.print(cells_table(result.cells))
    console.print(accuracy_table(result))
    console.print(verdict(result))
    odd = (*doubts(recording), *warning_lines(recording))
    for line in odd[:MOST_WARNINGS]:
        console.print(f"Note: {line}", markup=False)
    if len(odd) > MOST_WARNINGS:
        console.print(f"and {len(odd) - MOST_WARNINGS} more: physid_drake inspect")
    if identifier.pool.diverged:
        console.print(f"{identifier.pool.diverged} of {identifier.pool.count} rollouts diverged and count as failed.")


def _keep_plan(
    plan: Plan | None, scenario: Scenario, folder: RunFolder, *, hindsight: Hindsight | None = None
) -> None:
    """Write the plan; an earlier one is dropped."""
    forget_plan(folder)
    if plan is not None:
        write_plan(folder, plan, seed=scenario.seed, hindsight=hindsight, page=None)


def _show_plan(plan: Plan | None, folder: RunFolder, console: Console, *, hindsight: Hindsight | None = None) -> None:
    if plan is not None:
        console.print(plan_table(plan, hindsight=hindsight))
        console.print(f"written: plan.json and {', '.join(push_files(plan))} in {folder.path}")


def _diagnose(
    scenario: Scenario, recording: Recording, folder: RunFolder, console: Console
) -> tuple[Diagnosis, Model]:
    """Say what physics is missing, and keep the model with it."""
    console.print("\nDiagnosing: what these pushes say beyond the plain cell")
    case = case_of(recording, scenario.cell, scenario.theta, jobs=scenario.search.jobs)
    kept = KeptRollouts(folder.own(STATE))
    diagnosis, evidence = run_case(case, console, seed=scenario.seed, alpha=ALPHA, kept=kept)
    write(folder, diagnosis, evidence, page=DIAGNOSIS_PAGE)
    show(console, diagnosis)
    console.print(f"written: diagnosis.json, diagnosis.html, scene.html and model.yaml in {folder.path}")
    return diagnosis, model_of(evidence)


def _planned_again(
    planner: Planner, plain: Plan, diagnosis: Diagnosis, found: Model, console: Console
) -> tuple[Plan, Hindsight]:
    """The plan with the effects that were found, or the same plan where none was, and what is to be said of it."""
    caveat = _caveat(diagnosis)
    if not found.effects:
        return plain, Hindsight(caveat=caveat)
    console.print(f"Planned again, with {' and '.join(e.name for e in found.effects)}:")
    scatter, pushes = diagnosis.friction_scatter, len(diagnosis.fit.per_push)
    with progress_bar(console) as bar:
        again = planner.with_model(found, friction_scatter=scatter, pushes=pushes, tick=bar)
    return again, Hindsight(plain=plain, outcome=outcome_under(plain, found), caveat=caveat)


def _caveat(diagnosis: Diagnosis) -> str:
    return caveat_of(diagnosis.verdict, {e.name: e.indistinguishable_from for e in diagnosis.effects})


def _live(recording: Recording, host: str, console: Console) -> Stage:
    stage = Stage(recording, meshcat=served(host))
    stage.show_start()
    console.print(f"Meshcat: {stage.meshcat.web_url()}")
    return stage


def _identifier(scenario: Scenario, recording: Recording, out: Path) -> Identifier:
    return Identifier(
        recording,
        cell=scenario.cell,
        theta=scenario.theta,
        search=scenario.search,
        held_out_share=scenario.held_out_share,
        seed=scenario.seed,
        state=out / BELIEF,
    )


def _planner(scenario: Scenario, recording: Recording, identifier: Identifier, console: Console) -> Planner | None:
    """What plans a push with an identification; None where nothing pushes, or no goal was asked for and none fits."""
    asked = scenario.plan.goal_m or scenario.plan.start_m
    try:
        if recording.hand is None:
            raise ConfigError("plan: no hand pushes in this recording.")
        return planner_of(scenario.plan, identifier.pool.spec, identifier.problems, recording.name, scenario.seed)
    except ConfigError as error:
        if asked:
            raise
        console.print(f"No push is planned. {error}")
        return None


def _identify(
    identifier: Identifier, planner: Planner | None, scenario: Scenario, recording: Recording, console: Console
) -> tuple[Identification, Plan | None]:
    """Wire and run the diagram: the recording's player, the system that learns from its pushes, and the policy's."""
    last = len(recording.pushes) * PUSH_PERIOD  # what the last push teaches is seen at the next update
    with progress_bar(console) as bar:
        builder = DiagramBuilder()
        player = builder.AddSystem(RecordingPlayer(recording.pushes))
        system = builder.AddSystem(
            IdentificationSystem(
                _learner(identifier, scenario, recording, bar),
                dimension=identifier.thetas.space.dimension,
                nominal=identifier.thetas.space.nominal,
            )
        )
        builder.Connect(player.GetOutputPort("push.measured"), system.GetInputPort("push.measured"))
        policy = None
        if planner is not None:
            policy = builder.AddSystem(
                PolicySystem(lambda known: planner.run(known, bar), dimension=planner.dimension, begin=last)
            )
            identified = system.GetOutputPort("identification.estimated")
            builder.Connect(identified, policy.GetInputPort("identification.estimated"))
        simulator = Simulator(builder.Build())
        simulator.AdvanceTo(last + PUSH_PERIOD)
        root = simulator.get_context()
        result: Identification | None = system.identification(system.GetMyContextFromRoot(root))
        plan = None if policy is None else policy.plan(policy.GetMyContextFromRoot(root))
    assert result is not None
    return result, plan


def _learner(identifier: Identifier, scenario: Scenario, recording: Recording, bar: Progress) -> Learner[Any]:
    """What learns from the pushes: from all at once, or from one after another."""
    if not scenario.search.online:
        return BatchLearner(lambda _: identifier.run(bar), after=len(recording.pushes))
    return OnlineIdentifier(
        recording, cell=scenario.cell, theta=scenario.theta, search=scenario.search, seed=scenario.seed,
        pool=identifier.pool, progress=bar,
    )  # fmt: skip


def _scenes(result: Identification, identifier: Identifier, recording: Recording) -> list[ShownMotion]:
    """Held-out pushes first, as the model predicts them: with nothing of their own fitted."""
    by_name = {problem.name: problem for problem in identifier.problems}
    names = [*result.held_out, *result.training][:SHOWN]
    scenes = []
    for push in recording.subset(names).pushes:
        problem = by_name[push.name]
        nuisance = nuisance_of(problem, 0.01)
        task = Task(problem=problem, theta=result.theta, nuisance=nuisance, values=0.0 * nuisance.stds)
        scenes.append(ShownMotion(push=push, motion=simulate(identifier.pool.spec, identifier.thetas, task)))
    return scenes


def _keep_serving(no_view: bool, stage: Stage, console: Console) -> None:
    if no_view or not (sys.stdin.isatty() and sys.stdout.isatty()):
        return
    console.print(f"The animation plays at {stage.meshcat.web_url()}; press Enter to end.")
    sys.stdin.readline()


if __name__ == "__main__":
    sys.exit(main())
