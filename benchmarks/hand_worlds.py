"""Diagnoses of MuJoCo worlds whose hand moves otherwise: hand_worlds.py MANNER [--seeds 11 12] [--effect NAME].

Hands of the proof's worlds come from afar, go on at 0.05 to 0.5 m/s, brake and stay. Here the same scenes are pushed
by hands that are slow (10 to 60 mm/s, with a force sensor), that go and brake as gently as people's arms do, that go
round a bend, that halt on their way, or that begin where they touch and withdraw; by ones that come from afar, stand,
push, stand and withdraw, as people's arms do (`visiting`; with a force sensor); by ones low on the object; or by
ones that are tracked no better than the object, or with a slow noise. Of `camera`, hands and noise are the proof's,
but the object is seen 31 times a second, between samples of the hand, stamps count from 1970, nothing is stated.
Prints what was put in and what is said of it.
"""

import argparse
import dataclasses as dc
import math

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy import signal

from physid_drake.diagnose import diagnose
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import PoseStream, Push, Recording
from physid_drake.validation.worlds.knobs import draw_knob
from physid_drake.validation.worlds.scene import DrawnPush, Rng, Scene, draw_scene
from physid_drake.validation.worlds.sensing import record, recording_of
from physid_drake.validation.worlds.strengths import simulate
from physid_drake.validation.worlds.world_plan import HandPath

SPEEDS = (0.01, 0.06)  # m/s, of slow hands
BRAKE = 0.1  # s
AWAY, COMES, STANDS = 0.1, 0.25, 0.8  # m, m/s, s: how far and how fast a hand comes, and how long it stands
WANDERS, MEMORY = 3e-4, 0.05  # m, s: a slow noise of the hand
FORCE, RATE = 0.02, 100.0  # N, Hz
CAMERA_RATE, FRAMES = 250.0, 8  # Hz; one picture in so many samples
EPOCH = 1.7e9  # s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("manner", choices=MANNERS)
    parser.add_argument("--seeds", type=int, nargs="+", default=[11, 12, 13])
    parser.add_argument("--effect", help="of the catalogue; none without")
    parser.add_argument("--share", type=float, default=0.5, help="of the strongest that the proof draws")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    console = Console(width=118)
    table = Table("seed", "put in", "noise [mm]", "said", "p", "held out [mm]", "[N]", "misfit")
    for seed in given.seeds:
        recording, noise = world(given.manner, seed, given.effect, given.share)
        case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=given.jobs)
        said, _ = diagnose(case)
        names = " and ".join(" or ".join([e.name, *e.indistinguishable_from]) for e in said.effects)
        table.add_row(
            str(seed), given.effect or "none", f"{1e3 * noise:.2f}", names or said.verdict, f"{said.p_value:.2g}",
            f"{1e3 * said.fit.position_before:.2f} to {1e3 * said.fit.position_after:.2f}",
            "" if said.fit.force_before is None else f"{said.fit.force_before:.3f} to {said.fit.force_after:.3f}",
            f"{said.reduced_chi2_before:.2f}",
        )  # fmt: skip
        console.print(f"{seed}: {said.sentence}")
    console.print(table)


def world(manner: str, seed: int, effect: str | None, share: float) -> tuple[Recording, float]:
    """A recording, and its tracker's noise [m]."""
    rng = np.random.default_rng([seed, 77])
    scene = MANNERS[manner](rng, draw_scene(rng))
    effects = [] if effect is None else [strong(rng, scene, effect, share)]
    motions = simulate(scene, effects)
    pushes = [record(rng, scene, k, motion)[0] for k, motion in enumerate(motions)]
    if manner == "wandering":
        pushes = [wandered(rng, push, 1.0 / scene.rate) for push in pushes]
    if manner == "camera":
        pushes = [filmed(push) for push in pushes]
    return recording_of(f"{manner} {seed}", scene, pushes, effect == "actuator_lag"), scene.noise.position


def slow(rng: Rng, scene: Scene) -> Scene:
    """The same way of the hand, but for the brake, at another speed; with a force sensor."""
    measured = dc.replace(scene, noise=dc.replace(scene.noise, force=FORCE), rate=RATE)
    return along(measured, lambda push: slowed(rng, push.path))


def slowed(rng: Rng, path: HandPath) -> HandPath:
    slower = speed_of(path) / math.exp(rng.uniform(*np.log(SPEEDS)))
    spans = slower * np.diff(path.times)
    spans[-1] = BRAKE
    times = path.times[0] + np.concatenate([[0.0], np.cumsum(spans)])
    return dc.replace(path, times=times, velocities=path.velocities / slower)


def gentle(rng: Rng, scene: Scene) -> Scene:
    """A straight way at a speed that rises and falls like that of least jerk, 30 s^2 (1 - s)^2."""
    s = np.linspace(0.0, 1.0, 41)
    shape = 30.0 * (s * (1.0 - s)) ** 2  # of mean 1, peak 1.875

    def path(push: DrawnPush) -> HandPath:
        old, ahead = push.path, heading_of(push.path)
        length = float(np.linalg.norm(old.position(old.times[-1:])[0] - old.start))
        lasts = 1.875 * length / speed_of(old)
        return dc.replace(old, times=old.times[0] + lasts * s, velocities=length / lasts * shape[:, None] * ahead)

    return along(scene, path)


def curved(rng: Rng, scene: Scene) -> Scene:
    """From the touch on, the heading swings by up to 40 deg to one side and back."""

    def path(push: DrawnPush) -> HandPath:
        old, speed, swing = push.path, speed_of(push.path), math.radians(rng.uniform(-40.0, 40.0))
        s = np.linspace(0.0, 1.0, 31)
        angles = math.atan2(*heading_of(old)[::-1]) + swing * np.sin(math.pi * s)
        touch, end = old.times[2], old.times[3]
        times = np.concatenate([old.times[:2], touch + (end - touch) * s, old.times[4:]])
        bends = speed * np.column_stack([np.cos(angles), np.sin(angles)])
        return dc.replace(old, times=times, velocities=np.concatenate([old.velocities[:2], bends, [[0.0, 0.0]]]))

    return along(scene, path)


def halting(rng: Rng, scene: Scene) -> Scene:
    """Half way from the touch to the brake the hand stands for 0.1 to 0.5 s."""

    def path(push: DrawnPush) -> HandPath:
        old, ahead = push.path, speed_of(push.path) * heading_of(push.path)
        half, last, wait = (old.times[3] - old.times[2]) / 2.0, old.times[4] - old.times[3], rng.uniform(0.1, 0.5)
        spans = [*np.diff(old.times[:3]), half, last, wait, last, half, last]
        still = np.zeros(2)
        return dc.replace(
            old, times=old.times[0] + np.concatenate([[0.0], np.cumsum(spans)]),
            velocities=np.array([still, ahead, ahead, ahead, still, still, ahead, ahead, still]),
        )  # fmt: skip

    return along(scene, path)


def touching(rng: Rng, scene: Scene) -> Scene:
    """The hand begins 0.2 mm from the object, speeds up in 0.1 s, and goes back after the brake."""

    def path(push: DrawnPush) -> HandPath:
        old, ahead = push.path, heading_of(push.path)
        forth, back, still = speed_of(old) * ahead, -0.1 * ahead, np.zeros(2)
        spans = [0.1, old.times[3] - old.times[2], old.times[4] - old.times[3], 0.1, 0.1, 0.3, 0.1]
        return dc.replace(
            old, start=old.position(old.times[2:3])[0] - 2e-4 * ahead,
            times=old.times[0] + np.concatenate([[0.0], np.cumsum(spans)]),
            velocities=np.array([still, forth, forth, still, still, back, back, still]),
        )  # fmt: skip

    return along(scene, path)


def visiting(rng: Rng, scene: Scene) -> Scene:
    """At 0.25 m/s to where the push begins, and 0.1 m back in the end, 0.8 s after it; all of least jerk."""
    s = np.linspace(0.0, 1.0, 41)
    shape = 30.0 * (s * (1.0 - s)) ** 2

    def path(push: DrawnPush) -> HandPath:
        old, ahead = push.path, heading_of(push.path)
        length = float(np.linalg.norm(old.position(old.times[-1:])[0] - old.start))
        ways, speeds = (AWAY, length, -AWAY), (COMES, speed_of(old), -COMES)
        ends, times, velocities = old.times[0], [], []
        for way, speed in zip(ways, speeds, strict=True):
            lasts = 1.875 * way / speed
            times.append(ends + lasts * s)
            velocities.append(way / lasts * shape[:, None] * ahead)
            ends += lasts + STANDS
        return dc.replace(old, start=old.start - AWAY * ahead, times=np.concatenate(times),
                          velocities=np.concatenate(velocities))  # fmt: skip

    return along(dc.replace(scene, noise=dc.replace(scene.noise, force=FORCE), rate=RATE), path)


def low(rng: Rng, scene: Scene) -> Scene:
    """The tip is at a quarter to a half of the object's height, instead of at a half."""
    height = float(rng.uniform(0.5, 1.0)) * scene.plan.tip_height
    return dc.replace(scene, plan=dc.replace(scene.plan, tip_height=height))


def noisy(rng: Rng, scene: Scene) -> Scene:
    """The hand is tracked no better than the object."""
    return dc.replace(scene, noise=dc.replace(scene.noise, hand=scene.noise.position))


def wandering(rng: Rng, scene: Scene) -> Scene:
    """The hand's noise remembers 50 ms (``wandered``), and nothing is stated of it."""
    return dc.replace(scene, sensors_stated=False, noise=dc.replace(scene.noise, hand=1e-5))


def wandered(rng: Rng, push: Push, interval: float) -> Push:
    """A push with a first-order autoregressive noise of the hand."""
    keeps, steps = math.exp(-interval / MEMORY), rng.standard_normal(push.hand.positions.shape)
    steps[1:] *= math.sqrt(1.0 - keeps**2)
    noise = WANDERS * signal.lfilter([1.0], [1.0, -keeps], steps, axis=0)
    return dc.replace(push, hand=dc.replace(push.hand, positions=push.hand.positions + noise))


def camera(rng: Rng, scene: Scene) -> Scene:
    """Nothing is stated, nor weighed; every sample is made, most are taken away by ``filmed``."""
    noise = dc.replace(scene.noise, dropout=0.0)
    return dc.replace(scene, sensors_stated=False, stated_mass=None, noise=noise, rate=CAMERA_RATE)


def filmed(push: Push) -> Push:
    """The object in one sample of eight, the hand in every other one, never in the same."""
    return dc.replace(push, object=thinned(push.object, 0, FRAMES), hand=thinned(push.hand, 1, 2))


def thinned(stream: PoseStream, first: int, step: int) -> PoseStream:
    keep = slice(first, None, step)
    times = EPOCH + stream.times[keep]
    return PoseStream(times=times, positions=stream.positions[keep], quaternions=stream.quaternions[keep])


MANNERS = {
    "slow": slow, "gentle": gentle, "curved": curved, "halting": halting, "touching": touching,
    "visiting": visiting, "low": low, "noisy": noisy, "wandering": wandering, "camera": camera,
}  # fmt: skip


def along(scene: Scene, path) -> Scene:
    """The scene with another path of each push."""
    return dc.replace(scene, pushes=tuple(dc.replace(push, path=path(push)) for push in scene.pushes))


def speed_of(path: HandPath) -> float:
    return float(np.linalg.norm(path.velocities, axis=1).max())


def heading_of(path: HandPath):
    """Unit vector (2,) of the way to the object."""
    return path.velocities[1] / np.linalg.norm(path.velocities[1])


def strong(rng: Rng, scene: Scene, effect: str, share: float):
    """An effect, at a share of its strongest."""
    knob = draw_knob(effect, rng, scene)
    return knob.at(share * knob.limit)


if __name__ == "__main__":
    main()
