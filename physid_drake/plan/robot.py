"""Robots that make planned pushes, for the loop of pushing, learning and planning."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from physid_drake.errors import RobotError
from physid_drake.model import Model
from physid_drake.plan.trajectory import Ending, Situation, path_of, tip_height_of, trajectory_of, true_solid
from physid_drake.policies import PlannedPush, hand_samples
from physid_drake.recording import PoseStream, Push, Sensors, planar_poses

Array = NDArray[np.float64]
Pose = tuple[float, float, float]

RATE = 100.0  # Hz of the recording
REST = 0.2  # s recorded after the object has stopped


class Robot(Protocol):
    """Sees the object, and makes planned pushes."""

    def see(self) -> Pose:
        """The object's pose, x, y [m], yaw [rad]."""
        ...

    def execute(self, push: PlannedPush, *, aim: Pose | None = None) -> Push:
        """Make one push and record it.

        Args:
            push: to make.
            aim: pose of the object at which the hand aims, x, y [m], yaw [rad]; None for where it is seen.

        Raises:
            RobotError: if it cannot push.
        """
        ...


class SimulatedRobot:
    """A robot whose world is a simulated model. The object stays where a push has left it.

    Attributes:
        ending: how the last push ended; ``AT_REST`` before the first.
    """

    def __init__(
        self, hidden: Model, *, start: Pose, sensors: Sensors, rng: np.random.Generator, pushes: int = 0
    ) -> None:
        """Put the object on the table.

        Args:
            hidden: the model of the world, which whoever plans does not know.
            start: of the object, x, y [m], yaw [rad].
            sensors: standard deviations of white noise; None is no noise.
            rng: draws the noise.
            pushes: number of pushes that were made before, for effects that depend on it.
        """
        self._hidden, self._pose, self._sensors, self._rng = hidden, start, sensors, rng
        self._pushes = pushes
        self.ending = Ending.AT_REST

    def see(self) -> Pose:
        """The object's pose, x, y [m], yaw [rad], with the tracker's noise."""
        x, y, yaw = np.array(self._pose) + self._rng.standard_normal(3) * self._sensors.object_std
        return float(x), float(y), float(yaw)

    def execute(self, push: PlannedPush, *, aim: Pose | None = None) -> Push:
        """Make one push, and record it at 100 Hz until the object has rested for 0.2 s.

        Args:
            push: to make.
            aim: pose of the object at which the hand aims, x, y [m], yaw [rad]; None for where it is seen.

        Raises:
            RobotError: if an earlier push lost the object, or the rollout diverges.
        """
        if self.ending not in (Ending.AT_REST, Ending.MOVING):
            raise RobotError(f"robot: the object {self.ending.value} in the last push; put it back first.")
        situation = Situation(start=self._pose, order=self._pushes)
        path = path_of(self._hidden.baseline(), push, aim or self.see())
        trajectory = trajectory_of(self._hidden, (push,), situation, path=path, rate=RATE)
        if trajectory.ending is Ending.DIVERGED:
            raise RobotError("robot: the hidden world's rollout diverged.")
        self._pushes += 1
        self.ending = trajectory.ending
        x, y, yaw = trajectory.end.tolist()
        self._pose = (x, y, yaw)
        moving = np.flatnonzero(np.abs(np.diff(trajectory.poses, axis=0)).max(axis=1) > 1e-6)
        stopped = float(trajectory.times[moving[-1] + 1]) if len(moving) else 0.0
        end = min(max(stopped, float(path.times[-1])) + REST, float(trajectory.times[-1]))
        count = math.ceil(end * RATE)
        times, poses = trajectory.times[:count], trajectory.poses[:count]
        hand = hand_samples(path, tip_height_of(self._hidden, situation), rate=RATE).positions
        hand = np.vstack([hand, np.repeat(hand[-1:], max(0, len(times) - len(hand)), axis=0)])[: len(times)]
        hand[:, :2] += (self._sensors.hand_position_std or 0.0) * self._rng.standard_normal((len(times), 2))
        return Push(
            name=f"pushes/{self._pushes:03d}.csv", object=self._object(times, poses), force=None,
            hand=PoseStream(times=times, positions=hand, quaternions=np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1))),
        )  # fmt: skip

    def _object(self, times: Array, poses: Array) -> PoseStream:
        seen = poses + self._rng.standard_normal(poses.shape) * self._sensors.object_std
        return planar_poses(times, seen, 0.5 * true_solid(self._hidden).height)
