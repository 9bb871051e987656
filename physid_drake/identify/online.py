"""Identification push by push: from the belief after t pushes and a new push to the belief after t + 1."""

from __future__ import annotations

import dataclasses as dc
from typing import Any

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import CellConfig
from physid_drake.cell.solid import solid_of
from physid_drake.errors import RecordingError
from physid_drake.identify.accuracy import accuracy_of
from physid_drake.identify.baseline import LAST, baseline, fitter_of, settled, with_tolerances
from physid_drake.identify.config import SearchConfig
from physid_drake.identify.identify import Identification
from physid_drake.identify.theta_search import log_misfits
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.rollouts import Ask, Physics
from physid_drake.progress import Progress
from physid_drake.pushes.case import Case, case_of, theta_space
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.push_checks import refuse
from physid_drake.pushes.theta import ThetaMap
from physid_drake.recording import Push, Recording
from physid_drake.search import SearchResult, search_minimum, search_named
from physid_drake.space import ParameterSpace

Array = NDArray[np.float64]

BUDGET = 12  # trials of the search on a new push
CANDIDATES = 256
PRIOR_SHARE = 0.1  # of the candidates, drawn from P_0: what the Gaussian rules out may still be tried
NEAREST = 3  # trials from which a fit of all pushes starts, beside the last one


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class OnlineBelief:
    """P_t: a Gaussian over theta in the unit cube, from a fit of all pushes so far.

    Attributes:
        space: of theta.
        pushes: all so far.
        finder: the fitter of ``fit``; None before the first push in which the object moves.
        fit: theta, and each push's nuisance parameters.
        search: of the newest push, over candidates drawn from P_{t-1}; None before the first push.
        foreseen: by a push's name (m,), recorded less predicted features before it was learned from, in the features'
            units; None where there is no rollout.
        rollouts: number of rollouts so far.
    """

    space: ParameterSpace
    pushes: tuple[Push, ...] = ()
    finder: Fitter | None = None
    fit: Fit | None = None
    search: SearchResult | None = None
    foreseen: dict[str, Array | None] = dc.field(default_factory=dict)
    rollouts: int = 0

    def __deepcopy__(self, memo: Any) -> OnlineBelief:
        return self

    @property
    def mean(self) -> Array:
        """Mean (d,) in the unit cube."""
        if self.fit is None:
            return np.asarray(self.space.to_unit(self.space.nominal))
        return self.fit.point.z[: self.space.dimension]

    @property
    def theta(self) -> Array:
        """The estimate (d,), each entry in its unit."""
        return np.asarray(self.space.from_unit(self.mean))

    @property
    def covariance(self) -> Array:
        """Covariance (d, d) in the unit cube."""
        d = self.space.dimension
        if self.finder is None or self.fit is None:
            return np.diag(np.square(self.space.prior_std_unit))
        return self.finder.covariance(self.fit)[:d, :d]

    @property
    def information(self) -> Array:
        """Inverse covariance (d, d) in the unit cube."""
        return np.asarray(np.linalg.inv(self.covariance))

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Thetas (count, d), each entry in its unit, drawn from P_t.

        A tenth are drawn from P_0, since P_t may exclude the true theta.
        """
        spread = count if self.fit is None else max(1, int(PRIOR_SHARE * count))
        wide = self.space.sample(rng, spread, from_prior=True)
        if spread == count:
            return wide
        root = np.linalg.cholesky(self.covariance)
        points = self.mean + rng.standard_normal((count - spread, len(self.mean))) @ root.T
        inside = np.clip(1.0 - np.abs(1.0 - np.abs(points)), 0.0, 1.0)  # reflected at the bounds
        return np.concatenate([self.space.from_unit(inside), wide])


class OnlineIdentifier:
    """Learns theta from one push after another. What it has learned is in the belief that it returns, not in itself.

    Attributes:
        thetas: which parameters are unknown.
    """

    def __init__(
        self, recording: Recording, *, cell: CellConfig, theta: ThetaConfig, search: SearchConfig, seed: int,
        budget: int = BUDGET, progress: Progress | None = None,
    ) -> None:  # fmt: skip
        """Prepare.

        Args:
            recording: object, table, hand and sensors. Its pushes, if it has any, are checked for whether one could
                learn from them, and not used.
            cell: how pushes are simulated.
            theta: which parameters are unknown.
            search: method and number of processes; its other fields are those of the batch search, and not used.
            seed: random seed.
            budget: trials of the search on a new push.
            progress: called with the stage, steps done and steps in all.

        Raises:
            RecordingError: if the recording cannot be learned from; ``pushes/push_checks.py`` lists the reasons.
        """
        refuse(recording)
        self.thetas: ThetaMap = theta_space(recording.object, solid_of(recording.object.shape), cell, theta)
        self._recording, self._cell, self._theta = recording, cell, theta
        self._jobs, self._chooser, self._seed, self._budget = search.jobs, search_named(search.method), seed, budget
        self._progress: Progress = progress or (lambda stage, done, total: None)

    def start(self) -> OnlineBelief:
        """P_0, the prior."""
        return OnlineBelief(space=self.thetas.space)

    def case(self, pushes: tuple[Push, ...]) -> Case:
        """Pushes, made ready to be fitted.

        Raises:
            RecordingError: if the object moves in none of them.
        """
        recording = dc.replace(self._recording, pushes=pushes)
        return case_of(recording, self._cell, self._theta, jobs=self._jobs, most=len(pushes))

    def learn(self, belief: OnlineBelief, push: Push) -> OnlineBelief:
        """P_{t+1} from P_t and one new push.

        A small search over candidates drawn from P_t finds thetas that explain the new push. All pushes are then
        fitted from the best of these and from the previous fit. A push in which nothing moves, or which cannot be
        rolled out, changes only the list of pushes.

        Args:
            belief: P_t.
            push: the new one.

        Raises:
            KeyboardInterrupt: when interrupted; the belief that was given is unchanged.

        Source: Zhu, Kimmel, Boularias, section III.B, for the search.
        """
        pushes = (*belief.pushes, push)
        rng = np.random.default_rng([self._seed, len(belief.pushes)])
        try:
            finder = fitter_of(self.case(pushes), self._seed)
        except RecordingError:  # the object has not moved yet, or nothing can be rolled out
            return dc.replace(belief, pushes=pushes, foreseen={**belief.foreseen, push.name: None})
        names = [problem.name for problem in finder.case.problems]
        if names[-1] != push.name:  # what cannot be rolled out says nothing
            return dc.replace(belief, pushes=pushes, foreseen={**belief.foreseen, push.name: None})
        newest = len(names) - 1
        expected = _error(finder, newest, belief.theta)
        found = self._search(belief, finder, newest, rng)
        self._progress("new push", newest, 0)
        fit = with_tolerances(finder, self._fitted(belief, finder, found, rng))
        return OnlineBelief(
            space=belief.space, pushes=pushes, finder=finder, fit=fit, search=found,
            foreseen={**belief.foreseen, push.name: expected}, rollouts=belief.rollouts + finder.predictor.count,
        )  # fmt: skip

    def identification(self, belief: OnlineBelief) -> Identification | None:
        """The belief as an identification, with intervals; None before the first push in which the object moved."""
        finder, fit = belief.finder, belief.fit
        if finder is None or fit is None:
            return None
        foreseen = [belief.foreseen[problem.name] for problem in finder.case.problems]
        return Identification(
            case=finder.case, fitter=finder, fit=fit, found=fit, finder=finder, search=belief.search,
            foreseen=accuracy_of(finder.case, foreseen),
        )  # fmt: skip

    def _search(self, belief: OnlineBelief, finder: Fitter, push: int, rng: np.random.Generator) -> SearchResult:
        return search_minimum(
            lambda thetas: log_misfits(finder.predictor, [push], finder.at_rest(), thetas),
            belief.space, belief.draw(rng, CANDIDATES), self._chooser, budget=self._budget, rng=rng,
            entropy_tolerance=0.0,
            on_trial=lambda b: self._progress("search with the new push", b.n_trials, self._budget),
        )  # fmt: skip

    def _fitted(self, belief: OnlineBelief, finder: Fitter, found: SearchResult, rng: np.random.Generator) -> Fit:
        """All pushes, from where the last fit was and from the best trials; from everywhere before there is one."""
        order = np.argsort(found.belief.errors, kind="stable")[:NEAREST]
        trials = [np.asarray(found.belief.thetas[k]) for k in order]
        last, before = belief.fit, belief.finder
        if last is None or before is None:
            return baseline(finder, rng, trials)
        known = {p.name: nuisance for p, nuisance in zip(before.case.problems, last.point.nuisance, strict=True)}
        rests = finder.at_rest()
        nuisances = tuple(known.get(p.name, rest) for p, rest in zip(finder.case.problems, rests, strict=True))
        h = dc.replace(last.hypothesis, around=finder.case.around, tolerances=0)
        zs = [belief.mean, *(np.clip(belief.space.to_unit(theta), *h.bounds) for theta in trials)]
        points = [p for p in finder.points([h] * len(zs), zs, [nuisances] * len(zs)) if p is not None]
        if not points:
            return baseline(finder, rng, trials)
        begun = finder.robust(finder.started([h] * len(points), points, [None] * len(points)))
        fits = finder.fitted(begun, LAST)
        return settled(finder, max(fits, key=lambda f: f.log_likelihood), rng)


def _error(finder: Fitter, push: int, theta: Array) -> Array | None:
    """Recorded less predicted (m,) of a push of which nothing is known; None of no rollout."""
    predictor = finder.predictor
    vector = predictor.vectors([Ask(push, Physics(theta), finder.at_rest()[push])])[0]
    return (
        None
        if vector is None
        else np.asarray(np.linalg.solve(predictor.whitening[push], predictor.recorded[push] - vector))
    )
