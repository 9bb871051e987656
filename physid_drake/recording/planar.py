"""Planar motion to poses: bodies that lie flat on the table and turn about z only."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from physid_drake.recording.reading import unit_quaternions
from physid_drake.recording.values import Array, PoseStream, RotationKind


def planar_poses(
    times: npt.ArrayLike, planar: npt.ArrayLike, height: float, rotation: RotationKind = "full"
) -> PoseStream:
    """Poses of a body at a fixed height.

    Args:
        times: (n,) in s.
        planar: (n, 3) x and y in m, yaw in rad.
        height: z of the body's origin in m.
        rotation: how much of it was measured.
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
        rotation=rotation,
    )


def turned(yaw: npt.ArrayLike, vectors: npt.ArrayLike) -> Array:
    """Vectors (n, 2) turned by yaws (n,) or () in rad."""
    x, y = np.asarray(vectors, dtype=np.float64).T
    angle = np.asarray(yaw, dtype=np.float64)
    return np.column_stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y])
