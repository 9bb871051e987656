"""The story: a recording in, an identified model out."""

from __future__ import annotations

import dataclasses as dc
import math
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.belief import Belief
from physid_drake.cell import CellConfig
from physid_drake.cell.solid import solid_of
from physid_drake.errors import ConfigError
from physid_drake.identify.cells import TOLD, CellsTold, cells_told, tied_cells
from physid_drake.identify.config import SearchConfig
from physid_drake.identify.polish import Polished, Polisher
from physid_drake.progress import Progress
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.misfit import DIVERGED, whitened_residual
from physid_drake.pushes.noise import Noise, noise_of
from physid_drake.pushes.nuisance import FIRST_SCATTER, nuisance_of
from physid_drake.pushes.prediction import Prediction
from physid_drake.pushes.problem import PushProblem, problems_of, spec_of
from physid_drake.pushes.refusals import refuse
from physid_drake.pushes.rollouts import RolloutPool
from physid_drake.pushes.task import Task
from physid_drake.pushes.theta import ThetaMap, cell_error, range_of, theta_map
from physid_drake.recording import Recording, thinned
from physid_drake.run_folder import part_of
from physid_drake.search import SearchResult, search_minimum, search_named
from physid_drake.space import Parameter, ParameterSpace

Array = NDArray[np.float64]

EXPLAINED = 1.5  # reduced chi-square below which the plain cell leaves no more than noise and its own error
MOST_SCATTER = 0.08  # of friction from push to push: pushes that differ by more differ in something that is left out
AT_BOUND = 1e-3  # of the unit cube


@dc.dataclass(frozen=True, kw_only=True)
class Estimate:
    """One parameter, as these pushes tell it.

    Attributes:
        name, unit: which.
        value: best estimate.
        ci90: 90 % interval.
        identifiable: whether the pushes leave at most half of the prior's spread (``TOLD``).
        prior: its value before.
        at_bound: whether it ran into a bound that is none of physics: the truth may lie beyond.
    """

    name: str
    unit: str
    value: float
    ci90: tuple[float, float]
    identifiable: bool
    prior: float
    at_bound: bool = False


@dc.dataclass(frozen=True, kw_only=True)
class Accuracy:
    """How well pushes are predicted: root mean squares over samples, and over pushes at their end.

    Attributes:
        position, rotation: along the path [m, rad].
        end_position, end_rotation: at the last sample [m, rad].
        force: of the hand's force [N]; None where none was recorded.
        sigmas: everything in standard deviations of the sensors.
        diverged: rollouts that diverged and are left out.
    """

    position: float
    rotation: float
    end_position: float
    end_rotation: float
    force: float | None
    sigmas: float
    diverged: int


@dc.dataclass(frozen=True, kw_only=True)
class Identification:
    """What was identified.

    Attributes:
        thetas: the parameter space and what is fixed.
        theta: (d,) the polished estimate.
        estimates: one per parameter.
        noise: the recording's.
        search: the search's result; its belief holds P_min.
        polished: the least-squares fit.
        reduced_chi2: cost per degree of freedom; 1 means that the plain cell explains the pushes to their noise.
        training, held_out: names of the pushes.
        before, after: accuracy on held-out pushes with the prior's theta and with the estimate.
        fitted: accuracy on the training pushes.
        cells: what the pushes tell about friction cells; None without a grid of them.
        foreseen: accuracy on each push before it was learned from; None where all were learned at once. ``fitted`` is
            then each push's right after.
    """

    thetas: ThetaMap
    theta: Array
    estimates: tuple[Estimate, ...]
    noise: Noise
    search: SearchResult
    polished: Polished
    reduced_chi2: float
    training: tuple[str, ...]
    held_out: tuple[str, ...]
    before: Accuracy | None
    after: Accuracy | None
    fitted: Accuracy
    cells: CellsTold | None = None
    foreseen: Accuracy | None = None

    @property
    def explains(self) -> bool:
        """Whether the plain cell explains the pushes to their noise, with frictions that hardly differ."""
        return self.reduced_chi2 < EXPLAINED and not self.by_frictions

    @property
    def by_frictions(self) -> bool:
        """Whether frictions that differ from push to push took up what the plain cell leaves."""
        return self.polished.friction_scatter > MOST_SCATTER


def split_pushes(count: int, share: float, rng: np.random.Generator) -> tuple[list[int], list[int]]:
    """Indices of training and held-out pushes; at least two stay for training, one push is not split.

    Raises:
        ConfigError: if ``share`` is not in [0, 1).
    """
    if not 0.0 <= share < 1.0:
        raise ConfigError(f"held_out_share must be in [0, 1), but is {share:g}.")
    number = min(max(0, count - 2), round(share * count)) if share > 0.0 else 0
    chosen = set(rng.permutation(count)[:number].tolist())
    return [i for i in range(count) if i not in chosen], sorted(chosen)


class Identifier:
    """Identifies theta from a recording: search, polish, intervals, held-out accuracy."""

    def __init__(
        self,
        recording: Recording,
        *,
        cell: CellConfig,
        theta: ThetaConfig,
        search: SearchConfig,
        held_out_share: float,
        seed: int,
        state: Path | None = None,
    ) -> None:
        """Prepare.

        Args:
            recording: the pushes.
            cell: how the pushes are simulated.
            theta: what is unknown.
            search: how it is searched for.
            held_out_share: of the pushes that are not fitted.
            seed: of everything random.
            state: a file in which the search's belief is kept, to go on from.

        Raises:
            RecordingError: if the recording cannot be identified from; ``pushes/refusals.py`` has all reasons.
        """
        refuse(recording)
        solid = solid_of(recording.object.shape)
        self.recording = recording
        short = thinned(recording)
        self.noise = noise_of(short)
        self.problems = problems_of(short, self.noise, solid.height)
        grid = (cell.friction_cells[0], cell.friction_cells[1])
        free = theta_map(recording.object, solid, grid, theta, cell.default_density_kgpm3)
        self.thetas = tied_cells(free, solid.outline, theta)
        self._config, self._chooser = search, search_named(search.method)
        self.pool = RolloutPool(spec_of(recording, cell), self.thetas, jobs=search.jobs, integrator=search.integrator)
        self._streams = np.random.SeedSequence(seed).spawn(2)
        train, held = split_pushes(len(self.problems), held_out_share, np.random.default_rng(self._streams[0]))
        self.training = [self.problems[i] for i in train]
        self.held_out = [self.problems[i] for i in held]
        self._state = state
        self._progress: Progress = lambda stage, done, total: None

    def run(self, progress: Progress | None = None) -> Identification:
        """Search, polish, score.

        Args:
            progress: told stage, steps done, steps in all.

        Raises:
            KeyboardInterrupt: when interrupted; the search's state is kept, and a new run goes on from it.
        """
        self._progress = progress or self._progress
        found = self.search()
        start = found.theta_best if np.isfinite(found.error_best) else self.thetas.space.nominal
        polisher = Polisher(
            self.pool, self.training, self.noise, FIRST_SCATTER, tick=lambda what: self._progress(what, 0, 0)
        )
        return self._identification(found, polisher.run(start))

    def search(self) -> SearchResult:
        """The configured search, over candidates drawn from the prior."""
        rng = np.random.default_rng(self._streams[1])
        space, config = self.thetas.space, self._config
        candidates = space.sample(rng, config.candidates, from_prior=True)
        resume = self._saved_belief(candidates)

        def keep(belief: Belief) -> None:
            self._keep(belief)
            self._progress(f"search ({config.method.replace('_', ' ')})", belief.n_trials, config.budget)

        return search_minimum(
            self._objective, space, candidates, self._chooser, budget=config.budget, rng=rng,
            batch=config.batch, entropy_tolerance=config.entropy_tolerance_nats, patience=config.patience,
            refine_every=config.refine_every, on_trial=keep, resume_from=resume,
        )  # fmt: skip

    def _keep(self, belief: Belief) -> None:
        """Written beside and renamed, so that an interruption leaves the last whole one; a full disk ends no run."""
        if self._state is None:
            return
        try:
            with part_of(self._state) as part:
                belief.to_npz(part)
                part.replace(self._state)
        except OSError as error:
            warnings.warn(f"the search's state is not kept, so that it cannot go on from here: {error}", stacklevel=2)
            self._state = None

    def _saved_belief(self, candidates: Array) -> Belief | None:
        """The belief of an interrupted run of the same search; one with other candidates is not taken."""
        if self._state is None or not self._state.exists():
            return None
        belief = Belief.from_npz(self._state)
        if belief.candidates.shape != candidates.shape:
            return None
        # Candidates follow the belief, but the first trial is one of those that the search began with.
        begun = belief.n_trials == 0 or bool(np.any(np.all(belief.thetas[0] == candidates, axis=1)))
        return belief if begun else None

    def _objective(self, thetas: Array) -> Array:
        """Log of the rms misfit in standard deviations (k,): its minimum is the misfit's, and it spans decades."""
        tasks = [self._task(problem, theta) for theta in thetas for problem in self.training]
        predictions = self.pool.run(tasks)
        count = len(self.training)
        errors = []
        for k in range(len(thetas)):
            part = predictions[k * count : (k + 1) * count]
            errors.append(self._error(part))
        return np.array(errors)

    def _error(self, predictions: Sequence[Prediction | None]) -> float:
        """Of what came to an end, if most did: a push that diverges at every theta must not hide the others."""
        squares = [
            whitened_residual(problem, self.noise, p) ** 2
            for problem, p in zip(self.training, predictions, strict=True)
            if p is not None
        ]
        lost = len(predictions) - len(squares)
        if lost >= len(squares):
            return float("inf")
        return float(0.5 * np.log(np.mean(np.concatenate(squares))) + DIVERGED * lost)

    def _task(self, problem: PushProblem, theta: Array) -> Task:
        nuisance = nuisance_of(problem, FIRST_SCATTER)
        return Task(problem=problem, theta=theta, nuisance=nuisance, values=np.zeros(len(nuisance.names)))

    def accuracy(self, problems: Sequence[PushProblem], theta: Array) -> Accuracy:
        """How well theta (d,) predicts some pushes."""
        predictions = self.pool.run([self._task(problem, theta) for problem in problems])
        return accuracy_of(list(zip(problems, predictions, strict=True)), self.noise)

    def _identification(self, found: SearchResult, polished: Polished) -> Identification:
        theta = polished.theta
        self._progress("held-out pushes", 0, 0)
        held = self.held_out
        return Identification(
            thetas=self.thetas,
            theta=theta,
            estimates=estimates_of(self.thetas, polished),
            noise=self.noise,
            search=found,
            polished=polished,
            reduced_chi2=polished.chi2 / polished.degrees,
            training=tuple(p.name for p in self.training),
            held_out=tuple(p.name for p in held),
            before=self.accuracy(held, self.thetas.space.nominal) if held else None,
            after=self.accuracy(held, theta) if held else None,
            fitted=self.accuracy(self.training, theta),
            cells=cells_told(self.thetas, polished),
        )


def estimates_of(thetas: ThetaMap, polished: Polished) -> tuple[Estimate, ...]:
    """Estimates with intervals: the wider of the cost's curvature and the pushes' disagreement.

    The curvature knows the noise that is in the model. What is not in it (a hand path that was fitted) pulls theta
    differently in every push; taking the push as the unit shows by how much. None is narrower than the cell's own
    error, which pushes share.

    Source: G. A. F. Seber and C. J. Wild, Nonlinear Regression, 1989, section 5.1 (curvature); K.-Y. Liang and
    S. L. Zeger, Biometrika 73, 1986 (the sandwich over clusters).
    """
    space = thetas.space
    covariance = polished.covariance
    prior_rows = polished.jacobian[-space.dimension :]
    prior_spread = np.sqrt(np.diag(np.linalg.inv(prior_rows.T @ prior_rows)))
    curvature = np.sqrt(np.diag(covariance))
    z, spread = float(stats.norm.ppf(0.95)), curvature
    pushes = sum(bool(np.any(own)) for own in polished.residuals)  # one whose rollout fails says nothing
    free = pushes - space.dimension
    if free >= 2:
        pulls = _pulls(polished)
        meat = pulls.T @ pulls * (pushes / free)
        sandwich = np.sqrt(np.diag(covariance @ meat @ covariance))
        spread = np.maximum(curvature, sandwich * float(stats.t.ppf(0.95, free)) / z)
    u = np.asarray(space.to_unit(polished.theta))
    result = []
    for j, parameter in enumerate(space.parameters):
        told = bool(spread[j] < TOLD * prior_spread[j])
        if told or parameter.prior_std is not None:
            std = math.hypot(spread[j], cell_error(space, np.asarray(polished.theta), j))
            reach = z * min(std, prior_spread[j])
            low, high = max(0.0, u[j] - reach), min(1.0, u[j] + reach)
        else:
            low, high = min(0.05, u[j]), max(0.95, u[j])  # of a uniform prior, and where the value is
        result.append(
            Estimate(
                name=parameter.name,
                unit=parameter.unit,
                value=float(polished.theta[j]),
                ci90=(_moved(space, u, j, low), _moved(space, u, j, high)),
                identifiable=told,
                prior=parameter.prior_mean,
                at_bound=_may_lie_beyond(parameter, float(u[j])),
            )
        )
    return tuple(result)


def _may_lie_beyond(parameter: Parameter, place: float) -> bool:
    """Whether a value, at a place in its bounds from 0 to 1, is at one that the search chose, and not physics."""
    beyond = range_of(parameter.name)
    low = place < AT_BOUND and parameter.lower > max(beyond.above, beyond.least)
    return low or (place > 1.0 - AT_BOUND and parameter.upper < min(beyond.most, beyond.below))


def _moved(space: ParameterSpace, u: Array, j: int, value: float) -> float:
    """Parameter j of the point u (d,) of the unit cube with its entry j moved to ``value``."""
    point = u.copy()
    point[j] = value
    return float(space.from_unit(point)[j])


def _pulls(polished: Polished) -> Array:
    """Gradient (pushes, d) of each push's share of the cost with respect to the unit cube."""
    scale = 1.0 / math.sqrt(polished.inflation)
    pulls, first = [], 0
    for residual in polished.residuals:
        rows = polished.jacobian[first : first + len(residual)]
        pulls.append(scale * (rows.T @ residual))
        first += len(residual)
    return np.array(pulls)


def accuracy_of(made: Sequence[tuple[PushProblem, Prediction | None]], noise: Noise) -> Accuracy:
    """The accuracy of predictions, those that diverged (None) left out and counted."""
    pairs = [(p, r) for p, r in made if r is not None]
    diverged = len(made) - len(pairs)
    if not pairs:
        nothing = float("inf")
        return Accuracy(
            position=nothing, rotation=nothing, end_position=nothing, end_rotation=nothing, force=None,
            sigmas=nothing, diverged=diverged,
        )  # fmt: skip
    errors = [r.poses - p.poses for p, r in pairs]
    every, last = np.concatenate(errors), np.array([e[-1] for e in errors])
    forces = np.concatenate([r.forces - p.forces for p, r in pairs])
    whitened = np.concatenate([whitened_residual(p, noise, r) for p, r in pairs])
    return Accuracy(
        position=_rms(every[:, :2]) * math.sqrt(2.0),
        rotation=_rms(every[:, 2]),
        end_position=_rms(last[:, :2]) * math.sqrt(2.0),
        end_rotation=_rms(last[:, 2]),
        force=_rms(forces) * math.sqrt(2.0) if len(forces) else None,
        sigmas=_rms(whitened),
        diverged=diverged,
    )


def pooled(accuracies: Sequence[Accuracy]) -> Accuracy:
    """The root mean square of several accuracies, each counting alike; those of nothing are left out."""
    fine = [a for a in accuracies if math.isfinite(a.sigmas)]
    forces = [a.force for a in fine if a.force is not None]

    def rms(name: str) -> float:
        return _rms(np.array([getattr(a, name) for a in fine])) if fine else float("inf")

    return Accuracy(
        position=rms("position"), rotation=rms("rotation"), end_position=rms("end_position"),
        end_rotation=rms("end_rotation"), force=_rms(np.array(forces)) if forces else None, sigmas=rms("sigmas"),
        diverged=sum(a.diverged for a in accuracies),
    )  # fmt: skip


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else float("nan")
