"""What is compared of a push: mean poses over short windows, in standard deviations, with their noise covariance.

Means over windows keep what a rigid body can do within 20 to 100 ms, and make a push a vector of some forty numbers
whose covariance is written down in full, whatever the noise's correlation and the gaps in the stream.
"""

from __future__ import annotations

import dataclasses as dc

import numpy as np
from numpy.typing import NDArray

from physid_drake.pushes.prediction import Prediction
from physid_drake.pushes.problem import PushProblem
from physid_drake.pushes.tracker_noise import ForceNoise, TrackerNoise
from physid_drake.recording import Push, rest_segments

Array = NDArray[np.float64]

WINDOWS = 14  # while the object moves
FORCE_MEMORY = 0.03  # m of the hand's way: over which a force that wanders with the place on the table is the same
# What is left of the cell's own error after the touch: about a constant [m, m, rad].
FLOOR = np.array([5e-5, 5e-5, 1.0e-3])


@dc.dataclass(frozen=True, kw_only=True)
class PushFeatures:
    """One push as a vector: x of all windows, y, yaw if it was measured, then force components.

    Attributes:
        averaging: (w, n) takes samples to windows.
        middles: (w,) mean time of each window [s].
        sigmas: (3,) units of x, y, yaw [m, m, rad].
        recorded: (m,) the recording's features, in standard deviations.
        noise: (m, m) covariance of the features: tracker, time stamps, and the cell's own error.
        force_std: (k,) of each force window [N].
        force_way: (k,) how far the hand has gone by each [m].
        force_size: root mean square of the force [N].
        dofs: that were measured: three, or two where the yaw was not.
    """

    averaging: Array
    middles: Array
    sigmas: Array
    recorded: Array
    noise: Array
    force_std: Array
    force_way: Array
    force_size: float
    dofs: int = 3

    def of(self, prediction: Prediction) -> Array:
        """Features (m,) of a rollout."""
        return self._vector(prediction.poses, prediction.forces)

    def _vector(self, poses: Array, forces: Array) -> Array:
        windows = (self.averaging @ poses) / self.sigmas
        return np.concatenate([windows[:, : self.dofs].T.ravel(), (forces / self.force_std[:, None]).T.ravel()])

    def force_noise(self, forces: ForceNoise) -> Array:
        """Covariance (k, k) of a component in all windows, in deviations: white, wandering, off as a whole."""
        gaps = np.abs(self.force_way[:, None] - self.force_way[None, :])
        shares = forces.scatter**2 * np.exp(-gaps / FORCE_MEMORY) + forces.offset**2
        scaled: Array = self.force_size**2 * shares / np.outer(self.force_std, self.force_std)
        return np.eye(len(self.force_std)) + scaled

    def poses(self, vector: Array) -> Array:
        """Window means (w, 3) [m, m, rad] of a vector (m,); a yaw that was not measured is zero."""
        poses = np.zeros((len(self.middles), 3))
        poses[:, : self.dofs] = vector[: self.pose_numbers].reshape(self.dofs, -1).T
        return np.asarray(poses * self.sigmas)

    @property
    def pose_numbers(self) -> int:
        """How many of the numbers are of poses; the rest are of forces."""
        return self.dofs * len(self.middles)

    def forces(self, vector: Array) -> Array:
        """Force components (k, 2) [N] of a vector (m,)."""
        forces: Array = vector[self.pose_numbers :].reshape(2, -1).T * self.force_std[:, None]
        return forces


def features_of(push: Push, problem: PushProblem, noise: TrackerNoise) -> PushFeatures:
    """The features of a recorded push."""
    averaging = _averaging(push, problem)
    count = len(averaging)
    times = problem.times
    force_std = problem.force_std
    dofs = 2 if push.object.rotation == "none" else 3
    blocks = np.zeros((dofs * count + 2 * len(force_std),) * 2)
    speeds = _speeds(times, problem.poses)
    for dof in range(dofs):
        covariance = noise.correlation(times, dof)
        # A jittered stamp is white noise of the speed.
        covariance = covariance + np.diag((noise.jitter * speeds[:, dof] / noise.sigmas[dof]) ** 2)
        part = slice(dof * count, (dof + 1) * count)
        blocks[part, part] = averaging @ covariance @ averaging.T
        blocks[part, part] += (FLOOR[dof] / noise.sigmas[dof]) ** 2 * (0.9 + 0.1 * np.eye(count))
    made = PushFeatures(
        averaging=averaging,
        middles=averaging @ times,
        sigmas=noise.sigmas,
        recorded=np.zeros(0),
        noise=blocks,
        force_std=force_std,
        force_way=_way(problem),
        force_size=float(np.sqrt((problem.forces**2).sum(axis=1).mean())) if len(force_std) else 0.0,
        dofs=dofs,
    )
    blocks[dofs * count :, dofs * count :] = np.kron(np.eye(2), made.force_noise(noise.forces))
    return dc.replace(made, recorded=made._vector(problem.poses, problem.forces))


def _way(problem: PushProblem) -> Array:
    """How far the hand has gone (k,) by each force window [m]."""
    k = len(problem.force_times)
    places = np.zeros((k, 2)) if problem.path is None else problem.path.positions(problem.force_times)
    return np.concatenate([np.zeros(min(k, 1)), np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])


def _averaging(push: Push, problem: PushProblem) -> Array:
    """Windows over the motion, of equal length, and one over the final rest; the start's rest made the start pose."""
    times = problem.times
    n = len(times)
    rests = rest_segments(push) if not push.endpoint_only else []
    first = rests[0].stop - 1 if rests and rests[0].start == 0 and problem.path is not None else 0
    offset = int(np.searchsorted(push.object.times, times[0]))  # the first sample that is compared
    ends = offset + n
    last = rests[-1].start if rests and rests[-1].stop >= ends > rests[-1].start > first else ends
    first, last = max(0, first - offset), max(1, last - offset)
    if n < 4 or last - first < 4:
        rows = [np.arange(n)[k:] for k in (max(first, 0) if n > first else n - 1,)]
    else:
        windows = min(WINDOWS, (last - first) // 2)
        edges = np.linspace(times[first], times[min(last, n - 1)], windows + 1)
        # The last sample of a stream that ends in motion is on the last edge.
        index = np.minimum(np.searchsorted(edges, times, side="right") - 1, windows - 1)
        rows = [
            np.flatnonzero((index == k) & (np.arange(n) >= first) & (np.arange(n) < last)) for k in range(windows)
        ]
        rows.append(np.arange(last, n))
    rows = [row for row in rows if len(row)]
    averaging = np.zeros((len(rows), n))
    for k, row in enumerate(rows):
        averaging[k, row] = 1.0 / len(row)
    return averaging


def _speeds(times: Array, poses: Array) -> Array:
    """Speeds (n, 3) of x, y, yaw, smoothed over neighbours."""
    if len(times) < 5:
        return np.zeros_like(poses)
    rates: Array = np.abs(np.gradient(poses, times, axis=0))
    smooth = np.apply_along_axis(lambda column: np.convolve(column, np.ones(5) / 5.0, mode="same"), 0, rates)
    return np.asarray(smooth)
