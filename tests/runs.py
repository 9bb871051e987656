"""Small, quick runs of the main job: a coarse cell, three of the shipped pushes, two trials."""

import json
from dataclasses import replace
from pathlib import Path

import yaml

from physid_drake import run_cell
from physid_drake.cell import CellConfig, ContactConfig, SolverConfig
from physid_drake.identify import Identifier, SearchConfig
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import Recording, read_recording, write_recording
from physid_drake.resources import shipped

SHIPPED = shipped("recordings") / "eraser_reference"

# A coarse cell: 13 ms for a rollout instead of 34.
COARSE_CONTACT = {"model": "point", "support_points": 9}
COARSE_SOLVER = {"time_step_s": 0.002, "slide_time_step_s": 0.004}
COARSE = CellConfig(contact=ContactConfig(**COARSE_CONTACT), solver=SolverConfig(**COARSE_SOLVER))
QUICK = {
    "cell": {"contact": COARSE_CONTACT, "solver": COARSE_SOLVER},
    "theta": {"parameters": ["support_friction"]},
    "search": {"candidates": 32, "budget": 2, "jobs": 1},
}


def laid_over(base: dict, more: dict) -> dict:
    """The second mapping laid over the first, section by section."""
    return {
        key: laid_over(base.get(key, {}), more[key])
        if isinstance(more.get(key), dict)
        else more.get(key, base.get(key))
        for key in [*base, *(k for k in more if k not in base)]
    }


def shipped_pushes(count: int, name: str = SHIPPED.name) -> Recording:
    return read_recording(SHIPPED.with_name(name)).subset(range(count))


def write_small(folder: Path, count: int = 3, **changes: object) -> Path:
    """Some of the shipped pushes as a folder of their own."""
    write_recording(replace(shipped_pushes(count), **changes), folder)
    return folder


def quick(out: Path, *argv: object, recording: Path, plan_too: bool = False, **overrides: object) -> int:
    """The exit status of a quick run into ``out``; it plans no push unless asked."""
    override = json.dumps(laid_over(QUICK, overrides))
    arguments = ["--recording", recording, "--out", out, "--set", override, "--no-view", "--no-diagnosis", *argv]
    arguments += [] if plan_too else ["--no-plan"]
    return run_cell.main([str(a) for a in arguments])


def coarse_identifier(recording: Recording, **more: object) -> Identifier:
    """An identifier on a coarse cell in this process."""
    given = {
        "cell": COARSE,
        "theta": ThetaConfig(),
        "search": SearchConfig(candidates=32, budget=3, jobs=1),
        "seed": 0,
    }
    return Identifier(recording, **(given | more))


def rewrite_yaml(file: Path, **changes: object) -> None:
    content = yaml.safe_load(file.read_text())
    file.write_text(yaml.safe_dump(content | changes))
