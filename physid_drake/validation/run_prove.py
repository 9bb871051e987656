"""The ``prove`` command: sealed worlds made, diagnosed without their truth, opened and scored."""

from __future__ import annotations

import argparse
import functools
import os
import re
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from types import FrameType

from rich.console import Console

from physid_drake.errors import ConfigError, ProofError
from physid_drake.report.progress import progress_bar
from physid_drake.report.svg import drawn, png_of
from physid_drake.report.terminal import terminal
from physid_drake.run_folder import SETTINGS, RunFolder, settings_text
from physid_drake.validation.report.proof import Proof, proof_json, proof_markdown, proof_tables
from physid_drake.validation.report.proof_page import proof_page
from physid_drake.validation.report.proof_pictures import confusion_picture
from physid_drake.validation.scoring.figures import figures_of
from physid_drake.validation.scoring.score import read_outcomes
from physid_drake.validation.sealing.cluster import Cluster
from physid_drake.validation.sealing.diagnosing import (
    GRACE,
    Attempt,
    Task,
    attempt_of,
    diagnose_all,
    diagnose_command,
    is_open,
    verdict_of,
)
from physid_drake.validation.sealing.seal import (
    LINES,
    SEALED,
    TOTAL,
    check_seal,
    read_seal,
    sealed_names,
    shut,
    unlock,
)
from physid_drake.validation.sealing.secret import Secret, keep_secret, settled_secret
from physid_drake.versions import versions

WORLDS, QUICK, MOST_WORLDS = 200, 10, 100_000
COMMAND = "prove"
WRITTEN = ("index.html", "proof.md", "proof.json", "confusion.png")
UNKNOWN = "unknown"  # what hid the truth from a diagnosis that does not say so
Commander = Callable[..., tuple[str, ...]]
"""Recording, folder of the results, what must not be seen (one or more): the words of the command that diagnoses."""


def run(arguments: argparse.Namespace, command: Commander = diagnose_command) -> int:
    """Run the command.

    Args:
        arguments: of the command line.
        command: gives the command that diagnoses a recording.

    Raises:
        PhysidError: one line that says what is wrong.
        KeyboardInterrupt: when interrupted; all that is finished is kept.
    """
    out: Path = arguments.out or Path("proofs") / "worlds"  # no seed or kind: the diagnosis sees the folder's name
    worlds = _checked(arguments, out)
    opening = read_seal(out) if arguments.open else None  # before the folder is claimed: there may be none
    console = terminal()
    with claim(out, {}) as folder:
        if opening is not None:
            seal, secret = opening, settled_secret(out, arguments.seed, arguments.kind)
            names = secret.names(worlds)
        else:
            with ended_softly():
                for name in ("recordings/", f"{SEALED}/", "diagnoses/", LINES, TOTAL):
                    folder.own(name)
                unlock(out / SEALED)
                secret = keep_secret(out, arguments.seed, arguments.kind)
                names = secret.names(worlds)
                seal = _make(arguments, worlds, out, console)
                console.print(f"seal of {worlds} worlds, before any is diagnosed: sha256 {seal}", soft_wrap=True)
                diagnose_worlds(folder, names, arguments, console, command)
        proof = opened(out, names, seal, secret)
        if arguments.open:
            console.print(f"{len(proof.outcomes)} of {worlds} worlds have been diagnosed")
        write(folder, proof)
    for table in proof_tables(proof):
        console.print(table)
    console.print(
        f"written: {', '.join(str(out / name) for name in WRITTEN)}",
        soft_wrap=True,
    )
    return 0


def _checked(arguments: argparse.Namespace, out: Path) -> int:
    """How many worlds: those that were asked for, or an opened proof's, all that were sealed."""
    if arguments.quick and arguments.worlds is not None:
        raise ConfigError("--quick means ten worlds: give it or --worlds, not both.")
    asked = QUICK if arguments.quick else arguments.worlds
    sealed = len(sealed_names(out)) if arguments.open else 0
    worlds = int(asked) if asked is not None else sealed or WORLDS
    if worlds < 1:
        raise ConfigError(f"--worlds must be at least 1, but is {worlds}.")
    if worlds > MOST_WORLDS:
        raise ConfigError(f"--worlds must be at most {MOST_WORLDS}, but is {worlds}.")
    check_running(arguments)
    return worlds


def check_running(arguments: argparse.Namespace) -> None:
    """Refuse a seed, a number of jobs or a time that cannot be.

    Raises:
        ConfigError: which one, and what it must be.
    """
    for name, value, least in (("seed", arguments.seed, 0), ("jobs", arguments.jobs, 1)):
        if value is not None and value < least:
            raise ConfigError(f"--{name} must be at least {least}, but is {value}.")
    if not arguments.timeout > 0.0:
        raise ConfigError(f"--timeout must be positive, but is {arguments.timeout:g} s.")


def claim(out: Path, settings: dict[str, object]) -> AbstractContextManager[RunFolder]:
    """The folder of a proof, refused where it holds another, or where another run writes."""
    return RunFolder.claim(out, COMMAND, settings_text(COMMAND, settings), name=SETTINGS)


@contextmanager
def ended_softly() -> Iterator[None]:
    """Take a request to end, or a terminal that is lost, for an interruption.

    So that permissions come back and diagnoses keep their stages. What is ignored (``nohup``) stays so.
    """

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    asked = [number for number in (signal.SIGTERM, signal.SIGHUP) if signal.getsignal(number) != signal.SIG_IGN]
    try:
        earlier = {number: signal.signal(number, interrupt) for number in asked}
    except ValueError:  # not the main thread: then nobody can ask
        yield
        return
    try:
        yield
    finally:
        for number, handler in earlier.items():
            signal.signal(number, handler)


def _make(arguments: argparse.Namespace, worlds: int, out: Path, console: Console) -> str:
    """Make and seal the worlds in a process of their own, which finds their seed in the folder; the seal's hash."""
    words = [sys.executable, "-m", "physid_drake.validation.worlds.make", "--worlds", str(worlds), "--out", str(out),
             "--jobs", str(arguments.jobs)]  # fmt: skip
    words += ["--kind", arguments.kind] if arguments.kind else []
    last = ""
    with (
        progress_bar(console) as progress,
        # In a session of its own: it is told of an interruption once, by the lines below.
        subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
        ) as child,
    ):
        assert child.stderr is not None and child.stdout is not None
        try:
            for line in child.stderr:
                last = line.strip() or last
                counts = re.search(r" (\d+)/(\d+) ", line)
                if counts is not None:
                    progress("worlds made", int(counts[1]), int(counts[2]))
            said = child.stdout.read()
        except BaseException:
            child.send_signal(signal.SIGINT)  # it ends its own workers
            try:
                child.wait(GRACE)
            except subprocess.TimeoutExpired:
                os.killpg(child.pid, signal.SIGKILL)
            raise
    seal = re.search(r"sha256 ([0-9a-f]{64})", said)
    if child.returncode != 0 or seal is None:
        raise ProofError(last.removeprefix("error: ") or f"the worlds were not made: exit status {child.returncode}.")
    return seal[1]


def diagnose_worlds(
    folder: RunFolder, names: Sequence[str], arguments: argparse.Namespace, console: Console, command: Commander
) -> None:
    """Diagnose every world that has not been, with the sealed folder shut."""
    out = folder.path
    tasks = [
        Task(name=name, words=command(out / "recordings" / name, out / "diagnoses" / name, out / SEALED),
             folder=out / "diagnoses" / name)
        for name in names
    ]  # fmt: skip
    if any(is_open(task, arguments.retry) for task in tasks):
        for name in WRITTEN:  # they say of the worlds that were opened from which seed all of them are
            folder.forget(name)
    with shut(out / SEALED):
        run_tasks(tasks, arguments, console)


def run_tasks(tasks: Sequence[Task], arguments: argparse.Namespace, console: Console) -> None:
    """Diagnose with a bar, and a line for each that ends."""
    left = sum(is_open(task, arguments.retry) for task in tasks)
    with progress_bar(console) as progress:
        progress("diagnosed", 0, left)
        done = iter(range(1, left + 1))
        ended = functools.partial(_tell, console, progress, done, left)
        settings = {"timeout": arguments.timeout, "ended": ended, "again": arguments.retry}
        if arguments.cluster is None:
            diagnose_all(tasks, jobs=arguments.jobs, **settings)
            return
        with Cluster(arguments.cluster, arguments.timeout) as cluster:
            diagnose_all(tasks, jobs=cluster.width, begin=cluster.begin, **settings)


def _tell(
    console: Console,
    progress: Callable[[str, int, int], None],
    done: Iterator[int],
    left: int,
    task: Task,
    attempt: Attempt,
) -> None:
    said = "failed: " + attempt.error if attempt.error is not None else verdict_of(task.folder)
    k = next(done)
    console.print(f"{task.name}  {k}/{left}  {attempt.seconds:.0f} s  {said}", soft_wrap=True, markup=False)
    progress("diagnosed", k, left)


def opened(out: Path, names: Sequence[str], seal: str, secret: Secret) -> Proof:
    """Check the seal and score the worlds whose diagnosis has ended.

    Args:
        out: folder of the proof.
        names: of all worlds.
        seal: hash that was written down before the diagnosis.
        secret: what the worlds were drawn from.

    Raises:
        ProofError: if the truth is not the one that was sealed, or nothing is diagnosed yet.
    """
    check_seal(out, seal)
    attempts = {name: attempt_of(out / "diagnoses" / name) for name in names}
    ended = {name: attempt for name, attempt in attempts.items() if attempt is not None}
    if not ended:
        raise ProofError(f"'{out}': none of the {len(names)} sealed worlds has been diagnosed yet.")
    outcomes = tuple(read_outcomes(out / SEALED, out / "diagnoses", list(ended)))
    return Proof(
        seed=secret.seed, kind=secret.kind, seal=seal, sealed=len(names), outcomes=outcomes,
        figures=figures_of(outcomes), versions=versions(),
        hidden_by=Counter(sorted(attempt.hidden_by or UNKNOWN for attempt in ended.values())),
    )  # fmt: skip


def write(folder: RunFolder, proof: Proof) -> None:
    """Write ``proof.json``, ``proof.md``, the page and the confusion as a picture.

    Raises:
        OutputError: if one cannot be written.
    """
    folder.write("proof.json", proof_json(proof))
    folder.write("proof.md", proof_markdown(proof))
    folder.write("index.html", proof_page(proof))
    with drawn():
        folder.write_bytes("confusion.png", png_of(confusion_picture(proof.figures)))
