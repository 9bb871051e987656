"""A run's folder: what a command wrote there and may replace, one run at a time."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from physid_drake.errors import ConfigError, OutputError
from physid_drake.files import NotTextError, read_json, read_text
from physid_drake.whole_files import PART, write_whole
from physid_drake.wording import cause_of

MANIFEST: Final = "manifest.json"
FORMAT: Final = "physid-folder/1"
LOCK: Final = ".lock"
_NO_LOCKS: Final = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS)
CONFIG, SETTINGS = "config.yaml", "settings.json"  # what a folder was made with: by run_cell, by other commands


def named_after(name: str) -> str:
    """A recording's name as the name of one folder: letters, digits, dots within, dashes and underscores."""
    return re.sub(r"[^\w.-]+", "_", name)[:100].strip("._") or "recording"


def named_after_model(path: Path) -> str:
    """The name of a folder for what is made of a model: that of the model's folder, or of a file of another name.

    Args:
        path: the folder of a run or a diagnosis, its ``model.yaml``, or a file such as ``mug.yaml``.
    """
    place = path.resolve()
    if not place.is_dir():
        place = place.parent if place.name == "model.yaml" else place.with_suffix("")
    return named_after(place.name)


def settings_text(command: str, settings: Mapping[str, Any]) -> str:
    """The text of ``settings.json``: which command wrote the folder, and with what."""
    return json.dumps({"command": command, **settings}, indent=2) + "\n"


@dataclass(frozen=True, kw_only=True)
class RunFolder:
    """A folder that one command writes to.

    Its manifest lists what the command wrote there. Nothing else in the folder is ever replaced or removed, and a
    folder that holds something and has no manifest is not written to.

    Attributes:
        path: of the folder.
        command: whose folder it is.
    """

    path: Path
    command: str

    @classmethod
    def check(cls, path: Path, command: str, *, inputs: Sequence[Path] = (), recordings: Sequence[Path] = ()) -> None:
        """Refuse a folder that cannot or may not be written to, before anything is computed.

        Args:
            path: of the folder.
            command: that is to write there.
            inputs: folders that the command reads, which are somebody's own.
            recordings: likewise, and nothing is written below them, either.

        Raises:
            OutputError: if it is no folder, or cannot be written to.
            ConfigError: if it is an input, or holds what this command did not write.
        """
        try:
            place = path.resolve()
            for one in (*inputs, *recordings):
                if place == one.resolve() or (one in recordings and one.resolve() in place.parents):
                    raise ConfigError(f"output folder '{path}': is a folder that is read from; choose another --out.")
            existing = next(one for one in (path, *path.absolute().parents) if _is_there(one))
            if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
                raise OutputError(
                    f"output folder '{path}': cannot be written: '{existing}' is no folder to write to."
                )
            cls(path=path, command=command)._refuse_others()
        except (OSError, ValueError, RuntimeError) as error:  # too long a name, a NUL, a loop of links, no folder
            if isinstance(error, ConfigError | OutputError):
                raise
            raise OutputError(f"output folder '{path}': cannot be written: {cause_of(error)}.") from error

    @classmethod
    def begin(cls, path: Path, command: str) -> RunFolder:
        """Make the folder with an empty manifest, or go on in one of the same command.

        Raises:
            ConfigError: if it holds what this command did not write.
            OutputError: if it cannot be written.
        """
        cls.check(path, command)
        folder = cls(path=path, command=command)
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"output folder '{path}': cannot be written: {cause_of(error)}.") from error
        if not (path / MANIFEST).exists():
            folder._list(())
        return folder

    @classmethod
    @contextmanager
    def open(
        cls,
        path: Path,
        command: str,
        configuration: str,
        *,
        name: str = CONFIG,
        state: Sequence[str] = (),
        results: Sequence[str] = (),
    ) -> Iterator[RunFolder]:
        """Make the folder, or go on in one, while no other run does; results of other settings are refused.

        The state of an interrupted run with other settings is dropped.

        Args:
            path: of the folder.
            command: that writes there.
            configuration: text that says what the run is; kept in the folder.
            name: of the file that keeps it.
            state: names of the files that an interrupted run goes on from.
            results: names of its results.

        Raises:
            ConfigError: if it holds what this command did not write, or another run writes there.
            OutputError: if it cannot be written.
        """
        with _locked(path, command):
            folder = cls.begin(path, command)
            for file in (name, *state, *results):
                folder._refuse_foreign(file)
            if folder.read(name) != configuration:
                held = next((file for file in results if folder.holds(file)), None)
                if held is not None:
                    raise ConfigError(
                        f"output folder '{path}': holds '{held}' of another recording, or of other settings or"
                        " versions; choose another --out."
                    )
                for file in state:
                    folder.forget(file)
                folder.write(name, configuration)
            yield folder

    @classmethod
    @contextmanager
    def claim(cls, path: Path, command: str, configuration: str, *, name: str = SETTINGS) -> Iterator[RunFolder]:
        """Make the folder, or go on in one that was made with the same settings; any other is refused.

        Args:
            path: of the folder.
            command: that writes there.
            configuration: text that says what the run is; kept in the folder.
            name: of the file that keeps it.

        Raises:
            ConfigError: if it holds another run, or another run writes there.
            OutputError: if it cannot be read or written.
        """
        with _locked(path, command):
            folder = cls.begin(path, command)
            earlier = folder.read(name)
            if earlier is not None and earlier != configuration:
                raise ConfigError(
                    f"'{path}' holds another run of {command} ({' '.join(earlier.split())[:300]}); choose another"
                    " --out, or the same settings."
                )
            if earlier is None:
                folder.write(name, configuration)
            yield folder

    def read(self, name: str) -> str | None:
        """The text of a file that this command wrote; None where there is none.

        Raises:
            OutputError: if it cannot be read.
        """
        try:
            return read_text(self.path / name) if self.holds(name) else None
        except NotTextError:
            return ""  # somebody changed it: it is no text of ours
        except OSError as error:
            raise OutputError(f"'{self.path / name}': cannot be read: {cause_of(error)}.") from error

    def holds(self, name: str) -> bool:
        """Whether this command wrote a file of that name, and it is still there."""
        return self._lists(name) and (self.path / name).is_file()

    def write(self, name: str, text: str) -> None:
        """Write a text file whole or not at all.

        Raises:
            ConfigError: if there is one of that name which this command did not write.
            OutputError: if it cannot be written.
        """
        self.write_bytes(name, text.encode("utf-8"))

    def write_bytes(self, name: str, content: bytes) -> None:
        """Write a file of bytes whole or not at all.

        Raises:
            ConfigError: if there is one of that name which this command did not write.
            OutputError: if it cannot be written.
        """
        self.own(name)
        write_whole(self.path / name, content)

    def own(self, name: str) -> Path:
        """Take a name into the manifest, for a file or (``name/``) a folder that others write; its path.

        Raises:
            ConfigError: if there is one of that name which this command did not write.
            OutputError: if the manifest cannot be written.
        """
        if not self._lists(name):
            self._refuse_foreign(name)
            self._list((*self._listed(), name))
        path = self.path / name
        if name.endswith("/"):
            try:
                path.mkdir(exist_ok=True)
            except OSError as error:
                raise OutputError(f"'{path}': cannot be written: {cause_of(error)}.") from error
        return path

    def forget(self, name: str) -> None:
        """Drop a file that this command wrote: the run is done, or it was another run's.

        Raises:
            OutputError: if it cannot be dropped.
        """
        if not self._lists(name):
            return
        try:
            (self.path / name).unlink(missing_ok=True)
        except OSError as error:
            raise OutputError(f"'{self.path / name}': cannot be removed: {cause_of(error)}.") from error

    def _lists(self, name: str) -> bool:
        within = [f"{parent}/" for parent in Path(name).parents if parent != Path()]
        return not {name, *within}.isdisjoint(self._listed())

    def _listed(self) -> tuple[str, ...]:
        """The names in the manifest; none where there is no manifest."""
        command, names = _manifest(self.path)
        return names if command == self.command else ()

    def _list(self, names: Sequence[str]) -> None:
        content = {"format": FORMAT, "command": self.command, "files": sorted(names)}
        write_whole(self.path / MANIFEST, (json.dumps(content, indent=2) + "\n").encode("utf-8"))

    def _refuse_foreign(self, name: str) -> None:
        if not self._lists(name) and os.path.lexists(self.path / name):
            raise ConfigError(
                f"'{self.path / name}': was not written by this command, which would replace it; move it away, or"
                " choose another --out."
            )

    def _refuse_others(self) -> None:
        command, _ = _manifest(self.path)
        if command is None and self.path.is_dir() and not all(map(_is_scrap, self.path.iterdir())):
            raise ConfigError(
                f"output folder '{self.path}': is not empty, and not of this program (it has no {MANIFEST}); choose"
                " another --out."
            )
        if command not in (None, self.command):
            raise ConfigError(f"output folder '{self.path}': holds what {command} wrote; choose another --out.")


def _manifest(path: Path) -> tuple[str | None, tuple[str, ...]]:
    """Whose a folder is, and what of it; (None, ()) where nothing says so.

    Raises:
        ConfigError: if its manifest is none.
    """
    file = path / MANIFEST
    if not file.exists():
        return None, ()
    try:
        content = read_json(file)
        command, names = content["command"], content["files"]
        if content["format"] != FORMAT or not all(isinstance(word, str) for word in (command, *names)):
            raise ValueError("not of this format")
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise ConfigError(
            f"'{file}': cannot be read, so that nothing says what may be replaced here; choose another --out."
        ) from error
    return str(command), tuple(names)


@contextmanager
def _locked(path: Path, command: str) -> Iterator[None]:
    """Keep every other run out of a folder, which is made; the system lets go of it where a run is killed."""
    RunFolder.check(path, command)
    file = path / LOCK
    try:
        path.mkdir(parents=True, exist_ok=True)
        while True:
            descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o644)
            try:
                _take(descriptor, path)
            except BaseException:
                os.close(descriptor)
                raise
            # The run that held it may have removed it between opening and locking.
            if file.exists() and os.path.samestat(os.fstat(descriptor), file.stat()):
                break
            os.close(descriptor)
    except OSError as error:
        if isinstance(error, OutputError):
            raise
        raise OutputError(f"output folder '{path}': cannot be written: {cause_of(error)}.") from error
    try:
        yield
    finally:
        file.unlink(missing_ok=True)
        os.close(descriptor)


def _take(descriptor: int, path: Path) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise ConfigError(
            f"output folder '{path}': another run writes to it; wait for that, or choose another --out."
        ) from error
    except OSError as error:
        if error.errno not in _NO_LOCKS:  # some network file systems: there, nothing keeps two runs apart
            raise


def _is_scrap(path: Path) -> bool:
    """What a run that was killed as it began may leave in a folder: its lock, and a manifest that was not ended."""
    named = path.name == LOCK or (path.name.startswith(f".{MANIFEST}.") and path.suffix == PART)
    return named and path.is_file() and not path.is_symlink()


def _is_there(path: Path) -> bool:
    """Whether something has that name, if only a link to nothing.

    Raises:
        OSError: if nothing can have it: too long a name.
        ValueError: likewise, of a NUL in it.
    """
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True
