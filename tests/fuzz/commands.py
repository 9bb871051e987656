"""Command lines: flags and words that nobody means, in process; what would compute is taken out."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from random import Random
from typing import NoReturn
from unittest import mock

from fuzz import seeds
from fuzz.case import Case, RefusedError, WrongError
from fuzz.damage import damaged
from fuzz.judge import FOREIGN
from fuzz.trees import mutated, yaml_text
from physid_drake import cli, run_cell, run_diagnose, run_inspect, run_plan
from physid_drake.errors import ConfigError
from physid_drake.validation import run_experiment, run_prove, run_prove_real

NUMBERS = ("0", "1", "-1", "3", "1.5", "nan", "inf", "-inf", "1e308", "1e400", "9" * 30, "9" * 5000, "x", "",
           "0x1", "1_0", "-1e-1",
           "\u0661", " 1 ", "1e-320", "007", "2147483648", "18446744073709551616")  # fmt: skip
PATHS = ("r", "r/", "./r", "new", "new/deep/er", "file.txt", "file.txt/x", "full", "run", "", ".", "..",
         "/dev/null", "a\0b", "x" * 300,
         "x/" * 3000, "\x1b[2J", "loop", "pipe", "r/recording.yaml", "-", "--", "\udcff", "*", "~", "file.png",
         "new.png",
         "new.svg", "new.exe", "r/pushes", "gone")  # fmt: skip
WORDS = ("eraser", "sealed", "table_tilt", "x", "", "mass", "\u202e", "x" * 3000, "push_speed", "random",
         "motion_prediction",
         "mit_pushes", "none", "cmu", "[red]", "\x1b[2J", "{}", "{search: {budget: 0}}", "{x: 1}", "[", "point",
         "127.0.0.1")  # fmt: skip
FLAGS = {
    "inspect": ("--out", "--no-fit"),
    "convert": ("--limit", "--seed", "--map", "--guess"),
    "diagnose": ("--out", "--seed", "--alpha", "--effects", "--contact", "--time-step", "--pushes", "--jobs"),
    "plan": ("--goal", "--start", "--policy", "--model", "--baseline", "--speed", "--direction", "--travel",
    "--tolerance",
             "--search", "--budget", "--draws", "--risk", "--seed", "--out"),
    "prove": ("--worlds", "--quick", "--seed", "--out", "--kind", "--jobs", "--timeout", "--retry", "--open",
    "--real", "--only",
              "--pushes"),
    "experiment": ("--quick", "--data", "--jobs", "--seed", "--out"),
    "run_cell": ("--recording", "--out", "--seed", "--set", "--no-diagnosis", "--no-plan", "--no-view", "--host"),
}  # fmt: skip
PLACED = ("--out", "--map", "--model", "--data", "--recording", "--real")
WORDY = ("--policy", "--search", "--effects", "--contact", "--kind", "--only", "--host", "--set")
COUNTS = {"--goal": 2, "--start": 3}
BARE = (
    "--no-fit",
    "--guess",
    "--baseline",
    "--quick",
    "--retry",
    "--open",
    "--risk",
    "--no-diagnosis",
    "--no-plan",
    "--no-view",
)
STATUSES = (0, 1, 2, 130)
DONE = "all that can be refused was not"


def make(rng: Random, folder: Path) -> Case:
    """One command among files and folders of all sorts."""
    _surroundings(rng, folder)
    command = rng.choice((*FLAGS, "inspect", "convert", "plan", "nothing"))
    return Case(partial(_call, command, _words(rng, command)), may_change=("new.png", "new"),
                may_read=(folder.parent, folder.parent / "secret.txt"))  # fmt: skip


def _surroundings(rng: Random, folder: Path) -> None:
    files = {f"r/{name}": content for name, content in seeds.recording().items()}
    if rng.random() < 0.3:
        files["r/recording.yaml"] = damaged(rng, files["r/recording.yaml"])
    model = mutated(rng, seeds.model(), "yaml") if rng.random() < 0.5 else seeds.model()
    files |= {"run/model.yaml": yaml_text(model).encode("utf-8", "surrogatepass"), "full/x": b"x", "file.txt": b"x",
              "file.png": b"not ours", "s/exp.txt": seeds.log()}  # fmt: skip
    seeds.lay(folder, files)
    (folder / "loop").symlink_to("loop")
    (folder / "gone").symlink_to("not there")
    os.mkfifo(folder / "pipe")


def _words(rng: Random, command: str) -> list[str]:
    usual = {
        "inspect": ["r"], "convert": ["cmu", "s", "new"], "diagnose": ["r"], "plan": ["run", "--goal", "0.2", "0"],
        "prove": ["--out", "new"], "experiment": ["motion_prediction"], "run_cell": ["--recording", "r", "--no-view"],
    }.get(command, [])  # fmt: skip
    words = list(usual)
    for _ in range(rng.choice((0, 1, 1, 2, 4))):
        flag = rng.choice((*FLAGS.get(command, ("--x",)), *(("--help", "--nothing") if rng.random() < 0.1 else ())))
        words[rng.choice((0, len(words))) : 0] = [flag, *_values(rng, flag)]
    for _ in range(rng.choice((0, 0, 0, 1))):
        if words:
            words[rng.randrange(len(words))] = rng.choice(rng.choice((NUMBERS, PATHS, WORDS)))
    if rng.random() < 0.1:
        rng.shuffle(words)
    return words


def _values(rng: Random, flag: str) -> list[str]:
    """What stands behind a flag: as many as it takes, and of its kind, most times."""
    if flag in BARE:
        return []
    count = COUNTS.get(flag, 1) if rng.random() < 0.9 else rng.choice((0, 1, 2, 4))
    kind = PATHS if flag in PLACED else WORDS if flag in WORDY else NUMBERS
    return [rng.choice(kind if rng.random() < 0.85 else rng.choice((NUMBERS, PATHS, WORDS))) for _ in range(count)]


def _call(command: str, words: list[str]) -> None:
    out, errors = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    with _nothing_computed(), mock.patch.object(sys, "stdout", out), mock.patch.object(sys, "stderr", errors):
        try:
            status = run_cell.main(words) if command == "run_cell" else cli.main([command, *words])
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 99
    said = errors.buffer.getvalue().decode("utf-8", "replace")
    _check(status, said)
    if status != 0 and DONE not in said:
        raise RefusedError(said.strip().splitlines()[-1])


def _check(status: int, said: str) -> None:
    if status not in STATUSES:
        raise WrongError(f"exit status {status}: {said[-300:]}")
    if "Traceback" in said or FOREIGN.search(said):
        raise WrongError(f"what is said is not meant for a person: {said[-500:]}")
    if status == 0:
        return
    lines = [line for line in said.splitlines() if "error: " in line]
    if status in (1, 2) and (len(lines) != 1 or not said.strip().splitlines()[-1] == lines[0].strip()):
        raise WrongError(f"status {status} without one last line that says why: {said[-500:]!r}")


@contextmanager
def _nothing_computed() -> Iterator[None]:
    def stop(*_: object, **__: object) -> NoReturn:
        raise ConfigError(f"{DONE}.")

    taken_out = (
        (run_diagnose, "case_of"), (run_inspect, "examined"),
        (run_cell, "_identifier"), (run_plan, "plan"), (run_prove, "_make"),
        (run_prove, "diagnose_worlds"), (run_prove_real, "prepare"), (run_experiment, "run_all"),
    )  # fmt: skip
    with ExitStack() as stack:
        for module, name in taken_out:
            stack.enter_context(mock.patch.object(module, name, stop))
        yield
