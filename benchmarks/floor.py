"""How well held-out pushes can be predicted at best, and who could: floor.py PROOF_FOLDER [--worlds 20].

The proof's floor is what the true world leaves of pushes whose own friction it is not told. It is told the start of
the object exactly, which nobody is: a push may move its end by thirty times a difference of its start. Here the true
world also starts where the tracker saw the object before it moved, and so does the cell, told theta and the effects
("cell": what the cell, the recorded hand and the windows add). Where worlds are diagnosed, only those are taken.
"""

import argparse
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from physid_drake.effects.catalogue import effect_named
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.task import Task
from physid_drake.recording import read_recording
from physid_drake.validation.worlds.effects.catalogue import CATALOGUED, OTHERS
from physid_drake.validation.worlds.floor import floor_of
from physid_drake.validation.worlds.scene import draw_scene
from physid_drake.validation.worlds.strengths import simulate

STILL = 1e-5  # m, rad
ATTEMPTS = 4  # in which a world may have been drawn


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--worlds", type=int, default=20)
    given = parser.parse_args()
    answered = {path.parent.name for path in (given.folder / "diagnoses").glob("*/diagnosis.json")}
    seals = [s for s in sorted((given.folder / "sealed").glob("*.json")) if s.stem in answered or not answered]
    rows = [row_of(given.folder, seal) for seal in track(seals[: given.worlds], console=Console(stderr=True))]
    Console(width=120).print(table(rows))


def row_of(folder, seal):
    """Root mean square of the position [mm]: told the start, as tracked, and by the diagnosis if there is one."""
    truth = json.loads(seal.read_text())
    recording = read_recording(folder / "recordings" / truth["id"])
    scene = scene_of(truth)
    effects = [{**CATALOGUED, **OTHERS}[e["name"]](**tuples(e["parameters"])) for e in truth["effects"]]
    plain = tuple(replace(push, friction_factor=1.0) for push in scene.pushes)
    tracked = tuple(started(push, error) for push, error in zip(plain, start_errors(recording, truth), strict=True))
    told, seen = (left(scene, pushes, effects, recording) for pushes in (plain, tracked))
    found = folder / "diagnoses" / truth["id"] / "diagnosis.json"
    cell = math.nan if truth["kind"] == "other" else cells_error(recording, truth)
    after = math.nan
    if found.is_file():
        answer = json.loads(found.read_text())
        right = {e["name"] for e in answer["effects"]} == {e["name"] for e in truth["effects"]}
        after = 1e3 * answer["fit"]["held_out_rms_after_m"] if right else math.nan
    return truth["id"], ", ".join(e["name"] for e in truth["effects"]) or truth["kind"], told, seen, cell, after


def scene_of(truth):
    for attempt in range(ATTEMPTS):
        scene = draw_scene(np.random.default_rng([truth["seed"], truth["index"], 4, attempt]))
        if all(getattr(scene.plan, name) == truth["theta"][name] for name in ("mass", "support_friction")):
            return scene
    raise SystemExit(f"error: world {truth['id']} was drawn by another version.")


def tuples(parameters):
    return {k: tuple(map(tuple, v)) if isinstance(v, list) else v for k, v in parameters.items()}


def start_errors(recording, truth):
    """Per push (3,), what the tracker's noise makes of the mean pose before the object moves."""
    for push, poses in zip(recording.pushes, truth["noise_free_poses"].values(), strict=True):
        free = np.array(poses)
        moving = np.flatnonzero((np.abs(free - free[0]) > STILL).any(axis=1))
        rest = max(1, int(moving[0]) if len(moving) else len(free))
        error = push.object.planar[:rest] - free[:rest]
        error[:, 2] = (error[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
        yield error.mean(axis=0)


def started(push, error):
    return replace(push, pose=tuple(np.asarray(push.pose) + error))


def left(scene, pushes, effects, recording):
    """Root mean square of recorded less predicted positions [mm]."""
    expected = [motion.poses for motion in simulate(replace(scene, pushes=pushes), effects)]
    deviations = np.array([scene.noise.position, scene.noise.position, scene.noise.rotation])
    return 1e3 * floor_of(recording.pushes, expected, scene.rate, deviations)["position_m"]


def cells_error(recording, truth):
    """The same of the cell, told theta and the effects, but not each push's own friction and start [mm]."""
    case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=1)
    names, known = case.thetas.space.names, truth["theta"]
    theta = np.array([known.get(name, known["support_friction"]) for name in names])
    effects = tuple(effect_named(e["name"])(**tuples(e["parameters"])) for e in truth["effects"])
    tasks = [
        Task(problem=problem, theta=theta, nuisance=own, values=np.zeros(len(own.names)), effects=effects)
        for problem, own in zip(case.problems, case.nuisances, strict=True)
    ]
    predictions = case.pool.run(tasks)
    if any(prediction is None for prediction in predictions):
        return math.nan
    errors = [
        features.poses(features.recorded - features.of(prediction))[:, :2]
        for features, prediction in zip(case.features, predictions, strict=True)
    ]
    return 1e3 * math.sqrt(2.0 * np.mean(np.square(np.concatenate(errors))))


def table(rows):
    made = Table(title="error of held-out pushes in mm, and over that of the true model")
    errors = ("true world", "as tracked", "cell", "diagnosis")
    for column in ("world", "truth", *errors, *(f"{name} / true" for name in errors[1:])):
        made.add_column(column, justify="left" if column in ("world", "truth") else "right")
    for name, truth, *errors in rows:
        made.add_row(name, truth, *(shown(value) for value in (*errors, *(e / errors[0] for e in errors[1:]))))
    errors = np.array([row[2:] for row in rows]).T
    made.add_section()
    made.add_row("median", "", *(shown(np.nanmedian(c)) for c in (*errors, *errors[1:] / errors[0])))
    return made


def shown(value):
    return "" if math.isnan(value) else f"{value:.2f}"


if __name__ == "__main__":
    main()
