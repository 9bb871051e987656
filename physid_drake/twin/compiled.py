"""How the twin's functions are compiled: once for a machine and a revision, by numba, where the user may write."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Final, TypeVar

from numba import config, njit

F = TypeVar("F", bound=Callable[..., Any])

_SUMS: Final = {"nnan", "contract", "reassoc", "arcp", "nsz", "afn"}
"""What sums over support points may do for speed: change the order of terms. No number in them is infinite."""
_WITHIN: Final = {"_nrt": False, "no_cfunc_wrapper": True}
"""Of functions that compiled ones call: they count no users of arrays, and C cannot call them."""
REVISION: Final = re.compile("[0-9a-f]{16}")
_KEPT: Final = 3  # revisions whose machine code is kept


def compiled_outermost(function: F) -> F:
    """A function in machine code, which Python calls, and which makes all the arrays that those within it use.

    Meanwhile other threads may go on.
    """
    return _compiled(function, error_model="numpy", nogil=True)


def compiled(function: F) -> F:
    """A function in machine code that makes no arrays; so none has to count who uses them, which took half the time.

    A division by zero gives what IEEE says, so that loops can use vectors.
    """
    return _compiled(function, error_model="numpy", **_WITHIN)


def compiled_inside(function: F) -> F:
    """The same of what is called often: it becomes a part of what calls it, which hands over no tuples of arrays."""
    return _compiled(function, error_model="numpy", forceinline=True, **_WITHIN)


def compiled_sum(function: F) -> F:
    """The same of a sum over points, whose terms may be added in another order."""
    return _compiled(function, error_model="numpy", fastmath=_SUMS, **_WITHIN)


@cache
def cache_folder() -> Path | None:
    """Where machine code is kept; None where the user may write nowhere, and it is made anew in every process.

    It is named after all of the twin's sources: numba alone looks at the file of a function, and not at those of the
    functions that it calls.
    """
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    try:
        root = (Path(base) if base else Path.home() / ".cache") / "physid_drake" / "twin"
        folder = root / digest.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (OSError, RuntimeError):  # no right to write; no home
        return None
    _tidy(root)
    return folder


def is_compiled() -> bool:
    """Whether an earlier process left its machine code."""
    folder = cache_folder()
    return folder is not None and any(folder.rglob("*.nbi"))


def drop_cache() -> None:
    """Drop this revision's machine code: it was cut off, or there is no room for it."""
    folder = cache_folder()
    if folder is not None:
        shutil.rmtree(folder, ignore_errors=True)


def _compiled(function: F, **how: Any) -> F:
    folder = cache_folder()
    if folder is None:
        result: F = njit(**how)(function)
        return result
    before, config.CACHE_DIR = config.CACHE_DIR, str(folder)
    try:
        result = njit(cache=True, **how)(function)
    finally:
        config.CACHE_DIR = before
    return result


def _tidy(root: Path) -> None:
    """Drop the machine code of older revisions."""
    with suppress(OSError):
        ours = (folder for folder in root.iterdir() if REVISION.fullmatch(folder.name))
        folders = sorted(ours, key=lambda folder: folder.stat().st_mtime, reverse=True)
        for folder in folders[_KEPT:]:
            shutil.rmtree(folder, ignore_errors=True)
