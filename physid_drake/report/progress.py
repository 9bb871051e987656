"""How far a computation is: a bar in a terminal, else lines on standard error: of every stage, and every minute."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from physid_drake.progress import Progress

AGAIN = 60.0  # s: a stage that lasts so long says how far it is


@contextmanager
def progress_bar(console: Console) -> Iterator[Progress]:
    """Show how far it is while the block runs; the function it gives takes stage, done and total (0 if unknown)."""
    if not console.is_terminal:
        yield _in_lines()
        return
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("starting", total=None)

        def show(stage: str, done: int, total: int) -> None:
            bar.update(task, description=stage, completed=done, total=total or None)

        yield show


def _in_lines() -> Progress:
    """For a log, where a bar cannot be redrawn; results stay alone on standard output."""
    since, said, last = time.monotonic(), 0.0, ""

    def show(stage: str, done: int, total: int) -> None:
        nonlocal said, last
        after = time.monotonic() - since
        if stage == last and (not total or after - said < AGAIN):
            return
        how_far = f", {done} of {total}" if stage == last else ""
        said, last = after, stage
        print(f"{after:5.0f} s  {stage}{how_far}", file=sys.stderr, flush=True)

    return show
