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
import shutil
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from physid_drake.errors import ConfigError, PhysidError, ProofError
from physid_drake.processes import in_processes
from physid_drake.recording import Recording, write_recording
from physid_drake.run_folder import RunFolder
from physid_drake.validation.sealing.seal import LINES, RECORDING, SEALED, TOTAL, files_digest, write_seal
from physid_drake.validation.sealing.secret import Secret, keep_secret, name_by_seed
from physid_drake.validation.worlds.contact import RESIDUAL_RESTITUTION
from physid_drake.validation.worlds.effects.catalogue import CATALOGUED, OTHERS
from physid_drake.validation.worlds.effects.effect import Effect, parameters_of
from physid_drake.validation.worlds.floor import floor_of
from physid_drake.validation.worlds.mix import KINDS, Assignment, Kind, assign
from physid_drake.validation.worlds.scene import Rng, Scene, draw_scene
from physid_drake.validation.worlds.sensing import record, recording_of
from physid_drake.validation.worlds.shapes import Array
from physid_drake.validation.worlds.strengths import difference, draw_effects, loaded, simulate, stands
from physid_drake.validation.worlds.world_plan import Motion
from physid_drake.whole_files import write_whole

COMMAND: Final = "prove"
"""Whose the folder is, also one that is made by hand."""
RECORDINGS: Final = "recordings"
SMALLEST_SIZE: Final = 1.0
"""A world whose effect cannot reach this within its bounds is drawn anew, a few times."""
_ATTEMPTS: Final = 4


@dataclass(frozen=True, kw_only=True)
class DrawnWorld:
    """What a world is made of: what it was to be, its scene, its effects, and the size of each [sigmas]."""

    chosen: Assignment
    scene: Scene
    effects: tuple[Effect, ...]
    sizes: tuple[float, ...]


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
    size = difference(scene, motions, simulate(scene, ())) if effects else 0.0
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
        effects, sizes = draw_effects(rng, scene, chosen.effects)
        if all(size >= SMALLEST_SIZE for size in sizes) and loaded(scene, effects) and stands(scene, effects):
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
