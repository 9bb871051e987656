"""What the loop needs from a search."""

from typing import Protocol

import numpy as np
import numpy.typing as npt

from physid_drake.belief import Belief

Indices = npt.NDArray[np.intp]


class Search(Protocol):
    """Chooses the next trials from a belief; keeps no state of its own."""

    def propose(self, belief: Belief, rng: np.random.Generator, batch: int = 1) -> Indices:
        """Candidates to try next.

        Args:
            belief: What is thought so far.
            rng: For searches that draw.
            batch: How many to propose.

        Returns:
            Distinct indices (k,) into `belief.candidates`, none tried before; k < batch when fewer are left.
        """
        ...
