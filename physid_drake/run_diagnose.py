"""The ``diagnose`` command: a recording in, ``diagnosis.json``, a page and ``model.yaml`` out."""

from __future__ import annotations

import argparse
import dataclasses as dc
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat
from rich.console import Console

from physid_drake.cell import CellConfig
from physid_drake.diagnose import Case, Diagnosis, Evidence, case_of, diagnose
from physid_drake.diagnose.estimates import correlation_of
from physid_drake.diagnose.memory import Memory
from physid_drake.diagnose.model import Fitted
from physid_drake.effects import effect_named
from physid_drake.errors import ConfigError
from physid_drake.identify.config import ThetaConfig
from physid_drake.identify.rollouts import simulate
from physid_drake.model import Correlation, Model
from physid_drake.recording import Recording, read_recording
from physid_drake.report.diagnosis import diagnosis_json, findings_table, fit_table, ranking_table, regime_table
from physid_drake.report.diagnosis_page import ShownPush, diagnosis_page
from physid_drake.report.progress import progress_bar
from physid_drake.report.stage import Scene, Stage
from physid_drake.resources import shipped
from physid_drake.run_folder import RunFolder

STATE = "stages.npz"
SHOWN = 12  # pushes in the animation
ALPHA = 0.01  # false-alarm rate
LONGEST_TICK = 2e-2  # s, for slow pushes: within 0.08 mm and 0.6 mrad of ticks of 1 ms (benchmarks/slow_pushes.py)


def run(arguments: argparse.Namespace) -> int:
    """Run the command.

    Raises:
        PhysidError: one line that says what is wrong.
        KeyboardInterrupt: when interrupted; the stages that were done are kept.
    """
    if not 0.0 < arguments.alpha < 1.0:
        raise ConfigError(f"--alpha must be between 0 and 1, but is {arguments.alpha:g}.")
    if arguments.seed < 0:
        raise ConfigError(f"--seed must be at least 0, but is {arguments.seed}.")
    if arguments.pushes < 1:
        raise ConfigError(f"--pushes must be at least 1, but is {arguments.pushes}.")
    for name in arguments.effects or ():
        effect_named(name)
    console = Console()
    recording = read_recording(recording_folder(arguments.recording))
    config = cell_config(recording, arguments.contact, arguments.time_step)
    case = case_of(recording, config, ThetaConfig(), jobs=arguments.jobs, most=arguments.pushes)
    settings = {"seed": arguments.seed, "alpha": arguments.alpha, "effects": arguments.effects,
                "cell": dc.asdict(config), "recording": recording.name, "pushes": _fingerprint(case)}  # fmt: skip
    out = arguments.out or Path("diagnoses") / recording.name
    folder = RunFolder.open(out, json.dumps(settings, indent=2) + "\n", name="settings.json", state=STATE)
    diagnosis, evidence = run_case(
        case, console, seed=arguments.seed, alpha=arguments.alpha, effects=arguments.effects,
        memory=Memory(folder.path / STATE),
    )  # fmt: skip
    write(folder, diagnosis, evidence)
    folder.forget(STATE)
    show(console, diagnosis)
    console.print(f"written: diagnosis.json, page.html, scene.html and model.yaml in {folder.path}")
    return 0


def run_case(
    case: Case,
    console: Console,
    *,
    seed: int,
    alpha: float,
    effects: Sequence[str] | None = None,
    memory: Memory | None = None,
) -> tuple[Diagnosis, Evidence]:
    """Diagnose with a progress bar."""
    with progress_bar(console) as tick:
        return diagnose(case, seed=seed, alpha=alpha, effects=effects, tick=tick, memory=memory)


def recording_folder(text: str) -> Path:
    """A folder, or a recording that ships with the project."""
    path = Path(text)
    if not path.exists() and path.parent == Path() and (shipped("recordings") / text).is_dir():
        return shipped("recordings") / text
    return path


def cell_config(recording: Recording, contact: str, time_step: float | None) -> CellConfig:
    """The cell's configuration: ticks of 1 ms, longer where the hand is slow.

    Raises:
        ConfigError: if the time step is not in (0, 0.05] s.
    """
    if time_step is not None and not 0.0 < time_step <= 0.05:
        raise ConfigError(f"--time-step must be in (0, 0.05] s, but is {time_step:g}.")
    config = CellConfig()
    config.contact.model = contact
    config.solver.time_step_s = time_step or _tick(recording)
    config.solver.slide_time_step_s = max(config.solver.slide_time_step_s, config.solver.time_step_s)
    if time_step is not None:
        config.solver.slide_time_step_s = min(0.05, 2.0 * time_step)
    return config


def _tick(recording: Recording) -> float:
    """1 ms; longer where the hand goes less than a tenth of a millimetre in it."""
    fastest = 0.0
    for push in recording.pushes:
        if push.hand is None or len(push.hand) < 3:
            return 1e-3
        steps = np.linalg.norm(np.diff(push.hand.positions[:, :2], axis=0), axis=1)
        fastest = max(fastest, float(np.quantile(steps / np.diff(push.hand.times), 0.95)))
    return float(np.clip(1e-4 / max(fastest, 1e-6), 1e-3, LONGEST_TICK)) if fastest < 0.03 else 1e-3


def _fingerprint(case: Case) -> list[float]:
    """What tells one recording from another: the sum of each push's poses."""
    return [float(p.poses.sum() + p.times.sum()) for p in case.problems]


def show(console: Console, diagnosis: Diagnosis) -> None:
    """Print the diagnosis."""
    console.print()
    p_value = f"p = {diagnosis.p_value:.2g}" if diagnosis.p_value > 0.0 else "p < 1e-300"
    console.print(f"[bold]{diagnosis.verdict}[/bold] ({p_value}). {diagnosis.sentence}")
    if diagnosis.location is not None:
        console.print(f"Where: {diagnosis.location.statement}.")
    console.print(f"Left over: {diagnosis.left}.")
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
            f" {1e3 * push.contact_offset_m:.0f} mm off the middle, would settle it with probability"
            f" {push.settles_with_probability:.2f}."
        )


def write(
    folder: RunFolder, diagnosis: Diagnosis, evidence: Evidence, *, page: str = "page.html", scene: str = "scene.html"
) -> None:
    """Write ``diagnosis.json``, the page, ``model.yaml`` and a scene of Meshcat that opens in any browser.

    Raises:
        OutputError: if one cannot be written.
    """
    folder.write("diagnosis.json", diagnosis_json(diagnosis))
    pushes = shown_pushes(diagnosis, evidence)
    folder.write(page, diagnosis_page(diagnosis, evidence.case.recording, pushes, evidence.wrenches, scene=scene))
    folder.write("model.yaml", model_of(diagnosis, evidence).dump())
    folder.write(scene, staged(diagnosis, evidence).StaticHtml())


def staged(diagnosis: Diagnosis, evidence: Evidence, meshcat: Meshcat | None = None) -> Meshcat:
    """The pushes in Meshcat: recorded, and as the model that leaves has them, with what the plain cell lacks."""
    case, state = evidence.case, model_that_leaves(diagnosis, evidence).state
    stage = Stage(case.recording, meshcat)
    scenes = []
    for i in range(min(SHOWN, len(case.problems))):
        task = evidence.fitter.task(state, i, own=0.0 * state.own[i])
        scenes.append(Scene(push=case.recording.pushes[i], motion=simulate(case.pool.spec, case.thetas, task)))
    stage.play(scenes)
    stage.show_missing(evidence.wrenches, unit_force=0.1 * case.around.friction * case.around.weight)
    return stage.meshcat


def shown_pushes(diagnosis: Diagnosis, evidence: Evidence) -> list[ShownPush]:
    """All pushes, recorded and as the models before and after have them."""
    case = evidence.case
    pushes = []
    for i, problem in enumerate(case.problems):
        features = case.features[i]
        pushes.append(
            ShownPush(
                name=problem.name,
                times=features.middles,
                recorded=features.poses(features.recorded),
                before=features.poses(_predicted(evidence.nearest, i, features.recorded)),
                after=(
                    features.poses(_predicted(evidence.final, i, features.recorded)) if diagnosis.effects else None
                ),
                released=next(
                    (w.start for w in evidence.wrenches if w.push == i and w.phase == "free_slide"), None
                ),
            )
        )  # fmt: skip
    return pushes


def _predicted(fitted: Fitted, i: int, recorded: np.ndarray) -> np.ndarray:
    """Features that a model predicts with the push's own unknowns at zero, and without the diagnosis' tolerances."""
    push, own = fitted.pushes[i], fitted.own_dimension
    return np.asarray(recorded - push.residual + push.shared[:, :own] @ fitted.solution.beta[:own])


def model_that_leaves(diagnosis: Diagnosis, evidence: Evidence) -> Fitted:
    """The fit with the effects if they were found, else the plain cell where it predicts best."""
    return evidence.final if diagnosis.effects else evidence.nearest


def model_of(diagnosis: Diagnosis, evidence: Evidence) -> Model:
    """The model that leaves: with the effects if they were found, else plain."""
    case = evidence.case
    fitted = model_that_leaves(diagnosis, evidence)
    state, spec = fitted.state, case.pool.spec
    intervals: dict[str, object] = {
        f"theta.{name}": list(t.ci90) for name, t in diagnosis.theta.items() if t.ci90 is not None
    }
    for effect in diagnosis.effects:
        intervals |= {f"{effect.name}.{name}": p.ci90 for name, p in effect.parameters.items()}
    names, matrix = correlation_of(case, fitted)
    kept = [k for k, name in enumerate(names) if name in intervals]
    return Model(
        recording=case.recording.name,
        shape=spec.shape,
        hand_radius=spec.hand_radius,
        table=spec.table,
        config=spec.config,
        body=case.thetas.body(np.asarray(case.thetas.space.from_unit(state.u))),
        effects=tuple(e.effect(case) for e in state.effects) if diagnosis.effects else (),
        intervals=intervals,
        correlation=Correlation.of([names[k] for k in kept], matrix[np.ix_(kept, kept)]),
    )
