"""Updates a model's estimates, intervals and correlation with a push that was made."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from physid_drake.cell import HandPath
from physid_drake.model import Correlation, Model
from physid_drake.plan.draws import Z90, moved, root_of, uncertain_names, value_of
from physid_drake.plan.trajectory import Ending, Situation, trajectory_of
from physid_drake.policies import PlannedPush

Array = NDArray[np.float64]
Pose = tuple[float, float, float]

OWN_ERROR = (1e-3, 1e-3, 0.01)  # m, m, rad: standard deviation of a right model's error, beside the tracker's noise
STEP = (0.1,)  # standard deviations, of differences
MOST_STEPS = 6
LOST = 1e3  # standard deviations: of a rollout that diverged, in all that is compared


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class MadePush:
    """A push that was made.

    Attributes:
        planned: the push.
        path: the hand's path that was commanded.
        situation: where the object was seen before it.
        end: where the object was seen at rest after it, x, y [m], yaw [rad].
    """

    planned: PlannedPush
    path: HandPath
    situation: Situation
    end: Pose


def learned(model: Model, made: MadePush, *, noise: Sequence[float], friction_scatter: float = 0.0) -> Model:
    """The model after one more push: the most probable estimates, and a Gaussian about them.

    The prior is the model's intervals with its correlation. Only the pose in which the object came to rest is
    compared, so that no common clock is needed. The friction of this push is estimated along, and not kept. A model
    without intervals is returned unchanged.

    Args:
        model: before the push.
        made: the push.
        noise: standard deviations of the tracker, x, y [m] and yaw [rad].
        friction_scatter: relative standard deviation of friction between pushes [-].

    Source: J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., 2006, chapter 10, for Gauss-Newton; D. MacKay,
        Information Theory, Inference, and Learning Algorithms, 2003, chapter 27, for Laplace's approximation.
    """
    names = uncertain_names(model)
    if not names:
        return model
    root = root_of(np.eye(len(names)) if model.correlation is None else model.correlation.among(names))
    # The start is seen with the same noise as the end.
    spread = np.sqrt(2.0 * np.square(noise) + np.square(OWN_ERROR))

    def residuals(scores: Array) -> Array:
        values = dict(zip(names, (root @ scores[:-1]).tolist(), strict=True))
        there = moved(model, values, friction_scatter * float(scores[-1]))
        way = trajectory_of(there, (made.planned,), made.situation, path=made.path)
        if way.ending is Ending.DIVERGED:
            return np.concatenate([np.full(3, LOST), scores])
        off = way.end - np.array(made.end)
        off[2] = np.angle(np.exp(1j * off[2]))
        return np.concatenate([off / spread, scores])

    found = least_squares(
        residuals, np.zeros(len(names) + 1), diff_step=STEP * (len(names) + 1), x_scale=1.0, max_nfev=MOST_STEPS
    )
    jacobian = np.asarray(found.jac, dtype=np.float64)
    information = jacobian.T @ jacobian  # the prior's rows are in it
    covariance = root @ np.linalg.inv(information)[:-1, :-1] @ root.T
    return _with_belief(model, names, root @ found.x[:-1], covariance)


def _with_belief(model: Model, names: Sequence[str], scores: Array, covariance: Array) -> Model:
    """The model at scores (n,) of its belief, with the intervals and the correlation of their covariance (n, n)."""
    stds = np.sqrt(np.maximum(np.diag(covariance), 1e-12))
    intervals = dict(model.intervals)
    for name, score, std in zip(names, scores.tolist(), stds.tolist(), strict=True):
        ends = [value_of(moved(model, {name: score + side * Z90 * std}, 0.0), name) for side in (-1.0, 1.0)]
        intervals[name] = sorted(ends)
    there = moved(model, dict(zip(names, scores.tolist(), strict=True)), 0.0)
    return dc.replace(
        there, intervals=intervals, correlation=Correlation.of(names, covariance / np.outer(stds, stds))
    )
