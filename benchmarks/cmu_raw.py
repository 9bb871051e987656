"""How wide the CMU triangle stands, from the raw logs alone, without a simulator: cmu_raw.py FOLDER_OF_cmu_pushes.

A slow slide obeys a limit surface. If that is an ellipsoid, an object that is pushed with a force f at the arm d
turns by d / c^2 for every metre that it goes along the force, c being the largest friction torque over the largest
friction force (S. Goyal, A. Ruina, J. Papadopoulos, Wear 143, 1991; R. Howe, M. Cutkosky, IJRR 15, 1996). Under the
Coulomb friction of known weights c is their mean distance from the centre of mass. So the slope of turn per metre
over measured arms says how far out the triangle stands; neither friction nor the contact with the finger matters.
With c, each push's mean force f at its arm d says what a force without an arm would be, f sqrt(1 + (d / c)^2); how
much that differs from push to push is the scatter of friction (median absolute deviation of its logarithm, as of a
normal distribution).
"""

import argparse
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy import stats

from physid_drake.recording import read_recording
from physid_drake.recording.adapters.cmu import convert_cmu

SUPPORTS = ("patch", "30_63.33_43.33_30_43.33_63.33", "30_90_30_30_30_90", "10_130_10_10_10_130")
CORNER = 0.05  # m from the right-angle corner to the centre of mass, along both legs
LEG = 0.15  # m
LEAST_WAY = 3e-3  # m along the force: less tells no turn per metre
LOADED = 0.6  # of the median force: below it the finger is not pushing yet
LEAST_FORCE = 1.0  # N
BOOTSTRAPS = 2000


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder / "cmu_pushes" / "sensor_log"
    if not folder.is_dir():
        sys.exit(f"error: no folder '{folder}'.")
    table = Table(title="largest friction torque over largest friction force [mm]")
    for column in ("support", "pushes", "from the logs", "90 %", "from the points", "if even", "friction"):
        table.add_column(column, no_wrap=True, justify="left" if column == "support" else "right")
    for name in SUPPORTS:
        arms, turns, forces = arms_turns_and_forces(pushes_in(folder / name))
        radius, (low, high) = fitted_radius(arms, turns)
        known = "" if name == "patch" else f"{1e3 * radius_of_points(name):.1f}"
        table.add_row(
            name, str(len(arms)), f"{1e3 * radius:.1f}", f"{1e3 * low:.1f} to {1e3 * high:.1f}", known,
            f"{1e3 * radius_if_even():.1f}", f"+-{100 * scatter_of_friction(arms, forces, radius):.0f} %",
        )  # fmt: skip
    Console(width=110).print(table)


def pushes_in(source):
    """The converted pushes; those that hold a tracker's error are left out with a warning of the converter's."""
    with tempfile.TemporaryDirectory() as made, warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        convert_cmu(source, Path(made) / "pushes")
        return read_recording(Path(made) / "pushes").pushes


def arms_turns_and_forces(pushes):
    """Arm of the mean force about the centre of mass [m], turn per way along it [rad/m], that force [N]: (3, n)."""
    rows = [row for row in map(arm_turn_and_force, pushes) if row is not None]
    return np.array(rows).T


def arm_turn_and_force(push):
    force = push.force.forces[:, :2]
    size = np.linalg.norm(force, axis=1)
    if (size > LEAST_FORCE).sum() < 20:
        return None
    loaded = size > LOADED * np.median(size[size > LEAST_FORCE])
    times, force = push.force.times[loaded], force[loaded]
    hand = np.column_stack([np.interp(times, push.hand.times, push.hand.positions[:, k]) for k in (0, 1)])
    way = push.object.positions[-1, :2] - push.object.positions[0, :2]
    done = (times - times[0]) / (times[-1] - times[0])  # the pose is known before and after: a steady motion between
    arm = hand - (push.object.positions[0, :2] + done[:, None] * way)
    torque = np.mean(arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0])
    mean = force.mean(axis=0)
    pull = float(np.linalg.norm(mean))
    along = float(way @ mean) / pull
    w, _, _, z = push.object.quaternions[[0, -1]].T
    yaw = 2.0 * np.arctan2(z, w)
    turn = (yaw[1] - yaw[0] + np.pi) % (2.0 * np.pi) - np.pi
    if along < LEAST_WAY:
        return None
    return torque / pull, turn / along, pull


def scatter_of_friction(arms, forces, radius):
    """How much the force without an arm differs from push to push [-]."""
    logs = np.log(forces * np.hypot(1.0, arms / radius))
    return float(stats.median_abs_deviation(logs, scale="normal"))


def fitted_radius(arms, turns):
    """Radius [m] from the median of all slopes between two pushes (Theil, Sen), and its 90 % bootstrap interval."""
    rng = np.random.default_rng(0)
    draws = rng.integers(len(arms), size=(BOOTSTRAPS, len(arms)))
    slopes = [stats.theilslopes(turns[d], arms[d]).slope for d in draws]
    radius = 1.0 / np.sqrt(stats.theilslopes(turns, arms).slope)
    return radius, 1.0 / np.sqrt(np.quantile(slopes, [0.95, 0.05]))


def radius_of_points(name):
    """Mean distance of three points that carry the triangle, from its centre of mass [m]."""
    points = 1e-3 * np.array([float(n) for n in name.split("_")]).reshape(2, 3) - CORNER
    loads = np.linalg.solve(np.vstack([np.ones(3), points]), np.array([1.0, 0.0, 0.0]))
    return float(loads @ np.linalg.norm(points, axis=0))


def radius_if_even():
    """Mean distance of the triangle's points from its centre of mass [m]."""
    time_steps = (np.arange(600) + 0.5) / 600 * LEG
    x, y = np.meshgrid(time_steps, time_steps)
    inside = x + y < LEG
    return float(np.hypot(x - CORNER, y - CORNER)[inside].mean())


if __name__ == "__main__":
    main()
