"""A run's folder: files that are written whole or not at all, the state to go on from, and what made them."""

from __future__ import annotations

import json
import os
import platform
import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from physid_drake.errors import ConfigError, OutputError

SEAL = "seal.sha256"  # of a proof
CONFIG, SETTINGS = "config.yaml", "settings.json"  # what a folder was made with: by run_cell, by other commands
PACKAGES = ("physid_drake", "drake", "mujoco", "numpy", "scipy", "scikit-learn")


def versions() -> dict[str, str]:
    """Of Python and of what the numbers of a run depend on, as far as it is installed."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def made_with() -> str:
    """The versions in one line."""
    return ", ".join(f"{name} {version}" for name, version in versions().items())


def named_after(name: str) -> str:
    """A recording's name as the name of one folder: letters, digits, dots within, dashes and underscores."""
    return re.sub(r"[^\w.-]+", "_", name).strip("._") or "recording"


def settings_text(command: str, settings: Mapping[str, Any]) -> str:
    """The text of ``settings.json``: which command wrote the folder, and with what."""
    return json.dumps({"command": command, **settings}, indent=2) + "\n"


def command_of(path: Path) -> str | None:
    """The command that wrote a folder; None where nothing says so."""
    try:
        if (path / CONFIG).exists():
            return "run_cell"
        if (path / SEAL).exists():
            return "prove"
        content = json.loads((path / SETTINGS).read_text(encoding="utf-8"))
        return str(content["command"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


@dataclass(frozen=True, kw_only=True)
class RunFolder:
    """A run's folder: its configuration, the state to go on from, the results."""

    path: Path

    @classmethod
    def open(
        cls,
        path: Path,
        configuration: str,
        *,
        name: str = CONFIG,
        state: Sequence[str] = (),
        results: Sequence[str] = (),
    ) -> RunFolder:
        """Make the folder, or go on in one; the files of a run with another configuration are dropped.

        Args:
            path: of the folder.
            configuration: text that says what the run is; kept in the folder.
            name: of the file that keeps it.
            state: names of the files that an interrupted run goes on from; dropped, too, where nothing says whose.
            results: names of its results.

        Raises:
            OutputError: if it cannot be written.
        """
        folder = cls(path=path)
        try:
            path.mkdir(parents=True, exist_ok=True)
            config = path / name
            same = config.exists() and config.read_text(encoding="utf-8") == configuration
            for file in () if same else (*state, *(results if config.exists() else ())):
                folder.forget(file)
        except (OSError, UnicodeDecodeError) as error:
            raise OutputError(f"output folder '{path}': cannot be written: {error}.") from error
        folder.write(name, configuration)
        return folder

    @staticmethod
    def check(path: Path, command: str) -> None:
        """Refuse a folder that cannot be written to or belongs to another command, before anything is computed.

        Args:
            path: of the folder.
            command: that is to write there.

        Raises:
            OutputError: if it is no folder, or may not be written to.
            ConfigError: if results of another command are in it, whose files have the same names.
        """
        other = command_of(path)
        if other not in (None, command):
            raise ConfigError(f"output folder '{path}': holds what {other} wrote; choose another --out.")
        existing = next(one for one in (path, *path.absolute().parents) if one.exists())
        if not existing.is_dir() or not os.access(existing, os.W_OK):
            raise OutputError(f"output folder '{path}': cannot be written: '{existing}' is no folder to write to.")

    @classmethod
    def claim(cls, path: Path, configuration: str, *, name: str, what: str) -> RunFolder:
        """Make the folder, or go on in one that was made for the same; any other is refused.

        Args:
            path: of the folder.
            configuration: text that says what the run is; kept in the folder.
            name: of the file that keeps it.
            what: is in such a folder, for the message.

        Raises:
            ConfigError: if it holds another run.
            OutputError: if it cannot be read or written.
        """
        file = path / name
        try:
            earlier = file.read_text(encoding="utf-8") if file.exists() else configuration
        except (OSError, UnicodeDecodeError) as error:
            raise OutputError(f"'{file}': cannot be read: {error}.") from error
        if earlier != configuration:
            raise ConfigError(
                f"'{path}' holds another {what} ({' '.join(earlier.split())}); choose another --out, or the same"
                " settings."
            )
        return cls.open(path, configuration, name=name)

    def write(self, name: str, text: str) -> None:
        """Write a text file whole or not at all.

        Raises:
            OutputError: if it cannot be written.
        """
        self.write_bytes(name, text.encode("utf-8"))

    def write_bytes(self, name: str, content: bytes) -> None:
        """Write a file of bytes whole or not at all.

        Raises:
            OutputError: if it cannot be written.
        """
        part = None
        try:
            with tempfile.NamedTemporaryFile("wb", dir=self.path, delete=False) as part:
                part.write(content)
            Path(part.name).chmod(0o644)
            os.replace(part.name, self.path / name)  # noqa: PTH105
        except OSError as error:
            if part is not None:
                Path(part.name).unlink(missing_ok=True)
            raise OutputError(f"'{self.path / name}': cannot be written: {error}.") from error

    def forget(self, name: str) -> None:
        """Drop a file: the run is done, or it was another run's.

        Raises:
            OutputError: if it cannot be dropped.
        """
        try:
            (self.path / name).unlink(missing_ok=True)
        except OSError as error:
            raise OutputError(f"'{self.path / name}': cannot be removed: {error}.") from error
