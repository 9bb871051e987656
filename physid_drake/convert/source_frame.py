"""The way back, from W to the frame of the log: for what a map may have got wrong of a log's numbers.

A unit, the axes of a frame and the order of a quaternion are of the log's numbers: they were read before an origin
was taken away and a frame was turned. To put them right, poses go back to the log's frame, and come again.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from physid_drake.convert.conventions import (
    places_in_world,
    rotation_wxyz,
    rotations_in_world,
    with_offset,
    wxyz_of,
)
from physid_drake.convert.mapping import Offset, PoseMap, Stated, World
from physid_drake.recording import PoseStream

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class SourceFrame:
    """How poses of one body came into W from the frame of a log, which without a map is W.

    Attributes:
        world: where W lies in that frame.
        offset: of the body in the frame that was tracked.
        inverse: whether rotations were written as R_BW.
        height: of the body in W [m], where nothing measured it.
    """

    world: World = field(default_factory=World)
    offset: Offset = field(default_factory=Offset)
    inverse: bool = False
    height: float | None = None

    def places(self, stream: PoseStream) -> Array:
        """Where the tracked frame was (n, 3), in the log's coordinates [m]."""
        move = np.asarray(self.offset.translation)
        tracked = stream.positions - (move if stream.rotation == "none" else self._turns(stream).apply(move))
        placed = rotation_wxyz(self.world.rotation).inv().apply(tracked)
        return np.asarray(placed @ self.world.axes + np.asarray(self.world.origin))

    def rotations(self, stream: PoseStream) -> Rotation:
        """How it was turned (n), in the log's coordinates, as written."""
        axes = self.world.axes
        turned = rotation_wxyz(self.world.rotation).inv() * self._turns(stream)
        rotation = Rotation.from_matrix(axes.T @ turned.as_matrix() @ axes)
        return rotation.inv() if self.inverse else rotation

    def with_places(self, stream: PoseStream, places: Array) -> PoseStream:
        """The stream in W, of other places in the log."""
        turns = None if stream.rotation == "none" else self._turns(stream)
        move = Offset(translation=self.offset.translation)
        positions, _ = with_offset(places_in_world(places, self.world), turns, move)
        return replace(stream, positions=self._at_height(positions))

    def with_rotations(self, stream: PoseStream, rotations: Rotation) -> PoseStream:
        """The stream in W, of other rotations in the log."""
        rotation = rotations.inv() if self.inverse else rotations
        placed = places_in_world(self.places(stream), self.world)
        positions, turned = with_offset(placed, rotations_in_world(rotation, self.world), self.offset)
        assert turned is not None
        return replace(stream, positions=self._at_height(positions), quaternions=wxyz_of(turned))

    def _turns(self, stream: PoseStream) -> Rotation:
        """Of the tracked frame in W."""
        turned = Rotation.from_quat(np.roll(stream.quaternions, -1, axis=1))
        return turned * rotation_wxyz(self.offset.rotation).inv()

    def _at_height(self, positions: Array) -> Array:
        if self.height is not None:
            positions[:, 2] = self.height
        return positions


def source_frame(stated: Stated | None, pose: PoseMap | None) -> SourceFrame:
    """The frame of one of a map's bodies."""
    if stated is None or pose is None:
        return SourceFrame()
    return SourceFrame(
        world=stated.world_of(pose),
        offset=pose.offset,
        inverse=pose.turn is not None and pose.turn.inverse,
        height=pose.height,
    )
