"""Configuration of the identification: plain data for Drake's typed YAML loader, no deferred annotations."""

import dataclasses as dc

INTEGRATORS = ("twin", "cell")


@dc.dataclass
class SearchConfig:
    """The search over theta.

    Attributes:
        method: a name in ``search.SEARCHES``.
        candidates: number of thetas in the candidate set.
        budget: largest number of thetas that are tried.
        batch: thetas that are tried between two updates of the belief.
        entropy_tolerance_nats: the search stops when the entropy of P_min has changed by less than this ...
        patience: ... in so many updates.
        refine_every: trials after which candidates are drawn anew where P_min is large; 0 keeps the first set.
        jobs: processes; 0 takes the machine's cores.
        integrator: ``twin`` simulates trials with the compiled twin where it can, and with Drake otherwise; ``cell``
            simulates all of them with Drake, which takes about a hundred times as long.
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
