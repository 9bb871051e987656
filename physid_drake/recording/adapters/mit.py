"""Converts the MIT push dataset (Yu, Bauza, Fazeli, Rodriguez, IROS 2016): raw pushes, or end points.

Raw pushes are one HDF5 or JSON file each, named
``motion_surface=abs_shape=rect1_a=0_v=20_i=1.000_s=0.500_t=0.000.h5``, with ``tip_pose``, ``object_pose``
(time, x, y, angle) and ``ft_wrench`` (time, fx, fy, torque: the force ON THE SENSOR, so the force on the
object is its negative), in the robot's base frame, each stream with its own clock samples. End points are
tables ``<surface>_<shape>_v<speed in mm/s>.csv`` with one push a row.
"""

from __future__ import annotations

import csv
import io
import math
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from physid_drake.errors import RecordingError
from physid_drake.recording.adapters.mit_shapes import (
    THICKNESS,
    TIP_RADIUS,
    PublishedObject,
    published_object,
)
from physid_drake.recording.adapters.mit_streams import read_push
from physid_drake.recording.adapters.sources import drawn, source_files
from physid_drake.recording.description import read_text
from physid_drake.recording.limits import FURTHEST
from physid_drake.recording.object_model import ObjectModel
from physid_drake.recording.planar import planar_poses, turned
from physid_drake.recording.reading import read_recording
from physid_drake.recording.values import Hand, HandStream, Push, Recording, Sensors, Table
from physid_drake.recording.writing import write_recording
from physid_drake.wording import one_line, shown

TIP_LENGTH: Final = 0.010
END_POINT_RATE: Final = 50.0
"""Hand samples per second on the straight path between two published end points."""

MOST_SECONDS: Final = 600.0
"""From one published end point to the other."""

_RAW_NAME: Final = re.compile(r"motion_surface=(?P<surface>[^_]+)_shape=(?P<shape>[^_]+)_")
_TABLE_NAME: Final = re.compile(r"(?P<surface>[a-z]+)_(?P<shape>[a-z]+\d?)_v(?P<speed>\d+)")
_END_POINT_COLUMNS: Final = tuple(
    f"{when}_{what}"
    for when in ("start", "end")
    for what in ("object_x_m", "object_y_m", "object_yaw_rad", "tip_x_m", "tip_y_m")
)


@dataclass(frozen=True, kw_only=True)
class _Source:
    """What a folder of files is about; ``speed`` in m/s for a table of end points, else None."""

    files: tuple[Path, ...]
    surface: str
    shape: str
    speed: float | None


def convert_mit(source: Path, folder: Path, limit: int | None = None, seed: int = 0) -> Recording:
    """Converts pushes of one object on one surface, and writes the recording.

    Args:
        source: a raw push, a folder of raw pushes of one object, or one table of end points.
        folder: where the recording goes; must not exist, or be empty.
        limit: draw so many pushes at random, and keep their order; None takes all.
        seed: of that draw.

    Returns:
        The recording as read back from ``folder``.

    Raises:
        RecordingError: if the source is not in a published layout, mixes objects, or is not of a convex one.
        OutputError: if the folder cannot be written.
    """
    rng = np.random.default_rng(seed)
    found = _look_at(Path(source))
    published = published_object(found.shape, str(found.files[0]))
    if found.speed is not None:
        pushes = _end_point_pushes(found.files[0], published, found.speed, limit, rng)
    else:
        pushes = _raw_pushes(found.files, published, limit, rng)
    recording = Recording(
        name=f"mit_{found.shape}_{found.surface}",
        description=_describe(found),
        object=ObjectModel(shape=published.shape, mass=published.mass),
        table=_table_under(pushes),
        hand=Hand(tip="cylinder", radius=TIP_RADIUS, length=TIP_LENGTH, stream=_hand_stream(found)),
        sensors=Sensors(),
        pushes=tuple(pushes),
    )
    write_recording(recording, folder)
    return read_recording(folder)


def _look_at(source: Path) -> _Source:
    files = source_files(source, ".h5", ".hdf5", ".json")
    if files[0].suffix.lower() == ".csv":
        match = _TABLE_NAME.fullmatch(files[0].stem)
        if match is None:
            raise RecordingError(
                f"{files[0]}: a table of end points is named <surface>_<shape>_v<mm/s>.csv; rename it."
            )
        speed = float(match["speed"]) * 1e-3
        if speed <= 0.0:
            raise RecordingError(
                f"{files[0]}: the speed in the name must be positive, but got {match['speed']} mm/s."
            )
        return _Source(files=(files[0],), surface=match["surface"], shape=match["shape"], speed=speed)
    kinds: set[tuple[str, str]] = set()
    for file in files:
        match = _RAW_NAME.match(file.name)
        if match is None:
            raise RecordingError(
                f"{file}: a raw push is named motion_surface=<surface>_shape=<shape>_...; rename it."
            )
        kinds.add((match["surface"], match["shape"]))
        if len(kinds) > 1:
            pairs = " and ".join(f"{shape} on {surface}" for surface, shape in sorted(kinds))
            raise RecordingError(f"{file}: one recording is of one object on one surface, but here are {pairs}.")
    surface, shape = kinds.pop()
    return _Source(files=tuple(files), surface=surface, shape=shape, speed=None)


def _describe(found: _Source) -> str:
    text = (
        f"MIT push dataset (Yu, Bauza, Fazeli, Rodriguez, IROS 2016): {found.shape} on {found.surface}, "
        "pushed by a steel rod. B is at the centroid; table size assumed. "
    )
    if found.speed is not None:
        return text + (
            f"Published end points; the hand's path is the straight line between its end points at "
            f"{found.speed:g} m/s, which the publisher gives as its set speed."
        )
    return text + "Published raw streams, each with its own clock samples."


def _hand_stream(found: _Source) -> HandStream:
    return "commanded" if found.speed is not None else "measured"


def _table_under(pushes: list[Push]) -> Table:
    """A table that reaches at least 0.3 m beyond all that was recorded."""
    streams = [
        stream.positions[:, :2] for push in pushes for stream in (push.object, push.hand) if stream is not None
    ]
    points = np.vstack(streams)
    low, high = points.min(axis=0), points.max(axis=0)
    centre, size = np.round(0.5 * (low + high), 2), np.ceil(10.0 * (high - low) + 6.2) / 10.0
    return Table(size=(float(size[0]), float(size[1])), centre=(float(centre[0]), float(centre[1])))


def _raw_pushes(
    files: tuple[Path, ...], published: PublishedObject, limit: int | None, rng: np.random.Generator
) -> list[Push]:
    pushes: list[Push] = []
    refused: RecordingError | None = None
    for k in drawn(len(files), limit, rng):
        try:
            push = read_push(files[k], f"pushes/{len(pushes) + 1:04d}.csv", published)
        except RecordingError as error:
            warnings.warn(f"{files[k].name}: left out: {error}", UserWarning, stacklevel=3)
            refused = error
            continue
        for warning in push.warnings:
            warnings.warn(f"{files[k].name}: {warning}", UserWarning, stacklevel=3)
        pushes.append(push)
    if refused is not None and not pushes:
        raise refused
    return pushes


def _end_point_pushes(
    file: Path, published: PublishedObject, speed: float, limit: int | None, rng: np.random.Generator
) -> list[Push]:
    reader = csv.DictReader(io.StringIO(read_text(file), newline=""))
    _header(file, reader)
    missing = [column for column in _END_POINT_COLUMNS if column not in (reader.fieldnames or ())]
    if missing:
        raise RecordingError(f"{file}: row 1: column {missing[0]}: is missing; is it a table of end points?")
    try:
        rows = [[_number(file, reader.line_num, c, row[c]) for c in _END_POINT_COLUMNS] for row in reader]
    except csv.Error as error:
        raise RecordingError(f"{file}: row {reader.line_num}: not a readable table: {one_line(error)}.") from error
    if not rows:
        raise RecordingError(f"{file}: row 1: there are no pushes under a header; give a full table.")
    return [
        _end_point_push(f"pushes/{n + 1:04d}.csv", f"{file.name}, row {k + 2}", rows[k], published, speed)
        for n, k in enumerate(drawn(len(rows), limit, rng))
    ]


def _header(file: Path, reader: csv.DictReader[str]) -> None:
    try:
        _ = reader.fieldnames
    except csv.Error as error:
        raise RecordingError(f"{file}: row 1: not a readable table: {one_line(error)}.") from error


def _number(file: Path, line: int, column: str, text: str | None) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not abs(value) <= FURTHEST:
        raise RecordingError(
            f"{file}: row {line}: column {column}: must be a number from -{FURTHEST:g} to {FURTHEST:g}, but got"
            f" {shown(text)}."
        )
    return value


def _end_point_push(name: str, note: str, row: list[float], published: PublishedObject, speed: float) -> Push:
    poses = np.array([row[0:3], row[5:8]])
    poses[:, 2] = np.unwrap(poses[:, 2])
    poses[:, :2] += turned(poses[:, 2], np.tile(published.centroid, (2, 1)))
    first, last = np.array(row[3:5]), np.array(row[8:10])
    duration = max(float(np.hypot(*(last - first))) / speed, 1.0 / END_POINT_RATE)
    if duration > MOST_SECONDS:
        raise RecordingError(
            f"{note}: the tip must get from end to end within {MOST_SECONDS:g} s, but takes {duration:.3g} s at"
            " the speed in the file's name; is it right, and is the table in m?"
        )
    times = np.linspace(0.0, duration, max(2, math.ceil(duration * END_POINT_RATE) + 1))
    path = first + (times / duration)[:, None] * (last - first)
    return Push(
        name=name,
        object=planar_poses([0.0, duration], poses, 0.5 * THICKNESS),
        hand=planar_poses(times, np.column_stack([path, np.zeros(len(times))]), 0.5 * THICKNESS),
        force=None,
        note=note,
    )
