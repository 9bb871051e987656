"""What is decided of opened worlds, and what each constant is worth: decisions.py PROOF [...] [--worlds ID ...].

PROOF is a folder of ``python -m physid_drake.validation.worlds.make`` whose truth lies open. For each world: the
p-value, what is said and whether that is right, the best hypotheses with their gain on held-out pushes in log
likelihood, their best push's part of it and their noise scale (1 where noise explains what is left), and CPU seconds.
At the end how many answers are not right, by kind of world, as it is and with one constant of ``diagnose/decide.py``
left out. ``--chance`` takes only worlds without an effect, fits no effect, and says how often p is below some values:
as often as they say, at best.
"""

import argparse
import json
import math
import time
from collections import Counter
from contextlib import nullcontext
from pathlib import Path
from unittest.mock import patch

import numpy as np
from rich.console import Console
from rich.table import Table

from physid_drake.diagnose import decide
from physid_drake.diagnose.decide import decided, most_noise_scale
from physid_drake.diagnose.search import searched
from physid_drake.effects import applicable
from physid_drake.identify.baseline import baseline, fitter_of, with_tolerances
from physid_drake.inference.replicates import gains_by_chance, p_value
from physid_drake.inference.scores import columns
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording.reading import read_recording
from physid_drake.validation.scoring.score import Outcome

SHOWN = 3
LEVELS = (0.001, 0.01, 0.05, 0.1, 0.5)
WITHOUT = {
    "": {}, "CONFIRMED": {"CONFIRMED": 1.0}, "MARGIN": {"MARGIN": 0.0}, "ADEQUATE": {"ADEQUATE": 0.0},
    "LITTLE": {"LITTLE": 0.0}, "MOST_NOISE_SCALE": {"MOST_NOISE_SCALE": math.inf}, "DOUBTS": {"DOUBTS": 0.0},
}  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("proofs", type=Path, nargs="+", metavar="PROOF")
    parser.add_argument("--worlds", nargs="*", metavar="ID")
    parser.add_argument("--chance", action="store_true")
    given = parser.parse_args()
    folders = [f for proof in given.proofs for f in sorted((proof / "recordings").iterdir())]
    truths = {f: truth_of(f) for f in folders if not given.worlds or f.name in given.worlds}
    if given.chance:
        values = np.array([chance(folder) for folder, truth in truths.items() if truth["kind"] == "none"])
        print(", ".join(f"below {a:g}: {np.sum(values < a)} of {len(values)}" for a in LEVELS))
        return
    faults = Counter()
    for folder, truth in truths.items():
        for name, fault in answered(folder, truth).items():
            faults[name, truth["kind"], fault] += 1
    Console(width=120).print(table(faults))


def truth_of(folder):
    return json.loads((folder.parents[1] / "sealed" / f"{folder.name}.json").read_text())


def identified_in(folder):
    """The baseline, fitted on the twin, and what fitted it."""
    recording = read_recording(folder)
    finder = fitter_of(case_of(recording, cell_config(recording), ThetaConfig()), 0)
    return finder, with_tolerances(finder, baseline(finder, np.random.default_rng(0)))


def chance(folder):
    """The p-value of a recording, whose effects are looked for by their columns alone."""
    finder, plain = identified_in(folder)
    found = columns(finder, plain, applicable(finder.case.around))
    p = p_value(*gains_by_chance(finder, plain, found, np.random.default_rng(0)))
    print(f"{folder.name} p {p:.2g}", flush=True)
    return p


def answered(folder, truth):
    """What is wrong with the answer, None where nothing is, with all constants and without each of them."""
    begin = time.process_time()
    finder, plain = identified_in(folder)
    case = finder.case
    found = searched(finder, plain, applicable(case.around), seed=0, alpha=0.01, progress=lambda *_: None)
    faults = {}
    for name, changes in WITHOUT.items():
        with patch.multiple(decide, **changes) if changes else nullcontext():
            said = decided(found, most=most_noise_scale(case.noise))
        faults[name] = outcome_of(truth, said).fault
        if not name:
            first = said
    put_in = ", ".join(f"{e['name']} {e['calibrated_size_sigma']:.1f}" for e in truth["effects"]) or "none"
    names = " and ".join(" or ".join(c) for c in classes_of(first)) or "-"
    shown = "; ".join(map(one_line, (*found.named[:SHOWN], *found.unnamed[:1])))
    print(
        f"{folder.name} [{put_in}] {len(case.problems)} pushes, p {found.p_value:.2g}, left {found.left:.2g}:"
        f" {first.verdict} {names} ({faults[''] or 'right'}) | {shown} | {time.process_time() - begin:.0f} s",
        flush=True,
    )
    return faults


def classes_of(said):
    if said.verdict not in ("explained", "ambiguous"):
        return ()
    return tuple((kind.name, *alike) for kind, alike in zip(said.effects, said.classes(), strict=True))


def outcome_of(truth, said):
    return Outcome(
        id=truth["id"], kind=truth["kind"], true=tuple(e["name"] for e in truth["effects"]),
        size=truth["size_sigma"], verdict=said.verdict, classes=classes_of(said),
    )  # fmt: skip


def one_line(one):
    return f"{one.name} {one.gain:.1f}, {one.gains.max():.1f} of it ({one.fit.noise_scale:.2f})"


def table(faults):
    kinds = ("none", "effect", "pair", "other")
    rows = Table("without", *kinds, title="answers that are not right, of all", title_justify="left")
    for name in WITHOUT:
        cells = []
        for kind in kinds:
            of_kind = {fault: n for (which, k, fault), n in faults.items() if which == name and k == kind}
            wrong = ", ".join(f"{n} {fault}" for fault, n in sorted(of_kind.items(), key=str) if fault is not None)
            cells.append(f"{wrong or 0} of {sum(of_kind.values())}")
        rows.add_row(name or "nothing", *cells)
    return rows


if __name__ == "__main__":
    main()
