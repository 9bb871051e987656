"""The ``diagnose`` command: a recording in, ``diagnosis.json``, a page and ``model.yaml`` out."""

from __future__ import annotations

import argparse
import dataclasses as dc
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat
from rich.console import Console
from rich.text import Text

from physid_drake.diagnose import Diagnosis, Evidence, diagnose, model_of
from physid_drake.doctor.examination import FAR
from physid_drake.effects import effect_named
from physid_drake.errors import ConfigError
from physid_drake.pushes.case import Case, case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.kept_rollouts import KeptRollouts
from physid_drake.pushes.rollouts import simulate
from physid_drake.pushes.task import Task
from physid_drake.recording import digest_of, read_recording, recording_folder
from physid_drake.report.diagnosis import diagnosis_json, findings_table, fit_table, ranking_table, regime_table
from physid_drake.report.diagnosis_page import MEANING, diagnosis_page, shown_pushes
from physid_drake.report.pages import DIAGNOSIS, INDEX, SCENE, index_page
from physid_drake.report.progress import DIAGNOSIS_STAGES, progress_bar
from physid_drake.report.scene_page import scene_page
from physid_drake.report.stage import MOST_ARROW, ShownMotion, Stage
from physid_drake.report.terminal import terminal
from physid_drake.run_folder import SETTINGS, RunFolder, named_after, settings_text, versions

COMMAND = "diagnose"
STATE = "rollouts.bin"
PAGES = (INDEX, DIAGNOSIS, SCENE)
FILES = ("diagnosis.json", "model.yaml", *PAGES)
SHOWN = 12  # pushes in the animation
MOST_NOTES = 8  # on the terminal
ALPHA = 0.01  # false-alarm rate
LONGEST_STEP = 0.05  # s


def run(arguments: argparse.Namespace) -> int:
    """Run the command.

    Raises:
        PhysidError: one line that says what is wrong.
        KeyboardInterrupt: when interrupted; the rollouts that were made are kept.
    """
    if not 0.0 < arguments.alpha < 1.0:
        raise ConfigError(f"--alpha must be between 0 and 1, but is {arguments.alpha:g}.")
    if arguments.seed < 0:
        raise ConfigError(f"--seed must be at least 0, but is {arguments.seed}.")
    if arguments.time_step is not None and not 0.0 < arguments.time_step <= LONGEST_STEP:
        raise ConfigError(f"--time-step must be in (0, {LONGEST_STEP}] s, but is {arguments.time_step:g}.")
    if arguments.pushes < 1:
        raise ConfigError(f"--pushes must be at least 1, but is {arguments.pushes}.")
    if arguments.jobs < 0:
        raise ConfigError(f"--jobs must be at least 0, but is {arguments.jobs}.")
    for name in arguments.effects or ():
        effect_named(name)
    console = terminal()
    source = recording_folder(arguments.recording)
    recording = read_recording(source)
    config = cell_config(recording, contact=arguments.contact, time_step=arguments.time_step)
    case = case_of(recording, config, ThetaConfig(), jobs=arguments.jobs, most=arguments.pushes)
    settings = settings_text(COMMAND, {
        "seed": arguments.seed, "alpha": arguments.alpha, "effects": arguments.effects, "cell": dc.asdict(config),
        "pushes": arguments.pushes, "recording": digest_of(recording), "versions": versions(),
    })  # fmt: skip
    # Not the recording's name, which those that were converted from one data set share.
    out = arguments.out or Path("diagnoses") / named_after(source.resolve().name)
    RunFolder.check(out, COMMAND, recordings=[source])
    with RunFolder.open(out, COMMAND, settings, name=SETTINGS, state=(STATE,), results=FILES) as folder:
        kept = KeptRollouts(folder.own(STATE))
        if len(kept):
            console.print(f"going on with what was kept, rollouts: {len(kept)}")
        try:
            diagnosis, evidence = run_case(
                case, console, seed=arguments.seed, alpha=arguments.alpha, effects=arguments.effects, kept=kept
            )
        except KeyboardInterrupt:
            if len(kept):
                console.print("what was found is kept, and the same command goes on from there")
            raise
        write(folder, diagnosis, evidence)
        folder.forget(STATE)
    show(console, diagnosis)
    console.print(f"written: diagnosis.json, model.yaml and pages; open {folder.path / INDEX}")
    return 0


def run_case(
    case: Case,
    console: Console,
    *,
    seed: int,
    alpha: float,
    effects: Sequence[str] | None = None,
    kept: KeptRollouts | None = None,
) -> tuple[Diagnosis, Evidence]:
    """Diagnose with a progress bar."""
    with progress_bar(console, DIAGNOSIS_STAGES) as tick:
        return diagnose(case, seed=seed, alpha=alpha, effects=effects, tick=tick, kept=kept)


def show(console: Console, diagnosis: Diagnosis) -> None:
    """Print the diagnosis."""
    console.print()
    p_value = f"p = {diagnosis.p_value:.2g}" if diagnosis.p_value > 0.0 else "p < 1e-300"
    console.print(Text.assemble((diagnosis.verdict, "bold"), f" ({p_value}). {diagnosis.sentence}"))
    if diagnosis.location is not None:
        console.print(f"Where: {diagnosis.location.statement}.")
    console.print(f"Left over: {diagnosis.left}.")
    if diagnosis.verdict == "unexplained" and diagnosis.reduced_chi2_before > FAR**2:
        console.print("The baseline model misses by far: `physid_drake inspect` tries whether a convention is wrong.")
    for warning in diagnosis.warnings[:MOST_NOTES]:
        console.print(f"Note: {warning}.")
    if len(diagnosis.warnings) > MOST_NOTES:
        console.print(f"Note: {len(diagnosis.warnings) - MOST_NOTES} more in diagnosis.json and on the page.")
    if diagnosis.effects:
        console.print(findings_table(diagnosis))
    console.print(fit_table(diagnosis))
    if diagnosis.fit.regimes:
        console.print(regime_table(diagnosis))
    console.print(ranking_table(diagnosis))
    push = diagnosis.next_push
    if push is not None:
        console.print(
            f"Next push: towards {push.direction_deg:.0f} degrees at {push.speed_mps:.2g} m/s,"
            f" {push.aim}, {push.start}, would settle it with probability"
            f" {push.settles_with_probability:.2f}."
        )


def write(folder: RunFolder, diagnosis: Diagnosis, evidence: Evidence, *, pages: Sequence[str] | None = None) -> None:
    """Write ``diagnosis.json``, the page, ``model.yaml`` and a scene of Meshcat that opens in any browser.

    Args:
        folder: where.
        diagnosis: what was found.
        evidence: and how.
        pages: of a folder whose index somebody else writes; None: these alone, and it is written here.

    Raises:
        OutputError: if one cannot be written.
    """
    pushes = shown_pushes(diagnosis, evidence)
    folder.forget("diagnosis.json")  # an earlier one's belongs to another model
    folder.write(
        DIAGNOSIS, diagnosis_page(diagnosis, evidence.case.recording, pushes, evidence.wrenches, pages=pages or PAGES)
    )
    folder.write("model.yaml", model_of(evidence).dump())
    stage = staged(evidence).StaticHtml()
    folder.write(SCENE, scene_page(stage, diagnosis, evidence.wrenches, unit_force_of(evidence), pages or PAGES))
    if pages is None:
        lines = [diagnosis.sentence, f"{diagnosis.verdict.capitalize()}: {MEANING[diagnosis.verdict]}"]
        folder.write(INDEX, index_page(f"Diagnosis of {diagnosis.recording}", lines, FILES))
    folder.write("diagnosis.json", diagnosis_json(diagnosis))  # last: where it is, all is


def staged(evidence: Evidence, meshcat: Meshcat | None = None) -> Meshcat:
    """The pushes in Meshcat: recorded, and as the model that leaves has them, with what the plain cell lacks."""
    case, fit = evidence.case, evidence.leaving
    h, z = fit.hypothesis, fit.point.z
    stage = Stage(case.recording, meshcat)
    scenes = []
    for i in range(min(SHOWN, len(case.problems))):
        problem, nuisance = case.problems[i], case.nuisances[i]
        task = Task(
            problem=problem, theta=h.theta(z), nuisance=nuisance,
            values=np.zeros(len(nuisance.names)),  # nothing known of the pushes themselves
            effects=h.effects(z),
        )  # fmt: skip
        scenes.append(ShownMotion(push=case.recording.pushes[i], motion=simulate(case.pool.spec, case.thetas, task)))
    stage.play(scenes)
    stage.show_missing(evidence.wrenches, unit_force_of(evidence))
    return stage.meshcat


def unit_force_of(evidence: Evidence) -> float:
    """The force whose arrow has unit length [N]: a tenth of the friction, more where more is surely missing."""
    around, sure = evidence.case.around, [w for w in evidence.wrenches if w.stands_out]
    strongest = max((math.hypot(*w.wrench[:2]) for w in sure), default=0.0)
    return max(0.1 * around.friction * around.weight, strongest / MOST_ARROW)
