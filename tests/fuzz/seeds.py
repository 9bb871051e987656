"""Valid inputs, as small as they can be, from which all others are made."""

from __future__ import annotations

import io
import json
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from physid_drake.recording import Push, Recording, read_recording, write_recording
from physid_drake.resources import shipped

Files = dict[str, bytes]
"""Contents by name within a folder."""

CUBE = """\
v -0.05 -0.03 -0.015
v 0.05 -0.03 -0.015
v 0.05 0.03 -0.015
v -0.05 0.03 -0.015
v -0.05 -0.03 0.015
v 0.05 -0.03 0.015
v 0.05 0.03 0.015
v -0.05 0.03 0.015
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""
SHAPES: tuple[dict[str, Any], ...] = (
    {"shape": "box", "size_m": [0.127, 0.051, 0.03]},
    {"shape": "cylinder", "radius_m": 0.04, "length_m": 0.03, "axis": "z"},
    {"shape": "cylinder", "radius_m": 0.015, "length_m": 0.08, "axis": "y"},
    {"shape": "prism", "polygon_m": [[-0.05, -0.03], [0.07, -0.03], [-0.02, 0.06]], "height_m": 0.03},
    {"shape": "mesh", "file": "meshes/cube.obj", "scale": 1.0},
)
HANDS: tuple[dict[str, Any] | None, ...] = (
    {"tip": "cylinder", "radius_m": 0.01, "length_m": 0.06, "stream": "measured"},
    {"tip": "sphere", "radius_m": 0.01, "stream": "commanded"},
    {"tip": "capsule", "radius_m": 0.01, "length_m": 0.06, "stream": "measured"},
    {"tip": "reflex_sf", "stream": "measured"},
)
SENSORS = {
    "object_position_std_m": 3e-4,
    "object_rotation_std_rad": 3e-3,
    "hand_position_std_m": 1e-4,
    "force_std_n": 0.02,
}


@cache
def recording() -> Files:
    """Two of the shipped pushes, some sixty rows each, one with forces, as the files of a folder."""
    whole = read_recording(shipped("recordings") / "eraser_reference").subset(range(2))
    pushes = [_thinner(push) for push in whole.pushes]
    small = replace(whole, pushes=tuple(pushes))
    with tempfile.TemporaryDirectory() as scratch:
        write_recording(small, Path(scratch) / "r")
        files = {
            one: (Path(scratch) / "r" / one).read_bytes() for one in ("recording.yaml", *(p.name for p in pushes))
        }
    with_force = files[pushes[0].name].decode().splitlines()
    lines = [f"{with_force[0]},force_x_n,force_y_n,force_z_n", *(f"{line},0.1,0.02,0" for line in with_force[1:])]
    files[pushes[0].name] = ("\n".join(lines) + "\n").encode()
    return {**files, "meshes/cube.obj": CUBE.encode()}


def _thinner(push: Push) -> Push:
    def some(stream: Any) -> Any:
        kept = slice(None, None, 2)
        return replace(stream, times=stream.times[kept], positions=stream.positions[kept],
                       quaternions=stream.quaternions[kept])  # fmt: skip

    return replace(push, object=some(push.object), hand=some(push.hand))


@cache
def description() -> dict[str, Any]:
    """What ``recording.yaml`` says."""
    found: dict[str, Any] = yaml.safe_load(recording()["recording.yaml"])
    return {**found, "sensors": SENSORS}


def lay(folder: Path, files: Files) -> Path:
    """Write the files of a folder."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def read_small() -> Recording:
    """The recording of ``recording``, read."""
    with tempfile.TemporaryDirectory() as scratch:
        return read_recording(lay(Path(scratch), recording()))


@cache
def model() -> dict[str, Any]:
    """What ``model.yaml`` says of a tilted table."""
    from plans import TILTED

    found: dict[str, Any] = yaml.safe_load(TILTED.dump())
    return found


@cache
def belief() -> bytes:
    """A belief's file after six trials."""
    from physid_drake.belief import Belief
    from physid_drake.space import Parameter, ParameterSpace

    space = ParameterSpace(parameters=(
        Parameter(name="mass", unit="kg", lower=0.1, upper=2.0, prior_mean=0.5, scale="log"),
        Parameter(name="friction", unit="-", lower=0.1, upper=1.0, prior_mean=0.3, prior_std=0.1),
    ))  # fmt: skip
    candidates = space.sample(np.random.default_rng(1), 12, from_prior=False)
    made = Belief.start(space, candidates, np.random.default_rng(0))
    made = made.update(candidates[:6], [*np.sum(candidates[:5], axis=1), np.inf], np.random.default_rng(1))
    with tempfile.TemporaryDirectory() as scratch:
        made.to_npz(Path(scratch) / "belief.npz")
        return (Path(scratch) / "belief.npz").read_bytes()


@cache
def rollouts() -> bytes:
    """A file of kept rollouts."""
    from physid_drake.pushes.kept_rollouts import KeptRollouts, key_of
    from physid_drake.pushes.prediction import Prediction

    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch) / "rollouts.bin"
        kept = KeptRollouts(file)
        for k in range(3):
            said = Prediction(poses=np.full((4, 3), 0.1 * k), forces=np.zeros((2, 2)), fell=False)
            kept.keep({key_of(k): said, key_of(-1 - k): None})
        return file.read_bytes()


def diagnosis() -> dict[str, Any]:
    """What is read of ``diagnosis.json``."""
    parameter = {"value": 0.42, "unit": "N*s/m", "ci90": [0.38, 0.46], "null": 0.0}
    effect = {"name": "viscous_drag", "indistinguishable_from": ["quadratic_drag"], "probability": 0.9,
              "parameters": {"coefficient": parameter}}  # fmt: skip
    theta = {"support_friction": {"value": 0.303, "ci90": [0.298, 0.308]}, "mass": {"value": None, "ci90": None}}
    fit = {"held_out_rms_before": 5.0, "held_out_rms_after": 1.1, "per_push": [{"name": "1"}, {"name": "2"}]}
    return {"format": "physid-diagnosis/1", "verdict": "explained", "effects": [effect], "fit": fit, "theta": theta,
            "reduced_chi2_after": 1.0, "friction_scatter": 0.03, "pushes": 12}  # fmt: skip


def result() -> dict[str, Any]:
    """What is read of ``result.json``."""
    pushes = {"pushes": ["001.csv", "002.csv", "003.csv"]}
    return {"format": "physid-result/1", "friction_scatter": 0.02, "training": pushes, "held_out": pushes}


def truth(name: str) -> dict[str, Any]:
    """What was sealed of a world."""
    effects = [{"name": "viscous_drag", "parameters": {"coefficient": 0.4}}]
    return {"id": name, "kind": "effect", "effects": effects, "size_sigma": 8.0,
            "theta": {"support_friction": 0.3, "mass": 0.25}, "held_out_floor": {"rms": 1.0}}  # fmt: skip


def npz(arrays: dict[str, Any], *, packed: bool = False) -> bytes:
    """Arrays as the bytes of an npz file."""
    stream = io.BytesIO()
    (np.savez_compressed if packed else np.savez)(stream, **arrays)
    return stream.getvalue()


def tosses() -> dict[str, Any]:
    """Two tosses of a cube that end in a slide."""
    rows = []
    for number in range(2):
        one = np.zeros((50, 13))
        along = np.linspace(0.0, 1.0, 50)
        one[:, 0] = 0.08 * along * (2.0 - along)
        one[:, 1], one[:, 2], one[:, 3] = 0.01 * number, 0.0524, 1.0
        rows.append(one)
    return {"traj": np.concatenate(rows), "length": np.array([50, 50])}


@cache
def log() -> bytes:
    """A log of the CMU pushes with one push."""
    yaw, rows = 0.5, 40
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    half = f"{np.cos(yaw / 2):.9f} 0 0 {np.sin(yaw / 2):.9f}"
    corner = np.array([600.0, 20.0])
    times = 1439922972.0 + 0.1 * np.arange(rows)
    along = -2.5 + 0.25 * np.arange(rows)
    tool = corner + np.column_stack([along, np.full(rows, 50.0)]) @ turn.T
    after = corner + turn @ [along[-1] + 2.5 * 0.33, 0.0]
    lines = ["1", f"{corner[0]} {corner[1]} 9.0 {half}", f"{after[0]} {after[1]} 9.0 {half}", str(rows)]
    lines += [f"{t:.3f} {-2.0 * (k > 12) + 0.3:.3f} {-0.2:.3f}" for k, t in enumerate(times)]
    lines += [str(rows), *(f"{t:.3f} {x:.4f} {y:.4f} 21.0 {half}" for t, (x, y) in zip(times, tool, strict=True))]
    return ("\n".join(lines) + "\n").encode()


def raw_push() -> dict[str, Any]:
    """The streams of a raw push of the MIT dataset."""
    clock = 1.5e9 + 0.02 * np.arange(40)
    tip = 0.3 - 0.045 - 0.00475 - 0.004 + 0.0008 * np.arange(40)
    moved = np.maximum(0.0, tip - tip[5])
    zero = np.zeros(40)
    return {
        "tip_pose": np.column_stack([clock, tip, zero, zero]).tolist(),
        "object_pose": np.column_stack([clock, 0.3 + moved, zero, zero]).tolist(),
        "ft_wrench": np.column_stack([clock, -2.0 * (moved > 0.0), zero, zero]).tolist(),
    }


END_POINTS = (
    "start_object_x_m,start_object_y_m,start_object_yaw_rad,end_object_x_m,end_object_y_m,end_object_yaw_rad,"
    "start_tip_x_m,start_tip_y_m,end_tip_x_m,end_tip_y_m\n0.3,0,3.1,0.33,0,-3.1,0.2,0,0.25,0\n"
    "0.31,0.01,0.1,0.33,0,0.2,0.2,0,0.25,0\n"
)


@cache
def configurations() -> dict[str, dict[str, Any]]:
    """The shipped configurations, read."""
    found = {file.name: yaml.safe_load(file.read_text()) for file in sorted(shipped("configs").glob("*.yaml"))}
    return json.loads(json.dumps(found))
