"""Reads a folder in the format ``physid-recording/1``; refuses what breaks a rule, by file and row."""

from __future__ import annotations

import csv
import difflib
import io
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from physid_drake.errors import RecordingError
from physid_drake.recording import description
from physid_drake.recording.clocks import check_seconds
from physid_drake.recording.limits import FURTHEST, STRONGEST, first_beyond
from physid_drake.recording.naming import shipped_recording
from physid_drake.recording.screening import gap_warnings, screen_poses
from physid_drake.recording.values import (
    QUATERNION_TOLERANCE,
    Array,
    ForceStream,
    PoseStream,
    Push,
    Recording,
)
from physid_drake.wording import named, one_line, shown

TIME: Final = "time_s"
HAND_POSITION: Final = ("hand_x_m", "hand_y_m", "hand_z_m")
HAND_QUATERNION: Final = ("hand_qw", "hand_qx", "hand_qy", "hand_qz")
OBJECT_POSITION: Final = ("object_x_m", "object_y_m", "object_z_m")
OBJECT_QUATERNION: Final = ("object_qw", "object_qx", "object_qy", "object_qz")
OBJECT_YAW: Final = "object_yaw_rad"
YAW_DIGITS: Final = 12
"""Behind the point [rad]."""
FORCE: Final = ("force_x_n", "force_y_n", "force_z_n")
MOST_ROWS: Final = 200_000
"""Of one table: three minutes at 1 kHz. A push takes seconds, and each of its rows some 20 us to read."""

MOST_YAW: Final = 1e3
"""rad: of a heading, turns included. Degrees and counts of an encoder are more."""

CLOSEST: Final = 1e-9
"""In s between samples of one stream: less is round-off, and a speed over it overflows."""

COLUMNS: Final = (TIME, *HAND_POSITION, *HAND_QUATERNION, *OBJECT_POSITION, *OBJECT_QUATERNION, OBJECT_YAW, *FORCE)


@dataclass(frozen=True, kw_only=True)
class _PushTable:
    """One table: ``values`` (n, columns), NaN where a field is empty, and each row's line in the file."""

    file: Path
    columns: tuple[str, ...]
    values: Array
    lines: tuple[int, ...]

    def has(self, columns: Sequence[str]) -> bool:
        return all(column in self.columns for column in columns)

    def group(self, columns: Sequence[str]) -> Array:
        return self.values[:, [self.columns.index(column) for column in columns]]

    def filled(self, columns: Sequence[str]) -> npt.NDArray[np.intp]:
        """Indices of the rows where every column of a group is filled; refuses a group filled in part."""
        present = ~np.isnan(self.group(columns))
        partial = np.flatnonzero(present.any(axis=1) & ~present.all(axis=1))
        if len(partial):
            k = int(partial[0])
            column = columns[int(np.argmin(present[k]))]
            raise RecordingError(
                f"{self.file}: row {self.lines[k]}: column {column}: is empty, but "
                f"{columns[0]}..{columns[-1]} are one sample; fill all of them or none."
            )
        return np.flatnonzero(present.all(axis=1))


def read_recording(folder: str | Path) -> Recording:
    """Reads a recording.

    Args:
        folder: the folder with ``recording.yaml`` and its tables, or the name of a recording that ships.

    Returns:
        The recording; each push carries the warnings about its streams.

    Raises:
        RecordingError: if a rule of ``physid-recording/1`` is broken; one line naming file, row and column.
    """
    folder = _folder_of(Path(folder))
    top = description.load_description(folder)
    name = top.text("name")
    hand = description.hand_from(top)
    shape = description.object_from(top, folder)
    table, sensors = description.table_from(top), description.sensors_from(top)
    conversion = description.conversion_from(top)
    pushes = [
        _read_push(file, push_name, note, with_hand=hand is not None)
        for push_name, file, note in description.push_entries(top, folder)
    ]
    with top.naming():
        return Recording(
            name=name,
            description=top.text("description", ""),
            object=shape,
            table=table,
            hand=hand,
            sensors=sensors,
            pushes=tuple(pushes),
            folder=folder,
            conversion=conversion,
        )


def _folder_of(given: Path) -> Path:
    """The folder that somebody gives, or of the recording that ships under this name."""
    folder = shipped_recording(given) or given
    if not os.path.isdir(folder):  # noqa: PTH112  # Path.is_dir raises for a name that is too long
        raise RecordingError(
            f"{named(folder)}: is not a folder; give the folder that holds {description.DESCRIPTION_FILE}, or the"
            " name of a recording that ships, such as eraser_reference."
        )
    return folder


def _read_push(file: Path, name: str, note: str, *, with_hand: bool) -> Push:
    table = _read_table(file, with_hand)
    warnings: list[str] = []
    object_stream = (
        _yaw_stream(table, warnings)
        if table.has([OBJECT_YAW])
        else _pose_stream(table, "object", OBJECT_POSITION, OBJECT_QUATERNION, warnings)
    )
    if object_stream is None or len(object_stream) < 2:
        got = 0 if object_stream is None else len(object_stream)
        raise RecordingError(
            f"{file}: column {OBJECT_POSITION[0]}: at least two object poses are needed, but got {got}; "
            "record the pose before and after the push."
        )
    hand = _pose_stream(table, "hand", HAND_POSITION, HAND_QUATERNION, warnings) if with_hand else None
    if with_hand and hand is None:
        raise RecordingError(
            f"{file}: column {HAND_POSITION[0]}: recording.yaml describes a hand, but no row has its "
            "position; fill it, or remove this push's file, or the hand from recording.yaml."
        )
    force = _force_stream(table, warnings) if with_hand and table.has(FORCE) else None
    try:
        return Push(name=name, object=object_stream, hand=hand, force=force, note=note, warnings=tuple(warnings))
    except RecordingError as error:
        raise RecordingError(f"{file}: {error}") from error


def _read_table(file: Path, with_hand: bool) -> _PushTable:
    reader = csv.reader(io.StringIO(description.read_text(file), newline=""), strict=True)
    header: tuple[str, ...] = ()
    rows: list[list[float]] = []
    lines: list[int] = []
    try:
        for fields in reader:
            if not fields or fields == [""]:
                continue
            if not header:
                header = _read_header(file, fields, reader.line_num)
                _check_columns(file, header, with_hand)
            else:
                rows.append(_read_row(file, header, fields, reader.line_num))
                lines.append(reader.line_num)
                _check_length(file, lines)
    except csv.Error as error:
        raise RecordingError(
            f"{file}: row {reader.line_num}: not a readable table: {one_line(error)}; correct it."
        ) from error
    if not rows:
        raise RecordingError(f"{file}: row 1: there are no samples under a header; a push needs at least two rows.")
    table = _PushTable(file=file, columns=header, values=np.array(rows, dtype=np.float64), lines=tuple(lines))
    _check_times(table)
    if not with_hand:
        _refuse_hand(table)
    return table


def _read_header(file: Path, fields: list[str], line: int) -> tuple[str, ...]:
    header = tuple(field.strip() for field in fields)
    for k, column in enumerate(header):
        if column not in COLUMNS:
            hint = "separate columns by commas" if len(header) == 1 else _near(column)
            raise RecordingError(f"{file}: row {line}: column {shown(column)}: is unknown; {hint}.")
        if column in header[:k]:
            raise RecordingError(f"{file}: row {line}: column {column}: stands twice; remove one.")
    if TIME not in header:
        raise RecordingError(f"{file}: row {line}: column {TIME}: is missing; add it.")
    return header


def _near(column: str) -> str:
    """Which columns somebody may have meant, and where all of them are described."""
    close = difflib.get_close_matches(column.lower(), COLUMNS, n=2, cutoff=0.6)
    meant = f"is it {' or '.join(close)}" if close else "columns are time_s, object_x_m, hand_x_m and so on"
    return f"{meant} (docs/recording.md)? A log of another layout: `convert table`, docs/bring_your_data.md"


def _read_row(file: Path, header: tuple[str, ...], fields: list[str], line: int) -> list[float]:
    if len(fields) != len(header):
        raise RecordingError(
            f"{file}: row {line}: has {len(fields)} fields, but the header has {len(header)} columns; "
            "an empty field still needs its comma."
        )
    values = []
    for column, raw in zip(header, fields, strict=True):
        text = raw.strip()
        if not text:
            values.append(math.nan)
            continue
        try:
            # Python alone reads 1_000 as a number.
            value = float(text) if "_" not in text and text.isascii() else None
        except ValueError:
            value = None
        if value is None or not math.isfinite(value):
            raise RecordingError(
                f"{file}: row {line}: column {column}: must be a finite number, but got {shown(text)}; "
                "leave the field empty if there is no sample."
            )
        values.append(value)
    return values


def _check_length(file: Path, lines: list[int]) -> None:
    """Refuse a log of hours: each push is a table of its own."""
    if len(lines) > MOST_ROWS:
        raise RecordingError(
            f"{file}: row {lines[-1]}: a table must have at most {MOST_ROWS} samples; cut the push out of the log."
        )


def _check_seconds(table: _PushTable, times: Array, what: str) -> None:
    """Refuse times of one stream that can be no seconds, before anything is asked of them."""
    with np.errstate(over="ignore"):
        close = np.flatnonzero(np.diff(times) < CLOSEST)
    if len(close):
        one, other = (float(times[int(close[0]) + k]) for k in (0, 1))
        raise RecordingError(
            f"{table.file}: column {TIME}: the {what}'s samples at {one!r} s and {other!r} s are less than a"
            " nanosecond apart; merge them."
        )
    try:
        check_seconds(times, f"the {what}'s samples")
    except RecordingError as error:
        raise RecordingError(f"{table.file}: column {TIME}: {error}") from error


def _check_near(
    table: _PushTable, rows: npt.NDArray[np.intp], columns: Sequence[str], most: float, unit: str
) -> None:
    """Refuse what is out of all proportion, which overflows in whatever is made of it."""
    values = table.group(columns)[rows]
    k = first_beyond(values, most)
    if k is not None:
        column = int(np.argmax(np.abs(values[k])))
        raise RecordingError(
            f"{table.file}: row {table.lines[rows[k]]}: column {columns[column]}: must be between {-most:g} and "
            f"{most:g} {unit}, but got {float(values[k, column]):.6g} {unit}; is it in {unit}?"
        )


def _check_times(table: _PushTable) -> None:
    times = table.group([TIME])[:, 0]
    missing = np.flatnonzero(np.isnan(times))
    if len(missing):
        line = table.lines[int(missing[0])]
        raise RecordingError(f"{table.file}: row {line}: column {TIME}: is empty; every row needs its time.")
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if len(late):
        k = int(late[0]) + 1
        raise RecordingError(
            f"{table.file}: row {table.lines[k]}: column {TIME}: times must increase, but "
            f"{float(times[k])!r} s follows {float(times[k - 1])!r} s; sort the rows and merge repeated times."
        )


def _check_columns(file: Path, header: tuple[str, ...], with_hand: bool) -> None:
    required = (*OBJECT_POSITION, *(HAND_POSITION if with_hand else ()))
    if OBJECT_YAW in header and any(column in header for column in OBJECT_QUATERNION):
        raise RecordingError(
            f"{file}: row 1: column {OBJECT_YAW}: stands beside {OBJECT_QUATERNION[0]}; give one of them."
        )
    for group in (OBJECT_QUATERNION, *((FORCE, HAND_QUATERNION) if with_hand else ())):
        if any(column in header for column in group):
            required = (*required, *group)
    for column in required:
        if column not in header:
            why = "recording.yaml describes a hand; " if column.startswith("hand") else ""
            raise RecordingError(f"{file}: row 1: column {column}: is missing; {why}add it.")


def _refuse_hand(table: _PushTable) -> None:
    """Without a hand, its columns may stand there, but empty."""
    for column in table.columns:
        filled = np.flatnonzero(~np.isnan(table.group([column])[:, 0]))
        if column.startswith(("hand_", "force_")) and len(filled):
            raise RecordingError(
                f"{table.file}: row {table.lines[int(filled[0])]}: column {column}: recording.yaml describes no "
                "hand; add it there, or empty the column."
            )


def _pose_stream(
    table: _PushTable, what: str, position: Sequence[str], quaternion: Sequence[str], warnings: list[str]
) -> PoseStream | None:
    # Absent, also as columns that are empty throughout: the rotation was not measured.
    turned = table.has(quaternion) and not np.isnan(table.group(quaternion)).all()
    rows = table.filled([*position, *quaternion] if turned else position)
    if len(rows) == 0:
        return None
    times, positions = table.group([TIME])[rows, 0], table.group(position)[rows]
    _check_seconds(table, times, what)
    _check_near(table, rows, position, FURTHEST, "m")
    identity = np.tile([1.0, 0.0, 0.0, 0.0], (len(rows), 1))
    quaternions = table.group(quaternion)[rows] if turned else identity
    lines = [table.lines[k] for k in rows]
    if turned:
        _check_norms(table.file, positions, quaternions, lines, quaternion)
    screened = screen_poses(times, positions, quaternions, lines, what, turned=turned)
    warnings.extend(screened.warnings)
    if not screened.keep.any():
        return None
    return PoseStream(
        times=times[screened.keep],
        positions=positions[screened.keep],
        quaternions=unit_quaternions(quaternions[screened.keep]),
        rotation="full" if turned else "none",
    )


def _yaw_stream(table: _PushTable, warnings: list[str]) -> PoseStream | None:
    """The object's stream where of its rotation the yaw was measured."""
    rows = table.filled([*OBJECT_POSITION, OBJECT_YAW])
    if len(rows) == 0:
        return None
    times, positions = table.group([TIME])[rows, 0], table.group(OBJECT_POSITION)[rows]
    yaw = table.group([OBJECT_YAW])[rows, 0]
    _check_seconds(table, times, "object")
    _check_near(table, rows, OBJECT_POSITION, FURTHEST, "m")
    _check_near(table, rows, [OBJECT_YAW], MOST_YAW, "rad")
    # Turns and digits that do not count are taken away: what is written of it and read again is the same.
    yaw = np.round(np.remainder(yaw + np.pi, 2.0 * np.pi) - np.pi, YAW_DIGITS)
    zeros = np.zeros(len(yaw))
    quaternions = np.column_stack([np.cos(0.5 * yaw), zeros, zeros, np.sin(0.5 * yaw)])
    screened = screen_poses(times, positions, quaternions, [table.lines[k] for k in rows], "object", turned=False)
    warnings.extend(screened.warnings)
    if not screened.keep.any():
        return None
    return PoseStream(
        times=times[screened.keep],
        positions=positions[screened.keep],
        quaternions=unit_quaternions(quaternions[screened.keep]),
        rotation="yaw",
    )


def _check_norms(file: Path, positions: Array, quaternions: Array, lines: list[int], columns: Sequence[str]) -> None:
    with np.errstate(over="ignore"):
        norms = np.linalg.norm(quaternions, axis=1)
    lost = (quaternions == 0.0).all(axis=1) & (positions == 0.0).all(axis=1)
    wrong = np.flatnonzero((np.abs(norms - 1.0) > QUATERNION_TOLERANCE) & ~lost)
    if len(wrong):
        k = int(wrong[0])
        raise RecordingError(
            f"{file}: row {lines[k]}: column {columns[0]}: the quaternion's norm must be 1 within "
            f"{QUATERNION_TOLERANCE}, but got {norms[k]:.6g}; normalise it."
        )


def unit_quaternions(quaternions: Array) -> Array:
    """Quaternions (n, 4) scaled to norm 1, each with the sign that is nearest to the one before.

    One that is already of norm 1 to rounding is not touched, so reading what was written changes nothing.
    """
    norms = np.linalg.norm(quaternions, axis=1, keepdims=True)
    units = np.where(np.abs(norms - 1.0) > 1e-14, quaternions / norms, quaternions)
    flips = np.where((units[1:] * units[:-1]).sum(axis=1) < 0.0, -1.0, 1.0)
    signs = np.concatenate([[1.0], np.cumprod(flips)])
    continuous: Array = units * signs[:, None]
    return continuous


def _force_stream(table: _PushTable, warnings: list[str]) -> ForceStream | None:
    rows = table.filled(FORCE)
    if len(rows) == 0:
        return None
    times = table.group([TIME])[rows, 0]
    _check_seconds(table, times, "force")
    _check_near(table, rows, FORCE, STRONGEST, "N")
    warnings.extend(gap_warnings(times, [table.lines[k] for k in rows], "force"))
    return ForceStream(times=times, forces=table.group(FORCE)[rows])
