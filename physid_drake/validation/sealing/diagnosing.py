"""Diagnoses many recordings, each by its own command: it goes on where it stopped, and a failure ends nothing."""

from __future__ import annotations

import hashlib
import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final, Protocol

from physid_drake.errors import ProofError
from physid_drake.run_folder import RunFolder
from physid_drake.validation.sealing.blindfold import HIDDEN_BY
from physid_drake.validation.sealing.written import AGAIN, broken, is_number, read_object
from physid_drake.wording import shown

DIAGNOSE: Final = "diagnose"
"""The command that answers."""
RESULT: Final = "diagnosis.json"
OTHERS: Final = ("index.html", "diagnosis.html", "scene.html", "model.yaml")
"""What it writes beside it."""
ATTEMPT: Final = "attempt.json"
"""Beside a diagnosis: how long it took [s], or why there is none."""
FRESH_ERRORS: Final = "fresh.json"
"""Beside it: end-point errors of its model on pushes that it did not get."""
LOG: Final = "log.txt"
_POLL: Final = 0.05  # s
GRACE: Final = 10.0  # s that an interrupted diagnosis has to keep its stages
_LONGEST_LINE: Final = 300
THREADS: Final = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
"""One each: several diagnoses run side by side."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """One recording to be diagnosed.

    Attributes:
        name: of the recording.
        words: the command.
        folder: where the results go.
    """

    name: str
    words: tuple[str, ...]
    folder: Path


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """How a diagnosis ended.

    Attributes:
        seconds: that it took [s]; NaN where unknown.
        error: one line on why it failed, None where it did not.
        hidden_by: what hid the truth from it; None where nothing says so.
    """

    seconds: float
    error: str | None
    hidden_by: str | None = None


def diagnose_command(recording: Path, folder: Path, *sealed: Path) -> tuple[str, ...]:
    """The command that diagnoses a recording with one worker, blind to some folders.

    Args:
        recording: its folder, all that the diagnosis is given.
        folder: where its results go.
        sealed: what it must not see.
    """
    hidden = json.dumps([str(path.resolve()) for path in sealed])
    return (
        sys.executable, "-m", "physid_drake.validation.sealing.blindfold", hidden,
        "diagnose", str(recording.resolve()), "--out", str(folder.resolve()), "--jobs", "1", "--seed", "0",
    )  # fmt: skip


def attempt_of(folder: Path) -> Attempt | None:
    """How the diagnosis in a folder ended; None where there is none yet.

    Raises:
        ProofError: if what is written of it cannot be read.
    """
    file = folder / ATTEMPT
    noted = read_object(file, AGAIN) if file.exists() else {}
    seconds, error, hidden_by = (noted.get(name) for name in ("seconds", "error", "hidden_by"))
    if not (seconds is None or is_number(seconds)):
        raise broken(file, f"'seconds' must be a number, but is {shown(seconds)}", AGAIN)
    for name, word in (("error", error), ("hidden_by", hidden_by)):
        if not (word is None or isinstance(word, str)):
            raise broken(file, f"'{name}' must be a text or null, but is {shown(word)}", AGAIN)
    attempt = Attempt(
        seconds=math.nan if seconds is None else float(seconds), error=error or None, hidden_by=hidden_by
    )
    # One that failed may have done so after its answer was written.
    return attempt if attempt.error is not None or (folder / RESULT).is_file() else None


def verdict_of(folder: Path) -> str:
    """The verdict of a diagnosis.

    Raises:
        ProofError: if it cannot be read.
    """
    verdict = read_object(folder / RESULT, AGAIN).get("verdict")
    if not isinstance(verdict, str):
        raise broken(folder / RESULT, f"'verdict' must be a text, but is {shown(verdict)}", AGAIN)
    return verdict


def diagnose_all(
    tasks: Sequence[Task],
    *,
    jobs: int,
    timeout: float,
    ended: Callable[[Task, Attempt], None],
    again: bool = False,
    begin: Callable[[Task], Running] | None = None,
) -> None:
    """Run every task that has not ended before.

    Args:
        tasks: what to run.
        jobs: so many at a time.
        timeout: after which a task is stopped and counts as failed [s].
        ended: is told of every task that ends.
        again: also run those that failed before.
        begin: starts one; by default as a process of this machine.

    Raises:
        KeyboardInterrupt: when interrupted; what runs is told so first, so that it can keep its stages.
    """
    waiting = [task for task in tasks if is_open(task, again)]
    running: list[Running] = []
    start = begin or _Running.begin
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                running.append(start(waiting.pop(0)))
            time.sleep(_POLL)
            for one in tuple(running):
                attempt = one.look(timeout)
                if attempt is not None:
                    running.remove(one)
                    _note(one, attempt)
                    ended(one.task, attempt)
    finally:
        for one in running:
            one.interrupt()
        for one in running:
            one.stop(GRACE)


def is_open(task: Task, again: bool) -> bool:
    """Whether a task has not ended, or has failed and is to be run ``again``."""
    attempt = attempt_of(task.folder)
    return attempt is None or (again and attempt.error is not None)


def code_digest() -> str:
    """SHA-256 over the package's Python files: which revision answered, that anyone may compare with a checkout."""
    total = hashlib.sha256()
    root = Path(__file__).parents[1]
    for file in sorted(root.rglob("*.py")):
        total.update(file.relative_to(root).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return total.hexdigest()


def _note(run: Running, attempt: Attempt) -> None:
    content = {
        "seconds": round(attempt.seconds, 3),
        "error": attempt.error,
        "code": run.code,
        "hidden_by": attempt.hidden_by,
    }
    RunFolder.begin(run.task.folder, DIAGNOSE).write(ATTEMPT, json.dumps(content, indent=2) + "\n")


class Running(Protocol):
    """A diagnosis that runs."""

    @property
    def task(self) -> Task:
        """Which."""
        ...

    @property
    def code(self) -> str:
        """Digest of the revision that answers; known when it has ended."""
        ...

    def look(self, timeout: float) -> Attempt | None:
        """How it ended; None while it runs."""
        ...

    def interrupt(self) -> None:
        """Ask it to end."""
        ...

    def stop(self, grace: float = 0.0) -> None:
        """Wait so long [s], then end it."""
        ...


def begun(task: Task) -> RunFolder:
    """A task's folder, without what an attempt that failed left there."""
    folder = RunFolder.begin(task.folder, DIAGNOSE)
    for name in (ATTEMPT, RESULT, FRESH_ERRORS, *OTHERS):
        folder.forget(name)
    return folder


def ending(task: Task, code: int | None, seconds: float, timeout: float) -> Attempt:
    """How a command ended that has written its answer, if any, and its log; ``code`` is None where it was stopped."""
    said = _said(task.folder / LOG)
    hidden_by = next((line.removeprefix(HIDDEN_BY) for line in said if line.startswith(HIDDEN_BY)), None)
    return Attempt(seconds=seconds, error=_error(task, code, timeout, said), hidden_by=hidden_by)


def _error(task: Task, code: int | None, timeout: float, said: Sequence[str]) -> str | None:
    """One line on why it failed; None where it did not."""
    if code is None:
        return f"stopped after {timeout:g} s (--timeout)."
    if code == 0 and (task.folder / RESULT).is_file():
        try:
            verdict_of(task.folder)
        except ProofError as error:
            return str(error)
        return None
    last = _last_line(said)
    if code < 0:  # killed: its last line may tell how far it was, but hardly why
        return f"signal {-code}, after '{last}'."
    return last or f"exit status {code}, without a word."


@dataclass(frozen=True, kw_only=True)
class _Running:
    """A command that runs, in a session of its own so that all it starts can be stopped with it."""

    task: Task
    child: subprocess.Popen[bytes]
    log: IO[bytes]
    since: float
    code: str

    @classmethod
    def begin(cls, task: Task) -> _Running:
        log = begun(task).own(LOG).open("wb")
        child = subprocess.Popen(
            task.words, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, start_new_session=True,
            env={**os.environ, **THREADS},
        )  # fmt: skip
        return cls(task=task, child=child, log=log, since=time.monotonic(), code=code_digest())

    def look(self, timeout: float) -> Attempt | None:
        """How it ended; None while it runs."""
        code, seconds = self.child.poll(), time.monotonic() - self.since
        if code is None and seconds < timeout:
            return None
        self.stop()
        return ending(self.task, code, seconds, timeout)

    def interrupt(self) -> None:
        self._signal(signal.SIGINT)

    def stop(self, grace: float = 0.0) -> None:
        """Wait so long [s], then end it and all that it started."""
        with suppress(subprocess.TimeoutExpired):
            self.child.wait(grace)
        self._signal(signal.SIGKILL)
        self.child.wait()
        self.log.close()

    def _signal(self, number: signal.Signals) -> None:
        with suppress(ProcessLookupError, PermissionError):  # it may have ended by itself
            os.killpg(self.child.pid, number)


def _said(log: Path) -> list[str]:
    """What a command said, line by line."""
    text = log.read_text(encoding="utf-8", errors="replace")
    return [line.strip() for line in text.splitlines() if line.strip()]


def _last_line(said: Sequence[str]) -> str:
    """What it said last, its own error line first."""
    lines = [line for line in said if not line.startswith(HIDDEN_BY)]
    errors = [line for line in lines if line.startswith("error:")]
    return (errors or lines or [""])[-1][:_LONGEST_LINE]
