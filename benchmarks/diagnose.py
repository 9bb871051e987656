"""How often a diagnosis is right, in one proof or several together: diagnose.py [PROOF ...] [--worlds 20] [--seed N].

PROOF is a folder of ``prove`` in which worlds have been diagnosed, or an archive of one (``docs/archive/answers``),
scored when it was opened. Without one, ``prove`` makes and diagnoses as many worlds as are asked for (``pip install
'.[proof]'``; minutes for each), and goes on where it stopped.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tarfile
from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.table import Table

from physid_drake.errors import PhysidError
from physid_drake.validation.report.proof import MAIN, POWER, outcomes_in, said_of, truth_of
from physid_drake.validation.scoring.figures import figures_of
from physid_drake.validation.scoring.score import read_outcomes
from physid_drake.validation.scoring.tables import power_table, table
from physid_drake.validation.sealing.seal import SEALED, check_seal, read_seal

FAULTS = ("world", "truth", "sigma", "said")
LEVELS = (0.001, 0.01, 0.05, 0.1, 0.5)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("proofs", type=Path, nargs="*", metavar="PROOF")
    parser.add_argument("--worlds", type=int, default=20)
    parser.add_argument("--seed", type=int)
    given = parser.parse_args()
    try:
        folders = given.proofs or [made(given.worlds, given.seed)]
        outcomes = [outcome for folder in folders for outcome in opened(folder)]
    except PhysidError as error:
        parser.error(str(error))
    twice = [name for name, times in Counter(o.id for o in outcomes).items() if times > 1]
    if twice:
        parser.error(f"world {twice[0]} is in two of the folders: it would count twice.")
    if not outcomes:
        parser.error("none of the worlds has been diagnosed yet.")
    figures = figures_of(outcomes)
    faults = sorted((o for o in outcomes if o.fault is not None), key=lambda o: -o.size)
    rows = [(o.id, truth_of(o), f"{o.size:.1f}", said_of(o)) for o in faults]
    console = Console(width=140, markup=False)
    console.print(shown(f"{len(outcomes)} worlds of {len(folders)} proofs", MAIN, table(figures)))
    console.print(shown("single effects by size", POWER, power_table(figures)))
    console.print(shown("answers that are not right", FAULTS, rows))
    console.print(nearness(outcomes))
    told = {name: answer for folder in folders for name, answer in answers(folder).items()}
    chances = [told[o.id][0] for o in outcomes if o.kind == "none" and o.id in told]
    below = ", ".join(f"below {a:g}: {sum(p < a for p in chances)}" for a in LEVELS)
    console.print(f"p-values of {len(chances)} worlds without an effect: {below}")
    for verdict in sorted({answer[1] for answer in told.values()}):
        seconds = sorted(answer[2] for answer in told.values() if answer[1] == verdict)
        console.print(
            f"{verdict}: {statistics.median(seconds):.0f} s (median of {len(seconds)}), at most {seconds[-1]:.0f} s"
        )


def nearness(outcomes):
    """Held-out error of answers with a name over that of the baseline model: of right ones, and of all others."""
    ratios = {True: [], False: []}
    for one in outcomes:
        if one.classes and one.verdict in ("explained", "ambiguous"):
            ratios[one.fault is None].append(one.held_out.rms[1] / one.held_out.rms[0])
    said = [f"{name} {len(r)} at most {max(r):.2f}, above 1 in {sum(x > 1.0 for x in r)}" if r else f"{name} 0"
            for name, r in zip(("right answers", "others"), (ratios[True], ratios[False]), strict=True)]  # fmt: skip
    return f"held-out error with what was named, over the baseline's: {'; '.join(said)}"


def made(worlds, seed):
    """The folder of a proof that has been made and diagnosed."""
    folder = Path("proofs") / "worlds"
    words = ["prove", "--worlds", str(worlds), *([] if seed is None else ["--seed", str(seed)]), "--out", str(folder)]
    status = subprocess.run([sys.executable, "-m", "physid_drake", *words], check=False).returncode
    if status != 0:
        sys.exit(status)  # it has said why
    return folder


def opened(folder):
    """The outcomes of the worlds that have been diagnosed, if the seal holds; those that an archive holds."""
    if folder.is_file():
        return archived(folder)
    check_seal(folder, read_seal(folder))
    return read_outcomes(folder / SEALED, folder / "diagnoses")


def archived(file):
    """The outcomes of an archive, whose worlds anybody can make again from their seed."""
    try:
        with tarfile.open(file) as archive:
            return outcomes_in(json.load(archive.extractfile("proof.json")))
    except (tarfile.TarError, KeyError, ValueError) as error:
        raise PhysidError(f"{file} is no archive with a proof.json ({error}).") from error


def answers(folder):
    """p-value, verdict and seconds of every world that has been diagnosed, by name."""
    if folder.is_file():
        with tarfile.open(folder) as archive:
            files = {m.name: archive.extractfile(m).read() for m in archive if m.name.startswith("diagnoses/")}
    else:
        files = {str(f.relative_to(folder)): f.read_bytes() for f in (folder / "diagnoses").glob("*/*.json")}
    found = {}
    for name in {Path(file).parent for file in files}:
        texts = [files.get(str(name / file)) for file in ("diagnosis.json", "attempt.json")]
        if None not in texts:
            said, attempt = map(json.loads, texts)
            found[name.name] = said["p_value"], said["verdict"], attempt["seconds"]
    return found


def shown(title, headings, rows):
    lines = Table(*headings, title=title, title_justify="left")
    for row in rows:
        lines.add_row(*row)
    return lines


if __name__ == "__main__":
    main()
