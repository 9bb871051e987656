"""Where a recording is that somebody names: a folder of their own, or one that ships."""

from __future__ import annotations

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
        if not path.exists() and path.parent == Path() and (shipped("recordings") / text).is_dir():
            return shipped("recordings") / text
    except (OSError, ValueError) as error:  # too long a name, a NUL in it
        raise ConfigError(f"recording {shown(text)}: nothing can have such a name.") from error
    return path
