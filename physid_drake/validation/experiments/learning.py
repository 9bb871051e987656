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
from physid_drake.inference.predictions import Predictor
from physid_drake.inference.rollouts import Ask, Physics
from physid_drake.pushes.case import UNIT_SCATTER, case_of
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.nuisance import nuisance_of
from physid_drake.pushes.problem import PushProblem
from physid_drake.pushes.task import Task
from physid_drake.recording import Recording
from physid_drake.search import EntropySearch, GreedyEntropySearch, RandomSearch, Search, search_minimum
from physid_drake.space import ParameterSpace

Array = NDArray[np.float64]

GREEDY, ENTROPY, RANDOM = "greedy entropy search", "entropy search", "random search"
LEAST_SQUARES = "least squares"
SEARCHES: Final[Mapping[str, Callable[[], Search]]] = {
    GREEDY: GreedyEntropySearch,
    RANDOM: RandomSearch,
    ENTROPY: EntropySearch,
}
METHODS: Final = (GREEDY, RANDOM, LEAST_SQUARES, ENTROPY)
CANDIDATES: Final = 1000
AS_IN_THE_PAPER: Final = ThetaConfig(bounds={"mass": [0.1, 0.9]})  # kg
FAILED: Final = 1e4  # standard deviations: of a rollout that diverged, in all that is compared
_STEP = 0.01  # of the unit cube, for differences


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
    """The pushes of a recording, and how well a theta explains some of them.

    Attributes:
        case: the pushes, ready, in this process.
        problems: the pushes.
        thetas: what is unknown, and the body that a theta describes.
    """

    def __init__(
        self,
        recording: Recording,
        *,
        time_step_s: float = 2e-3,
        theta: ThetaConfig | None = None,
        config: CellConfig | None = None,
    ) -> None:
        """Prepare.

        Args:
            recording: the pushes.
            time_step_s: of the cell [s].
            theta: what is unknown; mass, within the paper's bounds, and both frictions if None.
            config: of the cell, instead of the default with that time step.
        """
        solver = SolverConfig(time_step_s=time_step_s, slide_time_step_s=max(time_step_s, 2e-3))
        self.config = config or CellConfig(solver=solver)
        count = len(recording.pushes)
        self.case = case_of(recording, self.config, theta or AS_IN_THE_PAPER, jobs=1, most=count)
        self.problems, self.thetas = self.case.problems, self.case.thetas
        self._places = {problem.name: i for i, problem in enumerate(self.problems)}
        self._predictor = Predictor(
            self.case, range(count)
        )  # as in the paper: every trial is a rollout of the engine

    def errors(self, problems: Sequence[PushProblem], theta: Array) -> list[Array | None]:
        """Recorded less predicted (m_i,) of some pushes, in units of the noise; None where a rollout diverged."""
        at = [self._places[problem.name] for problem in problems]
        asks = [Ask(i, Physics(theta), np.zeros(len(self.case.nuisances[i].names))) for i in at]
        pairs = zip(at, self._predictor.vectors(asks), strict=True)
        return [None if seen is None else self._predictor.recorded[i] - seen for i, seen in pairs]

    def residuals(self, problems: Sequence[PushProblem], theta: Array) -> Array:
        """Residuals (m,) of some pushes in standard deviations; large ones where a rollout diverged."""
        sizes = [len(self._predictor.recorded[self._places[problem.name]]) for problem in problems]
        pairs = zip(self.errors(problems, theta), sizes, strict=True)
        return np.concatenate([np.full(size, FAILED) if one is None else one for one, size in pairs])

    def misfit(self, residuals: Array) -> float:
        """Log of the rms of residuals (m,); inf where a rollout diverged."""
        if residuals.max() >= FAILED:
            return float("inf")
        return float(0.5 * np.log(np.mean(residuals**2)))

    def end_errors(self, problems: Sequence[PushProblem], theta: Array) -> EndErrors:
        """Errors of the last pose."""
        seen = self.case.pool.run([plain_task(problem, theta) for problem in problems])
        ends = [
            np.full(3, np.inf) if r is None else r.poses[-1] - p.poses[-1]
            for p, r in zip(problems, seen, strict=True)
        ]
        x, y, yaw = np.array(ends).T
        return EndErrors(positions=np.hypot(x, y), rotations=np.abs(yaw))

    def polish(self, problems: Sequence[PushProblem], trials: Trials, *, budget: int) -> Trials:
        """The same trials, and so many more of least squares from the best of them."""
        start = np.asarray(self.thetas.space.to_unit(trials.best_after(len(trials.misfits))))
        more = _least_squares(
            lambda theta: self.residuals(problems, theta), self.misfit, self.thetas.space, budget, lambda count: None,
            start,
        )  # fmt: skip
        return Trials(
            thetas=np.concatenate([trials.thetas, more.thetas]),
            misfits=np.concatenate([trials.misfits, more.misfits]),
        )

    def learn(
        self,
        method: str,
        problems: Sequence[PushProblem],
        *,
        budget: int,
        rng: np.random.Generator,
        on_trial: Callable[[int], None] | None = None,
    ) -> Trials:
        """Search theta with so many trials; arguments as in ``search_trials``, and the training pushes."""
        return search_trials(
            method, lambda theta: self.residuals(problems, theta), self.misfit, self.thetas.space, budget=budget,
            rng=rng, on_trial=on_trial,
        )  # fmt: skip


def search_trials(
    method: str,
    residuals: Callable[[Array], Array],
    misfit: Callable[[Array], float],
    space: ParameterSpace,
    *,
    budget: int,
    rng: np.random.Generator,
    on_trial: Callable[[int], None] | None = None,
) -> Trials:
    """Search theta with so many trials.

    Args:
        method: one of ``METHODS``.
        residuals: of theta (d,), an array (m,).
        misfit: what a search makes small, of residuals (m,).
        space: of theta.
        budget: trials.
        rng: draws candidates, and the search's own numbers.
        on_trial: told the number of trials made.
    """
    told = on_trial or (lambda count: None)
    if method == LEAST_SQUARES:
        return _least_squares(residuals, misfit, space, budget, told)
    blind = SEARCHES[method] is RandomSearch
    found = search_minimum(
        lambda thetas: np.array([misfit(residuals(theta)) for theta in thetas]),
        space, space.sample(rng, CANDIDATES, from_prior=True), SEARCHES[method](), budget=budget, rng=rng,
        # Random search does not look at its trials: one batch spares it the belief.
        n_initial=0 if blind else None, batch=budget if blind else 1,
        entropy_tolerance=0.0, on_trial=lambda belief: told(belief.n_trials),
    )  # fmt: skip
    return Trials(thetas=np.array(found.belief.thetas), misfits=np.array(found.belief.errors))


def _least_squares(
    residuals: Callable[[Array], Array],
    misfit: Callable[[Array], float],
    space: ParameterSpace,
    budget: int,
    told: Callable[[int], None],
    start: Array | None = None,
) -> Trials:
    """Gauss-Newton from a point of the unit cube, the nominal one if None; its differences count as trials."""
    thetas, misfits, at = list[Array](), list[float](), dict[bytes, Array]()

    def tried(u: Array) -> Array:
        if len(thetas) >= budget:
            raise _SpentError
        theta = np.asarray(space.from_unit(u))
        at[u.tobytes()] = found = residuals(theta)
        thetas.append(theta)
        misfits.append(misfit(found))
        told(len(thetas))
        return found

    def slopes(u: Array) -> Array:
        here = at[u.tobytes()]
        steps = np.where(u + _STEP < 1.0, _STEP, -_STEP)
        columns = [(tried(u + step * row) - here) / step for step, row in zip(steps, np.eye(len(u)), strict=True)]
        return np.column_stack(columns)

    begin = np.clip(np.asarray(space.to_unit(space.nominal)) if start is None else start, 1e-3, 1.0 - 1e-3)
    with contextlib.suppress(_SpentError):
        least_squares(tried, begin, jac=slopes, bounds=(0.0, 1.0), x_scale=0.1, xtol=1e-6, ftol=1e-8)
    return Trials(thetas=np.array(thetas), misfits=np.array(misfits))


class _SpentError(Exception):
    """The budget of a least-squares fit is spent."""


def plain_task(problem: PushProblem, theta: Array) -> Task:
    """A rollout of a push with theta (d,), its nuisance parameters at their most likely values."""
    nuisance = nuisance_of(problem, UNIT_SCATTER)
    return Task(problem=problem, theta=theta, nuisance=nuisance, values=np.zeros(len(nuisance.names)))
