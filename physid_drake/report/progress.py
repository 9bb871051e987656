"""How far a computation is: a bar in a terminal, else a line on standard error for every stage that begins."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

Show = Callable[[str, int, int], None]


@contextmanager
def progress_bar(console: Console) -> Iterator[Show]:
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
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("starting", total=None)

        def show(stage: str, done: int, total: int) -> None:
            progress.update(task, description=stage, completed=done, total=total or None)

        yield show


def _in_lines() -> Show:
    """For a log, where a bar cannot be redrawn; results stay alone on standard output."""
    since, last = time.monotonic(), ""

    def show(stage: str, done: int, total: int) -> None:
        nonlocal last
        if stage != last:
            last = stage
            print(f"{time.monotonic() - since:5.0f} s  {stage}", file=sys.stderr, flush=True)

    return show
