"""The twin beside the fine planar integrator and the cell: how near, which derivatives, how fast.

    python benchmarks/twin.py [--pushes 60] [--seed 0]

Prints three tables. Accuracy: rms difference over poses of each push in standard deviations of a tracker (0.3 mm,
3 mrad), over all pushes, the median push and the worst. Derivatives: by central differences, over all poses of all
pushes as one vector, the cosine between the two and the ratio of their lengths. Speed: CPU time of one rollout and
its ratio to the cell's, in one run and on one core.
"""

from __future__ import annotations

import argparse
import dataclasses as dc
import sys
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from reference.planar import PlanarObject
from reference.scenes import PlanarPush, Theta, simulate, sixty_pushes
from twin import SIGMA, cell_of, path_of, rms, shape_of, twin_body

from physid_drake.cell import Cell, CellConfig, ContactConfig, SolverConfig, Start
from physid_drake.cell.solid import solid_of
from physid_drake.twin.twin import Twin, TwinPush

Scene = tuple[PlanarObject, Theta, PlanarPush]
Simulator = Callable[[Scene, np.ndarray], np.ndarray]
STIFF = CellConfig(
    contact=ContactConfig(
        model="point", hand_frequency_rad_s=3000.0, rest_depth_m=3e-7, stiction_tolerance_mps=1e-5
    ),
    solver=SolverConfig(time_step_s=5e-4, slide_time_step_s=5e-4),
)  # fmt: skip
STEPS: dict[str, float] = {
    "support friction": 3e-3, "hand friction": 1e-2, "restitution": 2e-2, "start x": 2e-4, "start yaw": 2e-3,
    "centre of mass x": 5e-4,
}  # fmt: skip


@cache
def twin_of(name: str, radius: float, points: int) -> Twin:
    from reference.scenes import OBJECTS  # noqa: PLC0415

    return Twin(solid=solid_of(shape_of(OBJECTS[name])), hand_radius=radius, points=points)


@cache
def stiff_cell(name: str, radius: float) -> Cell:
    from reference.scenes import OBJECTS  # noqa: PLC0415

    return Cell(shape_of(OBJECTS[name]), hand_radius=radius, config=STIFF)


def asked_of(scene: Scene, times: np.ndarray) -> TwinPush:
    """The twin's push."""
    body, theta, push = scene
    return TwinPush(
        body=twin_body(body, theta), start=Start(pose=push.pose), path=path_of(push), begin=0.0, end=float(times[-1]),
        times=times, hand_height=push.tip_height,
    )  # fmt: skip


def by_twin(points: int) -> Simulator:
    """The twin with about so many support points."""

    def simulated(scene: Scene, times: np.ndarray) -> np.ndarray:
        return twin_of(scene[0].name, scene[2].tip_radius, points).rollouts([asked_of(scene, times)])[0].poses

    return simulated


def by_cell(build: Callable[[str, float], Cell]) -> Simulator:
    """The Drake cell."""

    def simulated(scene: Scene, times: np.ndarray) -> np.ndarray:
        body, theta, push = scene
        motion = build(body.name, push.tip_radius).rollout(
            twin_body(body, theta), start=Start(pose=push.pose), path=path_of(push), begin=0.0, end=float(times[-1]),
            hand_height=push.tip_height,
        )  # fmt: skip
        return motion.planar_at(times)

    return simulated


def by_reference(scene: Scene, times: np.ndarray) -> np.ndarray:
    """The fine planar integrator."""
    return simulate(*scene, times).poses


def changed(scene: Scene, name: str, step: float) -> Scene:
    """The scene with one of its numbers changed."""
    body, theta, push = scene
    x, y, yaw = push.pose
    match name:
        case "start x":
            return body, theta, dc.replace(push, pose=(x + step, y, yaw))
        case "start yaw":
            return body, theta, dc.replace(push, pose=(x, y, yaw + step))
        case "centre of mass x":
            return body, dc.replace(theta, com_offset=(theta.com_offset[0] + step, theta.com_offset[1])), push
    key = name.replace(" ", "_")
    value = getattr(theta, key) + step + (STEPS["restitution"] if name == "restitution" else 0.0)
    return body, dc.replace(theta, **{key: value}), push


def apart(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Differences of poses in deviations, turns left out."""
    away = one - other
    away[:, 2] = (away[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    return away / SIGMA


def accuracy(scenes: list[Scene], times: list[np.ndarray]) -> Table:
    """How near they are to each other."""
    simulators = {
        "reference": by_reference, "twin": by_twin(36), "twin, 100 points": by_twin(100),
        "cell": by_cell(lambda name, radius: cell_of(name, "point", radius)), "stiff cell": by_cell(stiff_cell),
    }  # fmt: skip
    poses = {name: [run(s, t) for s, t in zip(scenes, times, strict=True)] for name, run in simulators.items()}
    table = Table("", "all", "median push", "worst push", title="difference of poses [deviations of a tracker]")
    for one, other in (
        ("twin", "reference"), ("twin, 100 points", "reference"), ("cell", "reference"), ("stiff cell", "reference"),
        ("twin", "cell"), ("twin", "stiff cell"),
    ):  # fmt: skip
        each = np.array([rms(apart(a, b)) for a, b in zip(poses[one], poses[other], strict=True)])
        table.add_row(f"{one} v {other}", *(f"{v:.3f}" for v in (rms(each), np.median(each), each.max())))
    return table


def derivatives(scenes: list[Scene], times: list[np.ndarray]) -> Table:
    """Which way they say that motion goes."""
    simulators = {
        "twin": by_twin(36), "cell": by_cell(lambda name, radius: cell_of(name, "point", radius)),
        "reference": by_reference,
    }  # fmt: skip
    table = Table("", "twin v reference", "cell v reference", "twin v cell", title="derivatives: cosine, ratio")
    for name, step in STEPS.items():
        columns = {
            kind: np.concatenate([
                apart(run(changed(s, name, step), t), run(changed(s, name, -step), t)).ravel()
                for s, t in zip(scenes, times, strict=True)
            ])
            for kind, run in simulators.items()
        }  # fmt: skip
        table.add_row(name, *(alike(columns[a], columns[b]) for a, b in
                              (("twin", "reference"), ("cell", "reference"), ("twin", "cell"))))  # fmt: skip
    return table


def alike(one: np.ndarray, other: np.ndarray) -> str:
    """Cosine and ratio of lengths."""
    lengths = np.linalg.norm(one), np.linalg.norm(other)
    return f"{one @ other / (lengths[0] * lengths[1]):.4f}, {lengths[0] / lengths[1]:.3f}"


def speed(scenes: list[Scene], times: list[np.ndarray]) -> Table:
    """What a rollout costs."""
    cell = by_cell(lambda name, radius: cell_of(name, "point", radius))
    costs = {
        "cell": spent(lambda: [cell(s, t) for s, t in zip(scenes, times, strict=True)]),
        "twin, one call each": spent(lambda: [by_twin(36)(s, t) for s, t in zip(scenes, times, strict=True)]),
        "twin, eighty in a call": spent(lambda: [
            twin_of(s[0].name, s[2].tip_radius, 36).rollouts([asked_of(s, t)] * 80)
            for s, t in zip(scenes, times, strict=True)
        ]) / 80.0,
    }  # fmt: skip
    table = Table("", "CPU time [ms]", "cell's over it", title="one rollout")
    for name, cost in costs.items():
        table.add_row(name, f"{1e3 * cost / len(scenes):.2f}", f"{costs['cell'] / cost:.0f}")
    return table


def spent(call: Callable[[], object]) -> float:
    """CPU time [s], the least of three."""
    call()
    took = []
    for _ in range(3):
        begin = time.process_time()
        call()
        took.append(time.process_time() - begin)
    return min(took)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pushes", type=int, default=60, help="of the sixty (default: all)")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    scenes = sixty_pushes(given.seed)[: given.pushes]
    times = [simulate(*scene).times for scene in scenes]
    console = Console(width=100)
    for table in (accuracy, derivatives, speed):
        console.print(table(scenes, times))


if __name__ == "__main__":
    main()
