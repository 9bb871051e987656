"""A picture in a file of its own: whole or not at all, and over nothing but an earlier one of ours."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Final

from matplotlib.figure import Figure

from physid_drake.errors import ConfigError
from physid_drake.files import FileError, MissingFileError, read_bytes
from physid_drake.whole_files import write_whole

MARK: Final = "physid_drake inspect"
_KEYS: Final = {".png": "Software", ".svg": "Creator", ".pdf": "Creator"}
"""Under which each kind of picture says what made it."""
_SIGNED: Final = {
    ".png": f"Software\0{MARK}".encode(), ".svg": f"<dc:title>{MARK}</dc:title>".encode(),
    ".pdf": f"/Creator ({MARK})".encode(),
}  # fmt: skip


def check_picture(file: Path) -> None:
    """Refuse a file that is no picture, or that something else made.

    Raises:
        ConfigError: if its name does not end as a picture's, or it is there and is not one of ours.
    """
    if file.suffix.lower() not in _KEYS:
        raise ConfigError(f"--out '{file}': must end in {', '.join(_KEYS)}, such as pushes.png.")
    try:
        ours = _SIGNED[file.suffix.lower()] in read_bytes(file)
    except MissingFileError:
        return
    except FileError as error:
        raise ConfigError(f"--out '{file}': {error}; choose another name.") from error
    if not ours:
        raise ConfigError(f"--out '{file}': is there, and was not drawn by this command; choose another name.")


def write_picture(figure: Figure, file: Path) -> None:
    """Write a figure, in the kind that the file's name ends in.

    Raises:
        OutputError: if it cannot be written.
    """
    kind, drawn = file.suffix.lower(), io.BytesIO()
    figure.savefig(drawn, dpi=150, format=kind[1:], metadata={_KEYS[kind]: MARK})
    write_whole(file, drawn.getvalue())
