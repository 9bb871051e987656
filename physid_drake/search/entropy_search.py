"""Entropy search: try the candidate whose outcome is expected to leave the least entropy in P_min."""

from dataclasses import dataclass
from typing import final

import numpy as np

from physid_drake.belief import Belief
from physid_drake.belief.p_min import entropy, estimate_p_min, weigh_p_min
from physid_drake.errors import ParameterError
from physid_drake.search.greedy_entropy import GreedyEntropySearch
from physid_drake.search.protocol import Indices
from physid_drake.space import Array


@final
@dataclass(frozen=True, kw_only=True)
class EntropySearch:
    """The next trial is the one, of a shortlist, with the greatest expected fall of the entropy of P_min.

    The expectation over the trial's outcome is a Gauss-Hermite sum. For each outcome the sampled functions are
    conditioned on it (Matheron's rule, exact for a Gaussian process) and their minima counted again, so that all
    candidates are compared on the same functions and their Monte Carlo error cancels for the most part.

    P_min counts only over the `representers` likeliest minima, with their prior weights. Outcomes are imagined under
    the Gaussian process alone, with its hyperparameters held.
    A batch takes the best k under one belief, without imagining the results of the first ones.

    Attributes:
        shortlist: Untried candidates that are looked at: half of them those that greedy entropy search would try
            first, the others drawn from the ``representers``.
        representers: Candidates over which P_min counts.
        n_samples: Functions drawn.
        n_outcomes: Nodes of the Gauss-Hermite sum.

    Raises:
        ParameterError: When a number is below 2.

    Source: Hennig and Schuler, "Entropy Search for Information-Efficient Global Optimization", JMLR 13, 2012,
        section 2.5, with samples in place of their expectation propagation. Wilson et al., "Efficiently Sampling
        Functions from Gaussian Process Posteriors", ICML 2020, equation 8, for Matheron's rule.
    """

    shortlist: int = 24
    representers: int = 150
    n_samples: int = 400
    n_outcomes: int = 5

    def __post_init__(self) -> None:
        if min(self.shortlist, self.representers, self.n_samples, self.n_outcomes) < 2:
            raise ParameterError(f"entropy search: every number is at least 2, but got {self}.")

    def propose(self, belief: Belief, rng: np.random.Generator, batch: int = 1) -> Indices:
        """The `batch` candidates of the shortlist with the least expected entropy, least first."""
        listed = self._shortlist(belief, rng, batch)
        if len(listed) <= 1:
            return listed
        expected = self.expected_entropies(belief, listed, rng)
        # Stable: where nothing is left to learn the greedy order stays.
        return listed[np.argsort(expected, kind="stable")][:batch]

    def expected_entropies(self, belief: Belief, indices: Indices, rng: np.random.Generator) -> Array:
        """Entropy of P_min (k,) in nats that is expected after a trial of each candidate of `indices` (k,)."""
        process = belief.gaussian_process
        minima = self._representers(belief)
        both, places = np.unique(np.concatenate([minima, indices]), return_inverse=True)
        u = belief.candidates_u[both]
        functions = process.sample_exact(u, self.n_samples, rng)
        shared = process.covariance(u, belief.candidates_u[indices])
        means, _ = process.predict(belief.candidates_u[indices])
        noise = process.noise_variance
        errors = np.sqrt(noise) * rng.standard_normal((len(indices), self.n_samples))
        nodes, weights = np.polynomial.hermite_e.hermegauss(self.n_outcomes)
        counted, log_weights = places[: len(minima)], belief.log_weights[minima]
        expected = np.zeros(len(indices))
        for k, place in enumerate(places[len(minima) :]):
            variance = shared[place, k] + noise
            surprise = means[k] - functions[:, place] - errors[k]
            gain = shared[counted, k] / variance
            for node, weight in zip(nodes, weights / weights.sum(), strict=True):
                moved = functions[:, counted] + np.outer(surprise + node * np.sqrt(variance), gain)
                expected[k] += weight * entropy(weigh_p_min(estimate_p_min(moved), log_weights)[0])
        return expected

    def _representers(self, belief: Belief) -> Indices:
        """The likeliest minima; where fewer than that ever were one, those that are likely below the best."""
        order = np.argsort(-belief.p_min, kind="stable")[: self.representers]
        if belief.p_min[order[-1]] > 0.0:
            return order
        below = belief.gaussian_process.probability_below_best(belief.candidates_u)
        return np.lexsort((-below, -belief.p_min))[: self.representers]

    def _shortlist(self, belief: Belief, rng: np.random.Generator, batch: int) -> Indices:
        size = max(self.shortlist, 2 * batch)
        greedy = GreedyEntropySearch().propose(belief, rng, max(batch, size // 2))
        rest = np.setdiff1d(self._representers(belief), greedy)
        rest = rest[~belief.tried[rest]]
        drawn = rng.choice(rest, size=min(len(rest), size - len(greedy)), replace=False)
        return np.concatenate([greedy, drawn])
