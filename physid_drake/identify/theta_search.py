"""The search over theta: which theta explains the pushes best, by the entropy of P_min as in the paper."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from physid_drake.belief import Belief
from physid_drake.identify.config import SearchConfig
from physid_drake.inference.fit import Fitter
from physid_drake.inference.predictions import Predictor
from physid_drake.inference.rollouts import Ask, Physics
from physid_drake.progress import Progress
from physid_drake.search import SearchResult, search_minimum, search_named
from physid_drake.whole_files import part_of

Array = NDArray[np.float64]

DIVERGED = 3.0  # nats of a theta's cost for each push whose rollout diverges


class ThetaSearch:
    """The configured search, over candidates drawn from the prior; it can go on from a file that keeps its belief.

    Source: S. Zhu, A. Kimmel and A. Boularias, "Information-theoretic model identification and policy search using
    physics engines with application to robotic manipulation", 2017, section III.
    """

    def __init__(
        self, config: SearchConfig, rng: np.random.Generator, state: Path | None, progress: Progress
    ) -> None:
        """Prepare.

        Args:
            config: of the search.
            rng: draws candidates, and is given to the search.
            state: file that keeps the belief; None keeps none.
            progress: called with the stage, trials done and trials in all.
        """
        self._config, self._chooser = config, search_named(config.method)
        self._rng, self._state, self._progress = rng, state, progress

    def run(self, fitter: Fitter) -> SearchResult:
        """Minimise ``log_misfits`` over theta.

        The logarithm is taken because misfits span orders of magnitude; its minimum is the misfit's.
        """
        config, space, case = self._config, fitter.case.thetas.space, fitter.case
        # Its rollouts are its trials: a search that goes on from a file makes fewer.
        by_cell = config.integrator == "cell"
        predictor = fitter.predictor.judging(case.pool) if by_cell else fitter.predictor.apart()
        candidates = space.sample(self._rng, config.candidates, from_prior=True)
        pushes = range(len(case.problems))
        return search_minimum(
            lambda thetas: log_misfits(predictor, pushes, fitter.at_rest(), thetas), space, candidates, self._chooser,
            budget=config.budget, rng=self._rng, batch=config.batch, entropy_tolerance=config.entropy_tolerance_nats,
            patience=config.patience, refine_every=config.refine_every, on_trial=self._keep,
            resume_from=self._saved(candidates),
        )  # fmt: skip

    def _keep(self, belief: Belief) -> None:
        """Written beside and renamed, so that an interruption leaves the last whole one; a full disk ends no run."""
        self._progress("parameter search", belief.n_trials, self._config.budget)
        if self._state is None:
            return
        try:
            with part_of(self._state) as part:
                belief.to_npz(part)
                part.replace(self._state)
        except OSError as error:
            warnings.warn(f"the search's state is not kept, so that it cannot go on from here: {error}", stacklevel=2)
            self._state = None

    def _saved(self, candidates: Array) -> Belief | None:
        """The belief of an interrupted run of the same search; one with other candidates is not taken."""
        if self._state is None or not self._state.exists():
            return None
        belief = Belief.from_npz(self._state)
        if belief.candidates.shape != candidates.shape:
            return None
        # Candidates follow the belief, but the first trial is one of those that the search began with.
        begun = belief.n_trials == 0 or bool(np.any(np.all(belief.thetas[0] == candidates, axis=1)))
        return belief if begun else None


def log_misfits(predictor: Predictor, pushes: Sequence[int], nuisances: Sequence[Array], thetas: Array) -> Array:
    """Natural logarithm of the rms error (k,) of some pushes at k thetas, the errors in units of the noise.

    A push whose rollout diverges adds ``DIVERGED`` instead of its errors, so that one which diverges at every theta
    does not hide the others. Where half of the pushes or more diverge the result is infinite.

    Args:
        predictor: makes the rollouts.
        pushes: indices of the pushes.
        nuisances: each push's nuisance parameters (k,).
        thetas: (k, d), each entry in its unit.
    """
    vectors = iter(predictor.vectors([Ask(i, Physics(theta), nuisances[i]) for theta in thetas for i in pushes]))
    costs = []
    for _ in thetas:
        found = [(predictor.recorded[i], next(vectors)) for i in pushes]
        errors = [y - f for y, f in found if f is not None]
        lost = len(found) - len(errors)
        fine = lost < len(errors)
        costs.append(0.5 * np.log(np.mean(np.concatenate(errors) ** 2)) + DIVERGED * lost if fine else np.inf)
    return np.array(costs)
