"""Least squares on the whitened residuals: what the candidate grid of the search leaves over."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from physid_drake.identify.own_columns import own_columns, own_tasks
from physid_drake.pushes.misfit import Whitener, difference, diverged, whitened_residual
from physid_drake.pushes.noise import Noise
from physid_drake.pushes.nuisance import Nuisance, nuisance_of
from physid_drake.pushes.problem import PushProblem
from physid_drake.pushes.rollouts import RolloutPool
from physid_drake.pushes.task import Task
from physid_drake.space import ParameterSpace

Array = NDArray[np.float64]

THETA_STEP = 0.004  # of the unit cube, for differences; rollouts are repeatable to the bit, so small is safe
ROUNDS = 2  # of linearising the pushes' own unknowns
LARGEST_SCATTER = 0.2
SMALLEST_SCATTER = 2e-3
SCATTER_STEPS = 2
SCATTER_WEIGHT = 4.0
SCATTER_PUSHES = 4  # fewer pushes than this do not tell their scatter


@dataclass(frozen=True, kw_only=True)
class Polished:
    """The fit.

    Attributes:
        theta: (d,).
        jacobian: (m, d) of all whitened residuals, over the square root of the inflation, and of theta's
            priors, with respect to the unit cube.
        chi2: cost of the residuals and the pushes' unknowns, without theta's prior.
        inflation: reduced chi-square by which the noise was widened in the fit, at least 1.
        samples: number of residuals, but those of pushes whose rollout diverged.
        friction_scatter: from push to push [-].
        residuals: one per push, marginal (m_i,).
        unknowns: per push, name to value in its unit.
        rollouts: made.
    """

    theta: Array
    jacobian: Array
    chi2: float
    inflation: float
    samples: int
    friction_scatter: float
    residuals: tuple[Array, ...]
    unknowns: tuple[dict[str, float], ...]
    rollouts: int

    @property
    def covariance(self) -> Array:
        """Of theta (d, d) in the unit cube, from the cost's curvature."""
        return np.asarray(np.linalg.inv(self.jacobian.T @ self.jacobian))

    @property
    def degrees(self) -> float:
        """Degrees of freedom that the residuals leave (``degrees_of_freedom``)."""
        return degrees_of_freedom(self.samples, self.jacobian)

    @property
    def correlation(self) -> Array:
        """Of theta (d, d), each entry on its parameter's scale, from the cost's curvature.

        Not from the pushes' disagreement, which widens the intervals: of few pushes it tells no correlation.
        """
        stds = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(stds, stds))


def degrees_of_freedom(samples: int, jacobian: Array) -> float:
    """Of so many residuals, those that fitted parameters leave; at least 1.

    A parameter that its prior holds takes none: of many friction cells few combinations are fitted.

    Args:
        samples: number of residuals.
        jacobian: (m + d, d), those of the priors last.

    Source: T. Hastie, R. Tibshirani and J. Friedman, The Elements of Statistical Learning, 2nd ed., 2009, equation
    3.50 (effective degrees of freedom of ridge regression).
    """
    rows = jacobian[: -jacobian.shape[1]]
    fitted = float(np.trace(np.linalg.solve(jacobian.T @ jacobian, rows.T @ rows)))
    return max(1.0, samples - fitted)


def scatter_freedom(pushes: int) -> float:
    """Degrees of freedom with which so many pushes tell friction's scatter: theirs and those of the first guess."""
    return SCATTER_WEIGHT + (pushes if pushes >= SCATTER_PUSHES else 0)


def scatter_of(share: float, inflation: float, pushes: int) -> float:
    """Friction's scatter from push to push [-], as pushes have it.

    In a fit the inflation widens the priors of pushes' own unknowns along with the noise, so that it works with less.

    Args:
        share: the scatter in the fit, over the root of the inflation.
        inflation: of the noise.
        pushes: that the scatter was learned from; of too few it is the first guess, which nothing widens.
    """
    return min(LARGEST_SCATTER, share * float(np.sqrt(inflation))) if pushes >= SCATTER_PUSHES else share


class Polisher:
    """Alternates: linearise the pushes' own unknowns, then fit theta with them marginalised."""

    def __init__(
        self,
        pool: RolloutPool,
        problems: Sequence[PushProblem],
        noise: Noise,
        scatter: float,
        tick: Callable[[str], None] | None = None,
    ) -> None:
        self._pool, self._problems, self._noise = pool, problems, noise
        self._scatter = self._first_scatter = scatter
        self._inflation = 1.0
        self._lost: frozenset[int] = frozenset()  # pushes that diverge where they were linearised last
        self._tick = tick or (lambda _: None)
        self._space = pool.thetas.space

    def run(self, theta: Array) -> Polished:
        """Fit from a start theta (d,)."""
        before = self._pool.count
        self._tick("the pushes' own unknowns")
        whiteners = self._linearise(theta)
        for round_ in range(ROUNDS):
            self._tick(f"least squares, round {round_ + 1} of {ROUNDS}")
            theta, jacobian = self._fit(theta, whiteners)
            whiteners = self._linearise(theta)
            whiteners = self._learn_scales(theta, whiteners, jacobian)
        return self._result(theta, whiteners, self._pool.count - before)

    def _nuisances(self) -> list[Nuisance]:
        return [nuisance_of(problem, self._scatter) for problem in self._problems]

    def _tasks(self, theta: Array) -> list[Task]:
        """One rollout per push, nothing known of the pushes' own unknowns."""
        return [
            Task(problem=p, theta=theta, nuisance=n, values=np.zeros(len(n.names)))
            for p, n in zip(self._problems, self._nuisances(), strict=True)
        ]

    def _residuals(self, tasks: Sequence[Task]) -> list[Array]:
        """Whitened residuals (m_i,) of rollouts."""
        pairs = zip(tasks, self._pool.run(tasks), strict=True)
        return [whitened_residual(task.problem, self._noise, prediction) for task, prediction in pairs]

    def _linearise(self, theta: Array) -> list[Whitener]:
        """Jacobians of each push with respect to what it has for itself, by one extra rollout each."""
        stacks = [own_tasks(p, n, theta) for p, n in zip(self._problems, self._nuisances(), strict=True)]
        rows = iter(self._residuals([task for stack in stacks for task in stack]))
        residuals = [[next(rows) for _ in stack] for stack in stacks]
        self._lost = frozenset(i for i, own in enumerate(residuals) if diverged(own[0]))
        return [
            Whitener.of(own_columns(problem, self._noise, own))
            for problem, own in zip(self._problems, residuals, strict=True)
        ]

    def _fit(self, theta: Array, whiteners: list[Whitener]) -> tuple[Array, Array]:
        """Theta (d,) of least cost, and the slope (m, d) there; pushes that diverge where it starts say nothing."""
        space = self._space

        def cost(u: Array) -> Array:
            point = space.from_unit(u)
            return self._stacked(whiteners, self._residuals(self._tasks(point)), point)

        def slope(u: Array) -> Array:
            return self._jacobian(u, whiteners)

        found = least_squares(
            cost, np.clip(space.to_unit(theta), 1e-6, 1.0 - 1e-6),
            jac=slope, bounds=(0.0, 1.0), x_scale=0.1,
            max_nfev=12, xtol=1e-5, ftol=1e-6,
        )  # fmt: skip
        return np.asarray(space.from_unit(found.x)), np.asarray(found.jac)

    def _jacobian(self, u: Array, whiteners: list[Whitener]) -> Array:
        """Slope (m, d) of ``_stacked`` with respect to the unit cube, by central differences.

        A step whose rollout diverges counts as one that changes nothing.
        """
        sides = []
        for j in range(len(u)):
            low, high = u.copy(), u.copy()
            low[j], high[j] = max(0.0, u[j] - THETA_STEP), min(1.0, u[j] + THETA_STEP)
            sides.append((low, high))
        tasks = [task for pair in sides for u_side in pair for task in self._tasks(self._space.from_unit(u_side))]
        residuals, count = self._residuals(tasks), len(self._problems)
        columns = []
        for j, (low, high) in enumerate(sides):
            before, after = (residuals[k * count : (k + 1) * count] for k in (2 * j, 2 * j + 1))
            # Marginal residuals are linear in the residuals, and priors in the unit cube.
            changes = self._marginal(whiteners, [difference(a, b) for a, b in zip(before, after, strict=True)])
            prior = prior_rows(self._space, self._space.from_unit(high))
            prior = prior - prior_rows(self._space, self._space.from_unit(low))
            columns.append(np.concatenate([*changes, prior]) / (high[j] - low[j]))
        return np.column_stack(columns)

    def _stacked(self, whiteners: list[Whitener], residuals: list[Array], theta: Array) -> Array:
        """Marginal residuals and theta's priors; where the fit is worse than the noise, the noise is widened.

        Otherwise a misfit that no theta explains would overrule what a scale said of the mass.
        """
        return np.concatenate([*self._marginal(whiteners, residuals), prior_rows(self._space, theta)])

    def _marginal(self, whiteners: list[Whitener], residuals: list[Array]) -> list[Array]:
        """Marginal residuals (m_i + k_i,) with the widened noise; none of a push that is lost."""
        scale = 1.0 / np.sqrt(self._inflation)
        told = [0.0 * r if i in self._lost else r for i, r in enumerate(residuals)]
        return [scale * w.apply(r) for w, r in zip(whiteners, told, strict=True)]

    def _learn_scales(self, theta: Array, whiteners: list[Whitener], jacobian: Array) -> list[Whitener]:
        """Learn the noise's inflation and the scatter of friction from what is left; the whiteners that follow."""
        residuals = self._residuals(self._tasks(theta))
        told = [k for k in range(len(residuals)) if k not in self._lost]
        chi2 = sum(float((whiteners[k].apply(residuals[k]) ** 2).sum()) for k in told)
        samples = sum(len(residuals[k]) for k in told)
        self._inflation = max(1.0, chi2 / degrees_of_freedom(samples, jacobian))
        if len(told) < SCATTER_PUSHES:
            return whiteners
        old = self._scatter
        places = [nuisance.index("friction") for nuisance in self._nuisances()]
        wide = float(np.sqrt(self._inflation))
        scaled = [residuals[k] / wide for k in told]
        self._scatter = new_scatter(
            [whiteners[k] for k in told], [places[k] for k in told], scaled, old=old, first=self._first_scatter / wide
        )
        return [rescaled(w, k, self._scatter / old) for w, k in zip(whiteners, places, strict=True)]

    def _result(self, theta: Array, whiteners: list[Whitener], rollouts: int) -> Polished:
        residuals = [0.0 * r if diverged(r) else r for r in self._residuals(self._tasks(theta))]
        marginal = [w.apply(r) for w, r in zip(whiteners, residuals, strict=True)]
        unknowns = []
        for nuisance, whitener, residual in zip(self._nuisances(), whiteners, residuals, strict=True):
            values = whitener.unknowns(residual)[: len(nuisance.names)] * nuisance.stds
            unknowns.append(dict(zip(nuisance.names, values.tolist(), strict=True)))
        return Polished(
            theta=theta,
            jacobian=self._jacobian(np.asarray(self._space.to_unit(theta)), whiteners),
            chi2=float(sum((m**2).sum() for m in marginal)),
            inflation=self._inflation,
            samples=sum(len(r) for i, r in enumerate(residuals) if i not in self._lost),
            friction_scatter=scatter_of(self._scatter, self._inflation, len(whiteners) - len(self._lost)),
            residuals=tuple(marginal),
            unknowns=tuple(unknowns),
            rollouts=rollouts,
        )


def prior_rows(space: ParameterSpace, theta: Array) -> Array:
    """Distance from the prior (d,) in its standard deviations.

    A uniform prior counts as 1/sqrt(12) of the cube about the nominal value: nothing against pushes that tell
    the parameter, and it keeps a parameter that they do not tell where it was.
    """
    flat = np.sqrt(12.0) * (np.asarray(space.to_unit(theta)) - space.to_unit(space.nominal))
    own = np.asarray(space.prior_whitened(theta))
    return np.where([p.prior_std is None for p in space.parameters], flat, own)


def new_scatter(
    whiteners: Sequence[Whitener], places: Sequence[int], residuals: Sequence[Array], *, old: float, first: float
) -> float:
    """Scatter of friction from push to push, by expectation-maximisation on the linearised pushes.

    Few pushes alone would drive it to nothing, so ``SCATTER_WEIGHT`` pushes' worth of the first guess stand by
    (the mode under an inverse-gamma prior).

    Args:
        whiteners: of the pushes, scaled with the old scatter.
        places: of friction among each push's own unknowns.
        residuals: (m,) of each push.
        old: scatter [-].
        first: guess before any push [-].
    """
    factor = 1.0
    for _ in range(SCATTER_STEPS):
        second = []
        for k, whitener, residual in zip(places, whiteners, residuals, strict=True):
            scaled = rescaled(whitener, k, factor)
            second.append(scaled.unknowns(residual)[k] ** 2 + scaled.variances()[k])
        guess = SCATTER_WEIGHT * (first / (factor * old)) ** 2
        factor *= float(np.sqrt((sum(second) + guess) / (len(second) + SCATTER_WEIGHT)))
        factor = float(np.clip(factor, SMALLEST_SCATTER / old, LARGEST_SCATTER / old))
    return old * factor


def rescaled(whitener: Whitener, k: int, factor: float) -> Whitener:
    """The whitener after the prior of its unknown k was widened by a factor."""
    jacobian = whitener.jacobian.copy()
    jacobian[:, k] *= factor
    return Whitener.of(jacobian)
