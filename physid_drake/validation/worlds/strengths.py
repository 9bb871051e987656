"""How strong effects are: so that they move the object by as much as was drawn, and it still stands."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from physid_drake.validation.worlds.effects.effect import Effect
from physid_drake.validation.worlds.feet import stays_loaded
from physid_drake.validation.worlds.knobs import Knob, draw_knob
from physid_drake.validation.worlds.mujoco_world import PushWorld
from physid_drake.validation.worlds.scene import Rng, Scene
from physid_drake.validation.worlds.shapes import Array
from physid_drake.validation.worlds.world_plan import Motion

SIZES: Final = (2.0, 30.0)
"""Drawn sizes of effects, in standard deviations of the tracker."""
STILL: Final = 1e-4
"""What moves by more without a hand does not stand [m]: such a world is drawn anew, too."""
LOOK: Final = 0.2
"""For how long it is looked at [s]."""
_CALIBRATION_PUSHES: Final = 4
_CALIBRATION_ROUNDS: Final = 3


def simulate(scene: Scene, effects: Sequence[Effect], which: Sequence[int] | None = None) -> list[Motion]:
    """Noise-free motions of some pushes of a scene, or of all."""
    world = PushWorld(scene.plan, effects, pushes=len(scene.pushes))
    chosen = range(len(scene.pushes)) if which is None else which
    return [
        world.run(
            scene.pushes[k].pose,
            scene.pushes[k].path,
            push=k,
            friction_factor=scene.pushes[k].friction_factor,
            sample_time=1.0 / scene.rate,
            rest=scene.pushes[k].rest,
        )
        for k in chosen
    ]


def loaded(scene: Scene, effects: Sequence[Effect]) -> bool:
    """Whether every foot carries weight with both of two effects, each of which leaves it some."""
    if len(effects) < 2:
        return True
    return stays_loaded(functools.reduce(lambda plan, effect: effect.build(plan), effects, scene.plan))


def stands(scene: Scene, effects: Sequence[Effect]) -> bool:
    """Whether the object rests where each push begins: effects may drag it away."""
    world = PushWorld(scene.plan, effects, pushes=len(scene.pushes))
    for k, push in enumerate(scene.pushes):
        motion = world.run(push.pose, None, push=k, friction_factor=push.friction_factor, duration=LOOK)
        if float(np.linalg.norm(motion.true_poses[-1, :2] - np.array(push.pose[:2]))) > STILL:
            return False
    return True


def draw_effects(rng: Rng, scene: Scene, names: Sequence[str]) -> tuple[list[Effect], list[float]]:
    """Effects of some names, and the size of each [sigmas]: how far it moves the object."""
    effects, sizes = [], []
    for name in names:
        target = float(np.exp(rng.uniform(*np.log(SIZES))))
        effect, size = _calibrate(scene, draw_knob(name, rng, scene), target)
        effects.append(effect)
        sizes.append(size)
    return effects, sizes


def _calibrate(scene: Scene, knob: Knob, target: float) -> tuple[Effect, float]:
    """Sets a strength so that the effect moves the object by ``target`` standard deviations, within its bounds."""
    count = len(scene.pushes)
    # Drift grows with the order of pushes, and patches may lie beside some, so they are spread over the recording.
    which = sorted(set(np.linspace(0, count - 1, _CALIBRATION_PUSHES).round().astype(int).tolist()))
    plain = simulate(scene, (), which)
    strength, known = 0.3 * knob.limit, [(0.0, 0.0)]
    for _ in range(_CALIBRATION_ROUNDS):
        size = difference(scene, simulate(scene, (knob.at(strength),), which), plain)
        known.append((strength, size))
        if abs(math.log(max(size, 1e-9) / target)) < 0.1:
            break
        following = min(knob.limit, max(1e-4 * knob.limit, strength * _step(known, target)))
        if following == strength:
            break
        strength = following
    # The last step is not simulated again; the nearest that was is.
    strength, size = min(known[1:], key=lambda pair: abs(math.log(max(pair[1], 1e-9) / target)))
    return knob.at(strength), size


def _step(known: Sequence[tuple[float, float]], target: float) -> float:
    """Factor on the strength: a secant in logarithms, and at first proportional."""
    strength, size = known[-1]
    power = 1.0
    if len(known) > 2 and min(size, known[-2][1]) > 1e-6 and known[-2][0] != strength:
        power = math.log(size / known[-2][1]) / math.log(strength / known[-2][0])
    return float(np.clip((target / max(size, 1e-6)) ** (1.0 / float(np.clip(power, 0.4, 3.0))), 0.02, 30.0))


def difference(scene: Scene, motions: Sequence[Motion], plain: Sequence[Motion]) -> float:
    """Rms over samples, x, y and yaw, in the tracker's deviations, of motion since the start of each push."""
    deviations = np.array([scene.noise.position, scene.noise.position, scene.noise.rotation])
    squares = []
    for one, other in zip(motions, plain, strict=True):
        length = max(len(one.poses), len(other.poses))
        moved, still = (_padded(motion.poses, length) - motion.poses[0] for motion in (one, other))
        squares.append(((moved - still) / deviations) ** 2)
    return float(np.sqrt(np.concatenate(squares).mean()))


def _padded(poses: Array, length: int) -> Array:
    """The poses, with the last one repeated: what rests stays."""
    return np.concatenate([poses, np.repeat(poses[-1:], length - len(poses), axis=0)])
