"""What goes into a rollout and what comes out."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Outcome(enum.Enum):
    """How a rollout ended."""

    COMPLETED = "completed"
    FELL = "fell off the table"
    DIVERGED = "diverged"


@dataclass(frozen=True, kw_only=True)
class Start:
    """The object's state before a push: planar pose (x, y, yaw) [m, rad] and velocity [m/s, rad/s] of Bo in W."""

    pose: tuple[float, float, float]
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Motion:
    """What a rollout returns, at the time steps.

    Attributes:
        times: (n,) s.
        poses: (n, 7) quaternion wxyz and position of B in W.
        forces: (n, 3) mean force of the hand on the object over the time step that ends at each time, in W [N];
            without the impulse of a rigid tip's impact, which takes no time.
        outcome: how it ended.
        impacts: times of the impacts [s].
    """

    times: Array
    poses: Array
    forces: Array
    outcome: Outcome
    impacts: tuple[float, ...] = ()

    def planar_at(self, times: Array) -> Array:
        """Poses x, y, yaw (n, 3) [m, rad] at any times (n,), yaw unwrapped from the start's.

        Yaw is the heading of the object's y axis, which a cylinder that rolls about it keeps.
        """
        w, x, y, z = self.poses[:, :4].T
        yaw = np.unwrap(np.arctan2(2.0 * (w * z - x * y), 1.0 - 2.0 * (x * x + z * z)))
        table = np.column_stack([self.poses[:, 4], self.poses[:, 5], yaw])
        return np.column_stack([np.interp(times, self.times, column) for column in table.T])

    def forces_at(self, times: Array) -> Array:
        """Hand forces (n, 3) [N] at any times (n,)."""
        return np.column_stack([np.interp(times, self.times, column) for column in self.forces.T])


@dataclass
class Log:
    """Rows of a rollout in the making."""

    times: list[float] = field(default_factory=list)
    poses: list[Array] = field(default_factory=list)
    forces: list[tuple[float, float, float]] = field(default_factory=list)
    impacts: list[float] = field(default_factory=list)

    def add(self, time: float, pose: Array, force: tuple[float, float, float]) -> None:
        """Append a time step: time [s], pose (7,), hand force [N]."""
        self.times.append(time)
        self.poses.append(pose)
        self.forces.append(force)

    def motion(self, outcome: Outcome) -> Motion:
        """The rows as a Motion."""
        return Motion(
            times=np.array(self.times),
            poses=np.array(self.poses),
            forces=np.array(self.forces),
            outcome=outcome,
            impacts=tuple(self.impacts),
        )


def planar_pose(w: float, x: float, y: float, z: float, px: float, py: float) -> tuple[float, float, float]:
    """x, y [m] and the heading [rad] of the body's y axis, from a quaternion and a position."""
    return px, py, math.atan2(2.0 * (w * z - x * y), 1.0 - 2.0 * (x * x + z * z))
