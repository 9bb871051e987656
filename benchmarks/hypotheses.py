"""What the catalogue's hypotheses are worth on opened worlds, fitted on the twin: hypotheses.py PROOF [WORLD ...].

PROOF is a folder of ``python -m physid_drake.prove.make`` whose truth lies open. For each world: the p-value of the
baseline from replicates, the hypotheses whose held-out pushes are likeliest with their gain over the baseline in nats
(its spread over pushes) and loudness, which is 1 where noise explains what is left, and CPU seconds of the baseline
and of all that follows. Pairs of effects are fitted where replicates of the best single one say that something else
is missing. ``--chance`` takes only the worlds without an effect, fits no effect, and says how often p is below some
values: as often as they say, at best.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

from physid_drake.diagnose.hypotheses import baseline, with_one_more, with_tolerances, with_two
from physid_drake.effects import applicable
from physid_drake.inference.fit import Fitter
from physid_drake.inference.hypothesis import Hypothesis
from physid_drake.inference.predictions import Predictor
from physid_drake.inference.replicates import largest_gains, p_value
from physid_drake.inference.scores import columns
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording.reading import read_recording

ALPHA = 0.01
SINGLES = 4  # effects, beside each of which a second one is looked for
SHOWN = 4
LEVELS = (0.001, 0.01, 0.05, 0.1, 0.5)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("proof", type=Path)
    parser.add_argument("worlds", nargs="*", metavar="WORLD")
    parser.add_argument("--chance", action="store_true")
    given = parser.parse_args()
    folders = sorted((given.proof / "recordings").iterdir())
    truths = {f: truth_of(given.proof, f.name) for f in folders if not given.worlds or f.name in given.worlds}
    if given.chance:
        values = np.array([chance(folder) for folder, truth in truths.items() if truth == "none"])
        print(", ".join(f"below {a:g}: {np.sum(values < a)} of {len(values)}" for a in LEVELS))
        return
    for folder, truth in truths.items():
        print(line(folder, truth), flush=True)


def truth_of(proof, name):
    sealed = json.loads((proof / "sealed" / f"{name}.json").read_text())
    return ", ".join(f"{e['name']} {e['calibrated_size_sigma']:.1f}" for e in sealed["effects"]) or "none"


def plain_of(folder, rng):
    """The fitter of a recording, the baseline fitted, the catalogue's columns beside it, and its p-value."""
    recording = read_recording(folder)
    case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=1)
    fitter = Fitter(case, Predictor(case))
    plain = baseline(fitter, Hypothesis(space=case.thetas.space, around=case.around), rng)
    plain, found = with_tolerances(fitter, plain)
    return fitter, plain, found, p_value(*largest_gains(fitter, plain, found, rng))


def chance(folder):
    p = plain_of(folder, np.random.default_rng(0))[-1]
    print(f"{folder.name} p {p:.2g}", flush=True)
    return p


def line(folder, truth):
    begin, rng = time.process_time(), np.random.default_rng(0)
    fitter, plain, found, p = plain_of(folder, rng)
    case, ready = fitter.case, time.process_time()
    fits = ranked(fitter, with_one_more(fitter, plain, found))
    left = None
    if p < ALPHA:
        kinds = applicable(case.around)
        beside = columns(fitter, fits[0], [k for k in kinds if k is not fits[0].hypothesis.parts[0].kind])
        left = p_value(*largest_gains(fitter, fits[0], beside, rng))
        if left < ALPHA:
            fits = ranked(fitter, [*fits, *with_two(fitter, fits[:SINGLES], kinds)])
    before = fitter.held_out(plain)
    shown = []
    for fit in fits[:SHOWN]:
        gains = fitter.held_out(fit) - before
        spread = gains.std() * len(gains) ** 0.5
        shown.append(f"{fit.hypothesis.name} {gains.sum():.1f}+-{spread:.1f} ({fit.loudness:.2f})")
    seconds = f"{ready - begin:.1f} + {time.process_time() - ready:.1f} s, {fitter.predictor.count} rollouts"
    beside = "" if left is None else f", p beside the best {left:.2g}"
    return f"{folder.name} [{truth}] {len(case.problems)} pushes, p {p:.2g}{beside}: {'; '.join(shown)} | {seconds}"


def ranked(fitter, fits):
    return sorted(fits, key=lambda fit: -float(fitter.held_out(fit).sum()))


if __name__ == "__main__":
    main()
