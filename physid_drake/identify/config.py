"""Configuration of the identification: plain data for Drake's typed YAML loader, no deferred annotations."""

import dataclasses as dc

INTEGRATORS = ("twin", "cell")


@dc.dataclass
class SearchConfig:
    """The search over theta.

    Attributes:
        method: a name in ``search.SEARCHES``.
        candidates: number of thetas in the candidate set.
        budget: thetas tried.
        batch: thetas per update of the belief.
        entropy_tolerance_nats: the search stops when the entropy of P_min moves less than this.
        patience: over so many updates.
        refine_every: trials after which the candidates gather where the best theta may be; 0 keeps one fixed set.
        jobs: processes; 0 takes the machine's cores.
        integrator: ``twin`` simulates every trial of the search in the compiled planar image of the cell, and in
            Drake what that does not know; ``cell`` all of them in Drake, which takes a hundred times as long.
        online: learn from one push after another, with a small search for each, instead of from all at once.
    """

    method: str = "greedy_entropy"
    candidates: int = 1000
    budget: int = 40
    batch: int = 1
    entropy_tolerance_nats: float = 0.1
    patience: int = 5
    refine_every: int = 5
    jobs: int = 0
    integrator: str = "twin"
    online: bool = False
