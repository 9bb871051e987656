"""What one push after another tells, and what a push costs: python benchmarks/online.py [--pushes 6] [--cells 1 1].

The shipped recording (truth: hand friction 0.22, support friction 0.27 all over), default cell, one process.
"""

import argparse
import time

from rich.console import Console
from rich.table import Table

from physid_drake.cell import CellConfig
from physid_drake.identify import OnlineIdentifier, SearchConfig
from physid_drake.identify.accuracy import rms
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import read_recording
from physid_drake.resources import shipped


def main() -> None:
    """Print a row for each push."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pushes", type=int, default=6, metavar="N")
    parser.add_argument("--cells", type=int, nargs=2, default=[1, 1], metavar=("NX", "NY"))
    given = parser.parse_args()
    recording = read_recording(shipped("recordings") / "eraser_reference").subset(range(given.pushes))
    learner = OnlineIdentifier(
        recording, cell=CellConfig(friction_cells=given.cells),
        theta=ThetaConfig(parameters=["hand_friction", "support_friction"]), search=SearchConfig(jobs=1), seed=0,
    )  # fmt: skip
    belief = learner.start()
    table = Table(title=f"{recording.name}, {given.cells[0]} x {given.cells[1]} cells", title_justify="left")
    names = [name.replace("support_friction", "table").replace("_friction", "") for name in belief.space.names]
    for header in ("push", *names, "foreseen", "fitted", "rollouts", "CPU s"):
        table.add_column(header, justify="right")
    for k, push in enumerate(recording.pushes):
        begin, before = time.process_time(), belief.rollouts
        belief = learner.learn(belief, push)
        spent = time.process_time() - begin
        result = learner.identification(belief)
        assert result is not None
        estimates = [f"{e.value:.3f} ({e.ci90[0]:.3f} to {e.ci90[1]:.3f})" for e in result.estimates]
        table.add_row(str(k + 1), *estimates, f"{rms(belief.foreseen[push.name]):.2f}", f"{result.fitted.rms:.2f}",
                      str(belief.rollouts - before), f"{spent:.1f}")  # fmt: skip
    console = Console(width=170)
    console.print(table)
    if result.cells is not None:
        told = [f"{c.left:.3f}" for c in result.cells.combinations]
        console.print(
            f"{result.cells.identifiable} combinations told; share of the prior's spread left: {', '.join(told)}"
        )


if __name__ == "__main__":
    main()
