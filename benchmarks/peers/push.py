"""Five pushes of one eraser, 1.5 s each, in which something moves nearly all of the time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DURATION = 1.5  # s, of every push
SIZE = (0.127, 0.051, 0.030)  # m, of the eraser
MASS = 0.054  # kg
FRICTION = 0.3  # eraser on table, and eraser on hand
GRAVITY = 9.81  # m/s^2
TIP_RADIUS = 0.010  # m, a sphere
TIP_HEIGHT = 0.015  # m above the table: the height of the centre of mass
CLEARANCE = 0.003  # m between tip and eraser at the start


@dataclass(frozen=True, kw_only=True)
class Push:
    """A prescribed path of the tip; the eraser starts at rest at the origin, its long side along x.

    Attributes:
        name: for the table.
        times: (k,) knots [s].
        velocities: (k, 2) at the knots [m/s], linear between.
        start: (2,) of the tip [m].
    """

    name: str
    times: Array
    velocities: Array
    start: Array

    def positions(self, times: Array) -> Array:
        """Positions (n, 2) of the tip [m] at ``times`` (n,)."""
        spans = np.diff(self.times)[:, None]
        knots = np.vstack(
            [np.zeros(2), np.cumsum(0.5 * spans * (self.velocities[1:] + self.velocities[:-1]), axis=0)]
        )
        t = np.clip(times, self.times[0], self.times[-1])
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        into, slope = (t - self.times[k])[:, None], np.diff(self.velocities, axis=0) / spans
        return np.asarray(self.start + knots[k] + into * (self.velocities[k] + 0.5 * into * slope[k]))

    def grid(self, time_step: float) -> Array:
        """Positions (n + 1, 2) of the tip [m] at the steps of a simulation of ``DURATION``."""
        return self.positions(time_step * np.arange(round(DURATION / time_step) + 1))


class Engine(Protocol):
    """What can simulate a push."""

    def rollout(self, push: Push) -> Array:
        """Write the parameters, simulate, log the pose at every step: the last one (3,), x, y [m], yaw [rad]."""
        ...


def planar(places: Array, w: Array, x: Array, y: Array, z: Array) -> Array:
    """Poses (n, 3) [m, rad] of places (n, 3) and the components (n,) of quaternions; yaw does not leap."""
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.column_stack([places[:, :2], np.unwrap(yaw)])


def _push(name: str, start: tuple[float, float], times: list[float], velocities: list[tuple[float, float]]) -> Push:
    return Push(name=name, times=np.array(times), velocities=np.array(velocities), start=np.array(start))


def _along(speed: float, heading_deg: float) -> tuple[float, float]:
    """A velocity off the y axis by ``heading_deg``."""
    return speed * math.sin(math.radians(heading_deg)), speed * math.cos(math.radians(heading_deg))


_BELOW = -(0.5 * SIZE[1] + TIP_RADIUS + CLEARANCE)
_LEFT = -(0.5 * SIZE[0] + TIP_RADIUS + CLEARANCE)
_STOP = (0.0, 0.0)

PUSHES = (
    # 2 mm off the middle of the long side, quasi-static.
    _push("slow", (0.002, _BELOW), [0, 0.03, 1.45, 1.48], [_STOP, (0, 0.15), (0, 0.15), _STOP]),
    # Up to 0.5 m/s, then a brake of 20 ms: the eraser slides on for 0.15 s.
    _push("fast", (0.0005, _BELOW), [0, 1.2, 1.28, 1.30], [_STOP, (0, 0.5), (0, 0.5), _STOP]),
    # 0.25 m/s, turning by 30 degrees; released at the end.
    _push("curve", (-0.003, _BELOW), [0, 0.03, 1.4, 1.43], [_STOP, (0, 0.25), _along(0.25, 30), _STOP]),
    # 0.2 m/s, 25 degrees off the face's normal: the tip slides along the face.
    _push("oblique", (-0.02, _BELOW), [0, 0.03, 1.4, 1.43], [_STOP, _along(0.2, 25), _along(0.2, 25), _STOP]),
    # 0.3 m/s on the short side, 1 mm off its middle: unstable.
    _push("end-on", (_LEFT, 0.001), [0, 0.03, 1.35, 1.38], [_STOP, (0.3, 0), (0.3, 0), _STOP]),
)
