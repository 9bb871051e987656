"""Runs the command line blind to some folders: ``python -m physid_drake.validation.sealing.blindfold FOLDERS WORDS``.

FOLDERS is a JSON list of paths. They are hidden from the process (`physid_drake.validation.sealing.hiding`), and it
says by what. Python itself refuses, too, for where they cannot be: every opening or listing of what lies in the
folders, in this interpreter, raises an error that ends the command, and so does starting another program, which no
diagnosis does.

What only asks whether something is there (``os.stat``, ``os.path.exists``, ``os.readlink``) tells Python's audit
nothing, and neither does what C++ opens: against these there are the mounts and the permissions alone.
"""

from __future__ import annotations

import errno
import json
import os
import runpy
import sys
import threading
from collections.abc import Iterator
from typing import Final

from physid_drake.processes import killed_with_parent
from physid_drake.validation.sealing.hiding import hide

HIDDEN_BY: Final = "the truth is hidden by: "
"""What a blind command says first, before the word for it."""
LOOKS: Final = frozenset({
    "open", "os.listdir", "os.scandir", "os.walk", "os.fwalk", "os.rename", "os.link", "os.symlink", "os.chdir",
    "os.chmod", "os.chown", "os.chflags", "os.remove", "os.rmdir", "os.mkdir", "os.truncate", "os.utime",
    "os.getxattr", "os.listxattr", "os.setxattr", "os.removexattr", "glob.glob", "glob.glob/2", "pathlib.Path.glob",
    "pathlib.Path.rglob", "shutil.copyfile", "shutil.copymode", "shutil.copystat", "shutil.copytree", "shutil.move",
    "shutil.rmtree", "shutil.make_archive", "shutil.unpack_archive", "shutil.chown", "mmap.__new__",
})  # fmt: skip
"""Audit events whose first argument is a path, or an open file, that is looked at or moved."""
PAIRS: Final = frozenset({
    "os.rename", "os.link", "os.symlink", "shutil.copyfile", "shutil.copymode", "shutil.copystat", "shutil.copytree",
    "shutil.move",
})  # fmt: skip
"""Of these, those whose second argument is a path, too."""
MOVES: Final = frozenset({"os.rename", "shutil.move"})
"""Of these, what may give a folder another path by moving one above it."""
PROGRAMS: Final = frozenset({
    "subprocess.Popen", "os.exec", "os.posix_spawn", "os.spawn", "os.system", "os.fork", "os.forkpty", "pty.spawn",
    "os.startfile", "sqlite3.connect",
})  # fmt: skip
"""Audit events of what would look for Python."""
CALLS: Final = frozenset({
    "open", "open64", "openat", "openat64", "openat2", "fopen", "fopen64", "freopen", "opendir", "scandir", "syscall",
    "open_by_handle_at", "system", "popen", "fork", "vfork", "clone", "execv", "execve", "execvp", "execl", "execlp",
    "posix_spawn", "posix_spawnp", "mount", "umount", "umount2", "unshare", "setns",
})  # fmt: skip
"""Functions of the C library that ``ctypes`` may not look up."""
_OPEN_FILES: Final = "/proc/self/fd"


class SealedError(PermissionError):
    """Something that must not be seen was asked for."""


def blind_to(*folders: str) -> None:
    """From now on refuse every look into folders, and other programs; it cannot be undone in this interpreter.

    Args:
        folders: their paths.
    """
    hidden = tuple(os.path.realpath(folder) for folder in folders)
    within = threading.local()

    def refuse(event: str, arguments: tuple[object, ...]) -> None:
        if event in PROGRAMS:
            raise SealedError(errno.EACCES, f"starts what could see sealed folders ({event})")
        if event.startswith("ctypes.dlsym") and _word(arguments[-1]) in CALLS:
            raise SealedError(errno.EACCES, f"calls what could see sealed folders ({_word(arguments[-1])})")
        if event not in LOOKS or getattr(within, "looking", False):
            return
        within.looking = True  # to find out what a relative path means takes looks, too
        try:
            seen = _sealed_among(arguments[: 2 if event in PAIRS else 1], hidden, above=event in MOVES)
        finally:
            within.looking = False
        if seen is not None:
            raise SealedError(errno.EACCES, f"is sealed ({event})", seen)

    sys.addaudithook(refuse)


def _word(name: object) -> str:
    return name.decode("ascii", "replace") if isinstance(name, bytes) else str(name)


def _sealed_among(arguments: tuple[object, ...], hidden: tuple[str, ...], *, above: bool) -> str | None:
    """The first of some arguments of an event that is, or may be, in a hidden folder, or above one."""
    for argument in arguments:
        for path in _meant_by(argument):
            real = os.path.realpath(path)
            if any(_in(real, folder) or (above and _in(folder, real)) for folder in hidden):
                return path
    return None


def _in(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder.rstrip(os.sep) + os.sep)


def _meant_by(argument: object) -> Iterator[str]:
    """What an argument may mean: an event does not say which open folder (``dir_fd``) a relative path begins from."""
    if isinstance(argument, int):
        yield from _opened(argument)
    elif isinstance(argument, str | bytes | os.PathLike):
        path = os.fsdecode(argument)
        yield path
        if not os.path.isabs(path):  # noqa: PTH117  # pathlib has looks of its own
            for folder in _open_folders():
                yield os.path.join(folder, path)  # noqa: PTH118


def _opened(descriptor: int) -> Iterator[str]:
    """The path of an open file; nothing of one that is not open, or has none."""
    try:
        path = os.readlink(f"{_OPEN_FILES}/{descriptor}")  # noqa: PTH115
    except OSError:
        return
    if path.startswith(os.sep):
        yield path


def _open_folders() -> Iterator[str]:
    try:
        descriptors = os.listdir(_OPEN_FILES)  # noqa: PTH208
    except OSError:  # a system without /proc
        return
    for descriptor in descriptors:
        for path in _opened(int(descriptor)):
            if os.path.isdir(path):  # noqa: PTH112
                yield path


def main() -> None:
    """Run ``physid_drake`` with the words after the first, blind to the folders that the first names."""
    folders, *words = sys.argv[1:]
    hidden = json.loads(folders)
    print(HIDDEN_BY + hide(hidden), flush=True)
    killed_with_parent()
    blind_to(*hidden)
    sys.argv = ["physid_drake", *words]
    runpy.run_module("physid_drake", run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
