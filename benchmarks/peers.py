"""The diagnosis beside two peers on opened worlds: peers.py PROOF [...] [--worlds ID ...].

PROOF is a folder of ``python -m physid_drake.validation.worlds.make`` whose truth lies open. Every push is predicted
by what all others say: (1) least squares on the baseline model; (2) that, and a Gaussian process of what it leaves at
the end of a push, over where the object stood, from where, how fast and how far off its middle it was pushed
(scikit-learn, its kernel's lengths by likelihood); (3) what the diagnosis leaves. Errors of the last window, in mm
and degrees, root mean square over pushes and then the median over worlds; the CPU seconds that each took; and whether
it says what is missing.
"""

import argparse
import json
import time
import warnings
from collections import defaultdict
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from physid_drake.diagnose import diagnose_from
from physid_drake.identify import identified
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording.reading import read_recording

METHODS = ("least squares", "and a Gaussian process", "the diagnosis")
KINDS = ("none", "effect", "pair", "other")
NOISE = 1e-2  # of the white kernel at first, residuals scaled to one


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("proofs", type=Path, nargs="+", metavar="PROOF")
    parser.add_argument("--worlds", nargs="*", metavar="ID")
    given = parser.parse_args()
    found = defaultdict(list)
    for proof in given.proofs:
        for folder in sorted((proof / "recordings").iterdir()):
            if not given.worlds or folder.name in given.worlds:
                kind = json.loads((proof / "sealed" / f"{folder.name}.json").read_text())["kind"]
                found[kind].append(compared(folder))
                print(
                    kind, folder.name, *(f"{mm:.2f} mm {deg:.2f} deg" for mm, deg, _ in found[kind][-1]), flush=True
                )
    Console(width=120).print(table(found))


def compared(folder):
    """Of each method: errors at the end of pushes [mm, deg], and CPU seconds; the others' hold those of the first."""
    recording = read_recording(folder)
    begin = time.process_time()
    case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=1)
    known = identified(case, seed=0)
    plain = ends(known.case, known.errors)
    first = time.process_time()
    corrected = plain - by_process(descriptions(known.case), plain)
    second = time.process_time()
    _, evidence = diagnose_from(known, seed=0)
    third = time.process_time()
    last = ends(evidence.case, evidence.errors_after)
    spent = first - begin, second - begin, first - begin + third - second
    return [(*size_of(errors), cpu) for errors, cpu in zip((plain, corrected, last), spent, strict=True)]


def ends(case, errors):
    """Recorded less predicted in the last window (n, 3): along and across the push, and turned [m, m, rad]."""
    poses = np.array([f.poses(e)[-1] for f, e in zip(case.features, errors, strict=True)])
    for pose, problem in zip(poses, case.problems, strict=True):
        c, s = np.cos(heading_of(problem)), np.sin(heading_of(problem))
        pose[:2] = c * pose[0] + s * pose[1], c * pose[1] - s * pose[0]
    return poses


def heading_of(problem):
    return 0.0 if problem.path is None else problem.path.heading


def descriptions(case):
    """What is known of each push before it is made (n, 7)."""
    rows = []
    for problem in case.problems:
        x, y, yaw = problem.start.pose
        heading = heading_of(problem)
        off, speed = 0.0, float(np.hypot(*problem.start.velocity[:2]))
        if problem.path is not None:
            dx, dy = np.array([x, y]) - problem.path.start
            off, speed = np.cos(heading) * dy - np.sin(heading) * dx, problem.path.top_speed()
        rows.append([x, y, np.cos(heading), np.sin(heading), heading - yaw, speed, off])
    made = np.array(rows)
    made[:, 4] = np.cos(made[:, 4])
    return (made - made.mean(axis=0)) / np.maximum(made.std(axis=0), 1e-9)


def by_process(inputs, residuals):
    """What a process that was fitted to all other pushes says of each push (n, 3)."""
    said = np.zeros_like(residuals)
    for i in range(len(inputs)):
        others = np.arange(len(inputs)) != i
        for k in range(3):
            scale = np.sqrt(np.mean(residuals[others, k] ** 2)) + 1e-12
            kernel = ConstantKernel(1.0) * RBF(np.full(inputs.shape[1], 3.0)) + WhiteKernel(NOISE)
            process = GaussianProcessRegressor(kernel, n_restarts_optimizer=1, random_state=0)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ConvergenceWarning)
                process.fit(inputs[others], residuals[others, k] / scale)
            said[i, k] = scale * process.predict(inputs[i : i + 1])[0]
    return said


def size_of(errors):
    """Root mean square distance and turn of errors (n, 3) [mm, deg]."""
    return 1e3 * np.sqrt(np.mean((errors[:, :2] ** 2).sum(axis=1))), np.degrees(np.sqrt(np.mean(errors[:, 2] ** 2)))


def table(found):
    rows = Table(
        "worlds", "of", "method", "mm", "deg", "CPU s", "names it", title="held-out pushes", title_justify="left"
    )
    for kind in KINDS:
        for k, method in enumerate(METHODS if found[kind] else ()):
            mm, deg, cpu = np.median([world[k] for world in found[kind]], axis=0)
            names = "yes" if k == len(METHODS) - 1 else "no"
            rows.add_row(kind, str(len(found[kind])), method, f"{mm:.2f}", f"{deg:.2f}", f"{cpu:.0f}", names)
    return rows


if __name__ == "__main__":
    main()
