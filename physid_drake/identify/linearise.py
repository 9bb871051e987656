"""A push as a term of the normal equations: its misfit, linear in theta and in its own unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from physid_drake.identify.misfit import Whitener, difference, diverged, model_error_columns, whitened_residual
from physid_drake.identify.nuisance import Nuisance, nuisance_of
from physid_drake.identify.polish import NUISANCE_STEP, THETA_STEP, first_motion, prior_rows, rescaled
from physid_drake.identify.problem import Noise, PushProblem
from physid_drake.identify.rollouts import RolloutPool, Task
from physid_drake.space import ParameterSpace

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class PushTerm:
    """One push, linearised.

    Attributes:
        problem: the push.
        nuisance: its own unknowns.
        u: (d,) where, in the unit cube of theta.
        residual: (m,) whitened misfit there, in standard deviations.
        slope: (m, d) of the misfit with respect to the unit cube.
        own: (m, k) with respect to its own unknowns, in units of their priors.
        scatter: of friction from push to push that ``own`` was scaled with.
    """

    problem: PushProblem
    nuisance: Nuisance
    u: Array
    residual: Array
    slope: Array
    own: Array
    scatter: float

    @property
    def diverged(self) -> bool:
        """Whether the rollout at ``u`` diverged: the term then says nothing."""
        return diverged(self.residual)

    def whitener(self, scatter: float) -> Whitener:
        """What marginalises the push's own unknowns, friction's with another scatter."""
        return rescaled(Whitener.of(self.own), self.nuisance.index("friction"), scatter / self.scatter)

    def residual_at(self, u: Array) -> Array:
        """The misfit (m,) at another point (d,) of the cube, linearly."""
        return np.asarray(self.residual + self.slope @ (u - self.u))

    def marginal(self, u: Array, scatter: float) -> tuple[Array, Array]:
        """Marginal residual (m + k,) at u, and its slope (m + k, d)."""
        whitener = self.whitener(scatter)
        columns = [whitener.apply(column) for column in self.slope.T]
        return whitener.apply(self.residual_at(u)), np.column_stack(columns)

    def information(self, scatter: float) -> Array:
        """What the push tells about theta: the Gauss-Newton matrix (d, d) of its marginal cost, in the unit cube."""
        _, slope = self.marginal(self.u, scatter)
        return np.asarray(slope.T @ slope)


def linearised(
    pool: RolloutPool, problems: Sequence[PushProblem], noise: Noise, u: Array, scatter: float
) -> list[PushTerm]:
    """Terms of pushes at a point u (d,) of the unit cube, by 1 + k + 2 d rollouts each.

    A step whose rollout diverges counts as one that changes nothing.
    """
    space = pool.thetas.space
    centre = np.asarray(space.from_unit(u))
    low, high = np.maximum(0.0, u - THETA_STEP), np.minimum(1.0, u + THETA_STEP)
    tasks: list[Task] = []
    for problem in problems:
        nuisance = nuisance_of(problem, scatter)
        rest = np.zeros(len(nuisance.names))
        tasks += [
            Task(problem=problem, theta=centre, nuisance=nuisance, values=step)
            for step in [rest, *(NUISANCE_STEP * np.diag(nuisance.stds))]
        ]
        for j in range(len(u)):
            for side in (low, high):
                point = u.copy()
                point[j] = side[j]
                theta = np.asarray(space.from_unit(point))
                tasks.append(Task(problem=problem, theta=theta, nuisance=nuisance, values=rest))
    rows = [whitened_residual(task.problem, noise, p) for task, p in zip(tasks, pool.run(tasks), strict=True)]
    terms, first = [], 0
    for problem in problems:
        nuisance = nuisance_of(problem, scatter)
        own, steps = len(nuisance.names), 2 * len(u)
        stack = rows[first : first + 1 + own + steps]
        first += len(stack)
        here = stack[0]
        slopes = [
            difference(stack[1 + own + 2 * j], stack[2 + own + 2 * j]) / (high[j] - low[j]) for j in range(len(u))
        ]
        columns = [difference(here, row) / NUISANCE_STEP for row in stack[1 : 1 + own]]
        errors = model_error_columns(problem, noise, first_motion(problem, noise))
        terms.append(
            PushTerm(
                problem=problem, nuisance=nuisance, u=u.copy(), scatter=scatter,
                residual=here, slope=np.column_stack(slopes), own=np.column_stack([*columns, errors]),
            )
        )  # fmt: skip
    return terms


def prior_slope(space: ParameterSpace) -> Array:
    """The slope (d, d) of ``polish.prior_rows`` with respect to the unit cube; they are linear in it."""
    middle = np.full(space.dimension, 0.5)
    rows = [prior_rows(space, space.from_unit(middle + 0.25 * step)) for step in np.eye(space.dimension)]
    return np.asarray(4.0 * (np.array(rows) - prior_rows(space, space.from_unit(middle))).T)
