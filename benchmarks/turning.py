"""How well few points integrate the friction of a base that turns about a place in or near it.

Root mean square error of force and torque, in percent of Coulomb's friction and of it times the radius of gyration,
over places that are drawn evenly about the base: with what cancels where slip turns about a point, and without.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "unit"))

from test_support import OUTLINES, felt, fine_points, friction, spinning

from physid_drake.cell.support import FrictionGrid, support_of


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, nargs="+", default=[20, 30, 36, 45, 65, 100, 200])
    parser.add_argument("--places", type=int, default=300)
    given = parser.parse_args()
    made = Table(title="error of friction [%]: with what cancels, without (number of points)")
    made.add_column("points", justify="right")
    for name in OUTLINES:
        made.add_column(name, justify="right")
    truths = {name: truth_of(name, given.places) for name in OUTLINES}
    for points in given.points:
        made.add_row(str(points), *(shown(name, points, truths[name]) for name in OUTLINES))
    Console(width=120).print(made)


def truth_of(name, count):
    """Places (count, 2), force and torque (count, 3) about each, and their units (3,)."""
    fine = fine_points(OUTLINES[name], 300)
    even = np.full(len(fine), 1.0 / len(fine))
    low, high = fine.min(axis=0), fine.max(axis=0)
    places = np.random.default_rng(0).uniform(1.5 * low, 1.5 * high, (count, 2))
    units = np.array([1.0, 1.0, np.sqrt((fine**2).sum(axis=1).mean())])
    return places, np.array([friction(fine, even, place) for place in places]), units


def shown(name, points, truth):
    places, forces, units = truth
    support = support_of(OUTLINES[name], FrictionGrid(), points)
    found = np.array([felt(spinning(name, place, points=points)) for place in places])
    alone = np.array([friction(support.points, support.weights, place) for place in places])
    with_it, without = (100.0 * np.sqrt(np.mean(np.square((f - forces) / units))) for f in (found, alone))
    return f"{with_it:.2f}, {without:.2f} ({len(support.points)})"


if __name__ == "__main__":
    main()
