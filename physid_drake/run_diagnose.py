"""The ``diagnose`` command: a recording in, ``diagnosis.json``, a page and ``model.yaml`` out."""

from __future__ import annotations

import argparse
import dataclasses as dc
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.text import Text

from physid_drake.diagnose import Diagnosis, Evidence, diagnose, model_of
from physid_drake.doctor.examination import FAR
from physid_drake.effects import effect_named
from physid_drake.errors import ConfigError
from physid_drake.pushes.case import Case, case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.kept_rollouts import KeptRollouts
from physid_drake.recording import digest_of, read_recording, recording_folder
from physid_drake.report.acts import acts_of, setting_of, unit_force_of
from physid_drake.report.diagnosis import (
    diagnosis_json,
    findings_table,
    fit_table,
    parameters_table,
    ranking_table,
    regime_table,
)
from physid_drake.report.diagnosis_page import MEANING, diagnosis_page, shown_pushes
from physid_drake.report.pages import DIAGNOSIS, INDEX, SCENE, index_page
from physid_drake.report.progress import DIAGNOSIS_STAGES, progress_bar
from physid_drake.report.scene_page import scene_page
from physid_drake.report.stage import Act
from physid_drake.report.terminal import terminal
from physid_drake.run_folder import SETTINGS, RunFolder, named_after, settings_text
from physid_drake.versions import versions

COMMAND = "diagnose"
STATE = "rollouts.bin"
PAGES = (INDEX, DIAGNOSIS, SCENE)
FILES = ("diagnosis.json", "model.yaml", *PAGES)
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
            console.print(f"resuming with {len(kept)} rollouts of the interrupted run")
        try:
            diagnosis, evidence = run_case(
                case, console, seed=arguments.seed, alpha=arguments.alpha, effects=arguments.effects, kept=kept
            )
        except KeyboardInterrupt:
            if len(kept):
                console.print("interrupted: the rollouts are kept, and the same command resumes from them")
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
    with progress_bar(console, DIAGNOSIS_STAGES) as progress:
        return diagnose(case, seed=seed, alpha=alpha, effects=effects, progress=progress, kept=kept)


def show(console: Console, diagnosis: Diagnosis, *, parameters: bool = True) -> None:
    """Print the diagnosis, with the parameters unless they were printed already."""
    console.print()
    p_value = f"p = {diagnosis.p_value:.2g}" if diagnosis.p_value > 0.0 else "p < 1e-300"
    console.print(Text.assemble((diagnosis.verdict, "bold"), f" ({p_value}). {diagnosis.sentence}"))
    if diagnosis.location is not None:
        console.print(f"Where: {diagnosis.location.statement}.")
    console.print(f"Remaining misfit: {diagnosis.left}.")
    if diagnosis.verdict == "unexplained" and diagnosis.reduced_chi2_before > FAR**2:
        console.print(
            "The baseline model is far off: `physid_drake inspect` tests whether a unit or convention is wrong."
        )
    for warning in diagnosis.warnings[:MOST_NOTES]:
        console.print(f"warning: {warning}.")
    if len(diagnosis.warnings) > MOST_NOTES:
        console.print(f"{len(diagnosis.warnings) - MOST_NOTES} more warnings in diagnosis.json and on the page.")
    if diagnosis.effects:
        console.print(findings_table(diagnosis))
    if parameters:
        console.print(parameters_table(diagnosis))
    console.print(fit_table(diagnosis))
    if diagnosis.fit.regimes:
        console.print(regime_table(diagnosis))
    console.print(ranking_table(diagnosis))
    push = diagnosis.next_push
    if push is not None:
        console.print(
            f"Next push: towards {push.direction_deg:.0f} deg at {push.speed_mps:.2g} m/s, {push.aim}, {push.start};"
            f" distinguishes the candidates with probability {push.settles_with_probability:.2f}."
        )


def write(
    folder: RunFolder, diagnosis: Diagnosis, evidence: Evidence, *, pages: Sequence[str] | None = None,
    planned: Sequence[Act] = (),
) -> None:  # fmt: skip
    """Write ``diagnosis.json``, the page, ``model.yaml`` and a scene of Meshcat that opens in any browser.

    Args:
        folder: where.
        diagnosis: what was found.
        evidence: and how.
        pages: of a folder whose index somebody else writes; None: these alone, and it is written here.
        planned: pushes that the scene plays after the recorded ones.

    Raises:
        OutputError: if one cannot be written.
    """
    pushes = shown_pushes(diagnosis, evidence)
    folder.forget("diagnosis.json")  # an earlier one's belongs to another model
    folder.write(
        DIAGNOSIS, diagnosis_page(diagnosis, evidence.case.recording, pushes, evidence.wrenches, pages=pages or PAGES)
    )
    folder.write("model.yaml", model_of(evidence).dump())
    folder.write(SCENE, diagnosis_scene(diagnosis, evidence, pages=pages or PAGES, planned=planned))
    if pages is None:
        lines = [diagnosis.sentence, f"{diagnosis.verdict.capitalize()}: {MEANING[diagnosis.verdict]}"]
        folder.write(INDEX, index_page(f"Diagnosis of {diagnosis.recording}", lines, FILES))
    folder.write("diagnosis.json", diagnosis_json(diagnosis))  # last: where it is, all is


def diagnosis_scene(
    diagnosis: Diagnosis, evidence: Evidence, *, pages: Sequence[str] = (), planned: Sequence[Act] = ()
) -> str:
    """``scene.html``: the pushes as recorded, as the baseline has them and as the model that leaves does.

    Args:
        diagnosis: what was found.
        evidence: and how.
        pages: that lie beside it.
        planned: pushes that are played after the recorded ones.
    """
    named = " and ".join(effect.name for effect in diagnosis.effects)
    return scene_page(
        setting_of(evidence.known, evidence), [*acts_of(evidence.known, evidence), *planned],
        name=diagnosis.recording, lines=[f"{diagnosis.verdict.capitalize()}. {diagnosis.sentence}"],
        corrected=f"with {named}" if named else "with an unnamed force",
        unit_force=unit_force_of(evidence), pages=pages,
    )  # fmt: skip
