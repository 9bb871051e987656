"""Reads one push of the MIT push dataset from its HDF5 or JSON file, and cleans its three streams."""

from __future__ import annotations

import importlib
import io
import json
from pathlib import Path
from typing import Any, Final

import numpy as np

from physid_drake.errors import RecordingError
from physid_drake.files import FileError, read_bytes
from physid_drake.recording.adapters.mit_shapes import THICKNESS, TIP_RADIUS, PublishedObject
from physid_drake.recording.outlines import outline_distance
from physid_drake.recording.planar import planar_poses, turned
from physid_drake.recording.screening import describe_rows, gap_warnings
from physid_drake.recording.values import Array, ForceStream, Push
from physid_drake.wording import named, one_line, shown

KEYS: Final = ("tip_pose", "object_pose", "ft_wrench")
CLEARANCE: Final = 0.002
"""The force sensor's offset is read while the tip is this far from the object, in m."""

COLUMNS: Final = 4
MOST_ROWS: Final = 1_000_000
LARGEST: Final = 1e10
"""Of any number: the clocks' seconds are since 1970."""
_OFFSET_SAMPLES: Final = 5


def read_push(file: Path, name: str, published: PublishedObject) -> Push:
    """One push from its ``.h5`` or ``.json`` file.

    Raises:
        RecordingError: if the file cannot be read or does not hold the three streams.
    """
    raw = _read_json(file) if file.suffix.lower() == ".json" else _read_hdf5(file)
    warnings: list[str] = []
    tip, pose, wrench = (_cleaned(file, key, raw[key], warnings) for key in KEYS)
    start = min(tip[0, 0], pose[0, 0], wrench[0, 0])
    centroids = pose[:, 1:3] + turned(pose[:, 3], np.tile(published.centroid, (len(pose), 1)))
    planar = np.column_stack([centroids, np.unwrap(pose[:, 3])])
    forces = -wrench[:, 1:3]
    forces = forces - _offset(wrench[:, 0], forces, _contact_time(tip, planar[0], published), warnings)
    return Push(
        name=name,
        object=planar_poses(pose[:, 0] - start, planar, 0.5 * THICKNESS),
        # The tip is round: the angle of the robot's tool does not matter.
        hand=planar_poses(tip[:, 0] - start, np.column_stack([tip[:, 1:3], np.zeros(len(tip))]), 0.5 * THICKNESS),
        force=ForceStream(times=wrench[:, 0] - start, forces=np.column_stack([forces, np.zeros(len(forces))])),
        note="; ".join([file.stem, *warnings]),
        warnings=tuple(warnings),
    )


def _read_hdf5(file: Path) -> dict[str, Array]:
    try:
        h5py = importlib.import_module("h5py")
    except ImportError as error:
        raise RecordingError(
            f"{file}: reading HDF5 needs h5py, which is not installed; run `pip install physid_drake[mit]`."
        ) from error
    content = _content(file)
    try:
        # From memory: what took the file's place since then could be a pipe, which hangs.
        with h5py.File(io.BytesIO(content), "r") as opened:
            return {key: _stream(h5py, opened, file, key) for key in KEYS}
    except RecordingError:
        raise
    except KeyError as error:
        raise _missing(file) from error
    except (OSError, ValueError, TypeError, RuntimeError, MemoryError, OverflowError, AttributeError) as error:
        cause = one_line(error)
        raise RecordingError(f"{named(file)}: not a readable HDF5 file of the MIT pushes: {cause}.") from error


def _content(file: Path) -> bytes:
    try:
        return read_bytes(file)
    except FileError as error:
        raise RecordingError(f"{named(file)}: {error}.") from error


def _stream(h5py: Any, opened: Any, file: Path, key: str) -> Array:
    """One stream, which is what it claims to be, and in this very file."""
    link = opened.get(key, getlink=True)
    if link is None:
        raise _missing(file)
    problem = "is a link, and not the numbers themselves"
    if isinstance(link, h5py.HardLink):
        found = opened[key]
        if not isinstance(found, h5py.Dataset) or found.dtype.kind not in "iuf":
            problem = "must be a table of numbers"
        elif found.shape is None or len(found.shape) != 2 or found.shape[1] != COLUMNS or found.shape[0] > MOST_ROWS:
            problem = f"must have shape (n, {COLUMNS}) with at most {MOST_ROWS} rows, but claims {shown(found.shape)}"
        elif found.external is not None or found.is_virtual:
            problem = "has its numbers in another file"
        else:
            return np.asarray(found, dtype=np.float64)
    raise RecordingError(f"{named(file)}: {key}: {problem}; is it a raw push?")


def _read_json(file: Path) -> dict[str, Array]:
    try:
        loaded = json.loads(_content(file).decode("utf-8-sig"))
        if not isinstance(loaded, dict):
            raise _missing(file)
        return {key: np.asarray(loaded[key], dtype=np.float64) for key in KEYS}
    except RecordingError:
        raise
    except KeyError as error:
        raise _missing(file) from error
    except (ValueError, TypeError, RecursionError, OverflowError, LookupError) as error:
        cause = one_line(error)
        raise RecordingError(f"{named(file)}: not a readable JSON file of the MIT pushes: {cause}.") from error


def _missing(file: Path) -> RecordingError:
    return RecordingError(
        f"{named(file)}: must hold {', '.join(KEYS)}, but one of them is missing; is it a raw push?"
    )


def _cleaned(file: Path, key: str, rows: Array, warnings: list[str]) -> Array:
    """Rows (n, 4) with finite numbers and increasing times; says what it left out."""
    if rows.ndim != 2 or rows.shape[1] != 4:
        raise RecordingError(f"{file}: {key}: must have shape (n, 4), but got {rows.shape}; is it a raw push?")
    finite = np.isfinite(rows).all(axis=1)
    if not finite.all():
        warnings.append(f"{key}: {describe_rows(np.flatnonzero(~finite).tolist())}: not finite, left out.")
    kept = np.flatnonzero(finite)
    if (np.abs(rows[kept]) > LARGEST).any():
        raise RecordingError(f"{named(file)}: {key}: every number must be at most {LARGEST:g}; leave the file out.")
    latest = np.maximum.accumulate(rows[kept, 0])
    late = np.concatenate([[False], rows[kept[1:], 0] <= latest[:-1]]) if len(kept) else np.zeros(0, np.bool_)
    if late.any():
        repeated = describe_rows(kept[late].tolist())
        warnings.append(f"{key}: {repeated}: time stamp not after the one before, left out.")
    kept = kept[~late]
    if len(kept) < 2:
        raise RecordingError(f"{file}: {key}: needs at least two samples, but got {len(kept)}; leave the file out.")
    warnings.extend(gap_warnings(rows[kept, 0], kept.tolist(), key))
    return rows[kept]


def _contact_time(tip: Array, start: Array, published: PublishedObject) -> float:
    """Time in s when the tip first comes near the object's first pose ``start`` (x, y, yaw)."""
    local = turned(-start[2], tip[:, 1:3] - start[:2])
    near = np.flatnonzero(outline_distance(published.outline, local) < TIP_RADIUS + CLEARANCE)
    return float(tip[near[0] if len(near) else -1, 0])


def _offset(times: Array, forces: Array, contact_time: float, warnings: list[str]) -> Array:
    """The force sensor's constant offset (2,) in N: its mean before ``contact_time`` in s."""
    before = times < contact_time
    if before.sum() < _OFFSET_SAMPLES:
        warnings.append(
            f"ft_wrench: {int(before.sum())} samples before contact are too few to read the sensor's offset; "
            "none subtracted."
        )
        return np.zeros(2)
    offset: Array = forces[before].mean(axis=0)
    warnings.append(
        f"ft_wrench: constant offset of ({offset[0]:.3f}, {offset[1]:.3f}) N, the mean of "
        f"{int(before.sum())} samples before contact, subtracted."
    )
    return offset
