"""What of a published source is converted: its files, and pushes drawn from them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from physid_drake.errors import RecordingError
from physid_drake.wording import named, one_line


def source_files(source: Path, *suffixes: str) -> list[Path]:
    """The source itself, or the files with these suffixes in the source folder, sorted by name.

    Raises:
        RecordingError: if there is none.
    """
    source = Path(source)
    try:
        if source.exists() and not source.is_dir():
            return [source]
        files = sorted(f for f in source.iterdir() if f.suffix.lower() in suffixes) if source.is_dir() else []
    except OSError as error:
        raise RecordingError(f"{named(source)}: cannot be read: {one_line(error)}.") from error
    if not files:
        raise RecordingError(
            f"{named(source)}: no {' or '.join(suffixes)} file here; give one, or the folder with them."
        )
    return files


def drawn(count: int, limit: int | None, rng: np.random.Generator) -> list[int]:
    """Indices below ``count`` in order: all, or ``limit`` of them drawn at random.

    Raises:
        RecordingError: if ``limit`` is below 1.
    """
    if limit is None:
        return list(range(count))
    if limit < 1:
        raise RecordingError(f"limit must be at least 1, but got {limit}; leave it out to convert all pushes.")
    return sorted(int(k) for k in rng.choice(count, size=min(limit, count), replace=False))
