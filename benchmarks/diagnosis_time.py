"""Where the seconds of a diagnosis go, and how they grow: python benchmarks/diagnosis_time.py [--jobs N] [--quick].

On the recording that ships with the project (`sealed_01`, a grain), whose pushes are repeated with fresh noise where
more are asked for. Three tables: CPU and wall-clock seconds by stage; the same against the number of pushes; against
the effects that are looked for; and against processes. The compiled twin is warmed up before. Ratios within one run
are what counts: seconds are this machine's.
"""

import argparse
import dataclasses as dc
import time
from collections import defaultdict

import numpy as np
from rich.console import Console
from rich.table import Table

from physid_drake.diagnose import diagnose
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import read_recording
from physid_drake.resources import shipped

NOISE = np.array([3e-4, 3e-4, 0.0])  # m, of what is added to the object's positions in repeated pushes
PUSHES = (3, 6, 11, 22, 44, 100)
EFFECTS = (("anisotropic_table",), ("anisotropic_table", "table_tilt", "viscous_drag", "hand_compliance"), None)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--quick", action="store_true", help="up to 11 pushes")
    given = parser.parse_args()
    console = Console(width=110)
    timed(recording_of(3), 1, EFFECTS[0])  # compiles, and builds the cells
    console.print(by_stage(timed(recording_of(11), given.jobs, None)))
    counts = [n for n in PUSHES if n <= 11 or not given.quick]
    rows = [(str(n), timed(recording_of(n), given.jobs, None)) for n in counts]
    console.print(totals("pushes", rows))
    rows = [("all" if e is None else str(len(e)), timed(recording_of(11), given.jobs, e)) for e in EFFECTS]
    console.print(totals("effects", rows))
    console.print(totals("processes", [(str(n), timed(recording_of(11), n, None)) for n in (1, 2)]))


def recording_of(count):
    """So many pushes; of those that are repeated, each has noise of its own."""
    recording = read_recording(shipped("recordings") / "sealed_01")
    rng, pushes = np.random.default_rng(0), []
    for k in range(count):
        push = recording.pushes[k % len(recording.pushes)]
        stream, noise = push.object, (k >= len(recording.pushes)) * NOISE
        moved = stream.positions + noise * rng.standard_normal(stream.positions.shape)
        pushes.append(dc.replace(push, name=f"{k:03d}", object=dc.replace(stream, positions=moved)))
    return dc.replace(recording, pushes=tuple(pushes))


def timed(recording, jobs, effects):
    """CPU and wall-clock seconds of each stage, in their order; CPU of this process alone."""
    case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=jobs, most=len(recording.pushes))
    spent, now = defaultdict(lambda: np.zeros(2)), ["", time.process_time(), time.perf_counter()]

    def progress(stage, done, total):
        cpu, wall = time.process_time(), time.perf_counter()
        spent[now[0]] += (cpu - now[1], wall - now[2])
        now[:] = stage, cpu, wall

    diagnose(case, effects=effects, progress=progress)
    progress("", 0, 0)
    spent.pop("", None)
    return spent


def by_stage(spent):
    table = Table("stage", "CPU s", "wall s", "share", title="by stage, eleven pushes", title_justify="left")
    whole = sum(spent.values())[1]
    for stage, (cpu, wall) in spent.items():
        table.add_row(stage, f"{cpu:.1f}", f"{wall:.1f}", f"{100 * wall / whole:.0f} %")
    return table


def totals(what, rows):
    table = Table(what, "CPU s", "wall s", "times the first", title=f"against {what}", title_justify="left")
    first = sum(rows[0][1].values())[1]
    for name, spent in rows:
        cpu, wall = sum(spent.values())
        table.add_row(name, f"{cpu:.1f}", f"{wall:.1f}", f"{wall / first:.2f}")
    return table


if __name__ == "__main__":
    main()
