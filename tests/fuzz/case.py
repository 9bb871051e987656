"""One input, and what may come of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

MARK: Final = "SECRET-5f1d"
"""Stands in every secret file beside an input's folder."""
NUMBER: Final = "0.12398765432"
"""Likewise, where only a number is read."""


@dataclass(frozen=True)
class Case:
    """An input that is ready to be read.

    Attributes:
        run: reads it; what it returns is not looked at.
        may_read: files beside the folder that may be opened: the input itself names them, as a user would.
        may_change: names of files or folders, within the folder, that may be changed or removed.
    """

    run: Callable[[], object]
    may_read: tuple[Path, ...] = ()
    may_change: tuple[str, ...] = ()


class RefusedError(Exception):
    """What was read went wrong in words that a person can use: a command's error line, say."""


class WrongError(AssertionError):
    """What was read, or said of it, is not as it should be."""
