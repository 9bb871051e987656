"""Runs inputs in a process of its own, begins it again where one ends it, and counts what came of them."""

from __future__ import annotations

import json
import os
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

SILENT: Final = 10.0
"""Seconds after which an input hangs."""
START: Final = 120.0  # s: Drake and the seeds of a busy machine


@dataclass
class Tally:
    """What came of the inputs.

    Attributes:
        counts: by kind and outcome.
        faults: by group, the first example and how many; of ``warnings`` likewise.
        seconds: that all took.
        memory: the most that a process had [bytes].
    """

    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    faults: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    warnings: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    seconds: float = 0.0
    memory: int = 0

    @property
    def inputs(self) -> int:
        return sum(self.counts.values())

    def add(self, said: dict[str, Any]) -> None:
        self.counts[said["kind"], said["outcome"]] += 1
        self.memory = max(self.memory, said.get("memory", 0))
        if said["outcome"] in ("fault", "warning"):
            found = self.faults if said["outcome"] == "fault" else self.warnings
            found.setdefault(f"{said['kind']}: {said['group']}", []).append(said)

    def lines(self) -> list[str]:
        """One for each group of faults and warnings: how many, the first one's index, and its words."""
        return [
            f"{len(said)} x {group} [{said[0]['end']}]: {said[0]['text'][:400]}"
            for found in (self.faults, self.warnings)
            for group, said in sorted(found.items(), key=lambda item: -len(item[1]))
        ]


def run(
    indices: Sequence[int], *, seed: int, module: str = "fuzz.kinds", table: str = "KINDS", silent: float = SILENT,
    keep: bool = False, scratch: Path | None = None, progress: Callable[[int], object] = lambda done: None,
) -> Tally:  # fmt: skip
    """Run the inputs of some indices.

    Args:
        indices: of the inputs.
        seed: of all.
        module: that holds the table of kinds.
        table: its name there: names and makers.
        silent: seconds after which an input hangs.
        keep: whether to leave the inputs' folders.
        scratch: where they are made; None: a temporary folder.
        progress: is told how many are done.
    """
    tally, left, since = Tally(), list(indices), time.monotonic()
    own = scratch is None
    scratch = Path(tempfile.mkdtemp(prefix="fuzz_")) if scratch is None else scratch
    try:
        while left:
            done = _run_some(left, seed, module, table, silent, keep, scratch, tally, progress)
            left = left[done:]
    finally:
        if own and not keep:
            shutil.rmtree(scratch, ignore_errors=True)
    tally.seconds = time.monotonic() - since
    return tally


def _run_some(
    left: list[int], seed: int, module: str, table: str, silent: float, keep: bool, scratch: Path, tally: Tally,
    progress: Callable[[int], object],
) -> int:  # fmt: skip
    """Run until all are done or the process ends; how many are."""
    reading, writing = os.pipe()
    asked = {"indices": left, "seed": seed, "module": module, "table": table, "descriptor": writing, "keep": keep,
             "scratch": str(scratch)}  # fmt: skip
    tests = str(Path(__file__).parents[1])
    paths = os.pathsep.join(filter(None, [tests, os.environ.get("PYTHONPATH", "")]))
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    with tempfile.TemporaryFile() as log:
        child = subprocess.Popen(
            [sys.executable, "-P", "-m", "fuzz.worker", json.dumps(asked)], stdin=subprocess.DEVNULL, stdout=log,
            stderr=log,
            pass_fds=(writing,), env={**os.environ, **threads, "PYTHONPATH": paths}, start_new_session=True,
        )  # fmt: skip
        os.close(writing)
        done, at = 0, None
        try:
            with os.fdopen(reading, "rb") as lines:
                buffer = b""
                while True:
                    ready, _, _ = select.select([lines], [], [], START if at is None and not done else silent)
                    if not ready:
                        tally.add(_ended(at, "a hang", _last_words(child, log, abort=True)))
                        return done + 1
                    buffer += (some := os.read(reading, 65536))
                    *whole, buffer = buffer.split(b"\n")
                    for said in map(json.loads, whole):
                        at = said if "begin" in said else None
                        if at is None:
                            tally.add(said)
                            done += 1
                            progress(tally.inputs)
                    if not some:
                        break
            child.wait()
            if done < len(left) and at is not None:
                tally.add(_ended(at, f"a crash, status {child.returncode}", _last_words(child, log)))
                return done + 1
            if done < len(left) and not done:
                raise RuntimeError(f"the worker did not begin: {_last_words(child, log)}")
            return done
        finally:
            _kill(child)


def _ended(at: dict[str, Any] | None, how: str, words: str) -> dict[str, Any]:
    if at is None:
        raise RuntimeError(f"the worker is silent between two inputs: {words}")
    words = words.partition("Extension modules:")[0].strip()
    # Python names the frames of a process that is aborted, the last one first.
    frame = re.search(r'/physid_drake/(\S+)", line (\d+) in (\w+)', words)
    where = f" {frame[1]}:{frame[2]} {frame[3]}" if frame else ""
    return {"end": at["begin"], "kind": at["kind"], "outcome": "fault", "group": how + where, "text": words[:400],
            "traceback": words}  # fmt: skip


def _last_words(child: subprocess.Popen[bytes], log: Any, *, abort: bool = False) -> str:
    if abort:  # it says where it is, unless it is in a call that cannot be interrupted
        child.send_signal(signal.SIGABRT)
        with suppress(subprocess.TimeoutExpired):
            child.wait(2.0)
    log.seek(0)
    return log.read()[-20_000:].decode("utf-8", "replace")


def _kill(child: subprocess.Popen[bytes]) -> None:
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()
