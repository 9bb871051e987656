"""How far a rollout is from a recording, in standard deviations of the measurement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from physid_drake.pushes.noise import Noise
from physid_drake.pushes.nuisance import MODEL_ERROR
from physid_drake.pushes.prediction import Prediction
from physid_drake.pushes.problem import PushProblem

Array = NDArray[np.float64]

FAILED = 1e4  # standard deviations: of a rollout that diverged, in all that is compared
DIVERGED = 3.0  # nats of a theta's cost for each push whose rollout diverges


def whitened_residual(problem: PushProblem, noise: Noise, prediction: Prediction | None) -> Array:
    """Prediction minus recording, in standard deviations, with the noise's correlation taken out.

    Args:
        problem: the push.
        noise: of one sample.
        prediction: of the same samples; None of a rollout that diverged.

    Returns:
        (3 n + 2 k,) x, y, yaw of all samples, then the force components; all ``FAILED`` where the rollout diverged.
    """
    if prediction is None:
        return np.full(3 * len(problem.times) + 2 * len(problem.force_times), FAILED)
    poses = (prediction.poses - problem.poses) / noise.sigmas
    forces = (prediction.forces - problem.forces) / problem.force_std[:, None]
    return np.concatenate([_decorrelate(problem.times, poses, noise.correlations).T.ravel(), forces.T.ravel()])


def diverged(vector: Array) -> bool:
    """Whether what is compared of a rollout (m,) says that it diverged."""
    return bool(np.all(vector == FAILED))


def difference(before: Array, after: Array) -> Array:
    """Between two rollouts, each (m,); none where one of them diverged, which no slope describes."""
    return np.zeros_like(before) if diverged(before) or diverged(after) else after - before


def _decorrelate(times: Array, residual: Array, correlations: Array) -> Array:
    """Take out first-order autoregressive noise: e_k - rho e_(k-1), rho (3,) to the power of the gap in samples."""
    if not correlations.any() or len(residual) < 3:
        return residual
    interval = float(np.median(np.diff(times)))
    rho = correlations ** np.maximum(1.0, np.diff(times) / interval)[:, None]
    result = residual.copy()
    result[1:] = (residual[1:] - rho * residual[:-1]) / np.sqrt(1.0 - rho**2)
    return result


@dataclass(frozen=True, kw_only=True)
class Whitener:
    """Marginalises a push's own unknowns: residual r has covariance I + J P J^T, P their prior variances.

    Attributes:
        jacobian: (m, k) of the whitened residual with respect to the unknowns in units of their priors.
        lower: Cholesky factor (k, k) of I + J^T J.
    """

    jacobian: Array
    lower: Array

    @classmethod
    def of(cls, jacobian: Array) -> Whitener:
        """The whitener of a scaled Jacobian (m, k)."""
        information: Array = np.eye(jacobian.shape[1]) + jacobian.T @ jacobian
        return cls(jacobian=jacobian, lower=np.linalg.cholesky(information).astype(np.float64))

    def apply(self, residual: Array) -> Array:
        """A vector (m + k,) whose squared norm is r^T C^-1 r: what is left, and what the unknowns had to do.

        The unknowns take their most likely values; they are returned too since their prior is part of the cost.
        """
        values = self.unknowns(residual)
        return np.concatenate([residual + self.jacobian @ values, values])

    def unknowns(self, residual: Array) -> Array:
        """Most likely values (k,) of the unknowns, in units of their priors."""
        right = self.jacobian.T @ residual
        values: Array = -np.linalg.solve(self.lower.T, np.linalg.solve(self.lower, right))
        return values

    def variances(self) -> Array:
        """Posterior variances (k,) of the unknowns, in units of their priors."""
        inverse = np.linalg.inv(self.lower)
        spread: Array = (inverse**2).sum(axis=0)
        return spread


def model_error_columns(problem: PushProblem, noise: Noise, moved: float) -> Array:
    """Columns (m, 3) for the cell's own error: constant in x, y, yaw after the touch.

    Args:
        problem: the push.
        noise: its noise.
        moved: time of the first touch [s].
    """
    n, k = len(problem.times), len(problem.force_times)
    columns = np.zeros((3 * n + 2 * k, 3))
    after = (problem.times > moved).astype(np.float64)
    for dof in range(3):
        shape = np.zeros((n, 3))
        shape[:, dof] = after * MODEL_ERROR[dof] / noise.sigmas[dof]
        columns[: 3 * n, dof] = _decorrelate(problem.times, shape, noise.correlations).T.ravel()
    return columns
