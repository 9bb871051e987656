"""A push as a term of the normal equations: its misfit, linear in theta and in its own unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from physid_drake.identify.own_columns import own_columns, own_tasks
from physid_drake.identify.polish import THETA_STEP, prior_rows, rescaled
from physid_drake.pushes.misfit import Whitener, difference, diverged, whitened_residual
from physid_drake.pushes.noise import Noise
from physid_drake.pushes.nuisance import Nuisance, nuisance_of
from physid_drake.pushes.problem import PushProblem
from physid_drake.pushes.rollouts import RolloutPool
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
        own: (m, k) with respect to its own unknowns, in units of their priors, and to errors of path and cell.
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
    """Terms of pushes at a point u (d,) of the unit cube, by 1 + k + e + 2 d rollouts each.

    A step whose rollout diverges counts as one that changes nothing.
    """
    space = pool.thetas.space
    low, high = np.maximum(0.0, u - THETA_STEP), np.minimum(1.0, u + THETA_STEP)
    thetas = [
        space.from_unit(point) for sides in zip(_moved(u, low), _moved(u, high), strict=True) for point in sides
    ]
    nuisances = [nuisance_of(problem, scatter) for problem in problems]
    stacks = []
    for problem, nuisance in zip(problems, nuisances, strict=True):
        own = own_tasks(problem, nuisance, np.asarray(space.from_unit(u)))
        stacks.append([*own, *(replace(own[0], theta=np.asarray(theta)) for theta in thetas)])
    tasks = [task for stack in stacks for task in stack]
    pairs = zip(tasks, pool.run(tasks), strict=True)
    rows = iter([whitened_residual(task.problem, noise, prediction) for task, prediction in pairs])
    terms = []
    for problem, nuisance, stack in zip(problems, nuisances, stacks, strict=True):
        residuals = [next(rows) for _ in stack]
        own_rows, sides = residuals[: -len(thetas)], residuals[-len(thetas) :]
        slopes = [difference(*pair) for pair in zip(sides[::2], sides[1::2], strict=True)]
        terms.append(
            PushTerm(
                problem=problem, nuisance=nuisance, u=u.copy(), scatter=scatter, residual=residuals[0],
                slope=np.column_stack(slopes) / (high - low), own=own_columns(problem, noise, own_rows),
            )
        )  # fmt: skip
    return terms


def _moved(u: Array, goal: Array) -> list[Array]:
    """The point u (d,) with each of its entries in turn moved to that of a goal."""
    return [np.where(np.arange(len(u)) == j, goal, u) for j in range(len(u))]


def prior_slope(space: ParameterSpace) -> Array:
    """The slope (d, d) of ``polish.prior_rows`` with respect to the unit cube; they are linear in it."""
    middle = np.full(space.dimension, 0.5)
    rows = [prior_rows(space, space.from_unit(middle + 0.25 * step)) for step in np.eye(space.dimension)]
    return np.asarray(4.0 * (np.array(rows) - prior_rows(space, space.from_unit(middle))).T)
