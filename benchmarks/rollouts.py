"""Pushes per second per core, and how far each is from the truth: the Cell, MuJoCo and PyBullet.

    python benchmarks/rollouts.py [--quick]

The truth is the fine planar integrator of the tests. A peer that is not installed is left out, with the reason.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy: one rollout, one core
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import numpy as np
from joblib import Parallel, delayed
from peers.drake_cell import CellEngine, Setting, all_pushes, engine_of, watched
from peers.push import DURATION, FRICTION, MASS, PUSHES, SIZE, TIP_HEIGHT, TIP_RADIUS, Array, Engine
from reference.planar import Hand, HandPath, box, simulate_planar
from rich.console import Console
from rich.table import Table

from physid_drake import cell

POINT = Setting(model="point", near=1e-3, slide=1e-3)
HYDROELASTIC = Setting(model="hydroelastic", near=1e-3, slide=1e-3)
WANTED = {"point 1 ms": 20.0, "hydroelastic 1 ms": 8.0}  # pushes per second per core
WANTED_SCALING = 1.8
MOVING = 2e-4  # m/s of the centre or of a point 5 cm away: slower is rest


@dataclass(frozen=True, kw_only=True)
class Truth:
    """The reference: end poses (5, 3) [m, rad], and for how long the object moves in each push (5,) [s]."""

    ends: Array
    moving: Array


@dataclass
class Row:
    """One line of the table."""

    name: str
    build: Callable[[], Engine]
    note: str = ""
    engine: Engine | None = None
    seconds: float = np.inf  # of CPU per push, the best of the rounds
    skipped: float = 0.0  # of DURATION
    errors: Array = field(default_factory=lambda: np.zeros((0, 2)))  # (5, 2) mm, degrees


def truth_of_pushes() -> Truth:
    """Simulate every push with the planar reference (20 us steps, 600 points: converged to 0.005 mm)."""
    ends, moving = [], []
    for push in PUSHES:
        path = HandPath(times=push.times, p0=push.start, velocities=push.velocities)
        motion = simulate_planar(
            box("eraser", SIZE, MASS), FRICTION, np.linspace(0.0, DURATION, 1501),
            hand=Hand(path=path, radius=TIP_RADIUS, height=TIP_HEIGHT, friction=FRICTION),
        )  # fmt: skip
        speed = np.linalg.norm(motion.velocities * [1.0, 1.0, 0.05], axis=1)
        ends.append(motion.poses[-1])
        moving.append(DURATION * float(np.mean(speed > MOVING)))
    return Truth(ends=np.array(ends), moving=np.array(moving))


def drake_rows() -> list[Row]:
    """The Cell: two contact models, three choices of time steps, and rebuilt for every push."""
    rows = []
    for model in ("hydroelastic", "point"):
        for label, near, slide, rebuilt in (
            ("1 ms", 1e-3, 1e-3, False),
            ("2 ms", 2e-3, 2e-3, False),
            ("1 ms, slides 2 ms", 1e-3, 2e-3, False),
            ("1 ms, rebuilt", 1e-3, 1e-3, True),
        ):
            setting = Setting(model=model, near=near, slide=slide, rebuilt=rebuilt)
            note = {"1 ms, slides 2 ms": "default", "1 ms, rebuilt": "new Cell per push"}.get(label, "")
            rows.append(Row(f"{model} {label}", lambda setting=setting: CellEngine(setting), note))
    return rows


def mujoco_rows() -> list[Row]:
    """MuJoCo as it comes, and with the settings that make its friction right."""
    from peers.mujoco_feet import NaiveBox, SoftFeet, midpoints  # noqa: PLC0415

    support = engine_of(POINT).cell.scene.support  # the same quadrature, so that only the engines differ
    points, weights = support.points, support.weights
    same = f"the Cell's {len(points)} points"
    return [
        Row("MuJoCo box 2 ms", NaiveBox, "all default"),
        Row("MuJoCo 4x4 feet 1 ms", lambda: SoftFeet(*midpoints(4, 4), 1e-3), "soft impedance"),
        Row("MuJoCo 8x8 feet 1 ms", lambda: SoftFeet(*midpoints(8, 8), 1e-3), "soft impedance"),
        Row("MuJoCo Cell's feet 1 ms", lambda: SoftFeet(points, weights, 1e-3), same),
        Row("MuJoCo Cell's feet 2 ms", lambda: SoftFeet(points, weights, 2e-3, soft=True), "same, softer"),
    ]


def bullet_rows() -> list[Row]:
    """PyBullet, the engine of the paper."""
    from peers.bullet import BulletBox, BulletFeet  # noqa: PLC0415

    return [
        Row("PyBullet box 240 Hz", lambda: BulletBox(1 / 240), "damping 0"),
        Row("PyBullet box 1 kHz", lambda: BulletBox(1e-3), "damping 0"),
        Row("PyBullet 4x4 feet 1 kHz", lambda: BulletFeet(1e-3), "soft, damping 0"),
    ]


def all_rows(console: Console) -> list[Row]:
    """Every row whose engine is installed; says why others are missing."""
    rows = drake_rows()
    for peer, package, make in (("MuJoCo", "mujoco", mujoco_rows), ("PyBullet", "pybullet", bullet_rows)):
        try:
            rows += make()
        except ImportError as error:
            console.print(f"{peer} left out: {error}. Install it: pip install {package}")
    return rows


def prepare(row: Row, truth: Truth) -> None:
    """Build a row's engine, and compare its end poses with the truth's."""
    row.engine = row.build()
    ends = np.array([row.engine.rollout(push) for push in PUSHES])
    difference = ends - truth.ends
    turns = np.angle(np.exp(1j * difference[:, 2]))
    row.errors = np.column_stack([1e3 * np.linalg.norm(difference[:, :2], axis=1), np.degrees(np.abs(turns))])
    if isinstance(row.engine, CellEngine):
        row.skipped = float(np.mean([row.engine.skipped(push) for push in PUSHES]))


def measure(row: Row, shortest: float) -> None:
    """Time whole sets of pushes until ``shortest`` [s] of CPU are used; keep the best of the rounds."""
    assert row.engine is not None
    count, begin = 0, time.process_time()
    while (used := time.process_time() - begin) < shortest or count == 0:
        for push in PUSHES:
            row.engine.rollout(push)
        count += len(PUSHES)
    row.seconds = min(row.seconds, used / count)


def rate_table(rows: Sequence[Row], truth: Truth) -> Table:
    """The table of rates and errors."""
    table = Table(title=f"{len(PUSHES)} pushes of {DURATION} s each (eraser); end pose against the planar reference")
    table.add_column("setting", no_wrap=True)
    for name in (
        "pushes/s\nper core", "vs point\n1 ms", "pushes/s,\nnone skipped", "moving s\nper CPU s",
        "rms\nmm", "worst\nmm", "rms\ndeg", "worst\ndeg",
    ):  # fmt: skip
        table.add_column(name, justify="right")
    table.add_column("wanted / note", no_wrap=True)
    base = next(row.seconds for row in rows if row.name == "point 1 ms")
    for row, following in zip(rows, [*rows[1:], None], strict=True):
        rate, rms, worst = 1.0 / row.seconds, np.sqrt(np.mean(row.errors**2, axis=0)), row.errors.max(axis=0)
        table.add_row(
            row.name, f"{rate:.1f}", f"{base / row.seconds:.2f}", f"{rate * (1.0 - row.skipped / DURATION):.1f}",
            f"{rate * truth.moving.mean():.0f}", f"{rms[0]:.2f}", f"{worst[0]:.2f}", f"{rms[1]:.2f}",
            f"{worst[1]:.2f}", verdict(row.name, rate) or row.note,
            end_section=following is not None and following.name.split()[0] != row.name.split()[0],
        )  # fmt: skip
    return table


def verdict(name: str, rate: float) -> str:
    """What was wanted of a row, and whether it holds."""
    if name not in WANTED:
        return ""
    return f"≥ {WANTED[name]:.0f}: {'yes' if rate >= WANTED[name] else 'NO'}"


def skipped_line(truth: Truth) -> str:
    """How much of each push the Cell jumps over."""
    engine = engine_of(POINT)
    parts = [
        f"{push.name} {engine.skipped(push):.2f} (moving {moving:.2f})"
        for push, moving in zip(PUSHES, truth.moving, strict=True)
    ]
    return f"Skipped by the Cell, because nothing moves, in s of {DURATION}: {', '.join(parts)}. Peers skip nothing."


def scaling_rows(sets: int, rounds: int) -> Iterator[tuple[str, float, float, float, float]]:
    """Name, pushes/s with one and two processes (wall time, best of the rounds), CPU ms per push of each."""
    with Parallel(n_jobs=2, batch_size=1) as workers:
        for setting in (HYDROELASTIC, POINT):
            workers(delayed(all_pushes)(setting) for _ in range(8))  # imports, builds, warms
            all_pushes(setting)
            best = [(0.0, 0.0), (0.0, 0.0)]
            for _ in range(rounds):
                one = _timed(lambda setting=setting: [all_pushes(setting) for _ in range(sets)])
                two = _timed(lambda setting=setting: workers(delayed(all_pushes)(setting) for _ in range(2 * sets)))
                best = [max(best[0], one), max(best[1], two)]
            yield f"{setting.model} 1 ms", best[0][0], best[1][0], best[0][1], best[1][1]


def _timed(work: Callable[[], list[float]]) -> tuple[float, float]:
    """Pushes per second of wall time, and CPU ms per push, of sets of pushes that report their CPU time."""
    begin = time.perf_counter()
    cpu = work()
    pushes = len(cpu) * len(PUSHES)
    return pushes / (time.perf_counter() - begin), 1e3 * sum(cpu) / pushes


def scaling_table(sets: int, rounds: int) -> Table:
    """The table of one and two processes."""
    table = Table(title="Two processes (joblib, loky), wall time, workers warm")
    table.add_column("setting")
    for name in ("1 process\npushes/s", "2 processes\npushes/s", "ratio", "CPU ms per push\n1 -> 2 processes"):
        table.add_column(name, justify="right")
    table.add_column(f"at least {WANTED_SCALING}")
    for name, one, two, cpu_one, cpu_two in scaling_rows(sets, rounds):
        good = "yes" if two / one >= WANTED_SCALING else "NO"
        table.add_row(name, f"{one:.1f}", f"{two:.1f}", f"{two / one:.2f}", f"{cpu_one:.0f} -> {cpu_two:.0f}", good)
    return table


def share_lines() -> Iterator[str]:
    """Where a rollout's time goes: Drake's steps, exchange of the state, writing theta, Python."""
    for setting in (HYDROELASTIC, POINT):
        engine, watch = watched(setting)
        engine.rollout(PUSHES[0])
        watch.seconds.clear()
        begin = time.perf_counter()
        steps = sum(len(engine.motion(push).times) - 1 for push in PUSHES)
        total = time.perf_counter() - begin
        parts = {**watch.seconds, "Python of the cell": total - sum(watch.seconds.values())}
        shares = ", ".join(f"{name} {100 * spent / total:.0f} %" for name, spent in parts.items())
        yield f"{setting.model} 1 ms: {shares}; {1e6 * total / steps:.0f} us per tick."


def machine_line() -> str:
    """Where and what this measures, and how busy the machine is."""
    load = os.getloadavg()[0]
    busy = "" if load < 1.3 else "  BUSY: rates are too low, the ratio of two processes too."
    return f"Cell {cell_print()}, {os.cpu_count()} cores, load {load:.2f} at the start.{busy}"


def cell_print() -> str:
    """A fingerprint of the Cell's sources: workers import them later than this process."""
    digest = hashlib.sha256()
    for file in sorted(Path(cell.__file__).parent.glob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:10]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="one short round: rates within 30 %%")
    quick = parser.parse_args().quick
    rounds, shortest, sets = (1, 0.3, 4) if quick else (3, 1.5, 10)
    console, before = Console(width=max(146, Console().width)), cell_print()
    console.print(machine_line())
    truth = truth_of_pushes()
    rows = all_rows(console)
    for row in rows:
        prepare(row, truth)
    for _ in range(rounds):  # rounds outside, so that a busy moment does not fall on one row alone
        for row in rows:
            measure(row, shortest)
    console.print(rate_table(rows, truth))
    console.print(skipped_line(truth))
    console.print(scaling_table(sets, rounds))
    for line in share_lines():
        console.print(line)
    if cell_print() != before:
        console.print("INVALID: the Cell's sources changed while this ran, so the rows are of different programs.")


if __name__ == "__main__":
    main()
