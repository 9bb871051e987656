"""The terminal that results are printed to."""

from __future__ import annotations

from rich.console import Console

NARROWEST = 120  # columns of a file or a pipe: tables are legible there


def terminal() -> Console:
    """A console that prints what it is given: "[mm]" and names of pushes are no markup."""
    console = Console(markup=False)
    return console if console.is_terminal else Console(markup=False, width=max(NARROWEST, console.width))
