"""Files that are written whole or not at all, also where a command is ended meanwhile."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from physid_drake.errors import OutputError
from physid_drake.wording import cause_of

PART: Final = ".part"


def write_whole(path: Path, content: bytes) -> None:
    """Write a file whole or not at all.

    Raises:
        OutputError: if it cannot be written.
    """
    try:
        with part_of(path) as part:
            part.write_bytes(content)
            os.replace(part, path)  # noqa: PTH105
    except OSError as error:
        raise OutputError(f"'{path}': cannot be written: {cause_of(error)}.") from error


@contextmanager
def part_of(path: Path) -> Iterator[Path]:
    """A new, empty file beside a path, to be filled and renamed to it; removed where that does not come about."""
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name[:100]}.", suffix=PART, dir=path.parent)
    os.close(descriptor)
    part = Path(name)
    try:
        part.chmod(0o644)
        yield part
    finally:
        part.unlink(missing_ok=True)
