"""Effects of the tracker: what it reports of where the object was."""

from __future__ import annotations

import dataclasses as dc
import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from physid_drake.effects.effect import Coordinate, Effect, Family, Pose, Surroundings, families_of_sizes, parameter
from physid_drake.ranges import POSITIVE

Array = NDArray[np.float64]


@dc.dataclass(frozen=True, kw_only=True)
class TrackerLatency(Effect):
    """The object's stream is late.

    Late by the hand's clock: without a hand the recorded start is as late as all that follows, and nothing tells.
    """

    name: ClassVar[str] = "tracker_latency"
    element: ClassVar[str] = "sensor"
    statement: ClassVar[str] = "the tracker reports the object late"
    frame: ClassVar[str] = "time"
    amplitudes: ClassVar[tuple[str, ...]] = ("delay",)

    delay: float = parameter(0.0, "s")

    @classmethod
    def applies(cls, around: Surroundings) -> bool:
        """With a hand."""
        return around.has_hand

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The delay."""
        del around
        return (Coordinate(name="delay", step=2e-3, lower=0.0, upper=0.5, tolerance=2e-4),)

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """Small and large."""
        del around
        return families_of_sizes(1.0, 8.0, 30.0)

    def lateness(self) -> float:
        """By how much."""
        return self.delay


@dc.dataclass(frozen=True, kw_only=True)
class TrackerBias(Effect):
    """The tracked frame is not the object's: a constant pose offset in B."""

    name: ClassVar[str] = "tracker_bias"
    element: ClassVar[str] = "sensor"
    statement: ClassVar[str] = "the tracked frame is not the centre of the object's shape"
    frame: ClassVar[str] = "object"
    amplitudes: ClassVar[tuple[str, ...]] = ("x", "y", "yaw")

    x: float = parameter(0.0, "m")
    y: float = parameter(0.0, "m")
    yaw: float = parameter(0.0, "rad")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """How far the tracked frame is from the object, along its own axes, and yaw.

        Along its own axes, so that turning a round object moves nothing else.
        """
        most = 0.5 * around.radius
        places = tuple(Coordinate(name=name, step=4e-4, lower=-most, upper=most) for name in ("along_x", "along_y"))
        # About a round object nothing tells the yaw; trackers are mounted about straight.
        return (*places, Coordinate(name="yaw", step=4e-3, lower=-0.8, upper=0.8, std=0.2))

    @classmethod
    def at(cls, point: Array, around: Surroundings) -> TrackerBias:
        """The offset along the object's axes."""
        del around
        along_x, along_y, yaw = point.tolist()
        c, s = math.cos(yaw), math.sin(yaw)
        return cls(x=c * along_x - s * along_y, y=s * along_x + c * along_y, yaw=yaw)

    def true_pose(self, pose: Pose) -> Pose:
        """The object's pose for a tracked one."""
        yaw = pose[2] - self.yaw
        c, s = math.cos(yaw), math.sin(yaw)
        return pose[0] - (c * self.x - s * self.y), pose[1] - (s * self.x + c * self.y), yaw

    def tracked(self, poses: Array) -> Array:
        """The tracked frame's poses."""
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        shift = np.column_stack([c * self.x - s * self.y, s * self.x + c * self.y, np.full(len(poses), self.yaw)])
        tracked: Array = poses + shift
        return tracked


@dc.dataclass(frozen=True, kw_only=True)
class TrackerScale(Effect):
    """Lengths are measured ``ratio`` times too long, about the origin of W."""

    name: ClassVar[str] = "tracker_scale"
    element: ClassVar[str] = "sensor"
    statement: ClassVar[str] = "the tracker measures lengths too long or too short"
    frame: ClassVar[str] = "world"
    amplitudes: ClassVar[tuple[str, ...]] = ("ratio",)

    ratio: float = parameter(1.0, "-", values=POSITIVE)

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Log ratio."""
        del around
        return (Coordinate(name="ratio", log=True, step=3e-3, lower=math.log(0.7), upper=math.log(1.4)),)

    def true_pose(self, pose: Pose) -> Pose:
        """The object's pose for a tracked one."""
        return pose[0] / self.ratio, pose[1] / self.ratio, pose[2]

    def tracked(self, poses: Array) -> Array:
        """Positions, scaled."""
        tracked: Array = poses * np.array([self.ratio, self.ratio, 1.0])
        return tracked
