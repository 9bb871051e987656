"""Foreign logs: tables and bags in the layouts of others, with damaged bytes, odd fields, and maps that are wrong.

Some have an object of their own: a mesh of any format, or boxes.
"""

from __future__ import annotations

import importlib.util
import tempfile
import warnings
from functools import cache, partial
from pathlib import Path
from random import Random
from typing import Any

import foreign
import yaml
from foreign.frame_trees import tree

from fuzz import seeds
from fuzz.case import Case
from fuzz.damage import damaged, replaced
from fuzz.reading import look_at
from fuzz.trees import mutated, yaml_text
from physid_drake.convert import convert_bag, convert_table, guess_map

TABLES = foreign.TABLES | {
    "rows.csv": foreign.Log(write=foreign.rulers),
    "tracks": foreign.Log(write=foreign.video),
}
BAGS = foreign.BAGS | {
    "tree": foreign.Log(write=tree, needs="rosbags"),
    "tree.bag": foreign.Log(write=tree, needs="rosbags"),
    "loop": foreign.Log(write=partial(tree, wrong=True), needs="rosbags"),
}
MESHES = ("stl", "obj", "glb", "ply", "off")
FIELDS = ("nan", "inf", "-inf", "1e308", "-1", "x", "", "0", "1e400", "9" * 400, "1_0", "1,5", "1.000,5", "\u0661",
          '"', "NULL", "--", "1e-320", "0x1", "true")  # fmt: skip


def make(rng: Random, folder: Path) -> Case:
    """A log that is converted, or looked at for a first map."""
    logs = {**TABLES, **BAGS}
    name = rng.choice([name for name, log in logs.items() if importlib.util.find_spec(log.needs)])
    files, chart = _written(name)
    changed = dict(files)
    if rng.random() < 0.2:
        more, chart = _other_object(rng, chart)
        changed |= more
    what = rng.random()
    if what < 0.55:
        victim = rng.choice(list(changed))
        text = victim.endswith((".csv", ".txt", ".tsv", ".trc", ".json", ".jsonl")) and rng.random() < 0.6
        changed[victim] = _other_fields(rng, changed[victim]) if text else damaged(rng, changed[victim])
    if what > 0.45:
        chart = _other_map(rng, chart)
    seeds.lay(folder / "s", changed)
    # Beside the files of the log, where a mesh is looked for.
    (folder / "s/map.yaml").write_bytes(chart)
    if rng.random() < 0.03:
        replaced(rng, rng.choice([folder / "s/map.yaml", *((folder / "s" / one) for one in changed)]))
    convert = convert_bag if name in BAGS else convert_table
    if rng.random() < 0.2:
        return Case(partial(guess_map, folder / "s" / name))
    return Case(partial(_convert, convert, folder / "s" / name, folder))


def _convert(convert: Any, source: Path, folder: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        recording = convert(source, folder / "converted", folder / "s/map.yaml")
    look_at(recording, folder / "again")


@cache
def _written(name: str) -> tuple[seeds.Files, bytes]:
    """The files of a log of two short pushes, and its map."""
    writer = {**TABLES, **BAGS}[name].write
    with tempfile.TemporaryDirectory() as scratch:
        chart = writer(seeds.read_small(), Path(scratch) / name)
        found = {
            str(file.relative_to(scratch)): file.read_bytes() for file in Path(scratch).rglob("*") if file.is_file()
        }
    return found, chart.encode()


def _other_object(rng: Random, chart: bytes) -> tuple[seeds.Files, bytes]:
    """A map whose object is a mesh, with its file, or boxes."""
    tree = yaml.safe_load(chart)
    kind = rng.choice(["boxes", *(MESHES if importlib.util.find_spec("trimesh") else [])])
    if kind == "boxes":
        boxes = [{"size": [0.16, 0.04, 0.03], "centre": [0, 0.02, 0.0]},
                 {"size": [0.04, 0.12, 0.03], "centre": [0, -0.06, 0.0], "yaw_deg": 0}]  # fmt: skip
        tree["recording"]["object"] = {"shape": "boxes", "boxes": boxes}
        return {}, yaml_text(tree).encode()
    tree["recording"]["object"] = {"shape": "mesh", "file": f"object.{kind}", "up": rng.choice("zzzy")}
    content = _mesh(kind)
    return {f"object.{kind}": damaged(rng, content) if rng.random() < 0.7 else content}, yaml_text(tree).encode()


@cache
def _mesh(kind: str) -> bytes:
    import trimesh

    content = trimesh.creation.box((0.1, 0.05, 0.04)).export(file_type=kind)
    return content.encode() if isinstance(content, str) else bytes(content)


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
