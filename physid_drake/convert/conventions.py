"""From what a log says in its own conventions to poses and forces in W, in SI units.

A log's world S and the recording's world W differ by an origin, a signed permutation A of the axes, and what rotation
R is left: p_W = R A (p_S - o). A has determinant -1 where S is left-handed. Rotations go along, R_W = R A R_S A^T:
the axes of a body are taken the same way as those of the world, and one that stood like S stands like W if R is none.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from physid_drake.convert.mapping import NORM_TOLERANCE, ForceMap, Offset, Turn, World
from physid_drake.errors import RecordingError

Array = NDArray[np.float64]

TILTED = 1e-9
"""Cosine of an axis that is up, less than 1 by rounding alone."""


def rotation_of(turn: Turn, values: Array, scale: float, world: World) -> Rotation:
    """Rotations R_SM (n) as matrices in the log's own coordinates.

    Args:
        turn: how they are written.
        values: (n, k) as written, all finite.
        scale: of angles, to rad.
        world: whose vertical a yaw turns about.

    Raises:
        RecordingError: if a quaternion's norm is not 1, or a matrix turns nothing.
    """
    if turn.kind in ("wxyz", "xyzw"):
        wxyz = values if turn.kind == "wxyz" else np.roll(values, 1, axis=1)
        norms = np.linalg.norm(wxyz, axis=1)
        wrong = np.flatnonzero(np.abs(norms - 1.0) > NORM_TOLERANCE)
        if len(wrong):
            raise RecordingError(
                f"{len(wrong)} of {len(norms)} quaternions have no norm of 1 (the first has {norms[wrong[0]]:.4g});"
                " are these the four columns of one rotation?"
            )
        rotation = Rotation.from_quat(np.roll(wxyz, -1, axis=1))
    elif turn.kind == "euler":
        rotation = Rotation.from_euler(turn.order, scale * values)
    elif turn.kind == "matrix":
        rotation = _of_matrices(values.reshape(-1, 3, 3))
    elif turn.kind == "rotation_vector":
        rotation = Rotation.from_rotvec(scale * values)
    else:
        rotation = Rotation.from_rotvec(scale * values * world.axes[2])
    if not np.isfinite(rotation.as_quat()).all():
        raise RecordingError("its angles are out of all proportion; are these the columns of a rotation?")
    return rotation.inv() if turn.inverse else rotation


def _of_matrices(matrices: Array) -> Rotation:
    """Rotations of matrices (n, 3, 3), which are rounded."""
    off = np.abs(matrices @ matrices.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    wrong = np.flatnonzero(off > NORM_TOLERANCE)
    if len(wrong):
        raise RecordingError(
            f"{len(wrong)} of {len(matrices)} matrices are no rotations (rows of the first are off by"
            f" {off[wrong[0]]:.4g}); are these nine columns of one rotation, row by row?"
        )
    if (np.linalg.det(matrices) < 0.0).any():
        raise RecordingError("its matrices mirror (determinant -1); are the axes of the source left-handed?")
    return Rotation.from_matrix(matrices)


def in_space(values: Array, world: World) -> Array:
    """Vectors (n, 3) of S of which all coordinates were measured, or two (n, 2), along its axes that are not up.

    Raises:
        RecordingError: if there are two, and no axis of S is up.
    """
    if values.shape[1] == 3:
        return values
    vertical = np.abs((rotation_wxyz(world.rotation).as_matrix() @ world.axes)[2])
    up = int(np.argmax(vertical))
    if vertical[up] < 1.0 - TILTED:
        raise RecordingError("two columns lie in the table's plane, but no axis of the log is up; give three.")
    return np.asarray(np.insert(values, up, 0.0, axis=1))


def places_in_world(positions: Array, world: World) -> Array:
    """Positions (n, 3) [m] of S in W."""
    placed = (positions - np.asarray(world.origin)) @ world.axes.T
    return np.asarray(rotation_wxyz(world.rotation).apply(placed))


def rotations_in_world(rotation: Rotation, world: World) -> Rotation:
    """Rotations of S in W."""
    return rotation_wxyz(world.rotation) * Rotation.from_matrix(world.axes @ rotation.as_matrix() @ world.axes.T)


def with_offset(positions: Array, rotation: Rotation | None, offset: Offset) -> tuple[Array, Rotation | None]:
    """Poses of the wanted frame, whose pose in the tracked frame is ``offset``.

    Raises:
        RecordingError: if there is an offset, but no rotation that would turn it.
    """
    place, turn = np.asarray(offset.translation), rotation_wxyz(offset.rotation)
    if rotation is None:
        if np.any(place[:2] != 0.0) or offset.rotation != Offset().rotation:
            raise RecordingError("an offset within the plane turns with the body, but its rotation was not measured.")
        return positions + place, None
    return positions + rotation.apply(place), rotation * turn


def rotation_wxyz(quaternion: tuple[float, float, float, float]) -> Rotation:
    """The rotation of one quaternion, w first."""
    return Rotation.from_quat(np.roll(quaternion, -1))


def wxyz_of(rotation: Rotation) -> Array:
    """Quaternions (n, 4), w first."""
    return np.roll(np.atleast_2d(rotation.as_quat()), 1, axis=1)


def forces_in_world(forces: Array, force: ForceMap, hand: Rotation | None, world: World) -> Array:
    """Forces of the hand on the object (n, 3) [N] in W.

    Args:
        forces: (n, 3) [N] as measured, in the sensor's axes or S's.
        force: what they are.
        hand: rotations R_WP (n) at the forces' times, where the sensor turns with the hand.
        world: where W lies.
    """
    turned = rotation_wxyz(force.offset.rotation).apply(forces)
    if not force.in_hand:
        turned = rotation_wxyz(world.rotation).apply(turned @ world.axes.T)
    elif hand is not None:
        turned = hand.apply(turned)
    on_sensor = turned if force.on_hand else -turned
    # The sensor carries the tool: what it feels of that points down.
    return np.asarray(np.array([0.0, 0.0, -force.weight]) - on_sensor)
