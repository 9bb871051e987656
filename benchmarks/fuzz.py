"""How many of many odd inputs are read or refused in one line, and how many are a fault: python benchmarks/fuzz.py.

Recordings, foreign logs and their maps, meshes, configurations, models, folders of results, published sources and
command lines are made by small grammars (`tests/fuzz`), each from seed and index alone. A fault is an error that is
not meant for a person, a hang of 10 s, a crash of compiled code, more than 2 GB of memory, a file that is read or
written outside the input's folder, or an input that is changed. Python's own warnings are counted apart. ``--only
INDEX --keep`` repeats one input and shows where it lies. The exit status is 1 if there is a fault.
"""

import argparse
import sys
import tempfile
from pathlib import Path

from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from fuzz.harness import Tally, run


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=10_000, metavar="N", help="how many (default 10000)")
    parser.add_argument("--first", type=int, default=0, metavar="INDEX", help="of the first (default 0)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of all (default 0)")
    parser.add_argument("--only", type=int, nargs="+", metavar="INDEX", help="only these")
    parser.add_argument("--keep", action="store_true", help="leave the inputs' folders")
    arguments = parser.parse_args()
    indices = arguments.only or range(arguments.first, arguments.first + arguments.inputs)
    scratch = Path(tempfile.mkdtemp(prefix="fuzz_")) if arguments.keep else None
    tally = run(indices, seed=arguments.seed, keep=arguments.keep, scratch=scratch, progress=_tell)
    console = Console(width=110)
    console.print(table_of(tally))
    for line in tally.lines():
        print(line)
    if arguments.only:
        for said in (one for some in (*tally.faults.values(), *tally.warnings.values()) for one in some):
            print(said["traceback"])
    if scratch is not None:
        print(f"inputs: {scratch}")
    return 1 if tally.faults else 0


def table_of(tally: Tally) -> Table:
    """One row for each kind of input, and their sum."""
    rate, most = tally.inputs / tally.seconds, tally.memory / 1e6
    table = Table(title=f"{tally.inputs} inputs in {tally.seconds:.0f} s, {rate:.0f} a second, at most {most:.0f} MB")
    for column in ("kind", "inputs", "read", "refused", "warnings", "faults"):
        table.add_column(column, justify="left" if column == "kind" else "right")
    outcomes = ("read", "refused", "warning", "fault")
    kinds = sorted({kind for kind, _ in tally.counts})
    for kind in [*kinds, "all"]:
        of = kinds if kind == "all" else [kind]
        counts = [sum(tally.counts[one, outcome] for one in of) for outcome in outcomes]
        table.add_row(kind, *(str(n) for n in (sum(counts), *counts)), end_section=kind == kinds[-1])
    return table


def _tell(done: int) -> None:
    if done % 200 == 0 and sys.stderr.isatty():
        print(f"{done} done", end="\r", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
