"""The hand's path: piecewise-linear velocity with few knots.

A recorded path is not a polygon: linear interpolation of 0.05 mm of noise at 100 Hz is 7 mm/s of velocity
noise, on which the object bounces, and smoothing splines overshoot at the brake and throw it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class HandPath:
    """A planar path ``p_WP(t)`` whose velocity is linear between knots; at rest before and after them.

    Attributes:
        times: (k,) knots, increasing [s].
        velocities: (k, 2) at the knots [m/s]; what is not zero at an end stops there at once.
        start: (2,) position at ``times[0]`` [m].
    """

    times: Array
    velocities: Array
    start: Array

    def knot_positions(self) -> Array:
        """Positions (k, 2) at the knots [m]."""
        steps: Array = np.diff(self.times)[:, None] * 0.5 * (self.velocities[1:] + self.velocities[:-1])
        positions: Array = self.start + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
        return positions

    def positions(self, times: Array) -> Array:
        """Positions (n, 2) at any times (n,) [m]."""
        t = np.clip(times, self.times[0], self.times[-1])
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        into = (t - self.times[k])[:, None]
        slope = (self.velocities[k + 1] - self.velocities[k]) / (self.times[k + 1] - self.times[k])[:, None]
        result: Array = self.knot_positions()[k] + into * (self.velocities[k] + 0.5 * into * slope)
        return result
