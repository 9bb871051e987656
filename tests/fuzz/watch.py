"""Sees what an input makes a program read and write: by Python's audit hook, and by the system for compiled code."""

from __future__ import annotations

import ctypes
import os
import site
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import physid_drake
from fuzz.case import MARK, NUMBER, Case
from physid_drake.convert import matlab_process
from physid_drake.resources import shipped

SYSTEM: Final = ("/proc/", "/sys/devices/system/", "/sys/fs/cgroup/", "/dev/urandom", "/dev/null", "/etc/localtime",
                 "/usr/share/zoneinfo/", "/etc/mime.types", "/usr/share/fonts/", "/etc/ld.so", "/dev/tty",
                 "/usr/share/terminfo/", "/etc/terminfo/", "/lib/terminfo/")  # fmt: skip
_WRITES: Final = ("os.mkdir", "os.remove", "os.rmdir", "os.truncate", "os.chmod", "os.chown", "os.utime",
                  "shutil.rmtree",
                  "os.setxattr")  # fmt: skip
_PAIRS: Final = ("os.rename", "os.link", "os.symlink", "shutil.move", "shutil.copyfile")
_FOLLOWING: Final = ("os.truncate", "os.chmod", "os.chown", "os.utime", "os.setxattr", "shutil.copyfile")
_READS: Final = ("os.listdir", "os.scandir")
_NEVER: Final = ("subprocess.Popen", "os.system", "os.exec", "os.fork", "os.forkpty", "os.posix_spawn",
                 "socket.connect",
                 "socket.bind", "os.kill", "os.killpg", "ctypes.dlopen")  # fmt: skip
_CHANGING: Final = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_OPENED: Final = 0x20 | 0x1 | 0x2  # IN_OPEN, IN_ACCESS, IN_MODIFY


class Watch:
    """Installs a hook that stays, and looks at what happens only while a case is watched."""

    def __init__(self) -> None:
        self._folder: Path | None = None
        self._inside: tuple[str, ...] = ()
        self._readable: tuple[str, ...] = ()
        self._seen: list[str] = []
        self._busy = False
        self._system = _readable()
        sys.addaudithook(self._hear)

    @contextmanager
    def over(self, base: Path, case: Case) -> Iterator[list[str]]:
        """What went wrong while the block ran is in the list after it.

        Args:
            base: that holds the input's folder ``in``, an empty ``tmp``, and the secrets.
            case: what is run.
        """
        self._seen = []
        self._inside = tuple(os.path.realpath(base / name) + "/" for name in ("in", "tmp"))
        self._readable = tuple(os.path.realpath(file) for file in case.may_read)
        before = _contents(base / "in")
        listed = _names(base)
        secrets = _Opened([file for file in _secrets(base) if os.path.realpath(file) not in self._readable])
        usual = tempfile.tempdir, os.environ.get("TMPDIR")
        tempfile.tempdir = os.environ["TMPDIR"] = str(base / "tmp")
        here = Path.cwd()
        os.chdir(base / "in")
        self._folder = base
        try:
            yield self._seen
        finally:
            self._folder = None
            os.chdir(here)
            tempfile.tempdir = usual[0]
            os.environ.pop("TMPDIR") if usual[1] is None else os.environ.update(TMPDIR=usual[1])
            self._seen += [f"a secret file was opened by compiled code: {name}" for name in secrets.names()]
            self._compare(base, before, listed, case)
            self._seen[:] = list(dict.fromkeys(self._seen))

    def _compare(self, base: Path, before: dict[str, tuple[int, int]], listed: list[str], case: Case) -> None:
        if _names(base) != listed:
            self._seen.append(f"beside the folder there is now: {sorted(set(_names(base)) ^ set(listed))}")
        if (base / "bystander.txt").read_text() != "untouched\n":
            self._seen.append("the bystander was changed")
        if any((base / "tmp").iterdir()):
            self._seen.append("a temporary file was left")
        after = _contents(base / "in")
        for name, state in before.items():
            if after.get(name) != state and not _is_of(name, case.may_change):
                self._seen.append(f"an input was changed or removed: {name}")
        for name, state in after.items():
            if before.get(name) != state and state[0] >= 0:
                content = (base / "in" / name).read_bytes()
                if MARK.encode() in content or NUMBER.encode() in content:
                    self._seen.append(f"a secret was copied to {name}")

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if self._folder is None or self._busy:
            return
        self._busy = True
        try:
            self._judge(event, arguments)
        finally:
            self._busy = False

    def _judge(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            path, mode, flags = arguments
            changes = bool(flags & _CHANGING) if isinstance(flags, int) else any(c in "wax+" for c in mode or "")
            follows = not (isinstance(flags, int) and flags & os.O_NOFOLLOW)
            self._note(path, "written" if changes else "read", follows=follows)
        elif event in _WRITES:
            self._note(arguments[0], "written", follows=event in _FOLLOWING)
        elif event in _PAIRS:
            self._note(arguments[1], "written", follows=event in _FOLLOWING)
        elif event in _READS:
            self._note(arguments[0], "read")
        elif event in _NEVER and not _is_usual(event, arguments):
            self._seen.append(f"{event}{tuple(map(str, arguments))!r:.200}")

    def _note(self, path: Any, how: str, *, follows: bool = True) -> None:
        if path is None or isinstance(path, int):
            return
        try:
            folder, name = os.path.split(os.fsdecode(path))
            real = os.path.realpath(os.fsdecode(path)) if follows else f"{os.path.realpath(folder or '.')}/{name}"
        except (ValueError, OSError):  # a NUL: nothing is opened
            return
        if f"{real}/".startswith(self._inside) or real == "/dev/null":
            return
        if how == "read" and (real in self._readable or real.startswith(self._system)):
            return
        self._seen.append(f"{how} outside: {os.fsdecode(path)!r:.200}")


def _is_usual(event: str, arguments: tuple[Any, ...]) -> bool:
    """Whether this program's own symbols are looked up, or a process starts that is sent a MATLAB file to read."""
    if event == "ctypes.dlopen":
        return arguments[0] is None
    return len(arguments) > 1 and list(arguments[1] or ()) == [sys.executable, "-P", matlab_process.__file__]


class _Opened:
    """Which of some files were opened by whatever code, as Linux counts it; none where it does not."""

    def __init__(self, files: list[Path]) -> None:
        self._libc = ctypes.CDLL(None, use_errno=True)
        self._fd = self._libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
        self._names = {
            self._libc.inotify_add_watch(self._fd, os.fsencode(file), _OPENED): file.name for file in files
        } if self._fd >= 0 else {}  # fmt: skip

    def names(self) -> list[str]:
        if self._fd < 0:
            return []
        try:
            events = os.read(self._fd, 4096)
        except BlockingIOError:
            events = b""
        os.close(self._fd)
        return sorted({self._names.get(int.from_bytes(events[k : k + 4], sys.byteorder), "?")
                       for k in range(0, len(events), 16)})  # fmt: skip


def lay_out(base: Path) -> Path:
    """The surroundings of an input: secrets, a bystander, and the folder for it, which is returned."""
    folder = base / "in"
    for name in ("in", "tmp"):
        (base / name).mkdir()
    (base / "bystander.txt").write_text("untouched\n")
    (base / "secret.txt").write_text(f"{MARK}\n")
    (base / "secret.obj").write_text(f"# {MARK}\n" + "".join(
        f"v {x} {y} {z}\n" for x in (0, NUMBER) for y in (0, 0.05) for z in (0, 0.03)))  # fmt: skip
    (base / "secret.csv").write_text(
        "time_s,hand_x_m,hand_y_m,hand_z_m,object_x_m,object_y_m,object_z_m,object_qw,object_qx,object_qy,object_qz\n"
        f"0,0,0,0.015,{NUMBER},0,0.015,1,0,0,0\n0.1,0,0,0.015,{NUMBER},0,0.015,1,0,0,0\n"
    )
    return folder


def _names(folder: Path) -> list[str]:
    return sorted(one.name for one in folder.iterdir())


def _secrets(base: Path) -> list[Path]:
    return [base / f"secret.{kind}" for kind in ("txt", "obj", "csv")]


def _is_of(name: str, names: tuple[str, ...]) -> bool:
    return any(name == one or name.startswith(f"{one}/") for one in names)


def _contents(folder: Path) -> dict[str, tuple[int, int]]:
    """Size and time of every file, -1 of what is none."""
    found = {}
    waiting = [str(folder)]
    while waiting:
        with os.scandir(waiting.pop()) as entries:
            for one in entries:
                name = os.path.relpath(one.path, folder)
                if one.is_file(follow_symlinks=False):
                    state = one.stat(follow_symlinks=False)
                    found[name] = (state.st_size, state.st_mtime_ns)
                else:
                    found[name] = (-1, 0)
                    if one.is_dir(follow_symlinks=False):
                        waiting.append(one.path)
    return found


def _readable() -> tuple[str, ...]:
    """Folders that any program here reads: Python's, this package's, and the system's."""
    import matplotlib as mpl

    package = Path(physid_drake.__file__).parent
    folders = [sys.prefix, sys.base_prefix, sysconfig.get_paths()["stdlib"], *site.getsitepackages(), package,
               *(shipped(name) for name in ("models", "configs", "recordings")), Path(__file__).parents[1],
               mpl.get_cachedir(), mpl.get_configdir()]  # fmt: skip
    return (*SYSTEM, *(os.path.realpath(folder) + "/" for folder in folders))
