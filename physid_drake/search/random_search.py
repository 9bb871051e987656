"""Random search, the baseline of the paper."""

from dataclasses import dataclass
from typing import final

import numpy as np

from physid_drake.belief import Belief
from physid_drake.search.protocol import Indices


@final
@dataclass(frozen=True)
class RandomSearch:
    """The next trial is any untried candidate, each as likely as its prior weight says.

    It does not look at the trials. A batch as large as the budget therefore gives the same search with one
    estimate of P_min instead of one per trial.

    Source: Zhu, Kimmel, Boularias, section IV.A, "Random Search was performed by randomly sampling theta in
        the same parameter space".
    """

    def propose(self, belief: Belief, rng: np.random.Generator, batch: int = 1) -> Indices:
        """Draws up to `batch` untried candidates without replacement."""
        untried = np.flatnonzero(~belief.tried)
        # The largest of log-weight plus Gumbel noise is a draw by weight without replacement.
        keys = belief.log_weights[untried] + rng.gumbel(size=len(untried))
        return untried[np.argsort(-keys)][:batch]
