"""``recording.yaml``: what it says changed value by value, its text damaged, and its files replaced."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from random import Random
from typing import Any

from fuzz import seeds
from fuzz.case import Case
from fuzz.damage import damaged, replaced
from fuzz.reading import inspect
from fuzz.trees import Raw, mutated, yaml_text

NAMES = ("../x", "../secret.csv", "../secret.obj", "../secret.txt", "/etc/passwd", "/dev/zero", "", ".", "..",
         "a\0b", "x" * 5000,
         "pipe.csv", "link.csv", "link.obj", "folder", "folder/", "pushes", "meshes/../../secret.obj",
         "meshes/cube.obj",
         "pushes/001.csv", "./pushes/001.csv", "pushes//002.csv", "loop.csv", "~/x.csv", "C:\\x.csv",
         "pushes/001.csv/x",
         "//etc/passwd", "file:///etc/passwd", "recording.yaml", "\u202egpj.csv", "zeros.csv",
         "pipe.obj")  # fmt: skip


def make(rng: Random, folder: Path) -> Case:
    """A recording whose description is changed."""
    root = folder / "r"
    seeds.lay(root, seeds.recording())
    _traps(root, folder.parent)
    tree = {**seeds.description(), "object": dict(rng.choice(seeds.SHAPES)), "hand": rng.choice(seeds.HANDS)}
    if rng.random() < 0.5:
        tree["object"] |= {"mass_kg": 0.054, "mass_std_kg": 0.0005}
    what = rng.random()
    if what < 0.55:
        tree = mutated(rng, tree, "yaml")
    elif what < 0.75:
        tree = _sized(rng, tree)
    elif what < 0.9:
        tree = _named(rng, tree)
    content = yaml_text(tree).encode("utf-8", "surrogatepass")
    if what > 0.9 or rng.random() < 0.1:
        content = damaged(rng, content)
    (root / "recording.yaml").write_bytes(content)
    if rng.random() < 0.02:
        replaced(rng, root / "recording.yaml")
    given = root / rng.choice(("recording.yaml", "x" * 300, "pushes", "not there")) if rng.random() < 0.01 else root
    return Case(partial(inspect, given, folder / "written", prepared=rng.random() < 0.5))


def _traps(root: Path, beside: Path) -> None:
    """What a name may lead to that is no table."""
    import os

    os.mkfifo(root / "pipe.csv")
    os.mkfifo(root / "pipe.obj")
    (root / "link.csv").symlink_to(beside / "secret.csv")
    (root / "link.obj").symlink_to(beside / "secret.obj")
    (root / "loop.csv").symlink_to("loop.csv")
    (root / "zeros.csv").symlink_to("/dev/zero")
    (root / "folder").mkdir()


def _sized(rng: Random, tree: dict[str, Any]) -> dict[str, Any]:
    """Sizes from atoms to planets, of one thing or of all."""
    factor = 10.0 ** (rng.uniform(-12.0, 12.0) if rng.random() < 0.5 else rng.gauss(0.0, 0.5))
    what = rng.choice(("object", "hand", "table", "sensors"))

    def grown(value: Any) -> Any:
        if isinstance(value, float | int) and not isinstance(value, bool):
            return value * factor if rng.random() < 0.7 else value
        if isinstance(value, list):
            return [grown(one) for one in value]
        return {key: grown(one) for key, one in value.items()} if isinstance(value, dict) else value

    return {**tree, what: grown(tree[what])} if tree.get(what) else tree


def _named(rng: Random, tree: dict[str, Any]) -> dict[str, Any]:
    """Files that are none, lead elsewhere, or are there twice; and texts."""
    name = rng.choice(NAMES)
    match rng.randrange(4):
        case 0:
            return {**tree, "object": {"shape": "mesh", "file": name, "scale": rng.choice((1.0, 1e-3, 1e3))}}
        case 1:
            return {**tree, "pushes": [*tree["pushes"], {"file": name, "note": rng.choice(("", "a\nb", "x" * 2000))}]}
        case 2:
            return {**tree, "pushes": [{"file": name}] * rng.choice((1, 2, 500))}
        case _:
            text = rng.choice(
                ("", "x" * 300, "a\nb", "\x1b[2J", Raw('"\\ud800"'), "..", "a/b", "\u202e", "12345678", "3e8")
            )
            return {**tree, rng.choice(("name", "description")): text}
