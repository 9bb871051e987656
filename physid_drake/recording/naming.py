"""Where a recording is that somebody names: a folder of their own, or one that ships."""

from __future__ import annotations

import os
from pathlib import Path

from physid_drake.errors import ConfigError
from physid_drake.resources import shipped
from physid_drake.wording import shown


def recording_folder(text: str) -> Path:
    """A folder, or a recording that ships with the project.

    Raises:
        ConfigError: if no folder can have such a name.
    """
    path = Path(text)
    try:
        path.exists()
    except (OSError, ValueError) as error:  # too long a name, a NUL in it
        raise ConfigError(f"recording {shown(text)}: nothing can have such a name.") from error
    return shipped_recording(path) or path


def shipped_recording(name: Path) -> Path | None:
    """The folder of a recording that ships with the project; None where none is called so, or a file or folder is."""
    if os.path.lexists(name) or name.parent != Path():
        return None
    folder = shipped("recordings") / name
    return folder if os.path.isdir(folder) else None  # noqa: PTH112  # Path.is_dir raises for a name that is too long
