"""Makes sealed worlds: recordings that tell nothing, and apart from them the truth, under a hash.

``python -m physid_drake.validation.worlds.make --worlds 20 --seed 0 --out FOLDER`` writes ``recordings/<id>/``,
``sealed/<id>.json``, ``sealed/secret.json``, ``seal.txt`` and ``seal.sha256``. The same seed gives the same worlds
under other names; worlds that exist are skipped. ``--names-by-seed`` gives the names, too, and all the same bytes: it
is for opened seeds only, since who knows a seed finds its worlds by such names.
"""

from __future__ import annotations

import argparse
import functools
import json
import math
import shutil
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final, Literal, TypeAlias, get_args

import numpy as np

from physid_drake.errors import ConfigError, ParameterError, PhysidError, ProofError
from physid_drake.processes import in_processes
from physid_drake.recording import (
    Recording,
    write_recording,
)
from physid_drake.run_folder import RunFolder
from physid_drake.validation.sealing.seal import LINES, RECORDING, SEALED, TOTAL, files_digest, write_seal
from physid_drake.validation.sealing.secret import Secret, keep_secret, name_by_seed
from physid_drake.validation.worlds.contact import RESIDUAL_RESTITUTION
from physid_drake.validation.worlds.effects.catalogue import CATALOGUED, OTHERS
from physid_drake.validation.worlds.effects.effect import Effect, parameters_of
from physid_drake.validation.worlds.feet import stays_loaded
from physid_drake.validation.worlds.floor import floor_of
from physid_drake.validation.worlds.knobs import Knob, draw_knob
from physid_drake.validation.worlds.mujoco_world import PushWorld
from physid_drake.validation.worlds.scene import Rng, Scene, draw_scene
from physid_drake.validation.worlds.sensing import record, recording_of
from physid_drake.validation.worlds.shapes import Array
from physid_drake.validation.worlds.world_plan import Motion
from physid_drake.whole_files import write_whole

COMMAND: Final = "prove"
"""Whose the folder is, also one that is made by hand."""
RECORDINGS: Final = "recordings"
Kind: TypeAlias = Literal["none", "effect", "other", "pair", "notched"]
KINDS: Final[tuple[Kind, ...]] = get_args(Kind)
BLOCK: Final[tuple[Kind, ...]] = ("none",) * 5 + ("effect",) * 10 + ("other",) * 3 + ("pair",) * 2
"""Each twenty worlds are these, shuffled."""
SIZES: Final = (2.0, 30.0)
"""Drawn sizes of effects, in standard deviations of the tracker."""
GRAINS: Final = {"anisotropic_table", "anisotropic_object"}
"""Never in one world: MuJoCo's contacts have one grain."""
SMALLEST_SIZE: Final = 1.0
"""A world whose effect cannot reach this within its bounds is drawn anew, a few times."""

STILL: Final = 1e-4
"""What moves by more without a hand does not stand [m]: such a world is drawn anew, too."""

_CALIBRATION_PUSHES: Final = 4
_CALIBRATION_ROUNDS: Final = 3
_ATTEMPTS: Final = 4


@dataclass(frozen=True, kw_only=True)
class Assignment:
    """What world ``index`` shall be: its kind, the names of its effects, and whether its object has notches."""

    index: int
    kind: Kind
    effects: tuple[str, ...]
    notched: bool = False


@dataclass(frozen=True, kw_only=True)
class DrawnWorld:
    """What a world is made of: what it was to be, its scene, its effects, and the size of each [sigmas]."""

    chosen: Assignment
    scene: Scene
    effects: tuple[Effect, ...]
    sizes: tuple[float, ...]


def assign(index: int, seed: int, kind: Kind | None = None, effect: str | None = None) -> Assignment:
    """The mix: a quarter nothing, half one effect of the catalogue in turn, the rest others and pairs.

    Args:
        index: of the world.
        seed: of the whole set.
        kind: instead of the mix; of ``notched``, objects are a T, an L or a plus, and worlds have one effect or none.
        effect: instead of taking effects in turn; for a pair, its first.
    """
    if kind == "notched":
        # Every fourth without an effect: what the outline alone does must be no mismatch.
        plain = index % 4 == 3
        return replace(assign(index, seed, "none" if plain else "effect", None if plain else effect), notched=True)
    block, within = divmod(index, len(BLOCK))
    kinds = [BLOCK[k] for k in np.random.default_rng([seed, block, 1]).permutation(len(BLOCK)).tolist()]
    if effect is not None and kind is None:
        kind = "effect" if effect in CATALOGUED else "other"
    chosen = kinds[within] if kind is None else kind
    turn = index if kind is not None else block * BLOCK.count(chosen) + kinds[:within].count(chosen)
    if chosen == "none":
        return Assignment(index=index, kind=chosen, effects=())
    pool = list(OTHERS if chosen == "other" else CATALOGUED)
    order = np.random.default_rng([seed, 2, chosen == "other"]).permutation(len(pool)).tolist()
    first = effect if effect is not None else pool[order[turn % len(pool)]]
    if first not in pool:
        raise ParameterError(f"no effect {first!r} of kind {chosen}; there are {', '.join(pool)}.")
    if chosen != "pair":
        return Assignment(index=index, kind=chosen, effects=(first,))
    rest = [name for name in pool if name != first]
    drawn = int(np.random.default_rng([seed, index, 3]).integers(len(rest)))
    second = rest[drawn]
    if {first, second} == GRAINS:
        second = rest[(drawn + 1) % len(rest)]
    return Assignment(index=index, kind=chosen, effects=(first, second))


def make_world(
    index: int, seed: int, kind: Kind | None = None, effect: str | None = None, name: str | None = None
) -> tuple[Recording, dict[str, object]]:
    """One recording, and the truth about it.

    Args:
        index: of the world.
        seed: of the whole set.
        kind: none, effect, other, pair or notched; None: by the mix.
        effect: name of the effect; None: in turn.
        name: of the world, on which nothing else depends; None: by its seed.
    """
    drawn, rng = draw_world(index, seed, kind, effect)
    scene, effects = drawn.scene, drawn.effects
    motions = simulate(scene, effects)
    size = _difference(scene, motions, simulate(scene, ())) if effects else 0.0
    name = name_by_seed(index, seed) if name is None else name
    pushes = [record(rng, scene, k, motion) for k, motion in enumerate(motions)]
    recording = recording_of(name, scene, [push for push, _ in pushes], _lags(effects))
    truth = _truth(drawn, seed, size, motions, [poses for _, poses in pushes])
    return recording, {"id": name, "held_out_floor": _floor(scene, effects, recording)} | truth


def draw_world(index: int, seed: int, kind: Kind | None = None, effect: str | None = None) -> tuple[DrawnWorld, Rng]:
    """The world that ``make_world`` records, and what draws the noise of its recording; arguments as of that."""
    chosen = assign(index, seed, kind, effect)
    for attempt in range(_ATTEMPTS):
        rng = np.random.default_rng([seed, index, 4, attempt])
        scene = draw_scene(rng, notched=chosen.notched)
        effects, sizes = _draw_effects(rng, scene, chosen.effects)
        if all(size >= SMALLEST_SIZE for size in sizes) and _loaded(scene, effects) and stands(scene, effects):
            break
    return DrawnWorld(chosen=chosen, scene=scene, effects=tuple(effects), sizes=tuple(sizes)), rng


def _floor(scene: Scene, effects: Sequence[Effect], recording: Recording) -> dict[str, float]:
    """What the true world leaves of pushes whose own friction it is not told, as with pushes that are held out."""
    pushes = tuple(replace(push, friction_factor=1.0) for push in scene.pushes)
    expected = [motion.poses for motion in simulate(replace(scene, pushes=pushes), effects)]
    noise = scene.noise
    deviations = np.array([noise.position, noise.position, noise.rotation])
    return floor_of(recording.pushes, expected, scene.rate, deviations)


def _lags(effects: Sequence[Effect]) -> bool:
    return any(effect.name == "actuator_lag" for effect in effects)


# -------------------------------------------------------------------------------------------------- effects' strength


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


def _loaded(scene: Scene, effects: Sequence[Effect]) -> bool:
    """Whether every foot carries weight with both of two effects, each of which leaves it some."""
    if len(effects) < 2:
        return True
    return stays_loaded(functools.reduce(lambda plan, effect: effect.build(plan), effects, scene.plan))


def stands(scene: Scene, effects: Sequence[Effect], seconds: float = 0.2) -> bool:
    """Whether the object rests where each push begins: effects may drag it away."""
    world = PushWorld(scene.plan, effects, pushes=len(scene.pushes))
    for k, push in enumerate(scene.pushes):
        motion = world.run(push.pose, None, push=k, friction_factor=push.friction_factor, duration=seconds)
        if float(np.linalg.norm(motion.true_poses[-1, :2] - np.array(push.pose[:2]))) > STILL:
            return False
    return True


def _draw_effects(rng: Rng, scene: Scene, names: Sequence[str]) -> tuple[list[Effect], list[float]]:
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
        size = _difference(scene, simulate(scene, (knob.at(strength),), which), plain)
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


def _difference(scene: Scene, motions: Sequence[Motion], plain: Sequence[Motion]) -> float:
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


def _truth(
    drawn: DrawnWorld, seed: int, size: float, motions: Sequence[Motion], poses: Sequence[Array]
) -> dict[str, object]:
    scene, plan, noise = drawn.scene, drawn.scene.plan, drawn.scene.noise
    return {
        "seed": seed,
        "index": drawn.chosen.index,
        "kind": drawn.chosen.kind,
        "effects": [
            {"name": effect.name, "parameters": parameters_of(effect), "calibrated_size_sigma": part}
            for effect, part in zip(drawn.effects, drawn.sizes, strict=True)
        ],
        "size_sigma": size,
        "theta": {
            "mass": plan.mass,
            "support_friction": plan.support_friction,
            "hand_friction": plan.hand_friction,
            "restitution": RESIDUAL_RESTITUTION,
        },
        "noise": asdict(noise),
        "rate_hz": scene.rate,
        "friction_factors": [push.friction_factor for push in scene.pushes],
        "rested": [motion.rested for motion in motions],
        "noise_free_poses": {f"pushes/{k + 1:03d}.csv": np.round(rows, 8).tolist() for k, rows in enumerate(poses)},
    }


# -------------------------------------------------------------------------------------------------------- the folder


def make(
    out: Path,
    worlds: int,
    seed: int | None = None,
    kind: Kind | None = None,
    effect: str | None = None,
    jobs: int = 1,
    *,
    names_by_seed: bool = False,
) -> str:
    """Writes ``worlds`` worlds and their seal; returns the seal's SHA-256. Worlds that exist are skipped.

    Args:
        out: folder for ``recordings``, ``sealed`` and the seal; new, empty, or of the same settings.
        worlds: how many.
        seed: of all of them; None: as the folder has it, or any.
        kind: only this kind; None: the mix.
        effect: only this effect.
        jobs: processes.
        names_by_seed: name them by their seed, which is for opened seeds.

    Raises:
        ConfigError: if the folder holds something else.
        ProofError: if it is not as it was left.
        OutputError: if it cannot be written.
    """
    folder = RunFolder.begin(out, COMMAND)
    for name in (f"{RECORDINGS}/", f"{SEALED}/", LINES, TOTAL):
        folder.own(name)
    secret = keep_secret(out, seed, kind, effect, by_seed=names_by_seed)
    names = secret.names(worlds)
    missing = [index for index, name in enumerate(names) if not _exists(out, name)]
    begin = time.monotonic()
    for done, identity in enumerate(_made(out, missing, secret, jobs), start=1):
        left = (time.monotonic() - begin) / done * (len(missing) - done)
        print(f"{identity}  {done}/{len(missing)}  {left:.0f} s left", file=sys.stderr, flush=True)
    return write_seal(out, names)


def _exists(out: Path, identity: str) -> bool:
    return (out / SEALED / f"{identity}.json").is_file() and (out / RECORDINGS / identity).is_dir()


def _made(out: Path, indices: Sequence[int], secret: Secret, jobs: int) -> Iterator[str]:
    if jobs <= 1 or len(indices) <= 1:
        yield from (_write_world(out, index, secret) for index in indices)
        return
    write = functools.partial(_write_world, out, secret=secret)
    yield from (identity for _, identity in in_processes(write, indices, jobs))


def _write_world(out: Path, index: int, secret: Secret) -> str:
    """Writes one world, the truth last and at once, so that what was interrupted is made again.

    Raises:
        ProofError: if something lies where its recording goes that was not begun by such an interrupted making.
        OutputError: if it cannot be written.
    """
    name = secret.name_of(index)
    recording, truth = make_world(index, secret.seed, kind_of(secret), secret.effect, name)
    folder, sealed = out / RECORDINGS / name, out / SEALED / f"{name}.json"
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise ProofError(f"'{folder}': must be a folder, or nothing yet; move it away.")
    if folder.exists():  # without its truth, or it would not be made: what an interrupted making began
        shutil.rmtree(folder)
    write_recording(recording, folder)
    truth[RECORDING] = files_digest(folder)
    write_whole(sealed, (json.dumps(truth, sort_keys=True) + "\n").encode("utf-8"))
    return name


def kind_of(secret: Secret) -> Kind | None:
    """The kind of a proof's worlds; None for the mix.

    Raises:
        ProofError: if there is no such kind.
    """
    for kind in KINDS:
        if secret.kind == kind:
            return kind
    if secret.kind is not None:
        raise ProofError(f"no worlds are of kind '{secret.kind}'; there are {', '.join(KINDS)}.")
    return None


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m physid_drake.validation.worlds.make", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--worlds", type=int, default=20)
    parser.add_argument("--seed", type=int, help="of all worlds (default: the folder's, or one that is drawn)")
    parser.add_argument("--out", type=Path, required=True, help="new, empty, or of the same settings")
    parser.add_argument("--kind", choices=KINDS, help="only this kind, instead of the mix")
    parser.add_argument("--effect", choices=[*CATALOGUED, *OTHERS], help="only this effect")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--names-by-seed", action="store_true", help="as they once were: for opened seeds only")
    given = parser.parse_args(arguments)
    try:
        for name, value, least in (("seed", given.seed, 0), ("worlds", given.worlds, 1), ("jobs", given.jobs, 1)):
            if value is not None and value < least:
                raise ConfigError(f"--{name} must be at least {least}, but is {value}.")
        seal = make(
            given.out, given.worlds, given.seed, given.kind, given.effect, given.jobs,
            names_by_seed=given.names_by_seed,
        )  # fmt: skip
    except PhysidError as error:
        print("error: " + " ".join(str(error).split()), file=sys.stderr)
        return 1
    print(f"seal  sha256 {seal}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
