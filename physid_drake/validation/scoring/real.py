"""Recordings of others' robots as tests of the diagnosis: what is taken of them, and what is held back.

A recording gets a neutral name, and the diagnosis cannot look into the folder it came from: there, names of folders
are answers.
"""

from __future__ import annotations

import hashlib
import shutil
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from physid_drake.errors import PhysidError
from physid_drake.npz import read_arrays
from physid_drake.recording import Recording, read_recording, write_recording
from physid_drake.recording.adapters import convert_cmu, convert_cube, convert_mit

PUSHES: Final = 20
"""Pushes that are diagnosed."""
FRESH: Final = 8
"""Pushes that are drawn with them and that the diagnosis does not get; a quarter where there are few."""
CMU: Final = ("patch", "30_90_30_30_30_90", "10_130_10_10_10_130", "30_63.33_43.33_30_43.33_63.33")
MIT_SHAPES: Final = ("rect1", "rect2", "rect3", "tri1", "tri2", "tri3", "ellip1", "ellip2", "ellip3", "hex", "butter")
SQUARE: Final = "square_drops"
_LEAN: Final = np.deg2rad(1.0)
_CLIMB: Final = 1e-3  # m
_WAY: Final = 0.03  # m that a slide must go to be worth a diagnosis

Converter = Callable[..., Recording]


@dataclass(frozen=True, kw_only=True)
class RealCase:
    """A recording that others made.

    Attributes:
        name: by which a person chooses it; it may hold the answer.
        group: ``cmu``, ``mit``, ``cube`` or ``square``.
        source: within the folder of all published files.
        convert: makes a recording of it; None where the format cannot carry it.
    """

    name: str
    group: str
    source: str
    convert: Converter | None

    @property
    def id(self) -> str:
        """Eight hex digits that tell nothing."""
        return hashlib.sha256(self.name.encode()).hexdigest()[:8]


CASES: Final = (
    *(RealCase(name=f"cmu_{name}", group="cmu", source=f"cmu_pushes/sensor_log/{name}", convert=convert_cmu)
      for name in CMU),
    *(RealCase(name=f"mit_{shape}_v{speed}", group="mit", source=f"mit_push_endpoints/abs_{shape}_v{speed}.csv",
               convert=convert_mit)
      for shape in MIT_SHAPES for speed in (10, 20)),
    RealCase(name="cube_slides", group="cube", source="contactnets_cube/contactnets_all.npz", convert=convert_cube),
    RealCase(name=SQUARE, group="square", source="square_drops/dice_traj.npz", convert=None),
)  # fmt: skip


def chosen_cases(only: Sequence[str] | None) -> tuple[RealCase, ...]:
    """The cases, or those whose names are given or begin so.

    Raises:
        RealCaseError: if a name fits none.
    """
    if only is None:
        return CASES
    for name in only:
        if not any(case.name.startswith(name) for case in CASES):
            raise RealCaseError(
                f"no real case is named '{name}'; there are {', '.join(case.name for case in CASES)}."
            )
    return tuple(case for case in CASES if any(case.name.startswith(name) for name in only))


class RealCaseError(PhysidError, ValueError):
    """A real case is unknown."""


def prepare(case: RealCase, published: Path, out: Path, *, pushes: int = PUSHES, seed: int = 0) -> str | None:
    """Write ``recordings/<id>`` and, apart from it, the fresh pushes as ``held_out/<id>``, once.

    Args:
        case: what to convert.
        published: folder of all published files.
        out: folder of the proof.
        pushes: how many are diagnosed.
        seed: of the draws.

    Returns:
        Why there is nothing to diagnose; None where there is.
    """
    given, held = out / "recordings" / case.id, out / "held_out" / case.id
    if given.is_dir() and held.is_dir():
        return None
    source = published / case.source
    if not source.exists():
        return "the publisher has no such file, or it is not in this folder"
    if case.convert is None:
        return slides_of_squares(source)
    full = out / "held_out" / f"{case.id}_all"
    parts = full.with_name(f"{case.id}_given"), full.with_name(f"{case.id}_fresh")
    for stale in (given, held, full, *parts):
        shutil.rmtree(stale, ignore_errors=True)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # pushes that cannot be used: the command `convert` says so
            case.convert(source, full, limit=pushes + FRESH, seed=seed)
        _split(read_recording(full), case, *parts, pushes, seed)
        given.parent.mkdir(parents=True, exist_ok=True)
        for part, folder in zip(parts, (given, held), strict=True):
            part.rename(folder)  # whole or not at all: both are there, or both are made again
    except PhysidError as error:
        return str(error)
    finally:
        for part in (full, *parts):
            shutil.rmtree(part, ignore_errors=True)
    return None


def _split(drawn: Recording, case: RealCase, given: Path, held: Path, pushes: int, seed: int) -> None:
    """The pushes that are diagnosed, and the fresh ones; each part keeps its order."""
    order = np.random.default_rng([seed, 1]).permutation(len(drawn.pushes))
    pushes = min(pushes, len(order) - min(FRESH, len(order) // 4))
    for part, folder in ((order[:pushes], given), (order[pushes:], held)):
        if len(part):
            write_recording(replace(drawn.subset(sorted(part.tolist())), name=case.id), folder)
        else:
            folder.mkdir(parents=True)


def slides_of_squares(file: Path) -> str:
    """Why drops of a square between two plates are not diagnosed, with the figures that show it."""
    drops = np.asarray(read_arrays(file)["traj"], dtype=np.float64)
    ways = []
    for drop in drops:
        moves = (np.abs(drop[:, 2] - drop[-1, 2]) > _LEAN) | (np.abs(drop[:, 1] - drop[-1, 1]) > _CLIMB)
        first = int(np.flatnonzero(moves)[-1]) + 1 if moves.any() else 0
        ways.append(abs(drop[-1, 0] - drop[first, 0]))
    return (
        f"{sum(way >= _WAY for way in ways)} of {len(ways)} drops end in a slide of {1e3 * _WAY:g} mm or more (median"
        f" {1e3 * float(np.median(ways)):.2g} mm, longest {1e3 * max(ways):.0f} mm), along a line between two plates"
        " that rub too: place across and yaw, which the format needs, were not measured"
    )
