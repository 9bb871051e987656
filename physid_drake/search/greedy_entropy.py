"""Greedy entropy search: try the candidate that contributes most to the entropy of P_min."""

from dataclasses import dataclass
from typing import final

import numpy as np

from physid_drake.belief import Belief
from physid_drake.belief.p_min import entropy_terms
from physid_drake.search.protocol import Indices


@final
@dataclass(frozen=True)
class GreedyEntropySearch:
    """The next trial is the untried candidate of greatest -P_min log P_min.

    The term grows up to P_min = 1/e and falls above it, so a candidate that is almost surely the minimiser
    (0.9 gives 0.095 nats) waits behind a runner-up (0.05 gives 0.150 nats). That is the paper's rule. It costs
    next to no rollouts: a favourite is tried on its way up to 1/e, and to be passed over it must leap beyond
    within one update. Once it has been tried, the runners-up are all that is left to learn about. Measured in
    docs/archive/results.md, "Searches".

    Candidates that were tried are left out: the simulation is deterministic and would say the same again.
    A batch takes the k greatest terms under one belief, without imagining the results of the first ones.
    Where terms are equal, above all 0 because no sampled function had its minimum there, the candidate that
    is more likely to be below the candidate of least mean comes first.

    Source: Zhu, Kimmel, Boularias, "Information-theoretic Model Identification and Policy Search using
        Physics Engines", section III.B.
    """

    def propose(self, belief: Belief, rng: np.random.Generator, batch: int = 1) -> Indices:
        """The `batch` untried candidates of greatest -P_min log P_min, greatest first; draws nothing."""
        untried = np.flatnonzero(~belief.tried)
        terms = entropy_terms(belief.p_min[untried])
        if np.count_nonzero(terms) >= batch and len(np.unique(terms)) == len(terms):
            ties = np.zeros(len(untried))
        else:
            ties = belief.gaussian_process.probability_below_best(belief.candidates_u)[untried]
        return untried[np.lexsort((-ties, -terms))][:batch]
