"""How closely the cell follows the tests' planar reference: python benchmarks/accuracy.py [--seeds 0 1 2]."""

import argparse
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from reference.scenes import simulate, sixty_pushes
from twin import MODELS, parting, rms, twin


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    seeds = parser.parse_args().seeds
    table = Table(title="error in sigma (0.3 mm, 3 mrad), sixty pushes a seed")
    for column in ("contact", "seed", "rms", "rms [mm]", "rms [mrad]", "end rms", "median push", "worst push"):
        table.add_column(column, justify="right")
    for seed in seeds:
        pushes = [(*push, simulate(*push)) for push in sixty_pushes(seed)]
        for model in MODELS:
            series = []
            for body, theta, push, want in pushes:
                motion = twin(body, theta, push, want.times[-1], model, ())
                series.append(parting(motion, want.times, want.poses))
            table.add_row(model, str(seed), *(f"{value:.3f}" for value in summary(series)))
    Console(width=110).print(table)


def summary(series: list[np.ndarray]) -> list[float]:
    """The numbers of a row, from one array (n, 3) in sigma per push."""
    every, last = np.concatenate(series), np.array([s[-1] for s in series])
    each = [rms(s) for s in series]
    return [rms(every), 0.3 * rms(every[:, :2]), 3.0 * rms(every[:, 2]), rms(last), float(np.median(each)), max(each)]


if __name__ == "__main__":
    main()
