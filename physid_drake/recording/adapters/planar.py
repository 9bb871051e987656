"""Planar motion to poses: bodies that lie flat on the table and turn about z only."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from physid_drake.errors import RecordingError
from physid_drake.recording.reading import unit_quaternions
from physid_drake.recording.values import Array, PoseStream


def planar_poses(times: npt.ArrayLike, planar: npt.ArrayLike, height: float) -> PoseStream:
    """Poses of a body at a fixed height.

    Args:
        times: (n,) in s.
        planar: (n, 3) x and y in m, yaw in rad.
        height: z of the body's origin in m.
    """
    values = np.asarray(planar, dtype=np.float64)
    positions = np.column_stack([values[:, :2], np.full(len(values), height)])
    half = 0.5 * values[:, 2]
    zeros = np.zeros(len(values))
    quaternions = np.column_stack([np.cos(half), zeros, zeros, np.sin(half)])
    return PoseStream(
        times=np.asarray(times, dtype=np.float64),
        positions=positions,
        quaternions=unit_quaternions(quaternions),
    )


def turned(yaw: npt.ArrayLike, vectors: npt.ArrayLike) -> Array:
    """Vectors (n, 2) turned by yaws (n,) or () in rad."""
    x, y = np.asarray(vectors, dtype=np.float64).T
    angle = np.asarray(yaw, dtype=np.float64)
    return np.column_stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y])


def source_files(source: Path, *suffixes: str) -> list[Path]:
    """The source itself, or the files with these suffixes in the source folder, sorted by name.

    Raises:
        RecordingError: if there is none.
    """
    source = Path(source)
    if source.is_file():
        return [source]
    files = sorted(f for f in source.iterdir() if f.suffix.lower() in suffixes) if source.is_dir() else []
    if not files:
        raise RecordingError(f"{source}: no {' or '.join(suffixes)} file here; give one, or the folder with them.")
    return files


def drawn(count: int, limit: int | None, rng: np.random.Generator) -> list[int]:
    """Indices below ``count`` in order: all, or ``limit`` of them drawn at random.

    Raises:
        RecordingError: if ``limit`` is below 1.
    """
    if limit is None:
        return list(range(count))
    if limit < 1:
        raise RecordingError(f"limit must be at least 1, but got {limit}; leave it out to convert all pushes.")
    return sorted(int(k) for k in rng.choice(count, size=min(limit, count), replace=False))
