"""PoWER: policy learning by weighting exploration with the returns, the model-free peer of the paper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np
import numpy.typing as npt

from physid_drake.errors import ParameterError
from physid_drake.space import Array, ParameterSpace, read_only


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class PowerResult:
    """What PoWER tried and where it went.

    Attributes:
        thetas: (m, d) trials in their order, each entry in its unit.
        errors: (m,) of the trials, in the unit of the objective; inf where a trial failed.
        means: (updates + 1, d) the policy's settings, the start first.
    """

    thetas: Array
    errors: Array
    means: Array


def search_by_power(
    objective: Callable[[Array], Array],
    space: ParameterSpace,
    *,
    rng: np.random.Generator,
    rollouts: int = 5,
    updates: int = 10,
    sharpness: float = 2.0,
    exploration: float = 0.2,
    reused: int = 10,
    start: npt.ArrayLike | None = None,
) -> PowerResult:
    """Expectation-maximisation on rewards exp(-sharpness * error), with a Gaussian around the settings.

    Every update draws ``rollouts`` settings, and moves the mean to the average, weighted by reward, of the best
    ``reused`` trials so far (the importance sampler of the source). The Gaussian's variance follows in the same
    way, from the trials' deviations from the mean, and never falls below a tenth of the exploration at the start.

    Args:
        objective: errors (k,) at settings (k, d), such as the distance to a goal [m]; inf where a rollout failed.
        space: of the settings; everything happens in its unit cube.
        rng: draws the exploration.
        rollouts: trials of an update.
        updates: how many.
        sharpness: of the reward, in one over the unit of the error.
        exploration: standard deviation at the start, as a share of each bound's width.
        reused: trials that an update learns from.
        start: settings (d,) to begin with; None for the space's nominal ones.

    Raises:
        ParameterError: if a number is out of its range, or ``start`` is outside the bounds.

    Source: J. Kober and J. Peters, "Policy Search for Motor Primitives in Robotics", NIPS 2009, algorithm 1.
    """
    if min(rollouts, updates, reused) < 1 or not (sharpness > 0.0 and exploration > 0.0):
        raise ParameterError(
            "search_by_power: rollouts, updates and reused are at least 1, sharpness and exploration above 0, but"
            f" got {rollouts}, {updates}, {reused}, {sharpness:g}, {exploration:g}."
        )
    mean = np.asarray(space.to_unit(space.nominal if start is None else start))
    floor = (0.1 * exploration) ** 2
    variance = np.full(space.dimension, exploration**2)
    points, errors, means = np.zeros((0, space.dimension)), np.zeros(0), [mean]
    for _ in range(updates):
        tried = np.clip(mean + np.sqrt(variance) * rng.standard_normal((rollouts, space.dimension)), 0.0, 1.0)
        told = np.asarray(objective(space.from_unit(tried)), dtype=np.float64)
        points, errors = np.concatenate([points, tried]), np.concatenate([errors, told])
        best = np.argsort(errors, kind="stable")[:reused]
        rewards = np.exp(-sharpness * np.where(np.isfinite(errors[best]), errors[best], np.inf))
        if rewards.sum() > 0.0:
            shares = rewards / rewards.sum()
            deviations = points[best] - mean
            variance = np.maximum(shares @ deviations**2, floor)
            mean = mean + shares @ deviations
        means.append(mean)
    return PowerResult(
        thetas=read_only(space.from_unit(points)), errors=read_only(errors), means=read_only(space.from_unit(means))
    )
