"""What the twin is off by beside MuJoCo, from opened worlds without an effect: discrepancy.py PROOF ...

Each PROOF is a folder of ``python -m physid_drake.validation.worlds.make`` whose truth lies open; of its worlds those
without an effect are taken. The baseline is fitted to each, and the numbers of the discrepancy's covariance are those
under which what it leaves of all pushes is likeliest, each push's nuisance parameters and theta refitted: an error of
the pose that wanders along the object's way (standard deviations of place and yaw, the way over which it is the
same), a white one, and frictions with table and tip that wander along the way. Prints them, the log likelihood
without and with each kind, and quantiles over pushes of what is left, in squared deviations per number. Ten CPU
seconds a world.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.special import gammaln

from physid_drake.identify.baseline import baseline, with_tolerances
from physid_drake.inference.discrepancy import ALIKE, WANDERS, WHITE, discrepancy, way_of
from physid_drake.inference.fit import Fitter
from physid_drake.inference.predictions import Predictor
from physid_drake.inference.push import TAIL
from physid_drake.inference.rollouts import Physics
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording.reading import read_recording

NAMES = ("place", "white place", "yaw", "white yaw", "way", "friction with the table", "friction at the tip")
START = (1e-5, WHITE[0], WANDERS[2], 1e-5, ALIKE, 3e-3, 3e-3)
NONE = 1e-9
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 1.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("proofs", type=Path, nargs="+", metavar="PROOF")
    parser.add_argument("--worlds", type=int, help="so many at most")
    given = parser.parse_args()
    folders = [
        f for proof in given.proofs for f in sorted((proof / "recordings").iterdir()) if is_plain(proof, f.name)
    ]
    worlds = [left_of(folder) for folder in folders[: given.worlds]]
    print(f"{len(worlds)} worlds, {sum(map(len, worlds))} pushes")
    found = minimize(
        lambda logs: -log_likelihood(worlds, np.exp(logs))[0], np.log(START), method="Nelder-Mead",
        options={"maxfev": 400, "xatol": 0.05, "fatol": 0.5},
    )  # fmt: skip
    best = np.exp(found.x)
    print(", ".join(f"{name} {value:.2g}" for name, value in zip(NAMES, best, strict=True)))
    frictions, poses = best.copy(), best.copy()
    frictions[[0, 2]] = NONE
    poses[-2:] = NONE
    nothing = np.where(np.arange(len(best)) == NAMES.index("way"), ALIKE, NONE)
    for name, values in (("none", nothing), ("frictions", frictions), ("poses", poses), ("both", best)):
        total, left = log_likelihood(worlds, values)
        print(f"{name}: log likelihood {total:.1f}; left {np.round(np.quantile(left, QUANTILES), 2)}")


def is_plain(proof, name):
    return json.loads((proof / "sealed" / f"{name}.json").read_text())["kind"] == "none"


def left_of(folder):
    """Of each push: residual and derivatives in the features' units, and all that its covariance is made of."""
    recording = read_recording(folder)
    case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=1)
    predictor = Predictor(case)
    fitter = Fitter(case, predictor)
    fit = baseline(fitter, np.random.default_rng(0))
    physics = Physics(fit.hypothesis.theta(fit.point.z))
    of_path = predictor.path_errors(fit.point.nuisance, physics)
    fit = with_tolerances(fitter, fit)
    wanders = predictor.wanders(fit.point.nuisance, physics)
    pushes = []
    for i, (push, prior) in enumerate(zip(fit.pushes, fitter.priors(fit.scatter), strict=True)):
        features, problem = case.features[i], case.problems[i]
        back = np.linalg.inv(predictor.whitening[i])
        own, table, tip = (back @ columns for columns in (push.nuisance * prior, *wanders[i]))
        pushes.append({
            "residual": back @ push.residual, "shared": back @ push.shared,
            "table": table @ table.T, "tip": tip @ tip.T,
            "rest": predictor.noise[i] - discrepancy(problem, features) + own @ own.T + of_path[i] @ of_path[i].T,
            "way": way_of(np.vstack([problem.start.pose, features.poses(features.recorded)]))[1:],
            "moving": (features.middles > problem.moving[0]).astype(float), "sigmas": features.sigmas,
        })  # fmt: skip
    return pushes


def covariance(push, values):
    place, white_place, yaw, white_yaw, way, table, tip = values
    count = len(push["way"])
    alike = np.exp(-np.abs(push["way"][:, None] - push["way"][None, :]) / way)
    moving, total = np.outer(push["moving"], push["moving"]), push["rest"].copy()
    for dof, (wander, white) in enumerate([(place, white_place)] * 2 + [(yaw, white_yaw)]):
        part = slice(dof * count, (dof + 1) * count)
        own = wander**2 * alike + white**2 * np.eye(count)
        total[part, part] += moving * own / push["sigmas"][dof] ** 2
    return total + table**2 * push["table"] + tip**2 * push["tip"]


def log_likelihood(worlds, values):
    """Of all pushes, and of each the squared deviations that are left, per number."""
    total, left = 0.0, []
    for pushes in worlds:
        roots = [np.linalg.cholesky(covariance(push, values)) for push in pushes]
        sides = [np.column_stack([push["residual"], push["shared"]]) for push in pushes]
        white = [np.linalg.solve(root, side) for root, side in zip(roots, sides, strict=True)]
        stacked = np.vstack(white)
        dz = np.linalg.lstsq(stacked[:, 1:], stacked[:, 0], rcond=1e-9)[0]
        for root, own in zip(roots, white, strict=True):
            errors, m = own[:, 0] - own[:, 1:] @ dz, len(own)
            square = float(errors @ errors)
            total += gammaln(0.5 * (TAIL + m)) - gammaln(0.5 * TAIL) - 0.5 * m * np.log(TAIL)
            total -= 0.5 * (TAIL + m) * np.log1p(square / TAIL) + np.log(np.diag(root)).sum()
            left.append(square / m)
    return total, np.array(left)


if __name__ == "__main__":
    main()
