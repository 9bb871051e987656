"""Learning theta from pushes with a counted number of trials, by any of the methods that are compared."""

from __future__ import annotations

import contextlib
import dataclasses as dc
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from physid_drake.cell import CellConfig, SolverConfig
from physid_drake.identify import Identifier
from physid_drake.identify.config import SearchConfig, ThetaConfig
from physid_drake.identify.misfit import whitened_residual
from physid_drake.identify.nuisance import FIRST_SCATTER, nuisance_of
from physid_drake.identify.problem import PushProblem
from physid_drake.identify.rollouts import Prediction, Task
from physid_drake.recording import Recording
from physid_drake.search import GreedyEntropySearch, RandomSearch, Search, search_minimum

Array = NDArray[np.float64]

SEARCHES: Final[Mapping[str, Callable[[], Search]]] = {
    "greedy entropy search": GreedyEntropySearch,
    "random search": RandomSearch,
}
LEAST_SQUARES: Final = "least squares"
METHODS: Final = (*SEARCHES, LEAST_SQUARES)
CANDIDATES: Final = 1000
_STEP = 0.01  # of the unit cube, for differences
_FAILED = 1e3  # standard deviations


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Trials:
    """What a method tried, in its order; a trial is one rollout of every training push.

    Attributes:
        thetas: (m, d), each entry in its unit.
        misfits: (m,) log of the rms residual in standard deviations; inf where a rollout diverged.
    """

    thetas: Array
    misfits: Array

    def best_after(self, count: int) -> Array:
        """The theta (d,) of least misfit among the first ``count``."""
        return np.asarray(self.thetas[int(np.argmin(self.misfits[:count]))])


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class EndErrors:
    """How far pushes end from where they were seen to end: (n,) distances [m] and turns [rad], inf if diverged."""

    positions: Array
    rotations: Array


class Learner:
    """The pushes of a recording, and how well a theta explains some of them."""

    def __init__(self, recording: Recording, *, tick_s: float, theta: ThetaConfig | None = None) -> None:
        """Prepare.

        Args:
            recording: the pushes.
            tick_s: of the cell [s].
            theta: what is unknown; mass and both frictions if None.
        """
        self.config = CellConfig(solver=SolverConfig(time_step_s=tick_s, slide_time_step_s=max(tick_s, 2e-3)))
        identifier = Identifier(
            recording, cell=self.config, theta=theta or ThetaConfig(), search=SearchConfig(jobs=1),
            held_out_share=0.0, seed=0,
        )  # fmt: skip
        self.problems: tuple[PushProblem, ...] = identifier.problems
        self.thetas, self._noise, self._pool = identifier.thetas, identifier.noise, identifier.pool

    def predictions(self, problems: Sequence[PushProblem], theta: Array) -> list[Prediction | None]:
        """Rollouts of some pushes with theta (d,); None where one diverged."""
        return self._pool.run([_task(problem, theta) for problem in problems])

    def residuals(self, problems: Sequence[PushProblem], theta: Array) -> Array:
        """Residuals (m,) of some pushes in standard deviations; large ones where a rollout diverged."""
        parts = [
            np.full(3 * len(p.times), _FAILED) if r is None else whitened_residual(p, self._noise, r)
            for p, r in zip(problems, self.predictions(problems, theta), strict=True)
        ]
        return np.concatenate(parts)

    def misfit(self, residuals: Array) -> float:
        """Log of the rms of residuals (m,); inf where a rollout diverged."""
        if residuals.max() >= _FAILED:
            return float("inf")
        return float(0.5 * np.log(np.mean(residuals**2)))

    def end_errors(self, problems: Sequence[PushProblem], theta: Array) -> EndErrors:
        """Errors of the last pose."""
        ends = [
            np.full(3, np.inf) if r is None else r.poses[-1] - p.poses[-1]
            for p, r in zip(problems, self.predictions(problems, theta), strict=True)
        ]
        x, y, yaw = np.array(ends).T
        return EndErrors(positions=np.hypot(x, y), rotations=np.abs(yaw))

    def learn(
        self,
        method: str,
        problems: Sequence[PushProblem],
        *,
        budget: int,
        rng: np.random.Generator,
        candidates: int = CANDIDATES,
        on_trial: Callable[[int], None] | None = None,
    ) -> Trials:
        """Search theta with so many trials.

        Args:
            method: one of ``METHODS``.
            problems: the training pushes.
            budget: trials.
            rng: draws candidates, and the search's own numbers.
            candidates: of a search.
            on_trial: told the number of trials made.
        """
        told = on_trial or (lambda count: None)
        if method == LEAST_SQUARES:
            return self._least_squares(problems, budget, told)
        space = self.thetas.space
        found = search_minimum(
            lambda thetas: np.array([self.misfit(self.residuals(problems, theta)) for theta in thetas]),
            space, space.sample(rng, candidates, from_prior=True), SEARCHES[method](), budget=budget, rng=rng,
            # Random search does not look at its trials: one batch spares it the belief.
            n_initial=0 if method == "random search" else None, batch=budget if method == "random search" else 1,
            entropy_tolerance=0.0, on_trial=lambda belief: told(belief.n_trials),
        )  # fmt: skip
        if found.stop_reason == "interrupted":
            raise KeyboardInterrupt
        return Trials(thetas=np.array(found.belief.thetas), misfits=np.array(found.belief.errors))

    def _least_squares(self, problems: Sequence[PushProblem], budget: int, told: Callable[[int], None]) -> Trials:
        """Gauss-Newton in the unit cube from the nominal theta; its differences count as trials."""
        space, at = self.thetas.space, dict[bytes, Array]()
        thetas, misfits = list[Array](), list[float]()

        def residuals(u: Array) -> Array:
            if len(thetas) >= budget:
                raise _SpentError
            theta = np.asarray(space.from_unit(u))
            found = self.residuals(problems, theta)
            thetas.append(theta)
            misfits.append(self.misfit(found))
            told(len(thetas))
            at[u.tobytes()] = found
            return found

        def slopes(u: Array) -> Array:
            here = at[u.tobytes()]
            steps = np.where(u + _STEP < 1.0, _STEP, -_STEP)
            columns = [
                (residuals(u + step * row) - here) / step for step, row in zip(steps, np.eye(len(u)), strict=True)
            ]
            return np.column_stack(columns)

        start = np.clip(np.asarray(space.to_unit(space.nominal)), 1e-3, 1.0 - 1e-3)
        with contextlib.suppress(_SpentError):
            least_squares(residuals, start, jac=slopes, bounds=(0.0, 1.0), x_scale=0.1, xtol=1e-6, ftol=1e-8)
        return Trials(thetas=np.array(thetas), misfits=np.array(misfits))


class _SpentError(Exception):
    """The budget of a least-squares fit is spent."""


def _task(problem: PushProblem, theta: Array) -> Task:
    nuisance = nuisance_of(problem, FIRST_SCATTER)
    return Task(problem=problem, theta=theta, nuisance=nuisance, values=np.zeros(len(nuisance.names)))
