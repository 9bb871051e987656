"""Foreign logs: tables and bags in the layouts of others, with damaged bytes, odd fields, and maps that are wrong."""

from __future__ import annotations

import importlib.util
import tempfile
import warnings
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from random import Random
from typing import Any

import foreign
import yaml

from fuzz import seeds
from fuzz.case import Case
from fuzz.damage import damaged, replaced
from fuzz.reading import look_at
from fuzz.trees import mutated, yaml_text
from physid_drake.convert import convert_bag, convert_table, guess_map

Writer = Callable[[Any, Path], str]
TABLES: dict[str, tuple[Writer, str]] = {
    "take.csv": (foreign.motive, ""), "vicon.csv": (foreign.vicon, ""), "versuche.csv": (foreign.german, ""),
    "unity": (foreign.unity, ""), "rows.csv": (foreign.rulers, ""), "tracks": (foreign.video, ""),
    "padded.npz": (foreign.padded_npz, ""), "demos.h5": (foreign.demonstrations, "h5py"),
    "data.parquet": (foreign.lerobot, "pyarrow"),
}  # fmt: skip
BAGS: dict[str, tuple[Writer, str]] = {
    "mcap": (foreign.mcap, "rosbags"), "sqlite3": (partial(foreign.mcap, storage="sqlite3"), "rosbags"),
    "pushes.bag": (foreign.ros1, "rosbags"),
}  # fmt: skip
FIELDS = ("nan", "inf", "-inf", "1e308", "-1", "x", "", "0", "1e400", "9" * 400, "1_0", "1,5", "1.000,5", "\u0661",
          '"', "NULL", "--", "1e-320", "0x1", "true")  # fmt: skip


def make(rng: Random, folder: Path) -> Case:
    """A log that is converted, or looked at for a first map."""
    kinds = {name: one for name, one in {**TABLES, **BAGS}.items() if not one[1] or importlib.util.find_spec(one[1])}
    name = rng.choice(list(kinds))
    files, chart = _written(name)
    changed = dict(files)
    what = rng.random()
    if what < 0.55:
        victim = rng.choice(list(changed))
        text = victim.endswith((".csv", ".txt")) and rng.random() < 0.6
        changed[victim] = _other_fields(rng, changed[victim]) if text else damaged(rng, changed[victim])
    if what > 0.45:
        chart = _other_map(rng, chart)
    seeds.lay(folder / "s", changed)
    (folder / "map.yaml").write_bytes(chart)
    if rng.random() < 0.03:
        replaced(rng, rng.choice([folder / "map.yaml", *((folder / "s" / one) for one in changed)]))
    convert = convert_bag if name in BAGS else convert_table
    if rng.random() < 0.2:
        return Case(partial(guess_map, folder / "s" / name))
    return Case(partial(_convert, convert, folder / "s" / name, folder))


def _convert(convert: Any, source: Path, folder: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        recording = convert(source, folder / "converted", folder / "map.yaml")
    look_at(recording, folder / "again")


@cache
def _written(name: str) -> tuple[seeds.Files, bytes]:
    """The files of a log of two short pushes, and its map."""
    writer = {**TABLES, **BAGS}[name][0]
    with tempfile.TemporaryDirectory() as scratch:
        chart = writer(seeds.read_small(), Path(scratch) / name)
        found = {
            str(file.relative_to(scratch)): file.read_bytes() for file in Path(scratch).rglob("*") if file.is_file()
        }
    return found, chart.encode()


def _other_fields(rng: Random, content: bytes) -> bytes:
    lines = content.split(b"\n")
    for _ in range(rng.choice((1, 1, 3, 20))):
        at = rng.randrange(len(lines))
        fields = lines[at].split(b",")
        fields[rng.randrange(len(fields))] = rng.choice(FIELDS).encode()
        lines[at] = b",".join(fields)
    return b"\n".join(lines)


def _other_map(rng: Random, chart: bytes) -> bytes:
    if rng.random() < 0.3:
        return damaged(rng, chart)
    tree = yaml.safe_load(chart)
    for _ in range(rng.choice((1, 1, 2))):
        tree = mutated(rng, tree, "yaml")
    return yaml_text(tree).encode("utf-8", "surrogatepass")
