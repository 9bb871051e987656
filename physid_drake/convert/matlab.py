"""MATLAB's files up to version 7: variables and fields of structures as plain arrays."""

from __future__ import annotations

import io
import json
import subprocess
import sys
import zlib
from typing import Any, Final, Literal

import numpy as np

from physid_drake.convert import matlab_process
from physid_drake.convert.groups import Unread
from physid_drake.files import FileError

MOST_UNPACKED: Final = 1_000_000_000
"""Bytes of all elements."""
LONGEST: Final = 300.0
"""s: a file of that many bytes takes a tenth of it."""

_PACKED: Final = 15
"""MATLAB's code of an element that is packed by zlib."""
_PIECE: Final = 1 << 20


def read_matlab(content: bytes) -> dict[str, Any]:
    """Variables of a file, by name, and fields of structures by ``name/field``.

    They are read by a process of their own: compiled code that reads a damaged file may end it.

    Args:
        content: of the file.

    Raises:
        FileError: if it cannot be read, or nests deeper, or holds more, than a log does.
    """
    _check_unpacked(content)
    command = [sys.executable, "-P", matlab_process.__file__]
    try:
        ended = subprocess.run(command, input=content, capture_output=True, timeout=LONGEST, check=False)
    except subprocess.TimeoutExpired as error:
        raise FileError(f"cannot be read within {LONGEST:g} s") from error
    if ended.returncode == matlab_process.TOO_DEEP:
        raise FileError("it nests deeper, or holds more arrays, than a log does")
    if ended.returncode != 0:
        raise FileError("cannot be read: damaged, or of another kind")
    with np.load(io.BytesIO(ended.stdout), allow_pickle=False) as loaded:
        names, unread = json.loads(str(loaded["arr_0"]))
        found: dict[str, Any] = {name: loaded[f"arr_{k + 1}"] for k, name in enumerate(names)}
    return found | {name: Unread(why=why) for name, why in unread.items()}


def _check_unpacked(content: bytes) -> None:
    """Of MATLAB's elements that are packed, each is unpacked in pieces: none may be more than a log is."""
    order: Literal["little", "big"] = "little" if content[126:128] == b"IM" else "big"
    at, total = 128, 0
    while at + 8 <= len(content):
        kind = int.from_bytes(content[at : at + 4], order)
        size = int.from_bytes(content[at + 4 : at + 8], order)
        if kind == _PACKED:
            unpack, packed = zlib.decompressobj(), content[at + 8 : at + 8 + size]
            while packed and not unpack.eof:
                total += len(unpack.decompress(packed, _PIECE))
                packed = unpack.unconsumed_tail
                if total > MOST_UNPACKED:
                    raise FileError(f"it unpacks to more than {MOST_UNPACKED / 1e6:g} MB")
        at += 8 + size
