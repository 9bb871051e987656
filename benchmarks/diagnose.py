"""How good a diagnosis is, on worlds of MuJoCo that it has not seen: false alarms, power, names, abstention, pairs.

    python benchmarks/diagnose.py [--worlds N] [--seed S] [--out FOLDER] [--kind none|effect|other|pair]

Needs ``pip install '.[proof]'``. A world costs about ten seconds to make and a minute to diagnose on two cores; the
folder keeps both, so that the command goes on where it stopped.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from physid_drake.prove.score import read_outcomes, table


def main() -> None:
    """Make, diagnose, score."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/diagnose_benchmark"))
    parser.add_argument("--kind", choices=["none", "effect", "other", "pair"])
    arguments = parser.parse_args()
    made = [sys.executable, "-m", "physid_drake.prove.make", "--worlds", str(arguments.worlds), "--seed",
            str(arguments.seed), "--out", str(arguments.out)]  # fmt: skip
    subprocess.run([*made, *(["--kind", arguments.kind] if arguments.kind else [])], check=True)
    seconds = []
    for recording in sorted((arguments.out / "recordings").iterdir()):
        folder = arguments.out / "diagnoses" / recording.name
        if (folder / "diagnosis.json").exists():
            continue
        start = time.perf_counter()
        command = [sys.executable, "-m", "physid_drake", "diagnose", str(recording), "--out", str(folder)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        seconds.append(time.perf_counter() - start)
        print(f"{recording.name}: {seconds[-1]:.0f} s", flush=True)
    report(arguments.out)


def report(out: Path) -> None:
    """Print the table and every failure."""
    outcomes = read_outcomes(out / "sealed", out / "diagnoses")
    console = Console(width=110)
    rows = Table(title=f"{len(outcomes)} worlds")
    for column in ("", "figure", "asked"):
        rows.add_column(column)
    for row in table(outcomes):
        rows.add_row(*row)
    console.print(rows)
    for o in outcomes:
        said = " + ".join("|".join(names) for names in o.classes) or "-"
        good = not o.found if o.kind == "none" else o.verdict == "unexplained" if o.kind == "other" else o.both
        mark = " " if good else "!"
        print(f"{mark} {o.id} {o.kind:7s} {'+'.join(o.true) or '-':40s} {o.size:6.1f} sigma  {o.verdict:12s} {said}"
              f"  chi2 {o.chi2:.2f}  rms {o.rms[0]:.2f} -> {o.rms[1]:.2f}")  # fmt: skip


if __name__ == "__main__":
    main()
