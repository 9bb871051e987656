"""Published sources, in the three layouts that are converted."""

from __future__ import annotations

import io
from contextlib import suppress
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from fuzz import seeds
from fuzz.case import Case
from fuzz.damage import damaged, replaced
from fuzz.folders import changed_arrays
from fuzz.reading import look_at
from fuzz.trees import json_text, mutated
from physid_drake.recording.adapters import convert_cmu, convert_cube, convert_mit

RAW = "motion_surface=abs_shape=rect1_a=0_v=20_i=1.000_s=0.500_t=0.000"
NAMES = ("abs_rect1_v10.csv", "abs_rect1_v0.csv", "abs_butter_v10.csv", "x.csv",
         "abs_rect1_v" + "9" * 300 + ".csv", "abs_ellip1_v20.csv",
         "plywood_hex_v1.csv", "abs_tri3_v10.csv")  # fmt: skip
LINES = ("nan", "inf", "1e308", "-1", "x", "", "0", "1e400", "9" * 30, "1_0", "1 2 3", "3.5", "100000000")


def make(rng: Random, folder: Path) -> Case:
    """A source that is converted, and the recording that it becomes."""
    (folder / "s").mkdir()
    convert, file = rng.choice((_cube, _log, _raw, _hdf5, _end_points))(rng, folder / "s")
    if rng.random() < 0.03:
        replaced(rng, file)
    source = file if rng.random() < 0.5 else folder / "s"
    return Case(
        partial(
            _convert, convert, source, folder / "converted", rng.choice((None, None, 1, 0, -1, 100)), folder / "again"
        )
    )


def _convert(convert: Any, source: Path, out: Path, limit: int | None, again: Path) -> None:
    look_at(convert(source, out, limit=limit, seed=0), again)


def _cube(rng: Random, folder: Path) -> tuple[Any, Path]:
    arrays = seeds.tosses()
    what = rng.random()
    if what < 0.7:
        arrays = changed_arrays(rng, arrays)
    elif what < 0.8:
        arrays["traj"][rng.randrange(100), rng.randrange(13)] = rng.choice(
            (np.nan, np.inf, 1e300, -1.0, 1e6, 0.0, 1e-300)
        )
    elif what < 0.85:
        arrays["traj"][:, rng.randrange(13)] *= rng.choice((1e300, 0.0, -1.0, 1e-300, 1e5))
    content = seeds.npz(arrays, packed=rng.random() < 0.3)
    file = folder / "contactnets_all.npz"
    file.write_bytes(damaged(rng, content) if what > 0.85 else content)
    return convert_cube, file


def _log(rng: Random, folder: Path) -> tuple[Any, Path]:
    rows = [line.split() for line in seeds.log().decode().splitlines()]
    for _ in range(rng.choice((0, 1, 1, 2, 5))):
        row = rng.choice(rows)
        match rng.randrange(6):
            case 0 | 1:
                if row:
                    row[rng.randrange(len(row))] = rng.choice(LINES)
            case 2:
                rows.remove(row)
            case 3:
                rows.insert(rng.randrange(len(rows)), list(row))
            case 4:
                column = rng.randrange(8)
                factor = rng.choice((0.0, -1.0, 1e3, 1e-3, 1e300))
                for one in rows[3:]:
                    with suppress(ValueError, IndexError):
                        one[column] = repr(float(one[column]) * factor)
            case _:
                rows.extend([list(one) for one in rows[1:]])
        if not rows:
            break
    content = ("\n".join(map(" ".join, rows)) + "\n").encode()
    file = folder / "exp.txt"
    file.write_bytes(damaged(rng, content) if rng.random() < 0.2 else content)
    return convert_cmu, file


def _raw(rng: Random, folder: Path) -> tuple[Any, Path]:
    content = json_text(_streams(rng) if rng.random() < 0.5 else mutated(rng, seeds.raw_push(), "json"))
    file = folder / f"{RAW}.json"
    coded = content.encode("utf-8", "surrogatepass")
    file.write_bytes(damaged(rng, coded) if rng.random() < 0.2 else coded)
    return convert_mit, file


def _streams(rng: Random) -> dict[str, Any]:
    """The three streams, with numbers of another size or order."""
    streams = {key: np.array(rows) for key, rows in seeds.raw_push().items()}
    for _ in range(rng.choice((0, 1, 2))):
        rows = streams[rng.choice(list(streams))]
        column = rng.randrange(4)
        match rng.randrange(5):
            case 0:
                rows[:, column] *= rng.choice((0.0, -1.0, 1e3, 1e-3, 1e300, 1e-300, 1e6))
            case 1:
                rows[rng.randrange(40), column] = rng.choice((np.nan, np.inf, 1e308, 0.0, -1.0, 1e9))
            case 2:
                rows[:, column] = rng.choice((0.0, 1.0, np.nan, 1e300))
            case 3:
                rows[:, column] = rows[::-1, column].copy()
            case _:
                rows[rng.randrange(40) :, 0] += rng.choice((1.0, 100.0, 1e9, 1e300))
    return {key: [[_number(value) for value in row] for row in rows.tolist()] for key, rows in streams.items()}


def _number(value: float) -> Any:
    return value


def _hdf5(rng: Random, folder: Path) -> tuple[Any, Path]:
    import h5py

    file = folder / f"{RAW}.h5"
    stream = io.BytesIO()
    with h5py.File(stream, "w") as made:
        for key, rows in _streams(rng).items():
            match rng.randrange(14):
                case 0:
                    made[key] = h5py.ExternalLink("../secret.txt", "/x")
                case 1:
                    made[key] = h5py.SoftLink(rng.choice(("/tip_pose", "/nothing", f"/{key}")))
                case 2:
                    made.create_group(key)
                case 3:
                    made.create_dataset(
                        key, shape=(40, 4), dtype="f8", external=[("../secret.txt", 0, h5py.h5f.UNLIMITED)]
                    )
                case 4:
                    made.create_dataset(
                        key, shape=(rng.choice((10**6, 10**12)), 4), dtype="f8", chunks=(64, 4), compression="gzip"
                    )
                case 5:
                    made[key] = np.array(rows).astype(rng.choice(("S10", "i4", "f2", "c16", "bool", "u1")))
                case 6:
                    made[key] = rng.choice(
                        (np.zeros(4), np.zeros((0, 4)), np.zeros((3, 4)), np.zeros((2, 2, 4)), np.float64(3.0))
                    )
                case 7:
                    made[key] = h5py.Empty("f8")
                case _:
                    made[key] = np.array(rows)
    content = stream.getvalue()
    file.write_bytes(damaged(rng, content) if rng.random() < 0.4 else content)
    return convert_mit, file


def _end_points(rng: Random, folder: Path) -> tuple[Any, Path]:
    rows = [line.split(",") for line in seeds.END_POINTS.splitlines()]
    for _ in range(rng.choice((0, 1, 1, 3))):
        row = rng.choice(rows)
        row[rng.randrange(len(row))] = rng.choice((*LINES, '"', "1e5", "1e150", "-1e300", "3.2"))
    content = ("\n".join(map(",".join, rows)) + "\n").encode()
    file = folder / (NAMES[0] if rng.random() < 0.7 else rng.choice(NAMES))
    if len(file.name) > 250:
        file = file.with_name("abs_rect1_v" + "9" * 200 + ".csv")
    file.write_bytes(damaged(rng, content) if rng.random() < 0.2 else content)
    return convert_mit, file
