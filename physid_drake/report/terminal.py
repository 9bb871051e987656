"""The terminal that results are printed to, and tables that 80 columns hold: what is wide is folded, never cut."""

from __future__ import annotations

from typing import Final

from rich import box
from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

NARROWEST: Final = 120  # columns of a file or a pipe: tables are legible there


def terminal() -> Console:
    """A console that prints what it is given: "[mm]" and names of pushes are no markup."""
    console = Console(markup=False)
    return console if console.is_terminal else Console(markup=False, width=max(NARROWEST, console.width))


def words(header: str) -> Column:
    """A column of text, which may take several lines."""
    return Column(header, overflow="fold")


def numbers(header: str) -> Column:
    """A column of numbers: kept whole as long as text beside them can give way."""
    return Column(header, justify="right", no_wrap=True, overflow="fold")


def narrow_table(title: str, *columns: Column, caption: str | None = None, header: bool = True) -> Table:
    """A table without lines between columns; nothing in its title or caption is taken for markup."""
    named = Text(title, style="table.title")
    below = None if caption is None else Text(caption, style="table.caption")
    return Table(
        *columns, title=named, title_justify="left", caption=below, caption_justify="left", show_header=header,
        box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0), collapse_padding=True,
    )  # fmt: skip
