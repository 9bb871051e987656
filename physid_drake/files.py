"""Reads files that somebody else wrote: whole, of a bounded size, and never what is no plain file.

A named pipe hangs whoever opens it, a device never ends. So what is opened is looked at first, and once more when it
is open.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
import sys
from pathlib import Path
from typing import Any, Final

from physid_drake.wording import cause_of

MOST_BYTES: Final = 64_000_000
GROWN: Final = 1_000_000
"""Bytes that a file may have grown by since it was opened."""

_KINDS: Final = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


class FileError(OSError):
    """A file cannot be read; the message is the end of a sentence that begins with its name.

    Those who read turn it into their package's error, which names the file.
    """


class MissingFileError(FileError, FileNotFoundError):
    """There is no such file."""


class NotTextError(FileError):
    """A file is not UTF-8 text; ``line`` is where."""

    def __init__(self, line: int) -> None:
        super().__init__(f"cannot be read: line {line} is not UTF-8 text; save the file as UTF-8")
        self.line = line


def read_bytes(path: Path | str, *, most: int = MOST_BYTES) -> bytes:
    """What is in a plain file.

    Args:
        path: of the file; links are followed.
        most: bytes that it may have.

    Raises:
        MissingFileError: if it is not there.
        FileError: if it is no plain file, is larger, or cannot be read.
    """
    try:
        _check(os.stat(path), most)  # noqa: PTH116  # Path.stat has words of its own for a NUL
        # Without O_NONBLOCK, a pipe that took the file's place since then would hang.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
        with os.fdopen(descriptor, "rb") as file:
            found = os.fstat(descriptor)
            _check(found, most)
            # Python takes the memory that it is asked for before it looks how much there is.
            content = file.read(min(most, found.st_size + GROWN) + 1)
    except FileError:
        raise
    except FileNotFoundError as error:
        raise MissingFileError("there is no such file") from error
    except (OSError, ValueError) as error:  # ValueError: a path with a NUL
        raise FileError(f"cannot be read: {cause_of(error)[:80]}") from error
    if len(content) > most:
        raise FileError(_too_large(most))
    return content


def is_there(path: Path) -> bool:
    """Whether something has that name; nothing has one that is too long for any file."""
    try:
        return path.exists()
    except OSError:
        return False


def check_plain(path: Path | str) -> None:
    """Refuse what is no plain file, before a library opens it.

    Raises:
        MissingFileError: if it is not there.
        FileError: if it is a folder, a pipe or a device, or cannot be looked at.
    """
    try:
        _check(os.stat(path), most=sys.maxsize)  # noqa: PTH116  # Path.stat has words of its own for a NUL
    except FileError:
        raise
    except FileNotFoundError as error:
        raise MissingFileError("there is no such file") from error
    except (OSError, ValueError) as error:
        raise FileError(f"cannot be read: {cause_of(error)[:80]}") from error


def sha256_of(path: Path | str) -> str:
    """SHA-256 of a plain file of any size.

    Raises:
        MissingFileError: if it is not there.
        FileError: if it is no plain file, or cannot be read.
    """
    check_plain(path)
    try:
        with open(path, "rb", opener=_without_waiting) as file:  # Path.open takes no opener
            return hashlib.file_digest(file, "sha256").hexdigest()
    except (OSError, ValueError) as error:
        raise FileError(f"cannot be read: {str(error)[:80]}") from error


def _without_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_NONBLOCK | os.O_NOCTTY)


def read_text(path: Path | str, *, most: int = MOST_BYTES) -> str:
    """The text of a UTF-8 file, without the byte order mark that spreadsheets write.

    Args:
        path: of the file; links are followed.
        most: bytes that it may have.

    Raises:
        MissingFileError: if it is not there.
        NotTextError: if it is not UTF-8.
        FileError: if it is no plain file, is larger, or cannot be read.
    """
    content = read_bytes(path, most=most)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise NotTextError(content[: error.start].count(b"\n") + 1) from error


def read_json(path: Path | str) -> Any:
    """What a file of JSON says, of 64 MB at most; links are followed.

    Raises:
        MissingFileError: if it is not there.
        FileError: if it cannot be read as text, or is no JSON.
    """
    text = read_text(path)
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise FileError(f"cannot be read: no JSON (line {error.lineno}: {error.msg})") from error
    except (ValueError, RecursionError) as error:  # a number of thousands of digits; brackets in brackets
        raise FileError("cannot be read: no JSON that a program wrote") from error


def _check(found: os.stat_result, most: int) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = next((name for test, name in _KINDS if test(found.st_mode)), "no plain file")
        raise FileError(f"cannot be read: it is {kind}; give a plain file")
    if found.st_size > most:
        raise FileError(_too_large(most))


def _too_large(most: int) -> str:
    return f"cannot be read: it is larger than {most / 1e6:g} MB; is it the right file?"
