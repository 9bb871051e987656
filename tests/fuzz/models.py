"""``model.yaml``: what it says changed value by value, with every effect and shape, read as ``plan`` reads it."""

from __future__ import annotations

import argparse
import dataclasses as dc
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

from fuzz import seeds
from fuzz.case import Case, WrongError
from fuzz.damage import damaged, replaced
from fuzz.trees import mutated, yaml_text
from physid_drake.effects.catalogue import SHIPPED
from physid_drake.model_reading import load_model
from physid_drake.run_plan import _read

SHAPES: tuple[dict[str, Any], ...] = (
    {"shape": "box", "size": [0.127, 0.051, 0.03]},
    {"shape": "cylinder", "radius": 0.04, "length": 0.03, "axis": "z"},
    {"shape": "cylinder", "radius": 0.015, "length": 0.08, "axis": "y"},
    {"shape": "prism", "polygon": [[-0.05, -0.03], [0.07, -0.03], [-0.02, 0.06]], "height": 0.03},
    {"shape": "mesh", "file": "cube.obj", "scale": 1.0},
)
FILES = (
    "../secret.obj",
    "../secret.txt",
    "/etc/passwd",
    "/dev/zero",
    "",
    "x" * 5000,
    "pipe.obj",
    "cube.obj/",
    "a.stl",
)


def make(rng: Random, folder: Path) -> Case:
    """A model that is read, and sometimes built."""
    import os

    tree = {**seeds.model(), "object": dict(rng.choice(SHAPES))}
    if rng.random() < 0.5:
        tree["effects"] = [_effect(kind) for kind in rng.sample(SHIPPED, rng.choice((1, 2)))]
        tree["intervals"] = {}
    if rng.random() < 0.3:
        names = ["theta.support_friction", "theta.hand_friction"]
        tree["intervals"] = {name: [0.2, 0.3] for name in names}
        tree["correlation"] = {"names": names, "matrix": [[1.0, 0.5], [0.5, 1.0]]}
        tree |= {"hand_axes": [[1.0, 0.0], [0.0, 1.0]], "tip_height_m": 0.015, "contact_height_m": 0.012,
                 "top_speed_mps": 0.2}  # fmt: skip
    if rng.random() < 0.3:
        tree["cell"] = {**tree["cell"], "contact": {**tree["cell"]["contact"], "model": "hydroelastic"}}
    what = rng.random()
    if what < 0.8:
        complete = tree.pop("complete")
        tree = mutated(rng, tree, "yaml")
        if isinstance(tree, dict) and rng.random() < 0.97:
            tree = {**tree, "complete": complete}
    if what > 0.9 and isinstance(tree.get("object"), dict):
        tree["object"] = {"shape": "mesh", "file": rng.choice(FILES), "scale": rng.choice((1.0, 1e-3, 1e300))}
    content = yaml_text(tree).encode("utf-8", "surrogatepass")
    if what > 0.8 and rng.random() < 0.5:
        content = damaged(rng, content)
    seeds.lay(folder, {"run/model.yaml": content, "run/cube.obj": seeds.CUBE.encode()})
    os.mkfifo(folder / "run/pipe.obj")
    if rng.random() < 0.02:
        replaced(rng, folder / "run/model.yaml")
    build = rng.random() < 0.2
    # A model names its mesh where the recording has it, wherever that is.
    return Case(partial(_use, folder / "run", build), may_read=(folder.parent / "secret.obj",))


def _effect(kind: Any) -> dict[str, Any]:
    values = {field.name: field.default for field in dc.fields(kind)}
    return {"name": kind.name, "parameters": {
        name: [list(row) for row in value] if isinstance(value, tuple) else value for name, value in values.items()
    }}  # fmt: skip


def _use(run: Path, build: bool) -> None:
    model, _ = _read(argparse.Namespace(run_folder=run, model=None))
    model.baseline()
    text = model.dump()
    Path("again.yaml").write_text(text, encoding="utf-8")
    if load_model("again.yaml").dump() != text:
        raise WrongError("a model that was written is another when it is read")
    if build:
        model.build()
