"""How far a computation is: a bar in a terminal, else a line on standard error for every stage that begins."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from physid_drake.progress import Progress


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
    since, last = time.monotonic(), ""

    def show(stage: str, done: int, total: int) -> None:
        nonlocal last
        if stage != last:
            last = stage
            print(f"{time.monotonic() - since:5.0f} s  {stage}", file=sys.stderr, flush=True)

    return show
