"""Diagnoses of pushes that engines simulate as most people set them: usual_simulators.py [ENGINE ...] [--jobs N].

Twelve pushes of an eraser, 0.05 to 0.6 m/s, by PyBullet and MuJoCo (``peers``): a box with their defaults, and 64
feet with settings that make MuJoCo's dry friction right. Noise is 0.3 mm, 3 mrad and, of the hand, 0.1 mm; the mass
is weighed. Nothing was put in: what differs is the engine's friction and contact, which is in no catalogue but for
the corners on which a box stands.
"""

import argparse
import importlib
import sys
from pathlib import Path

import numpy as np
from rich.console import Console

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from peers.push import DURATION, SIZE, TIP_RADIUS
from peers.push import Push as Prescribed
from planar_worlds import HAND, POSITION, PUSHES, ROTATION, answer, numbers
from reference.scenes import OBJECTS, draw_push
from twin import shape_of

from physid_drake.recording import Hand, ObjectModel, Push, Recording, Sensors, Table, planar_poses

SEED = 5
RATE = 100.0  # 1/s, of the recording
ENGINES = {  # step [s], module of the peer, and how it is made
    "PyBullet box 240 Hz": (1 / 240, "bullet", lambda peer: peer.BulletBox(1 / 240)),
    "MuJoCo box 500 Hz": (2e-3, "mujoco_feet", lambda peer: peer.NaiveBox()),
    "MuJoCo 8x8 feet 1 kHz": (1e-3, "mujoco_feet", lambda peer: peer.SoftFeet(*peer.midpoints(8, 8), 1e-3)),
}


def recorded(name):
    """The engine's recording."""
    step, module, make = ENGINES[name]
    simulator = make(importlib.import_module(f"peers.{module}"))
    rng, body = np.random.default_rng(SEED), OBJECTS["eraser"]
    assert tuple(shape_of(body).size) == SIZE
    pushes = tuple(seen(k, simulator, step, rng) for k in range(PUSHES))
    return Recording(
        name=name, description="", table=Table(size=(4.0, 4.0)), hand=Hand(tip="sphere", radius=TIP_RADIUS),
        object=ObjectModel(shape=shape_of(body), mass=body.mass, mass_std=0.01 * body.mass), pushes=pushes,
        sensors=Sensors(object_position_std=POSITION, object_rotation_std=ROTATION, hand_position_std=HAND),
    )  # fmt: skip


def seen(k, simulator, step, rng):
    """A push that is drawn, simulated, sampled and made noisy."""
    drawn = draw_push(rng, OBJECTS["eraser"], tip_radius=TIP_RADIUS, pose=(0.0, 0.0, 0.0))
    path = Prescribed(name=str(k), times=drawn.path.times, velocities=drawn.path.velocities, start=drawn.path.p0)
    motion = np.vstack([np.zeros(3), simulator.motion(path)])
    times = np.arange(0.0, DURATION, 1.0 / RATE)
    poses = np.column_stack([np.interp(times, step * np.arange(len(motion)), column) for column in motion.T])
    poses += [POSITION, POSITION, ROTATION] * rng.standard_normal(poses.shape)
    tip = path.positions(times) + HAND * rng.standard_normal((len(times), 2))
    return Push(
        name=f"pushes/{k:03d}.csv", object=planar_poses(times, poses, 0.5 * SIZE[2]), force=None,
        hand=planar_poses(times, np.column_stack([tip, np.zeros(len(tip))]), drawn.tip_height),
    )  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("engines", nargs="*", metavar="ENGINE", help=f"of {', '.join(ENGINES)} (default: all)")
    parser.add_argument("--jobs", type=int, default=0, help="processes (default: one a core)")
    given = parser.parse_args()
    unknown = [name for name in given.engines if name not in ENGINES]
    if unknown:
        parser.error(f"there is no engine {unknown[0]!r}; there are {', '.join(ENGINES)}.")
    console = Console(width=150, markup=False)
    for name in given.engines or ENGINES:
        try:
            recording = recorded(name)
        except ImportError as error:
            console.print(f"{name} left out: {error}. Install it: pip install '.[peers]'")
            continue
        said = answer(recording, given.jobs)
        found = "; ".join(
            " or ".join((e.name, *e.indistinguishable_from)) + " " + ", ".join(numbers(e)) for e in said.effects
        )
        errors = f"{1e3 * said.fit.position_before:.2f} -> {1e3 * said.fit.position_after:.2f} mm"
        console.print(name, said.verdict, found, errors, said.sentence, sep=" | ")


if __name__ == "__main__":
    main()
