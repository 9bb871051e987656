"""Writes a recording as a folder in the format ``physid-recording/1``, whole or not at all."""

from __future__ import annotations

import csv
import dataclasses
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

import numpy as np
import yaml

from physid_drake.errors import OutputError
from physid_drake.files import read_bytes
from physid_drake.recording.description import DESCRIPTION_FILE, FORMAT
from physid_drake.recording.object_model import Box, Cylinder, MeshShape, ObjectModel, Prism
from physid_drake.recording.reading import (
    FORCE,
    HAND_POSITION,
    HAND_QUATERNION,
    OBJECT_POSITION,
    OBJECT_QUATERNION,
    OBJECT_YAW,
    TIME,
    YAW_DIGITS,
)
from physid_drake.recording.values import Hand, PoseStream, Push, Recording, Sensors
from physid_drake.recording.yaml_lines import Dumper
from physid_drake.wording import cause_of, shown


def write_recording(recording: Recording, folder: Path) -> None:
    """Writes a recording; reading the folder again gives an equal one, unless screening leaves samples out.

    A push whose name is not a ``.csv`` path goes to ``pushes/<name>.csv``. A mesh is copied into the folder
    as the one file it is; materials and textures it refers to are not.

    Args:
        recording: what to write.
        folder: a folder that does not exist yet, or is empty.

    Raises:
        OutputError: if the folder holds something, cannot be written, or a push's name is no path within it.
    """
    folder = Path(folder)
    try:
        if folder.is_symlink() or (folder.exists() and not (folder.is_dir() and not any(folder.iterdir()))):
            raise OutputError(f"{folder}: exists and is not an empty folder; choose another or remove it.")
        files = _push_files(recording)
        folder.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
        try:
            _write_into(recording, files, staging)
            staging.chmod(0o755)
            # Renaming onto an empty folder is atomic; onto one that was filled meanwhile it fails.
            staging.rename(folder)
        finally:
            if staging.exists():
                shutil.rmtree(staging, ignore_errors=True)
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {cause_of(error)}.") from error


def _write_into(recording: Recording, files: list[str], staging: Path) -> None:
    for push, file in zip(recording.pushes, files, strict=True):
        path = staging / file
        path.parent.mkdir(parents=True, exist_ok=True)
        _write_push(push, path)
    description = _describe(recording, files, staging)
    text = yaml.dump(
        description, Dumper=Dumper, sort_keys=False, allow_unicode=True, default_flow_style=None, width=100
    )
    (staging / DESCRIPTION_FILE).write_text(text, encoding="utf-8")


def _push_files(recording: Recording) -> list[str]:
    files = []
    for push in recording.pushes:
        name = push.name if push.name.endswith(".csv") else f"pushes/{push.name}.csv"
        path = PurePosixPath(name)
        if path.is_absolute() or ".." in path.parts or "\\" in name or "\0" in name or str(path) in files:
            raise OutputError(
                f"push {shown(push.name)}: cannot be a file of its own within a folder; rename the push."
            )
        files.append(str(path))
    return files


def _write_push(push: Push, path: Path) -> None:
    columns: list[str] = [TIME]
    rows: dict[float, dict[str, float]] = {}
    if push.hand is not None:
        columns += _add_poses(rows, push.hand, HAND_POSITION, HAND_QUATERNION)
    columns += _add_poses(rows, push.object, OBJECT_POSITION, OBJECT_QUATERNION)
    if push.force is not None:
        columns += FORCE
        for time, force in zip(push.force.times, push.force.forces, strict=True):
            rows.setdefault(float(time), {}).update(zip(FORCE, force, strict=True))
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        for time in sorted(rows):
            row = rows[time]
            writer.writerow([repr(time), *(repr(float(row[c])) if c in row else "" for c in columns[1:])])


def _add_poses(
    rows: dict[float, dict[str, float]], stream: PoseStream, position: Sequence[str], quaternion: Sequence[str]
) -> list[str]:
    """The columns of a stream, filled in: of its rotation, only what was measured."""
    columns, values = [*position], stream.positions
    if stream.rotation == "full":
        columns += quaternion
        values = np.column_stack([values, stream.quaternions])
    elif stream.rotation == "yaw":
        columns.append(OBJECT_YAW)
        # Within one turn, as the reader takes it: how many were made over a gap is a guess, and may be very many.
        values = np.column_stack([values, np.round(stream.headings, YAW_DIGITS)])
    for time, row in zip(stream.times, values, strict=True):
        rows.setdefault(float(time), {}).update(zip(columns, row, strict=True))
    return columns


def _describe(recording: Recording, files: list[str], staging: Path) -> dict[str, object]:
    described: dict[str, object] = {
        "format": FORMAT,
        "name": recording.name,
        "description": recording.description,
        "object": _describe_object(recording.object, recording.folder, staging),
        "table": {"size_m": _floats(recording.table.size), "centre_m": _floats(recording.table.centre)},
    }
    if recording.hand is not None:
        described["hand"] = _describe_hand(recording.hand)
    sensors = _describe_sensors(recording.sensors)
    if sensors:
        described["sensors"] = sensors
    described["pushes"] = [
        {"file": file, "note": push.note} if push.note else {"file": file}
        for push, file in zip(recording.pushes, files, strict=True)
    ]
    if recording.conversion is not None:
        described["converted"] = dataclasses.asdict(recording.conversion)
    return described


def _describe_object(model: ObjectModel, folder: Path | None, staging: Path) -> dict[str, object]:
    described: dict[str, object] = {}
    shape = model.shape
    if isinstance(shape, Box):
        described = {"shape": "box", "size_m": _floats(shape.size)}
    elif isinstance(shape, Cylinder):
        radius, length = float(shape.radius), float(shape.length)
        described = {"shape": "cylinder", "radius_m": radius, "length_m": length, "axis": shape.axis}
    elif isinstance(shape, Prism):
        polygon = [_floats(vertex) for vertex in shape.polygon]
        described = {"shape": "prism", "polygon_m": polygon, "height_m": float(shape.height)}
    else:
        described = {"shape": "mesh", "file": _copy_mesh(shape, folder, staging), "scale": float(shape.scale)}
    if model.mass is not None and model.mass_std is not None:
        described |= {"mass_kg": float(model.mass), "mass_std_kg": float(model.mass_std)}
    return described


def _copy_mesh(shape: MeshShape, folder: Path | None, staging: Path) -> str:
    root = folder.resolve() if folder is not None else None
    within = root is not None and shape.file.is_relative_to(root)
    relative = shape.file.relative_to(root) if within and root is not None else Path("meshes") / shape.file.name
    target = staging / relative
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(read_bytes(shape.file))
    return relative.as_posix()


def _describe_hand(hand: Hand) -> dict[str, object]:
    described: dict[str, object] = {"tip": hand.tip, "radius_m": float(hand.radius)}
    if hand.length is not None:
        described["length_m"] = float(hand.length)
    return described | {"stream": hand.stream}


def _describe_sensors(sensors: Sensors) -> dict[str, float]:
    described = {
        "object_position_std_m": sensors.object_position_std,
        "object_rotation_std_rad": sensors.object_rotation_std,
        "hand_position_std_m": sensors.hand_position_std,
        "force_std_n": sensors.force_std,
    }
    return {key: float(value) for key, value in described.items() if value is not None}


def _floats(values: tuple[float, ...]) -> list[float]:
    return [float(value) for value in values]
