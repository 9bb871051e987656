"""The main job: read a recording, identify, diagnose, plan, show. ``python -m physid_drake.run_cell --help``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from rich.console import Console

from physid_drake.command import DONE, Parser, path, run_command
from physid_drake.diagnose import Diagnosis, DiagnosisSystem, Examined, diagnose_from, model_of
from physid_drake.errors import ConfigError
from physid_drake.identify import Identification, Identifier, OnlineIdentifier, in_the_cell, with_prior
from physid_drake.identify.system import PUSH_PERIOD, BatchLearner, IdentificationSystem, Learner, RecordingPlayer
from physid_drake.model import Model
from physid_drake.plan import Hindsight, Plan, caveat_of, outcome_under
from physid_drake.plan.system import Planner, PolicySystem, identified_model, planner_of
from physid_drake.progress import Progress
from physid_drake.pushes.case import UNIT_SCATTER
from physid_drake.pushes.kept_rollouts import KeptRollouts
from physid_drake.pushes.problem import HandUse
from physid_drake.pushes.push_warnings import doubts
from physid_drake.recording import Recording, digest_of, read_recording, recording_folder
from physid_drake.report.acts import acts_of, acts_of_plan, setting_of, unit_force_of
from physid_drake.report.cells import cells_table
from physid_drake.report.inspection import warning_lines
from physid_drake.report.live import Live
from physid_drake.report.meshcat_server import LOOPBACK
from physid_drake.report.overview import overview_page
from physid_drake.report.pages import DIAGNOSIS as DIAGNOSIS_PAGE
from physid_drake.report.pages import INDEX, SCENE
from physid_drake.report.pages import PLAN as PLAN_PAGE
from physid_drake.report.plan import plan_table, push_files
from physid_drake.report.progress import (
    DIAGNOSIS_STAGES,
    HINDSIGHT,
    IDENTIFICATION_STAGES,
    JOB_STAGES,
    PLANNING_STAGES,
    progress_bar,
)
from physid_drake.report.result import result_json
from physid_drake.report.scene_page import scene_page
from physid_drake.report.tables import accuracy_table, estimates_table, verdict
from physid_drake.report.terminal import terminal
from physid_drake.run_diagnose import ALPHA, STATE, show, write
from physid_drake.run_folder import RunFolder, named_after
from physid_drake.run_plan import FILES as PLAN
from physid_drake.run_plan import forget as forget_plan
from physid_drake.run_plan import write as write_plan
from physid_drake.scenario import config_folders, dump_scenario, load_scenario
from physid_drake.scenario_schema import Scenario
from physid_drake.versions import made_with, versions

COMMAND = "run_cell"
BELIEF = "belief.npz"  # of an interrupted identification
DIAGNOSIS = ("diagnosis.json", DIAGNOSIS_PAGE)
RESULTS = ("result.json", INDEX, SCENE, "model.yaml", *DIAGNOSIS, *PLAN)
MOST_WARNINGS = 5  # printed


def main(argv: Sequence[str] | None = None) -> int:
    """Run the main job; returns the exit status: 0 done, 1 an error of the input or output, 130 interrupted."""

    def begin() -> int:
        run(_parser().parse_args(argv), terminal())
        return DONE

    return run_command(
        begin, interrupted="interrupted; the same command resumes from what has been saved, if anything has"
    )


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="python -m physid_drake.run_cell", description=(
        "Read a recording, identify its parameters, diagnose missing physics, plan a push and show the results."
    ))  # fmt: skip
    parser.add_argument(
        "config", nargs="?", metavar="CONFIG",
        help="FILE or FILE:SCENARIO (default: sealed, which ships with the project; with --recording: the defaults)",
    )  # fmt: skip
    parser.add_argument("--recording", metavar="FOLDER", help="recording to use instead of the scenario's")
    parser.add_argument(
        "--out", type=path, metavar="FOLDER",
        help="output folder (default: runs/<scenario>; with --recording and no CONFIG: runs/<recording>)",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, metavar="N", help="random seed, instead of the scenario's")
    parser.add_argument(
        "--set",
        dest="override",
        metavar="YAML",
        help="override settings of the scenario, such as '{search: {budget: 20}}'",
    )
    parser.add_argument("--no-diagnosis", action="store_true", help="identify and plan with the baseline model only")
    parser.add_argument("--no-plan", action="store_true", help="plan no push")
    parser.add_argument("--no-view", action="store_true", help="serve no live Meshcat view while working")
    parser.add_argument(
        "--host", default=LOOPBACK, metavar="ADDRESS",
        help=f"address that the live Meshcat listens on (default {LOOPBACK}: this machine only; *: all networks)",
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
    live = None if arguments.no_view else Live(recording, arguments.host)
    if live is not None:
        console.print(f"Meshcat: {live.url}")
    with RunFolder.open(out, COMMAND, made_by, state=(BELIEF, STATE), results=RESULTS) as folder:
        _refuse_to_drop(folder, arguments)
        _fill(folder, identifier, planner, scenario, recording, live, arguments, console)
    _keep_serving(live, console)


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
    live: Live | None, arguments: argparse.Namespace, console: Console,
) -> None:  # fmt: skip
    """Identify, diagnose and plan; then all is written, each file once, and then shown: a pipe may close."""
    folder.own(BELIEF)
    identifier.case.pool.kept = KeptRollouts(folder.own(STATE))
    work = Work(identifier, planner, scenario, recording, console, diagnosing=not arguments.no_diagnosis, live=live)
    examined, plan, hindsight = work.done()
    diagnosis, evidence = examined.diagnosis, examined.evidence
    planned = [] if plan is None else acts_of_plan(plan, hindsight)
    for stale in (*DIAGNOSIS, "result.json"):  # an earlier run's, of another model
        folder.forget(stale)
    files = ["result.json", "model.yaml", *(() if arguments.no_diagnosis else DIAGNOSIS[:1])]
    files += [] if plan is None else ["plan.json", *push_files(plan)]
    pages = (
        INDEX, *(() if arguments.no_diagnosis else (DIAGNOSIS_PAGE,)), SCENE, *(() if plan is None else (PLAN_PAGE,)),
    )  # fmt: skip
    folder.write(INDEX, overview_page(
        examined, name=recording.name, note=f"{recording.description} Seed {scenario.seed}.", plan=plan,
        hindsight=hindsight, files=[*files, *pages],
    ))  # fmt: skip
    _keep_plan(plan, scenario, folder, hindsight=hindsight, pages=pages)
    if evidence is None or diagnosis is None:
        folder.write("model.yaml", work.model(examined).dump())
        setting, acts = setting_of(examined.known, None), [*acts_of(examined.known, None), *planned]
        folder.write(SCENE, scene_page(setting, acts, name=recording.name, pages=pages))
    else:
        write(folder, diagnosis, evidence, pages=pages, planned=planned)
    # Last: where it is, all is.
    folder.write("result.json", result_json(examined, recording, scenario.seed, versions()))
    _show(examined.known, recording, console, alone=examined.diagnosis is None)
    if examined.diagnosis is not None:
        show(console, examined.diagnosis, parameters=False)
    if plan is not None:
        console.print(plan_table(plan, hindsight=hindsight))
    console.print(f"written: {', '.join(files)} and pages; open {folder.path / INDEX}")
    folder.forget(STATE)
    folder.forget(BELIEF)
    if live is not None:
        acts = [*acts_of(examined.known, evidence), *planned]
        live.play(setting_of(examined.known, evidence), acts, 1.0 if evidence is None else unit_force_of(evidence))


class Work:
    """Identification, diagnosis and plan as one Drake diagram."""

    def __init__(
        self, identifier: Identifier, planner: Planner | None, scenario: Scenario, recording: Recording,
        console: Console, *, diagnosing: bool, live: Live | None = None,
    ) -> None:  # fmt: skip
        """Prepare.

        Args:
            identifier: of the recording.
            planner: what plans a push; None plans none.
            scenario: how.
            recording: the pushes.
            console: for the progress.
            diagnosing: whether to look for what is missing, too.
            live: what shows how far it is, beside the console.
        """
        self._identifier, self._planner, self._scenario = identifier, planner, scenario
        self._recording, self._console, self._diagnosing = recording, console, diagnosing
        self._live = live
        self._hindsight: Hindsight | None = None

    def done(self) -> tuple[Examined, Plan | None, Hindsight | None]:
        """Wire and run: the recording's player, what learns from its pushes, what examines that, the policy's."""
        last = len(self._recording.pushes) * PUSH_PERIOD  # what the last push teaches is seen at the next update
        with progress_bar(self._console, self._stages()) as shown:
            bar = shown if self._live is None else self._live.watching(shown)
            builder = DiagramBuilder()
            player = builder.AddSystem(RecordingPlayer(self._recording.pushes))
            space = self._identifier.case.thetas.space
            system = builder.AddSystem(
                IdentificationSystem(self._learner(bar), dimension=space.dimension, nominal=space.nominal)
            )
            builder.Connect(player.GetOutputPort("push.measured"), system.GetInputPort("push.measured"))
            examiner = builder.AddSystem(DiagnosisSystem(lambda known: self._examined(known, bar), begin=last))
            identified = system.GetOutputPort("identification.estimated")
            builder.Connect(identified, examiner.GetInputPort("identification.estimated"))
            policy = None
            if self._planner is not None:
                planner = self._planner
                policy = builder.AddSystem(PolicySystem(
                    lambda examined: self._planned(planner, examined, bar), dimension=planner.dimension,
                    begin=last + PUSH_PERIOD,
                ))  # fmt: skip
                diagnosed = examiner.GetOutputPort("diagnosis.estimated")
                builder.Connect(diagnosed, policy.GetInputPort("identification.estimated"))
            simulator = Simulator(builder.Build())
            simulator.AdvanceTo(last + 2.0 * PUSH_PERIOD)
            root = simulator.get_context()
            examined = examiner.examined(examiner.GetMyContextFromRoot(root))
            plan = None if policy is None else policy.plan(policy.GetMyContextFromRoot(root))
        assert examined is not None
        return examined, plan, self._hindsight

    def model(self, examined: Examined) -> Model:
        """What a plan is made with: the baseline model, or what the diagnosis leaves."""
        if examined.evidence is not None:
            return model_of(examined.evidence)
        case = examined.known.case
        hand = HandUse.of(case.problems)
        return identified_model(examined.known, case.pool.spec, self._recording.name, hand=hand)

    def _learner(self, bar: Progress) -> Learner[Any]:
        """What learns from the pushes: from all at once, or from one after another."""
        scenario, recording = self._scenario, self._recording
        if not scenario.search.online:
            return BatchLearner(lambda _: self._identifier.run(bar), after=len(recording.pushes))
        return OnlineIdentifier(
            recording, cell=scenario.cell, theta=scenario.theta, search=scenario.search, seed=scenario.seed,
            progress=bar,
        )  # fmt: skip

    def _examined(self, known: Identification, bar: Progress) -> Examined:
        if self._scenario.search.online:
            bar("refit in the Drake cell", 0, 0)
            known = with_prior(in_the_cell(known))
        if not self._diagnosing:
            self._say(f"identified: {', '.join(e.name for e in known.estimates if e.identifiable)}")
            return Examined(known=known)
        diagnosis, evidence = diagnose_from(known, seed=self._scenario.seed, alpha=ALPHA, progress=bar)
        self._say(f"{diagnosis.verdict}: {diagnosis.sentence}")
        return Examined(known=evidence.known, diagnosis=diagnosis, evidence=evidence)

    def _planned(self, planner: Planner, examined: Examined, bar: Progress) -> Plan:
        """The plan with the model that leaves; what the baseline model's would have been, where that is another."""
        model, evidence, diagnosis = self.model(examined), examined.evidence, examined.diagnosis
        fit = examined.known.fit if evidence is None else evidence.corrected
        scatter, pushes = UNIT_SCATTER * fit.scatter, len(fit.pushes)
        plan = planner.with_model(model, friction_scatter=scatter, pushes=pushes, progress=bar)
        self._say(f"planned: miss {1e3 * plan.cost:.1f} mm")
        if diagnosis is not None:
            self._hindsight = self._with_plain(planner, examined, diagnosis, model, bar)
        return plan

    def _say(self, line: str) -> None:
        """Something was found."""
        if self._live is not None:
            self._live.found(line)

    def _stages(self) -> dict[str, float]:
        """The stages of this job, and how long each lasts beside the others."""
        stages = set(JOB_STAGES)
        if not self._diagnosing:
            stages -= set(DIAGNOSIS_STAGES) - set(IDENTIFICATION_STAGES)
        if self._planner is None:
            stages -= set(PLANNING_STAGES)
        return {name: lasts for name, lasts in JOB_STAGES.items() if name in stages}

    def _with_plain(
        self, planner: Planner, examined: Examined, diagnosis: Diagnosis, model: Model, bar: Progress
    ) -> Hindsight | None:
        caveat = caveat_of(diagnosis.verdict, {e.name: e.indistinguishable_from for e in diagnosis.effects})
        if not model.effects:
            return Hindsight(caveat=caveat) if caveat else None
        # Its own search and sweep are one stage of the job.
        plain = planner.run(examined.known, lambda _, done, total: bar(HINDSIGHT, done, total))
        return Hindsight(baseline=plain, outcome=outcome_under(plain, model), caveat=caveat)


def _show(result: Identification, recording: Recording, console: Console, *, alone: bool) -> None:
    """What was identified, and whether that is enough, unless a diagnosis is to say so."""
    console.print()
    console.print(estimates_table(result, recording.name))
    if result.cells is not None:
        console.print(cells_table(result.cells))
    console.print(accuracy_table(result))
    if alone:
        console.print(verdict(result))
    odd = (*doubts(recording), *warning_lines(recording))
    for line in odd[:MOST_WARNINGS]:
        console.print(f"warning: {line}", markup=False)
    if len(odd) > MOST_WARNINGS:
        console.print(f"{len(odd) - MOST_WARNINGS} more warnings: physid_drake inspect")
    pools = (result.case.pool, result.fitter.predictor.rollouts.pool)
    diverged, count = (sum(getattr(pool, name) for pool in pools) for name in ("diverged", "count"))
    if diverged:
        console.print(f"{diverged} of {count} rollouts diverged and count as failed.")


def _keep_plan(
    plan: Plan | None, scenario: Scenario, folder: RunFolder, *, hindsight: Hindsight | None, pages: Sequence[str]
) -> None:
    """Write the plan; an earlier one is dropped."""
    forget_plan(folder)
    if plan is not None:
        write_plan(folder, plan, seed=scenario.seed, hindsight=hindsight, pages=pages)


def _identifier(scenario: Scenario, recording: Recording, out: Path) -> Identifier:
    return Identifier(
        recording,
        cell=scenario.cell,
        theta=scenario.theta,
        search=scenario.search,
        seed=scenario.seed,
        state=out / BELIEF,
        most=scenario.pushes,
    )


def _planner(scenario: Scenario, recording: Recording, identifier: Identifier, console: Console) -> Planner | None:
    """What plans a push with an identification; None where nothing pushes, or no goal was asked for and none fits."""
    asked = scenario.plan.goal_m or scenario.plan.start_m
    try:
        if recording.hand is None:
            raise ConfigError("plan: no hand pushes in this recording.")
        return planner_of(
            scenario.plan, identifier.case.pool.spec, identifier.case.problems, recording.name, scenario.seed
        )
    except ConfigError as error:
        if asked:
            raise
        console.print(f"No push is planned: {error}")
        return None


def _keep_serving(live: Live | None, console: Console) -> None:
    if live is None or not (sys.stdin.isatty() and sys.stdout.isatty()):
        return
    console.print(f"The animation plays at {live.url}; press Enter to end.")
    sys.stdin.readline()


if __name__ == "__main__":
    sys.exit(main())
