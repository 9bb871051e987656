"""What the simulator itself may be off by: one covariance of a few numbers, learned from worlds without an effect.

Once the object moves, the error of its yaw wanders along its way, and its place is as unsure as a little white noise
makes it. By likelihood, of the twin beside MuJoCo: 419 pushes of 30 opened worlds (``benchmarks/discrepancy.py``).
Frictions that wander along the way came out at nothing there, which they are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from physid_drake.pushes.features import FLOOR, PushFeatures
from physid_drake.pushes.problem import PushProblem

Array = NDArray[np.float64]

WANDERS = np.array([0.0, 0.0, 2.9e-4])  # m, m, rad
ALIKE = 0.009  # m of way over which the error is the same
WHITE = np.array([1.8e-5, 1.8e-5, 0.0])  # m, m, rad
ARM = 0.04  # m: of a turn, whose way counts as well


def way_of(poses: Array) -> Array:
    """How far an object has gone (n,) by each of its poses (n, 3) [m], turns about it included."""
    steps = np.diff(poses, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1]) + ARM * np.abs(steps[:, 2])
    return np.concatenate([[0.0], np.cumsum(lengths)])


def discrepancy(problem: PushProblem, features: PushFeatures) -> Array:
    """Covariance (m, m) of a push's features, in their units; none of forces."""
    way = way_of(np.vstack([problem.start.pose, features.poses(features.recorded)]))[1:]
    alike = np.exp(-np.abs(way[:, None] - way[None, :]) / ALIKE)
    moving = features.middles > problem.moving[0]
    covariance, count = np.zeros((len(features.recorded),) * 2), len(way)
    for dof in range(features.dofs):
        part = slice(dof * count, (dof + 1) * count)
        own = WANDERS[dof] ** 2 * alike + WHITE[dof] ** 2 * np.eye(count)
        covariance[part, part] = own * np.outer(moving, moving) / features.sigmas[dof] ** 2
    return covariance


def sensor_noise(features: PushFeatures) -> Array:
    """The features' noise (m, m) without the cell's own error, of which ``discrepancy`` is another account."""
    noise, count = features.noise.copy(), len(features.middles)
    for dof in range(features.dofs):
        part = slice(dof * count, (dof + 1) * count)
        noise[part, part] -= (FLOOR[dof] / features.sigmas[dof]) ** 2 * (0.9 + 0.1 * np.eye(count))
    return noise
