"""Hides folders from a process that begins: mounts of its own, which it cannot undo, and no other process in sight.

An empty read-only file system lies over each folder, for this process alone. Root may make such mounts; any other
user may where the system lets users have namespaces of their own. Then the rights to undo it are given up for good,
and ``/proc`` shows this process only: the command line of the one that made the worlds may have their seed.

It is called before anything else, while the process has one thread: the system asks for that.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

MOUNTS: Final = "mount namespace"
PERMISSIONS: Final = "permissions"
"""No such mounts: what is left are the folders' permissions, and the blindfold."""

_NEW_MOUNTS, _NEW_USERS = 0x20000, 0x10000000
_READ_ONLY, _REMOUNT, _BIND, _MOVE, _WITH_ALL_BELOW, _PRIVATE = 1, 32, 4096, 8192, 16384, 1 << 18
_INERT: Final = 2 | 4 | 8  # no programs, devices or rights of other users
_DROP_BOUND, _NO_NEW_RIGHTS, _AMBIENT, _CLEAR_ALL = 24, 38, 47, 4  # of prctl
_WRITE_ANYWHERE: Final = 1  # the capability CAP_DAC_OVERRIDE: root may write results into another user's folder
_CAPABILITIES: Final = 64
_CAPABILITY_VERSION: Final = 0x20080522
_FILES_OF_PROC: Final = ("cpuinfo", "meminfo", "stat", "loadavg", "uptime", "version", "filesystems")
_LINKS_OF_PROC: Final = ("mounts", "net")


def hide(folders: Sequence[str]) -> str:
    """Hide folders from this process and all that it starts.

    Args:
        folders: their paths; those that do not exist hide nothing.

    Returns:
        `MOUNTS`, or `PERMISSIONS` where the system does not allow it.
    """
    there = [real for folder in folders if os.path.isdir(real := os.path.realpath(folder))]  # noqa: PTH112
    if not there or not sys.platform.startswith("linux"):
        return PERMISSIONS
    # Tried by another process first: one that gets half of it has no name for its user, or no /proc.
    return MOUNTS if _works(there) and _hidden(there) else PERMISSIONS


def _works(folders: Sequence[str]) -> bool:
    child = os.fork()
    if child == 0:
        os._exit(0 if _hidden(folders) else 1)
    return os.waitpid(child, 0)[1] == 0


def _hidden(folders: Sequence[str]) -> bool:
    """Hide folders, and say whether that has worked."""
    try:
        users = _own_mounts()
        _mount(None, "/", None, _WITH_ALL_BELOW | _PRIVATE)  # nothing of what follows is seen outside
        _hide_processes(folders[0])
        for folder in folders:
            if Path(folder).is_dir():  # it may lie in one before it
                _mount("none", folder, "tmpfs", _READ_ONLY | _INERT, "mode=000,size=4k")
        _leave_hidden_folder()
        _give_up_rights(0 if users else 1 << _WRITE_ANYWHERE)
    except (OSError, AttributeError):  # AttributeError: a C library without such calls
        return False
    return True


def _own_mounts() -> bool:
    """A mount namespace, and whether it took a namespace of users to get one."""
    user, group = os.geteuid(), os.getegid()
    try:
        _call("unshare", _NEW_MOUNTS)
        return False
    except OSError:  # not root, or a root without that right
        _call("unshare", _NEW_MOUNTS | _NEW_USERS)
    own = Path("/proc/self")
    (own / "setgroups").write_text("deny", encoding="ascii")  # the system asks for this before the groups
    (own / "uid_map").write_text(f"{user} {user} 1", encoding="ascii")
    (own / "gid_map").write_text(f"{group} {group} 1", encoding="ascii")
    return True


def _hide_processes(place: str) -> None:
    """A ``/proc`` with this process and what libraries ask of the machine; it is put together at ``place``."""
    _mount("none", place, "tmpfs", _INERT, "mode=755,size=64k")
    root, old = Path(place), Path("/proc")
    (root / "self").mkdir()
    _mount(f"/proc/{os.getpid()}", str(root / "self"), None, _BIND | _WITH_ALL_BELOW)
    (root / str(os.getpid())).symlink_to("self")
    for name in _FILES_OF_PROC:
        if (old / name).exists():
            (root / name).touch()
            _mount(str(old / name), str(root / name), None, _BIND)
    for name in _LINKS_OF_PROC:
        (root / name).symlink_to(f"self/{name}")
    _mount(place, "/proc", None, _MOVE)
    _mount(None, "/proc", None, _REMOUNT | _READ_ONLY | _INERT)


def _leave_hidden_folder() -> None:
    """The working folder may be what is below a mount: it is looked up again, or left."""
    try:
        os.chdir(Path.cwd())
    except OSError:
        os.chdir("/")


def _give_up_rights(kept: int) -> None:
    """Give up all capabilities but these, a bit each, for what is started from here, too."""
    _call("prctl", _NO_NEW_RIGHTS, 1, 0, 0, 0)
    _call("prctl", _AMBIENT, _CLEAR_ALL, 0, 0, 0)
    for number in range(_CAPABILITIES):
        if not kept >> number & 1:
            try:
                _call("prctl", _DROP_BOUND, number, 0, 0, 0)
            except OSError:  # this system has fewer
                break
    header = (ctypes.c_uint32 * 2)(_CAPABILITY_VERSION, 0)
    # Effective, permitted, inheritable; twice, since a number has 32 bits.
    rights = (ctypes.c_uint32 * 6)(kept, kept, 0, 0, 0, 0)
    _call("capset", ctypes.byref(header), ctypes.byref(rights))


def _mount(source: str | None, target: str, kind: str | None, flags: int, options: str | None = None) -> None:
    words = [None if word is None else os.fsencode(word) for word in (source, target, kind, options)]
    _call("mount", *words[:3], ctypes.c_ulong(flags), words[3])


def _call(name: str, *arguments: object) -> None:
    """A function of the C library that returns 0 where it has worked.

    Raises:
        OSError: with what the system says where it has not.
    """
    library = ctypes.CDLL(None, use_errno=True)
    if getattr(library, name)(*arguments) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number), name)
