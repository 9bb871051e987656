"""Diagnoses of MuJoCo worlds whose hand is slow: slow_worlds.py [--seeds 11 12 13] [--effect NAME --share 0.5].

Hands of the proof's worlds go 0.05 to 0.5 m/s. Here the same scenes are pushed at 10 to 60 mm/s, without release, for
several seconds each, and the hand's force is recorded. Prints what was put in and what is said of it.
"""

import argparse
import dataclasses as dc
import math

import numpy as np
from rich.console import Console
from rich.table import Table

from physid_drake.diagnose import case_of, cell_config, diagnose
from physid_drake.identify.config import ThetaConfig
from physid_drake.prove.knobs import draw_knob
from physid_drake.prove.make import simulate
from physid_drake.prove.scene import DrawnPush, Scene, draw_scene
from physid_drake.prove.sensing import record, recording_of
from physid_drake.recording import Recording

SPEEDS = (0.01, 0.06)  # m/s
BRAKE = 0.1  # s
FORCE, RATE = 0.02, 100.0  # N, Hz


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[11, 12, 13])
    parser.add_argument("--effect", help="of the catalogue; none without")
    parser.add_argument("--share", type=float, default=0.5, help="of the strongest that the proof draws")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    console = Console(width=118)
    table = Table("seed", "put in", "noise [mm]", "said", "p", "held out [mm]", "[N]", "misfit")
    for seed in given.seeds:
        recording, noise = world(seed, given.effect, given.share)
        case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=given.jobs)
        said, _ = diagnose(case)
        names = " and ".join(" or ".join([e.name, *e.indistinguishable_from]) for e in said.effects)
        table.add_row(
            str(seed), given.effect or "none", f"{1e3 * noise:.2f}", names or said.verdict, f"{said.p_value:.2g}",
            f"{1e3 * said.fit.position_before:.2f} to {1e3 * said.fit.position_after:.2f}",
            f"{said.fit.force_before:.3f} to {said.fit.force_after:.3f}", f"{said.reduced_chi2_before:.2f}",
        )  # fmt: skip
        console.print(f"{seed}: {said.sentence}")
    console.print(table)


def world(seed: int, effect: str | None, share: float) -> tuple[Recording, float]:
    """A recording, and its tracker's noise [m]."""
    rng = np.random.default_rng([seed, 77])
    drawn = draw_scene(rng)
    scene = dc.replace(
        drawn, pushes=tuple(slowed(rng, push) for push in drawn.pushes),
        noise=dc.replace(drawn.noise, force=FORCE), rate=RATE,
    )  # fmt: skip
    effects = [] if effect is None else [strong(rng, scene, effect, share)]
    motions = simulate(scene, effects)
    pushes = [record(rng, scene, k, motion)[0] for k, motion in enumerate(motions)]
    return recording_of(f"slow {seed}", scene, pushes, effect == "actuator_lag"), scene.noise.position


def slowed(rng: np.random.Generator, push: DrawnPush) -> DrawnPush:
    """The same way of the hand, but for the brake, at another speed."""
    path = push.path
    slower = float(np.linalg.norm(path.velocities, axis=1).max()) / math.exp(rng.uniform(*np.log(SPEEDS)))
    spans = slower * np.diff(path.times)
    spans[-1] = BRAKE
    times = path.times[0] + np.concatenate([[0.0], np.cumsum(spans)])
    return dc.replace(push, path=dc.replace(path, times=times, velocities=path.velocities / slower))


def strong(rng: np.random.Generator, scene: Scene, effect: str, share: float):
    """An effect, at a share of its strongest."""
    knob = draw_knob(effect, rng, scene)
    return knob.at(share * knob.limit)


if __name__ == "__main__":
    main()
