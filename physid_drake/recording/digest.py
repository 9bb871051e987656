"""What tells one recording from another, and from itself after a file of it was changed."""

from __future__ import annotations

import dataclasses as dc
import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from physid_drake.errors import RecordingError
from physid_drake.files import FileError, read_bytes
from physid_drake.recording.values import Recording
from physid_drake.wording import named


def digest_of(recording: Recording) -> str:
    """SHA-256 of all that a recording says, its mesh among it and wherever it lies, in hexadecimal.

    Raises:
        RecordingError: if its mesh cannot be read any more.
    """
    digest = hashlib.sha256()
    for piece in _pieces(recording):
        digest.update(piece)
    return digest.hexdigest()


def _pieces(value: Any) -> Iterator[bytes]:
    if isinstance(value, np.ndarray):
        yield repr(value.shape).encode()
        yield np.ascontiguousarray(value).tobytes()
    elif isinstance(value, Path):
        try:
            yield read_bytes(value)
        except FileError as error:
            raise RecordingError(f"mesh '{named(value)}': {error}.") from error
    elif dc.is_dataclass(value):
        for field in (f for f in dc.fields(value) if f.compare):
            yield field.name.encode()
            yield from _pieces(getattr(value, field.name))
    elif isinstance(value, tuple | list):
        yield repr(len(value)).encode()
        for one in value:
            yield from _pieces(one)
    else:
        yield repr(value).encode()
