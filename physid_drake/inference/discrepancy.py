"""The simulator's own error: a covariance with a few constants, learned from simulated worlds without an effect.

Once the object moves, its yaw has an error that is correlated over the way it has gone, and its position an error
that is white. The constants maximise the likelihood of 419 pushes of 30 worlds that were simulated with MuJoCo,
beside the twin (``benchmarks/discrepancy.py``). A friction that varies along the way was estimated there too, as
zero, which is true of these worlds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from physid_drake.pushes.features import FLOOR, PushFeatures
from physid_drake.pushes.problem import PushProblem

Array = NDArray[np.float64]

WANDERS = np.array([0.0, 0.0, 2.9e-4])  # m, m, rad
ALIKE = 0.009  # m: correlation length along the way
WHITE = np.array([1.8e-5, 1.8e-5, 0.0])  # m, m, rad
ARM = 0.04  # m: what a turn of a radian counts as


def way_of(poses: Array) -> Array:
    """Length of the way (n,) [m] up to each of an object's poses (n, 3), x, y [m], yaw [rad].

    A turn counts as its angle times ``ARM``.
    """
    steps = np.diff(poses, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1]) + ARM * np.abs(steps[:, 2])
    return np.concatenate([[0.0], np.cumsum(lengths)])


def discrepancy(problem: PushProblem, features: PushFeatures) -> Array:
    """Covariance (m, m) of the simulator's error of a push's features, in the features' units.

    That is in standard deviations of the tracker's noise. Forces have none.
    """
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
    """Covariance (m, m) of a push's features, in the features' units, by the sensors' noise alone.

    ``PushFeatures.noise`` contains a constant for the simulator's error, which is taken away here: ``discrepancy``
    describes it in more detail.
    """
    noise, count = features.noise.copy(), len(features.middles)
    for dof in range(features.dofs):
        part = slice(dof * count, (dof + 1) * count)
        noise[part, part] -= (FLOOR[dof] / features.sigmas[dof]) ** 2 * (0.9 + 0.1 * np.eye(count))
    return noise
