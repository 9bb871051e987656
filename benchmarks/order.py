"""How often frictions that follow nothing seem to follow the pushes' order: order.py [--draws 10000].

Linear pushes whose own frictions scatter, some of which hardly tell them, refitted with a shared parameter, as a
diagnosis does; the score test and the rank correlation of ``diagnose.screen.by_trend``. A drift is accepted below
``IN_ORDER`` = 1e-4 (docs/diagnosis.md), so often may it be wrong.
"""

import argparse
from types import SimpleNamespace

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from physid_drake.diagnose.linear import LinearPush, Whitened, best_scatter, solve
from physid_drake.diagnose.model import Fitted, State
from physid_drake.diagnose.screen import IN_ORDER, Signature, by_trend, score
from physid_drake.effects import Family

NUMBERS = 12  # of a push
LEVELS = (0.1, 0.01, 0.001, IN_ORDER)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=10000)
    given = parser.parse_args()
    below = [f"below {level:g}" for level in LEVELS]
    table = Table("pushes", "scatter", *below, title=f"of {given.draws} draws each")
    for pushes in (6, 8, 12, 20):
        for scatter in (0.5, 4.0):
            rng = np.random.default_rng([pushes, int(10 * scatter)])
            console = Console(stderr=True)
            seen = np.array([log_p(rng, pushes, scatter) for _ in track(range(given.draws), console=console)])
            table.add_row(str(pushes), f"{scatter:g}", *(str(int((seen < np.log(x)).sum())) for x in LEVELS))
    Console(width=120).print(table)


def log_p(rng, count, scatter):
    """Of the order, where frictions (in units of the usual scatter) follow nothing."""
    strength = np.where(rng.random(count) < 0.25, 0.05, rng.uniform(0.5, 3.0, count))  # slow pushes tell nothing
    own = [s * rng.normal(size=(NUMBERS, 1)) for s in strength]
    shared = [rng.normal(size=(NUMBERS, 1)) for _ in range(count)]
    frictions = scatter * rng.standard_normal(count)
    pushes = tuple(
        LinearPush(
            residual=column[:, 0] * friction + rng.standard_normal(NUMBERS), shared=more, own=column,
            noise=np.eye(NUMBERS), friction=0,
        )
        for column, more, friction in zip(own, shared, frictions, strict=True)
    )  # fmt: skip
    fitted = fitted_to(pushes)
    changes = np.arange(count) - 0.5 * (count - 1)
    signature = Signature(
        kind=SimpleNamespace(name="friction_drift"), family=Family(point=(0.0,), free=(0,)),
        columns=tuple(column * change for column, change in zip(own, changes, strict=True)), one_sided=(False,),
        stds=(np.inf,), friction_changes=tuple(changes.tolist()),
    )  # fmt: skip
    return by_trend(fitted, score(fitted, signature)).log_p


def fitted_to(pushes):
    """The plain model: a shared parameter, of which little is known, and each push's friction."""
    mean, std = np.zeros(1), np.full(1, 10.0)
    scatter, value = best_scatter(pushes, mean, std)
    return Fitted(
        state=State(u=np.zeros(1), effects=(), own=(np.zeros(1),) * len(pushes), scatter=scatter), pushes=pushes,
        prior_mean=mean, prior_std=std, solution=solve(Whitened.of(pushes, scatter), mean, std),
        predicted=tuple(np.zeros(NUMBERS) for _ in pushes), score=value,
    )  # fmt: skip


if __name__ == "__main__":
    main()
