"""``prove --real``: recordings of others' robots, diagnosed without what is known about them, then opened."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from physid_drake.cell import Outcome
from physid_drake.errors import ConfigError, ParameterError, PhysidError
from physid_drake.model import ModelCell
from physid_drake.model_reading import load_model
from physid_drake.pushes.noise import noise_of
from physid_drake.pushes.problem import PushProblem, problems_of
from physid_drake.recording import MeshShape, read_recording
from physid_drake.report.svg import drawn, png_of
from physid_drake.report.terminal import terminal
from physid_drake.run_folder import RunFolder
from physid_drake.validation.report.real import pressure_picture, real_json, real_markdown, real_table
from physid_drake.validation.run_prove import Commander, check_running, claim, ended_softly, run_tasks
from physid_drake.validation.scoring.real import RealCase, chosen_cases, prepare
from physid_drake.validation.scoring.real_score import RealOutcome, real_outcome
from physid_drake.validation.sealing.diagnosing import DIAGNOSE, FRESH_ERRORS, Task, attempt_of, diagnose_command
from physid_drake.validation.worlds.shapes import height_of

PUSHES, LEAST_PUSHES = 20, 3


def run_real(arguments: argparse.Namespace, command: Commander = diagnose_command) -> int:
    """Run the command on what is in ``arguments.real``.

    Raises:
        PhysidError: one line that says what is wrong.
        KeyboardInterrupt: when interrupted; all that is finished is kept.
    """
    published: Path = arguments.real
    if not published.is_dir():
        raise ConfigError(f"--real '{published}': there is no such folder.")
    pushes = PUSHES if arguments.pushes is None else int(arguments.pushes)
    if pushes < LEAST_PUSHES:
        raise ConfigError(f"--pushes must be at least {LEAST_PUSHES}, but is {pushes}.")
    check_running(arguments)
    cases = chosen_cases(arguments.only)
    seed = 0 if arguments.seed is None else int(arguments.seed)
    out: Path = arguments.out or Path("proofs") / "real"
    console = terminal()
    with claim(out, {"real": True, "seed": seed, "pushes": pushes}) as folder, ended_softly():
        for name in ("recordings/", "held_out/", "diagnoses/"):
            folder.own(name)
        reasons = {c.name: prepare(c, published, out, pushes=pushes, seed=seed) for c in cases}
        there = [case for case in cases if reasons[case.name] is None]
        hidden = (published, out / "held_out")
        tasks = [_task(case, out, command, hidden, pushes) for case in there]
        run_tasks(tasks, arguments, console)
        _measure_fresh(there, out)
        outcomes = [
            real_outcome(case, published, out)
            if reasons.get(case.name) is None
            else RealOutcome(case=case, skipped=f"skipped: {reasons[case.name]}")
            for case in chosen_cases(None)
            if case in cases or attempt_of(out / "diagnoses" / case.id) is not None
        ]
        _write(folder, outcomes)
    console.print(real_table(outcomes))
    console.print(f"written: {out / 'real.md'}, {out / 'real.json'}", soft_wrap=True)
    return 0


def _task(case: RealCase, out: Path, command: Commander, hidden: tuple[Path, Path], pushes: int) -> Task:
    """A case to be diagnosed, on all of its pushes: a diagnosis takes fewer by itself."""
    given, folder = out / "recordings" / case.id, out / "diagnoses" / case.id
    return Task(name=case.id, words=(*command(given, folder, *hidden), "--pushes", str(pushes)), folder=folder)


def _measure_fresh(cases: Sequence[RealCase], out: Path) -> None:
    """End-point errors of each diagnosis's model on pushes that it did not get, once."""
    for case in cases:
        diagnosis, held = out / "diagnoses" / case.id, out / "held_out" / case.id
        file = diagnosis / FRESH_ERRORS
        attempt = attempt_of(diagnosis)
        if file.exists() or attempt is None or attempt.error is not None or not any(held.iterdir()):
            continue
        try:
            errors = fresh_errors(diagnosis, held)
        except PhysidError:
            continue  # a model that cannot run leaves a dash in the table
        position, rotation = (float(np.sqrt(np.mean(np.square(column)))) for column in errors.T)
        RunFolder.begin(diagnosis, DIAGNOSE).write(
            FRESH_ERRORS, json.dumps({"position_m": position, "rotation_rad": rotation, "pushes": len(errors)}) + "\n"
        )


def fresh_errors(diagnosis: Path, held: Path) -> np.ndarray:
    """End-point errors (n, 2) [m, rad] of a model on a recording's pushes.

    Nothing tells where these pushes were among the others: a friction that drifts is that of the first push.

    Args:
        diagnosis: folder with ``model.yaml``.
        held: folder of the recording.

    Raises:
        PhysidError: if the model or the recording cannot be read, or a rollout diverges.
    """
    recording = read_recording(held)
    shape = recording.object.shape
    if isinstance(shape, MeshShape):
        raise ConfigError("a mesh has no height of its own here.")
    cell = load_model(diagnosis).build()
    problems = problems_of(recording, noise_of(recording), height_of(shape))
    return np.array([_end_error(cell, problem) for problem in problems])


def _end_error(cell: ModelCell, problem: PushProblem) -> tuple[float, float]:
    motion = cell.rollout(
        start=problem.start, path=problem.path, begin=problem.begin, end=problem.end,
        hand_height=problem.hand_height, hand_axes=problem.hand_axes,
    )  # fmt: skip
    if motion.outcome is Outcome.DIVERGED:
        raise ParameterError(f"push {problem.name}: the model's rollout diverges.")
    dx, dy, turn = (cell.tracked(motion, problem.times[-1:])[0] - problem.poses[-1]).tolist()
    return math.hypot(dx, dy), (turn + math.pi) % (2.0 * math.pi) - math.pi


def _write(folder: RunFolder, outcomes: Sequence[RealOutcome]) -> None:
    folder.write("real.md", real_markdown(outcomes))
    folder.write("real.json", real_json(outcomes))
    for outcome in outcomes:
        if outcome.pressure is None:
            continue
        with drawn():
            picture = png_of(pressure_picture(outcome.pressure, outcome.case.name))
        folder.write_bytes(f"pressure_{outcome.case.name}.png", picture)
