"""YAML as people write it: one line says what is wrong with it, whatever that is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from physid_drake.errors import ConfigError

# A date of no calendar, a tag that does not fit its value, and a thousand brackets are no YAMLError.
NO_YAML = (yaml.YAMLError, ValueError, TypeError, AttributeError, RecursionError)


def parsed(text: str, where: str) -> Any:
    """The content of a YAML text.

    Args:
        text: YAML.
        where: it is from, for the message.

    Raises:
        ConfigError: if it is no YAML.
    """
    try:
        return yaml.safe_load(text)
    except NO_YAML as error:
        cause = " ".join(str(error).split()).rstrip(".") or type(error).__name__
        raise ConfigError(f"{where}: is no YAML: {cause}.") from error


def read_yaml(path: Path, where: str) -> Any:
    """The content of a YAML file.

    Args:
        path: of the file.
        where: it is from, for the message.

    Raises:
        ConfigError: if it is not there, cannot be read, or is no YAML.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise ConfigError(f"{where}: there is no such file.") from error
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{where}: cannot be read: {' '.join(str(error).split())}.") from error
    return parsed(text, where)
