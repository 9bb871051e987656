"""Identification push by push: what is believed after t pushes and one new push make what is believed after t + 1."""

from __future__ import annotations

import dataclasses as dc
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from physid_drake.cell import CellConfig
from physid_drake.cell.solid import solid_of
from physid_drake.identify.cells import cells_told, tied_cells
from physid_drake.identify.config import SearchConfig
from physid_drake.identify.identify import Accuracy, Identification, accuracy_of, estimates_of, pooled
from physid_drake.identify.linearise import PushTerm, linearised, prior_slope
from physid_drake.identify.polish import (
    SCATTER_PUSHES,
    Polished,
    degrees_of_freedom,
    new_scatter,
    prior_rows,
    scatter_of,
)
from physid_drake.progress import Progress
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.misfit import whitened_residual
from physid_drake.pushes.noise import Noise, noise_of
from physid_drake.pushes.nuisance import FIRST_SCATTER, nuisance_of
from physid_drake.pushes.prediction import Prediction
from physid_drake.pushes.problem import PushProblem, problems_of, spec_of
from physid_drake.pushes.refusals import refuse
from physid_drake.pushes.rollouts import RolloutPool
from physid_drake.pushes.task import Task
from physid_drake.pushes.theta import ThetaMap, theta_map
from physid_drake.recording import Push, Recording, thinned
from physid_drake.search import SearchResult, search_minimum, search_named
from physid_drake.space import ParameterSpace

Array = NDArray[np.float64]

BUDGET = 12  # rollouts of the search on a new push
CANDIDATES = 256
PRIOR_SHARE = 0.1  # of the candidates, drawn from P_0: what the Gaussian rules out may still be tried
ROUNDS = 5  # linearisations of a new push, at most
SETTLED = 0.3  # posterior standard deviations: a smaller step ends the rounds
STALE = 1.0  # posterior standard deviations from where an earlier push was linearised
RELINEARISED = 1  # earlier pushes that are linearised again with a new one
SCALE_STEPS = 3  # alternations of theta and the noise's scales


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class OnlineBelief:
    """P_t: a Gaussian over theta in the unit cube, as the sum of the prior's information and that of t pushes.

    The terms are kept apart, so that the noise's inflation and friction's scatter can be learned from all pushes, and
    a push that was linearised far from where theta is believed now can be linearised again.

    Attributes:
        space: of theta.
        terms: of the pushes so far, but for those whose rollouts diverged.
        mean: (d,) of the Gaussian, in the unit cube.
        scatter: of friction from push to push, over the root of the inflation [-].
        inflation: by which the noise is widened where the pushes are not explained, at least 1.
        noise: of the recording; None before the first push.
        search: of the newest push, over candidates drawn from P_{t-1}. None before the first push.
        foreseen: how well each push was predicted before it was learned from; infinite where that rollout diverged.
        fitted: how well each push was predicted right after.
        rollouts: made so far.
    """

    space: ParameterSpace
    terms: tuple[PushTerm, ...] = ()
    mean: Array
    scatter: float = FIRST_SCATTER
    inflation: float = 1.0
    noise: Noise | None = None
    search: SearchResult | None = None
    foreseen: tuple[Accuracy, ...] = ()
    fitted: tuple[Accuracy, ...] = ()
    rollouts: int = 0

    @property
    def theta(self) -> Array:
        """The estimate (d,), each entry in its unit."""
        return np.asarray(self.space.from_unit(self.mean))

    @cached_property
    def rows(self) -> Array:
        """Slopes (m, d) of all marginal residuals over the root of the inflation, then of the prior's."""
        slopes = [term.marginal(self.mean, self.scatter)[1] / np.sqrt(self.inflation) for term in self.terms]
        return np.concatenate([*slopes, prior_slope(self.space)])

    @cached_property
    def information(self) -> Array:
        """Inverse covariance (d, d) of the Gaussian, in the unit cube."""
        return np.asarray(self.rows.T @ self.rows)

    def distance(self, u: Array) -> float:
        """How far a point (d,) of the cube is from the mean, in standard deviations."""
        step = u - self.mean
        return float(np.sqrt(step @ self.information @ step))

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Thetas (count, d) drawn from P_t; a share of them from P_0."""
        spread = max(1, int(PRIOR_SHARE * count)) if self.terms else count
        wide = self.space.sample(rng, spread, from_prior=True)
        if spread == count:
            return wide
        factor = np.linalg.inv(np.linalg.cholesky(self.information))
        points = self.mean + rng.standard_normal((count - spread, len(self.mean))) @ factor
        inside = np.clip(1.0 - np.abs(1.0 - np.abs(points)), 0.0, 1.0)  # reflected at the bounds
        return np.concatenate([self.space.from_unit(inside), wide])


class OnlineIdentifier:
    """Learns theta from one push after another; holds nothing but what does not change."""

    def __init__(
        self, recording: Recording, *, cell: CellConfig, theta: ThetaConfig, search: SearchConfig, seed: int,
        budget: int = BUDGET, pool: RolloutPool | None = None, progress: Progress | None = None,
    ) -> None:  # fmt: skip
        """Prepare.

        Args:
            recording: says what is pushed, by what and how it is measured; its pushes, if it has any, are asked only
                whether one could learn from them.
            cell: how pushes are simulated.
            theta: what is unknown.
            search: its method and number of processes; the other numbers are those of the batch search.
            seed: of everything random.
            budget: rollouts of the search on a new push.
            pool: of the same cell and theta, to share; None makes one.
            progress: told stage, steps done, steps in all.

        Raises:
            RecordingError: if the recording cannot be learned from; ``pushes/refusals.py`` has all reasons.
        """
        refuse(recording)
        solid = solid_of(recording.object.shape)
        grid = (cell.friction_cells[0], cell.friction_cells[1])
        free = theta_map(recording.object, solid, grid, theta, cell.default_density_kgpm3)
        self.thetas: ThetaMap = tied_cells(free, solid.outline, theta)
        self.pool = pool or RolloutPool(
            spec_of(recording, cell), self.thetas, jobs=search.jobs, integrator=search.integrator
        )
        self._recording, self._height = recording, solid.height
        self._chooser, self._seed, self._budget = search_named(search.method), seed, budget
        self._progress: Progress = progress or (lambda stage, done, total: None)

    def start(self) -> OnlineBelief:
        """P_0: the prior."""
        space = self.thetas.space
        return OnlineBelief(space=space, mean=np.asarray(space.to_unit(space.nominal)))

    def learn(self, belief: OnlineBelief, push: Push) -> OnlineBelief:
        """P_{t+1} from P_t and one new push.

        A small search over candidates drawn from P_t finds where the new push is explained. Gauss-Newton steps on the
        new push and the earlier pushes' information go on from the trial of least posterior cost.

        A push whose rollouts diverge leaves the belief as it was, and is counted in ``foreseen``.

        Raises:
            KeyboardInterrupt: when interrupted; the belief is as it was.

        Source: Zhu, Kimmel, Boularias, section III.B, for the search; B. Bell and F. Cathey, IEEE Trans. Automatic
            Control 38, 1993, for the iterated Kalman update as Gauss-Newton.
        """
        before = self.pool.count
        count = len(belief.foreseen)
        rng = np.random.default_rng([self._seed, count])
        # The noise is what sensors state, or what the first push shows: weights must not change under the terms.
        alone = thinned(dc.replace(self._recording, pushes=(push,)))
        noise = belief.noise or noise_of(alone)
        problem = dc.replace(problems_of(alone, noise, self._height, whole=False)[0], order=count)
        expected = self._predicted(problem, [belief.theta])[0]
        found = self._search(belief, problem, noise, rng)
        self._progress("what the push tells", count, 0)
        start = _best_start(belief, found, problem, noise, expected)
        learned = self._updated(dc.replace(belief, noise=noise, search=found), problem, start)
        fitted = self._predicted(problem, [learned.theta])[0]
        return dc.replace(
            learned,
            foreseen=(*belief.foreseen, accuracy_of([(problem, expected)], noise)),
            fitted=(*belief.fitted, accuracy_of([(problem, fitted)], noise)),
            rollouts=belief.rollouts + self.pool.count - before,
        )

    def identification(self, belief: OnlineBelief) -> Identification | None:
        """The belief as an identification, with intervals; None before the first push."""
        if belief.noise is None or belief.search is None:
            return None
        polished = _polished(belief)
        return Identification(
            thetas=self.thetas, theta=belief.theta, estimates=estimates_of(self.thetas, polished), noise=belief.noise,
            search=belief.search, polished=polished,
            reduced_chi2=polished.chi2 / polished.degrees if belief.terms else float("inf"),
            training=tuple(term.problem.name for term in belief.terms), held_out=(), before=None, after=None,
            fitted=pooled(belief.fitted), cells=cells_told(self.thetas, polished), foreseen=pooled(belief.foreseen),
        )  # fmt: skip

    def _search(
        self, belief: OnlineBelief, problem: PushProblem, noise: Noise, rng: np.random.Generator
    ) -> SearchResult:
        def objective(thetas: Array) -> Array:
            return np.array([_log_rms(problem, noise, p) for p in self._predicted(problem, thetas)])

        return search_minimum(
            objective, belief.space, belief.draw(rng, CANDIDATES), self._chooser, budget=self._budget, rng=rng,
            entropy_tolerance=0.0,
            on_trial=lambda b: self._progress("search on the new push", b.n_trials, self._budget),
        )  # fmt: skip

    def _updated(self, belief: OnlineBelief, problem: PushProblem, start: Array) -> OnlineBelief:
        """The terms with the new push, and the Gaussian that they make."""
        assert belief.noise is not None
        terms, u, best = belief.terms, start, None
        for _ in range(ROUNDS):
            term = linearised(self.pool, [problem], belief.noise, u, belief.scatter)[0]
            if term.diverged and best is None:
                return belief  # no trial of this push ends: it says nothing
            trial = _solved(dc.replace(belief, terms=(*terms, term)))
            # Weighed as before the push: a trial that learned more scatter would seem to cost less.
            cost = _cost_at(dc.replace(trial, scatter=belief.scatter, inflation=belief.inflation), u)
            if best is not None and (term.diverged or cost > best[0]):
                u = 0.5 * (u + best[1].terms[-1].u)  # the linear step went too far
                continue
            best = (cost, trial)
            if trial.distance(u) < SETTLED:
                break
            u = trial.mean
        assert best is not None
        return self._refreshed(best[1])

    def _refreshed(self, belief: OnlineBelief) -> OnlineBelief:
        """The pushes that were linearised furthest from the mean, linearised at it."""
        assert belief.noise is not None
        far = [belief.distance(term.u) for term in belief.terms]
        stale = [k for k in np.argsort(far)[::-1][:RELINEARISED] if far[k] > STALE]
        if not stale:
            return belief
        problems = [belief.terms[k].problem for k in stale]
        anew = linearised(self.pool, problems, belief.noise, belief.mean, belief.scatter)
        # A push that does not simulate there still says what it said where it did.
        fresh = {k: term for k, term in zip(stale, anew, strict=True) if not term.diverged}
        terms = tuple(fresh.get(k, term) for k, term in enumerate(belief.terms))
        return _solved(dc.replace(belief, terms=terms))

    def _predicted(self, problem: PushProblem, thetas: Array | list[Array]) -> list[Prediction | None]:
        nuisance = nuisance_of(problem, FIRST_SCATTER)
        rest = np.zeros(len(nuisance.names))
        return self.pool.run([Task(problem=problem, theta=t, nuisance=nuisance, values=rest) for t in thetas])


def _log_rms(problem: PushProblem, noise: Noise, prediction: Prediction | None) -> float:
    if prediction is None:
        return float("inf")
    return float(0.5 * np.log(np.mean(whitened_residual(problem, noise, prediction) ** 2)))


def _best_start(
    belief: OnlineBelief, found: SearchResult, problem: PushProblem, noise: Noise, expected: Prediction | None
) -> Array:
    """The trial (d,) of the unit cube of least posterior cost, the mean of P_t among them."""
    points = np.concatenate([belief.mean[np.newaxis], belief.space.to_unit(found.belief.thetas)])
    errors = np.concatenate([[_log_rms(problem, noise, expected)], found.belief.errors])
    # The noise is taken as wide as the best trial needs: its own unknowns are at rest here.
    mean_squares = np.exp(2.0 * (errors - errors.min())) if np.isfinite(errors.min()) else np.ones(len(errors))
    samples = 3 * len(problem.times) + 2 * len(problem.force_times)
    known = np.array([belief.distance(u) ** 2 for u in points])
    return np.asarray(points[int(np.argmin(samples * mean_squares + known))])


def _solved(belief: OnlineBelief) -> OnlineBelief:
    """The Gaussian of the terms: theta, the noise's inflation and friction's scatter in turn."""
    prior = prior_slope(belief.space)
    nominal = np.asarray(belief.space.to_unit(belief.space.nominal))
    samples = sum(len(term.residual) for term in belief.terms)
    for _ in range(SCALE_STEPS):
        parts = [term.marginal(belief.mean, belief.scatter) for term in belief.terms]
        scale = 1.0 / np.sqrt(belief.inflation)
        matrix = np.concatenate([*(scale * slope for _, slope in parts), prior])
        right = np.concatenate(
            [*(scale * (slope @ belief.mean - residual) for residual, slope in parts), prior @ nominal]
        )
        mean = np.asarray(lsq_linear(matrix, right, bounds=(0.0, 1.0)).x)
        belief = _with_scales(dc.replace(belief, mean=mean), samples)
    return belief


def _with_scales(belief: OnlineBelief, samples: int) -> OnlineBelief:
    whiteners = [term.whitener(belief.scatter) for term in belief.terms]
    residuals = [term.residual_at(belief.mean) for term in belief.terms]
    chi2 = sum(float((w.apply(r) ** 2).sum()) for w, r in zip(whiteners, residuals, strict=True))
    inflation = max(1.0, chi2 / degrees_of_freedom(samples, belief.rows))
    scatter = belief.scatter
    if len(belief.terms) >= SCATTER_PUSHES:
        places = [term.nuisance.index("friction") for term in belief.terms]
        wide = float(np.sqrt(inflation))
        scaled = [r / wide for r in residuals]
        scatter = new_scatter(whiteners, places, scaled, old=scatter, first=FIRST_SCATTER / wide)
    return dc.replace(belief, inflation=inflation, scatter=scatter)


def _cost_at(belief: OnlineBelief, u: Array) -> float:
    """Posterior cost at u (d,), where the newest push was simulated, with the belief's scatter and inflation."""
    squares = [float((term.marginal(u, belief.scatter)[0] ** 2).sum()) for term in belief.terms]
    prior = prior_rows(belief.space, belief.space.from_unit(u))
    return sum(squares) / belief.inflation + float(prior @ prior)


def _polished(belief: OnlineBelief) -> Polished:
    marginal = [term.marginal(belief.mean, belief.scatter)[0] for term in belief.terms]
    unknowns = []
    for term in belief.terms:
        names = term.nuisance.names
        values = term.whitener(belief.scatter).unknowns(term.residual_at(belief.mean))[: len(names)]
        stds = np.where(np.array(names) == "friction", belief.scatter, term.nuisance.stds)
        unknowns.append(dict(zip(names, (values * stds).tolist(), strict=True)))
    return Polished(
        theta=belief.theta, jacobian=belief.rows, chi2=float(sum((m**2).sum() for m in marginal)),
        inflation=belief.inflation, samples=sum(len(term.residual) for term in belief.terms),
        friction_scatter=scatter_of(belief.scatter, belief.inflation, len(belief.terms)),
        residuals=tuple(marginal), unknowns=tuple(unknowns), rollouts=belief.rollouts,
    )  # fmt: skip
