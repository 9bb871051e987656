"""Diagnoses on a Dask cluster: each worker is sent one recording, and there is no truth on it to look at.

A worker that dies on the way is replaced by another, which begins the recording anew; the answers are the same bytes
as on one machine.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Final

from physid_drake.errors import ProofError
from physid_drake.validation.sealing.diagnosing import (
    DIAGNOSE,
    LOG,
    OTHERS,
    RESULT,
    THREADS,
    Attempt,
    Task,
    begun,
    code_digest,
    ending,
)

PATIENCE: Final = 20.0  # s that a scheduler may take to answer
SAID: Final = 300  # letters of a line


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What a worker sends back.

    Attributes:
        status: exit status; None of a command that was stopped.
        files: what it wrote, by name, and what it said.
        seconds: that it took.
        code: which revision answered.
    """

    status: int | None
    files: dict[str, bytes]
    seconds: float
    code: str


class Cluster:
    """A Dask cluster, as something that diagnoses begin on."""

    def __init__(self, address: str, timeout: float) -> None:
        """Connect.

        Args:
            address: of the scheduler, such as ``tcp://10.0.0.1:8786``.
            timeout: after which a diagnosis is stopped [s].

        Raises:
            ProofError: if Dask is not installed, or no scheduler answers.
        """
        try:
            from distributed import Client  # noqa: PLC0415  # an extra
        except ImportError as error:
            raise ProofError("--cluster needs Dask: pip install '.[cluster]'.") from error
        self._client: Any
        try:
            connect: Any = Client
            self._client = connect(address, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError) as error:
            raise ProofError(f"--cluster {address}: no scheduler answers there.") from error
        self._timeout = timeout

    def __enter__(self) -> Cluster:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._client.close()

    @property
    def width(self) -> int:
        """How many diagnoses run at a time: the threads of all workers, at least 1."""
        return max(1, sum(map(int, self._client.nthreads().values())))

    def begin(self, task: Task) -> Remote:
        """Send a recording; the answer is asked for later."""
        source = Path(task.words[task.words.index(DIAGNOSE) + 1])
        sent = {str(f.relative_to(source)): f.read_bytes() for f in sorted(source.rglob("*")) if f.is_file()}
        begun(task)
        future = self._client.submit(answered, list(task.words), sent, self._timeout, pure=False)
        return Remote(task=task, future=future, since=time.monotonic())


@dataclass(kw_only=True)
class Remote:
    """A diagnosis that runs on a worker."""

    task: Task
    future: Any
    since: float
    code: str = ""

    def look(self, timeout: float) -> Attempt | None:
        """How it ended; None while it runs."""
        seconds = time.monotonic() - self.since
        if self.future.status == "pending":
            # It may wait for a worker; how long the command itself takes, the worker sees to.
            return None
        if self.future.status != "finished":
            why = f": {self.future.exception()}" if self.future.status == "error" else ""
            return Attempt(seconds=seconds, error=f"the cluster lost it{why}"[:SAID])
        answer: Answer = self.future.result()
        self.code = answer.code
        folder = begun(self.task)
        for name, content in answer.files.items():
            folder.write_bytes(name, content)
        return ending(self.task, answer.status, answer.seconds, timeout)

    def interrupt(self) -> None:
        """Ask the cluster to drop it."""
        self.future.cancel()

    def stop(self, grace: float = 0.0) -> None:
        """Nothing of it runs here."""


def answered(words: Sequence[str], recording: Mapping[str, bytes], timeout: float) -> Answer:
    """Diagnose a recording in a folder of its own, on whatever machine this is."""
    begin = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="physid_") as place:
        given, out = Path(place) / "recording", Path(place) / "answer"
        for name, content in recording.items():
            file = given / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)
        line = [sys.executable, *words[1:]]
        line[line.index(DIAGNOSE) + 1] = str(given)
        line[line.index("--out") + 1] = str(out)
        status: int | None
        try:
            done = subprocess.run(
                line, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=timeout,
                env={**os.environ, **THREADS}, check=False,
            )  # fmt: skip
            status, said = done.returncode, done.stdout
        except subprocess.TimeoutExpired as late:
            status, said = None, late.stdout or b""
        files = {name: (out / name).read_bytes() for name in (RESULT, *OTHERS) if (out / name).is_file()}
    return Answer(status=status, files={**files, LOG: said}, seconds=time.monotonic() - begin, code=code_digest())
