"""What longer time steps do to slow pushes: python benchmarks/slow_pushes.py [--pushes 8] [--speed 0.002]."""

import argparse
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from reference.scenes import OBJECTS, Theta, draw_push, simulate
from twin import parting, rms, twin

TICKS = (1e-3, 4e-3, 1e-2, 2e-2, 4e-2)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pushes", type=int, default=8)
    parser.add_argument("--speed", type=float, default=0.002, help="of the hand [m/s]")
    arguments = parser.parse_args()
    found = {time_step: [] for time_step in TICKS}
    for k in track(range(arguments.pushes), console=Console(stderr=True)):
        body, theta, push = drawn(k, arguments.speed)
        want = simulate(body, theta, push)
        for time_step in TICKS:
            motion = twin(body, theta, push, want.times[-1], "point", solver(time_step))
            found[time_step].append((motion.planar_at(want.times), parting(motion, want.times, want.poses)))
    Console(width=110).print(table(arguments, found))


def drawn(k, speed):
    """The k-th push of a box: towards its middle or off it, from several sides."""
    rng = np.random.default_rng([5, k])
    body = OBJECTS["box"]
    offset, heading = rng.uniform(-0.7, 0.7), rng.uniform(-0.3, 0.3)
    push = draw_push(rng, body, speed=speed, offset=offset, heading=heading, push_time=4.0, pose=(0, 0, 0))
    return body, Theta(support_friction=0.3, hand_friction=0.4), push


def solver(time_step):
    return (("time_step_s", time_step), ("slide_time_step_s", time_step))


def table(arguments, found):
    result = Table(title=f"{arguments.pushes} pushes of a box at {1e3 * arguments.speed:g} mm/s")
    for column in ("tick [ms]", "sigma off the reference", "worst mm off 1 ms", "worst mrad off 1 ms"):
        result.add_column(column, justify="right")
    shortest = [poses for poses, _ in found[TICKS[0]]]
    for time_step, pushes in found.items():
        apart = np.concatenate([poses - short for (poses, _), short in zip(pushes, shortest, strict=True)])
        reference = rms(np.concatenate([errors for _, errors in pushes]))
        worst = 1e3 * np.abs(apart).max(axis=0)
        result.add_row(f"{1e3 * time_step:g}", f"{reference:.3f}", f"{worst[:2].max():.4f}", f"{worst[2]:.3f}")
    return result


if __name__ == "__main__":
    main()
