"""How a command begins and ends: its words, one line for what is wrong, and the exit status."""

from __future__ import annotations

import argparse
import errno
import os
import re
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final, NoReturn, TextIO

from physid_drake.errors import ConfigError, PhysidError
from physid_drake.process_start import is_interruption
from physid_drake.wording import cause_of, in_one_line, shown

DONE, FAILED, INTERRUPTED = 0, 1, 130  # exit status; 2 is argparse's, of a wrong command line
NUMBER: Final = re.compile(r"-(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
"""What begins with a dash and is no flag; argparse alone takes -1e-1 for one."""
_GONE: Final = (errno.EBADF, errno.EPIPE)  # whoever read standard output


class Parser(argparse.ArgumentParser):
    """A parser of command lines whose refusals are short, whatever was given."""

    def __init__(self, **words: Any) -> None:
        super().__init__(**words)
        self._negative_number_matcher = re.compile(f"^{NUMBER.pattern}$")

    def error(self, message: str) -> NoReturn:
        """Print usage and one line, and end with status 2."""
        super().error(in_one_line(message))


def path(text: str) -> Path:
    """A path of the command line.

    Raises:
        argparse.ArgumentTypeError: if nothing can have such a name: too long, a NUL in it, a loop of links.
    """
    try:
        os.stat(text)  # noqa: PTH116
    except (FileNotFoundError, NotADirectoryError, PermissionError):
        pass
    except (OSError, ValueError) as error:
        raise argparse.ArgumentTypeError(f"{shown(text)} is no path: {cause_of(error)}.") from error
    return Path(text)


def run_command(run: Callable[[], int], *, interrupted: str = "interrupted") -> int:
    """Run a command to its end.

    Args:
        run: the command; returns its exit status.
        interrupted: what is said after Ctrl-C.

    Returns:
        0 done, 1 an error of the input or output in one line on standard error, 130 interrupted.
    """
    _make_printable()
    try:
        with _warnings_on_stderr(), _safe_helpers():
            _check_working_folder()
            try:
                status = run()
            finally:  # also of --help, whose reader may be gone
                sys.stdout.flush()
    except PhysidError as error:
        return _failed(str(error))
    except MemoryError:
        return _failed("there is not enough memory for this.")
    except OSError as error:
        if error.filename is not None:  # a folder that may not be looked into, say
            return _failed(f"'{error.filename}': {cause_of(error)}.")
        if not _is_of_output(error):
            raise
        return _without_output(error)
    except (KeyboardInterrupt, ImportError) as error:
        if not is_interruption(error):
            raise
        _say(interrupted)
        return INTERRUPTED
    return status


@contextmanager
def _safe_helpers() -> Iterator[None]:
    """Processes that work for this one do not look for modules in the working folder, either."""
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["PYTHONSAFEPATH"]
        else:
            os.environ["PYTHONSAFEPATH"] = before


def _failed(message: str) -> int:
    _say(f"error: {in_one_line(message)}")
    return FAILED


def say_error(message: str) -> None:
    """Print a reason for which a recording cannot be used, as one line on standard error; the command goes on."""
    _say(f"ERROR: {in_one_line(message)}")


def _say(line: str) -> None:
    with suppress(OSError):  # nobody may read it
        print(line, file=sys.stderr, flush=True)


def _make_printable() -> None:
    """A terminal that knows only ASCII gets question marks, and no traceback; what is closed, nothing."""
    for standard in (0, 1, 2):
        try:
            os.fstat(standard)
        except OSError:  # the next file to be opened would take its place, and be written to
            os.open(os.devnull, os.O_RDWR)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed by whoever started it
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115, PTH123
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace" if name == "stderr" else "replace")


def _check_working_folder() -> None:
    try:
        os.getcwd()  # noqa: PTH109
    except OSError as error:
        raise ConfigError("the working folder is gone; change into another.") from error


def _is_of_output(error: OSError) -> bool:
    """Whether standard output is what failed: its reader is gone, or the disk that it goes to is full."""
    return error.filename is None and (error.errno in _GONE or error.errno in (errno.ENOSPC, errno.EIO))


def _without_output(error: OSError) -> int:
    # Python would try to flush again at exit, and complain again.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    if error.errno not in _GONE:
        _say(f"error: standard output: {error.strerror}.")
    return FAILED


@contextmanager
def _warnings_on_stderr() -> Iterator[None]:
    """Show a warning meant for a person as one line, without the line of code that raised it."""
    with warnings.catch_warnings():
        warnings.filterwarnings("always", category=UserWarning, module=r"physid_drake\.")
        earlier = warnings.showwarning

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            if category is UserWarning and "physid_drake" in filename:
                _say(f"warning: {in_one_line(str(message))}")
            else:
                earlier(message, category, filename, lineno, file, line)

        warnings.showwarning = show
        yield
