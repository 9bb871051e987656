"""Configurations: a file of scenarios or a line of ``--set``, changed value by value or damaged."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from random import Random
from typing import Any

from fuzz import seeds
from fuzz.case import Case, WrongError
from fuzz.damage import damaged, replaced
from fuzz.trees import json_text, mutated, yaml_text
from physid_drake.scenario import config_folders, dump_scenario, load_scenario

MORE: dict[str, Any] = {
    "cell": {"contact": {"model": "hydroelastic", "support_points": 36, "stiction_tolerance_mps": 1e-4},
             "solver": {"scheme": "cenic", "time_step_s": 0.001}, "friction_cells": [2, 3]},
    "theta": {"parameters": ["support_friction", "mass"], "bounds": {"mass": [0.01, 1.0]}, "nominal": {"mass": 0.05}},
    "search": {"method": "greedy_entropy", "candidates": 32, "budget": 20, "batch": 2, "jobs": 1, "online": False},
    "plan": {"policy": "push", "goal_m": [0.3, 0.0], "start_m": [0.0, 0.0], "start_deg": 10.0, "tolerance_m": 0.01,
             "budget": 24, "sweep": 5, "draws": 4},
    "seed": 3, "pushes": 12, "recording": "eraser_reference",
}  # fmt: skip
WORDS = ("", ":", "a:", ":a", "x", "../secret.txt", "/dev/zero", "x" * 5000, "a\0b", "eraser", "sealed",
         "sealed.yaml:sealed",
         "pipe.yaml", ".", "eraser.yaml:" + "x" * 3000, "::", "~", "c.yaml:other", "c.yaml:\x1b[2J")  # fmt: skip


def make(rng: Random, folder: Path) -> Case:
    """A scenario that is read, written and read again."""
    import os

    name = rng.choice(list(seeds.configurations()))
    tree = {**seeds.configurations()[name], "all": MORE}
    override = None
    what = rng.random()
    if what < 0.55:
        one = rng.choice(list(tree))
        tree = {**tree, one: mutated(rng, tree[one], "yaml")} if rng.random() < 0.8 else mutated(rng, tree, "yaml")
        scenario = one
    else:
        scenario = rng.choice(list(tree))
    content = yaml_text(tree).encode("utf-8", "surrogatepass")
    if what > 0.8:
        content = damaged(rng, content)
    elif what > 0.55:
        override = json_text(mutated(rng, {rng.choice(list(MORE)): MORE[rng.choice(list(MORE))], **MORE}, "yaml"))
        if rng.random() < 0.3:
            override = damaged(rng, override.encode("utf-8", "surrogatepass")).decode("utf-8", "surrogateescape")
    (folder / "c.yaml").write_bytes(content)
    os.mkfifo(folder / "pipe.yaml")
    if rng.random() < 0.03:
        replaced(rng, folder / "c.yaml")
    given = rng.choice(("c.yaml", f"c.yaml:{scenario}", f"c.yaml:{scenario}", f"{folder / 'c.yaml'}:{scenario}"))
    if rng.random() < 0.05:
        given = rng.choice(WORDS)
    return Case(partial(_read, given, override), may_read=(folder.parent / "secret.txt",))


def _read(given: str, override: str | None) -> None:
    name, scenario = load_scenario(given, override)
    config_folders(given)
    text = dump_scenario(name, scenario)
    Path("again.yaml").write_text(text, encoding="utf-8")
    other, again = load_scenario(f"again.yaml:{name}" if ":" not in name else "again.yaml", None)
    if dump_scenario(other, again) != text:
        raise WrongError("a scenario that was written is another when it is read")
