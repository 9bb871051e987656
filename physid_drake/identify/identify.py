"""Identification as a whole: from a recording to parameters with intervals. It is the hypothesis without effects."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import CellConfig
from physid_drake.identify.accuracy import Accuracy, accuracy_of
from physid_drake.identify.baseline import baseline, fitter_of, with_tolerances
from physid_drake.identify.cells import IdentifiableCells, identifiable_cells
from physid_drake.identify.config import SearchConfig
from physid_drake.identify.estimates import Estimate, estimates_of
from physid_drake.identify.judge import Judge
from physid_drake.identify.theta_search import ThetaSearch
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.process_noise import EVEN_SURFACES, ProcessNoise
from physid_drake.progress import Progress
from physid_drake.pushes.case import MOST_PUSHES, UNIT_SCATTER, Case, case_of
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import Recording
from physid_drake.search import SearchResult

Array = NDArray[np.float64]

EXPLAINED = 1.5  # reduced chi-square below which the baseline model leaves no more than noise and its own error
MOST_SCATTER = 0.08  # of friction between pushes [-]: a larger one stands for missing physics


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Identification:
    """The result of an identification. It is immutable; a Drake port that copies its value gets the same object.

    Attributes:
        case: the recording, made ready.
        fitter: whose predictions ``fit`` is judged by: those of the Drake cell, or of the twin where the cell was not
            asked.
        fit: theta, and each push's nuisance parameters.
        found: the fit on the twin, before the cell's steps; a diagnosis goes on from it.
        finder: the fitter of ``found``.
        search: the result of the search, whose belief holds P_min; None without a search.
        before: accuracy with the prior's theta; None where the cell was not asked.
        errors: per push (m,), recorded less predicted features in the features' units, the cell's prediction made
            with theta from all other pushes; empty where the cell was not asked.
        rough: the process noise that was added to the sensors'.
        foreseen: accuracy on each push before it was learned from; None where all were learned from at once.
    """

    case: Case
    fitter: Fitter
    fit: Fit
    found: Fit
    finder: Fitter
    search: SearchResult | None
    before: Accuracy | None = None
    errors: tuple[Array, ...] = ()
    rough: ProcessNoise = EVEN_SURFACES
    foreseen: Accuracy | None = None

    def __deepcopy__(self, memo: Any) -> Identification:
        return self

    @property
    def theta(self) -> Array:
        """The estimate (d,), each entry in its unit."""
        return self.fit.hypothesis.theta(self.fit.point.z)

    @cached_property
    def estimates(self) -> tuple[Estimate, ...]:
        """An estimate with its interval for each parameter."""
        return estimates_of(self.fitter, self.fit)

    @cached_property
    def covariance(self) -> Array:
        """Covariance (d, d) of theta in the unit cube."""
        d = self.fit.hypothesis.space.dimension
        return self.fitter.covariance(self.fit)[:d, :d]

    @property
    def correlation(self) -> Array:
        """Correlation (d, d) of theta, with parameters on a log scale as their logarithms."""
        stds = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(stds, stds))

    @cached_property
    def cells(self) -> IdentifiableCells | None:
        """What the pushes say about friction cells; None without a grid of them."""
        d, h = self.fit.hypothesis.space.dimension, self.fit.hypothesis
        prior = np.linalg.inv(h.precision[:d, :d])
        return identifiable_cells(self.case.thetas, self.theta, np.asarray(prior), self.covariance)

    @property
    def pushes(self) -> tuple[str, ...]:
        """Names of the pushes."""
        return tuple(problem.name for problem in self.case.problems)

    @cached_property
    def after(self) -> Accuracy | None:
        """Accuracy on held-out pushes, each with theta from all others; None where the cell was not asked."""
        return accuracy_of(self.case, self.errors) if self.errors else None

    @property
    def noise(self) -> dict[str, Any]:
        """Standard deviations and times of the sensors' noise, by keys that end with their units.

        Those of the hand and of its force are there where they are compared.
        """
        case = self.case
        hand = {} if case.recording.hand is None else {"hand_m": case.sensors.hand}
        if case.sensors.hand_memory > 0.0:
            hand["hand_correlation_time_s"] = case.sensors.hand_memory
        if any(len(problem.force_times) for problem in case.problems):
            hand["force_n"] = case.sensors.force
        turned = any(features.dofs == 3 for features in case.features)
        turn = {"rotation_rad": case.noise.rotation} if turned else {}
        rough = {} if self.rough.is_none else {"friction_along_way": dc.asdict(self.rough)}
        return {
            "position_m": case.noise.position, **turn,
            "correlation_time_s": list(case.noise.correlation_time), "jitter_s": case.noise.jitter, **hand, **rough,
        }  # fmt: skip

    @cached_property
    def fitted(self) -> Accuracy:
        """Accuracy of the fit, with each push's most probable nuisance parameters."""
        predictor = self.fitter.predictor
        pairs = zip(predictor.recorded, self.fit.point.predicted, predictor.whitening, strict=True)
        return accuracy_of(self.case, [np.asarray(np.linalg.solve(w, y - f)) for y, f, w in pairs])

    @property
    def friction_scatter(self) -> float:
        """Relative standard deviation of friction between pushes [-]."""
        return UNIT_SCATTER * self.fit.scatter

    @property
    def degrees(self) -> int:
        """Degrees of freedom: residuals less parameters."""
        return self.fit.degrees

    @property
    def reduced_chi2(self) -> float:
        """Squared residuals in units of the noise, plus the prior's squares, over the degrees of freedom."""
        return self.fit.reduced_chi2

    @property
    def explains(self) -> bool:
        """Whether the baseline model explains the pushes to within noise, at a small scatter of friction."""
        return self.reduced_chi2 < EXPLAINED and not self.by_frictions

    @property
    def by_frictions(self) -> bool:
        """Whether the fit needs frictions that differ between pushes by more than ``MOST_SCATTER``."""
        return self.friction_scatter > MOST_SCATTER

    @property
    def rollouts(self) -> int:
        """Number of rollouts that were made."""
        return self.finder.predictor.count + self.fitter.predictor.count


def unknowns_of(case: Case, fit: Fit) -> dict[str, dict[str, float]]:
    """Each push's nuisance parameters, by the push's name and theirs, each in its unit."""
    triples = zip(case.problems, case.nuisances, fit.point.nuisance, strict=True)
    return {push.name: dict(zip(n.names, (nuisance * n.stds).tolist(), strict=True)) for push, n, nuisance in triples}


def identified(
    case: Case, *, seed: int, search: ThetaSearch | None = None, progress: Progress | None = None
) -> Identification:
    """Identify theta: a search, fits from many starts on the twin, and a refit of the best in the Drake cell.

    Args:
        case: the recording, made ready.
        seed: of the starts.
        search: its best theta is one of the starts; None makes no search.
        progress: called with the stage, steps done and steps in all.

    Raises:
        RecordingError: if no push can be rolled out.
    """
    say: Progress = progress or (lambda stage, done, total: None)
    say("parameter fit" if search is None else "parameter search", 0, 0)  # what is compiled, is compiled here
    finder = fitter_of(case, seed)
    best = None if search is None else search.run(finder)
    starts = [] if best is None or not np.isfinite(best.error_best) else [best.theta_best]
    say("parameter fit", 0, 0)
    return _identified(finder, seed, starts, best, EVEN_SURFACES, say)


def identified_with(
    known: Identification, rough: ProcessNoise, added: Sequence[Array], *, seed: int, progress: Progress
) -> Identification:
    """The identification, made again with process noise added to the sensors'.

    Args:
        known: the identification without it.
        rough: the process noise.
        added: covariances (m_i, m_i) that it adds to each push, from ``process_noise.learned``.
        seed: of the starts.
        progress: called with the stage, steps done and steps in all.
    """
    finder = Fitter(known.case, known.finder.predictor.noisier(added))
    again = _identified(finder, seed, [known.theta], known.search, rough, progress)
    return dc.replace(again, before=known.before, foreseen=known.foreseen)


def _identified(
    finder: Fitter,
    seed: int,
    starts: Sequence[Array],
    search: SearchResult | None,
    rough: ProcessNoise,
    progress: Progress,
) -> Identification:
    found = with_tolerances(finder, baseline(finder, np.random.default_rng(seed), starts))
    progress("refit in the Drake cell", 0, 0)
    return in_the_cell(Identification(
        case=finder.case, fitter=finder, fit=found, found=found, finder=finder, search=search, rough=rough,
    ))  # fmt: skip


def in_the_cell(known: Identification) -> Identification:
    """The identification with its fit refined in the Drake cell, and with that cell's held-out errors."""
    judge = Judge(known.finder)
    fit = judge.judged(known.found)
    return dc.replace(known, fitter=judge.fitter, fit=fit, errors=judge.left_out(fit))


def with_prior(known: Identification) -> Identification:
    """The identification with the accuracy that the prior's theta has in the Drake cell."""
    h = known.fit.hypothesis
    errors = Judge(known.finder).errors(h, [h.mean] * len(known.fit.pushes))
    return dc.replace(known, before=accuracy_of(known.case, errors))


class Identifier:
    """Identifies theta from a recording.

    Attributes:
        case: the recording, made ready.
    """

    def __init__(
        self,
        recording: Recording,
        *,
        cell: CellConfig,
        theta: ThetaConfig,
        search: SearchConfig,
        seed: int,
        state: Path | None = None,
        most: int = MOST_PUSHES,
    ) -> None:
        """Check the recording and make it ready.

        Args:
            recording: the pushes.
            cell: how pushes are simulated.
            theta: which parameters are unknown.
            search: how they are searched for.
            seed: random seed.
            state: a file that keeps the search's belief, from which an interrupted run goes on; None keeps none.
            most: largest number of pushes that are used; of more, so many are taken at equal distances in their
                order.

        Raises:
            RecordingError: if the recording cannot be identified from; ``pushes/push_checks.py`` lists the reasons.
        """
        self.case = case_of(recording, cell, theta, jobs=search.jobs, most=most)
        self._search, self._seed, self._state = search, seed, state

    def run(self, progress: Progress | None = None) -> Identification:
        """Search, fit on the twin, and refit in the Drake cell.

        Args:
            progress: called with the stage, steps done and steps in all.

        Raises:
            RecordingError: if no push can be rolled out.
            KeyboardInterrupt: when interrupted; the search's state is kept, and a new run goes on from it.
        """
        say: Progress = progress or (lambda stage, done, total: None)
        rng = np.random.default_rng(np.random.SeedSequence(self._seed).spawn(2)[1])
        search = ThetaSearch(self._search, rng, self._state, say)
        return with_prior(identified(self.case, seed=self._seed, search=search, progress=say))
