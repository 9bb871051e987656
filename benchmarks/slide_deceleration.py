"""Deceleration of free slides against speed: python benchmarks/slide_deceleration.py RECORDING.

Straight lines through stretches of the recorded speed, no simulator: what a person can check of a diagnosis that says
that friction grows with speed.
"""

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from physid_drake.recording import read_recording

GRAVITY = 9.81  # m/s^2
SAMPLES = 13  # of a straight line through the speed
SLOWEST = 0.05  # m/s: below, the slide comes to rest within a line
EDGES = (0.1, 0.2, 0.3, 0.4, 0.6, 1.0)  # m/s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path)
    recording = read_recording(parser.parse_args().recording)
    found = np.concatenate([decelerations(push.object.times, push.object.planar) for push in recording.pushes])
    table = Table(title=f"{len(recording.pushes)} slides, {len(found)} lines of {SAMPLES} samples")
    for column in ("speed [m/s]", "lines", "deceleration / g", "deviation"):
        table.add_column(column, justify="right")
    for low, high in pairwise(EDGES):
        within = found[(found[:, 0] >= low) & (found[:, 0] < high), 1]
        if len(within) > 1:
            table.add_row(
                f"{low:g} to {high:g}", str(len(within)), f"{within.mean():.3f}", f"{within.std(ddof=1):.3f}"
            )
    slope, at_rest = np.polyfit(found[:, 0], found[:, 1], 1)
    console = Console(width=100)
    console.print(table)
    console.print(f"deceleration / g = {at_rest:.3f} + {slope:.3f} s/m times the speed")


def decelerations(times, poses):
    """Mean speed [m/s] and deceleration over g (n, 2) of stretches of a slide."""
    speeds = np.hypot(*np.gradient(poses[:, :2], times, axis=0).T)
    half = SAMPLES // 2
    rows = []
    for k in range(half, len(times) - half, half):
        part = slice(k - half, k + half + 1)
        if speeds[part].min() > SLOWEST:
            rows.append((speeds[part].mean(), -np.polyfit(times[part], speeds[part], 1)[0] / GRAVITY))
    return np.array(rows).reshape(-1, 2)


if __name__ == "__main__":
    main()
