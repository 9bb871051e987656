"""A run's folder: files that are written whole or not at all, the state to go on from, and what made them."""

from __future__ import annotations

import os
import platform
import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from physid_drake.errors import ConfigError, OutputError

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


@dataclass(frozen=True, kw_only=True)
class RunFolder:
    """A run's folder: its configuration, the state to go on from, the results."""

    path: Path

    @classmethod
    def open(
        cls, path: Path, configuration: str, *, name: str = "config.yaml", files: Sequence[str] = ()
    ) -> RunFolder:
        """Make the folder, or go on in one; the files of a run with another configuration are dropped.

        Args:
            path: of the folder.
            configuration: text that says what the run is; kept in the folder.
            name: of the file that keeps it.
            files: names of those that an interrupted run goes on from, and of its results.

        Raises:
            OutputError: if it cannot be written.
        """
        folder = cls(path=path)
        try:
            path.mkdir(parents=True, exist_ok=True)
            config = path / name
            if config.exists() and config.read_text(encoding="utf-8") != configuration:
                for file in files:
                    folder.forget(file)
        except (OSError, UnicodeDecodeError) as error:
            raise OutputError(f"output folder '{path}': cannot be written: {error}.") from error
        folder.write(name, configuration)
        return folder

    @staticmethod
    def check(path: Path) -> None:
        """Refuse a folder that cannot be written to, before anything is computed for it.

        Raises:
            OutputError: if it is no folder, or may not be written to.
        """
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
