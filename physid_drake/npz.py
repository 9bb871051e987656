"""Reads plain arrays, and archives of them: what a header claims is held against what is there first."""

from __future__ import annotations

import io
import lzma
import struct
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.files import FileError, read_bytes
from physid_drake.wording import named, one_line, shown

MOST_UNPACKED: Final = 1_000_000_000  # bytes of all arrays together
_KINDS: Final = "biufUmM"  # truth values, whole and real numbers, text, durations, dates: no pickles, no records
_BROKEN: Final = (
    OSError, ValueError, TypeError, KeyError, IndexError, AttributeError, EOFError, OverflowError, MemoryError,
    RuntimeError, SyntaxError, zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, tokenize.TokenError,
)  # fmt: skip
_METHODS: Final = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def read_arrays(path: Path | str) -> dict[str, NDArray[Any]]:
    """All arrays of an npz file, by name.

    Args:
        path: of the file.

    Raises:
        MissingFileError: if it is not there.
        FileError: if it is no npz file, is damaged, holds what is no plain array, or unpacks to more than 1 GB.
    """
    content = read_bytes(path)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = archive.infolist()
            if sum(member.file_size for member in members) > MOST_UNPACKED:
                raise FileError(f"cannot be read: it unpacks to more than {MOST_UNPACKED / 1e6:g} MB")
            return {member.filename.removesuffix(".npy"): _array(archive, member) for member in members}
    except FileError:
        raise
    except _BROKEN as error:
        raise FileError(f"cannot be read: no npz file, or a damaged one ({one_line(error)})") from error


def read_array(path: Path | str) -> NDArray[Any]:
    """The array of an npy file, which may be structured.

    Args:
        path: of the file.

    Raises:
        MissingFileError: if it is not there.
        FileError: if it is no npy file, is damaged, holds what is no plain array, or is larger than 1 GB.
    """
    content = read_bytes(path, most=MOST_UNPACKED)
    try:
        return _of_npy(io.BytesIO(content), "it", structured=True)
    except FileError:
        raise
    except _BROKEN as error:
        raise FileError(f"cannot be read: no npy file, or a damaged one ({one_line(error)})") from error


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    where = f"its member '{named(member.filename)}'"
    if member.compress_type not in _METHODS:
        raise FileError(f"cannot be read: {where} is packed in a way that NumPy never packs")
    with archive.open(member) as packed:
        return _of_npy(io.BytesIO(packed.read(member.file_size)), where)


def _of_npy(stream: io.BytesIO, where: str, *, structured: bool = False) -> NDArray[Any]:
    version = np.lib.format.read_magic(stream)
    if version not in ((1, 0), (2, 0)):
        raise FileError(f"cannot be read: {where} is of another version of npy, {version}")
    header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    try:
        shape, by_columns, dtype = header(stream)
    except _BROKEN as error:  # NumPy's words may name objects of Python's own grammar
        raise FileError(f"cannot be read: {where} has no header as NumPy writes it") from error
    if not (dtype.kind in _KINDS or (structured and dtype.names and not dtype.hasobject)):
        raise FileError(f"cannot be read: {where} holds no numbers and no text")
    rest = stream.read()
    count = 1
    for size in shape:  # Python's whole numbers do not overflow
        count *= size
    if min(shape, default=0) < 0 or count * dtype.itemsize != len(rest):
        raise FileError(f"cannot be read: {where} claims {shown(shape)} numbers, but holds {len(rest)} bytes")
    flat = np.frombuffer(rest, dtype=dtype) if rest else np.zeros(count, dtype=dtype)
    return flat.reshape(shape, order="F" if by_columns else "C").copy()
