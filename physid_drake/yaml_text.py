"""YAML as people write it: one line says what is wrong with it, whatever that is."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml

from physid_drake.errors import ConfigError

# A date of no calendar, a tag that does not fit its value, and a thousand brackets are no YAMLError.
NO_YAML = (yaml.YAMLError, ValueError, TypeError, AttributeError, RecursionError)
WHOLE = re.compile(r"[-+]?(0|[1-9][0-9_]*|0x[0-9a-fA-F_]+)")


class _Loader(yaml.SafeLoader):
    """YAML in which nothing is there twice, and no number is another than it looks."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        keys = [key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode) and key.value != "<<"]
        for k, key in enumerate(keys):
            if key in keys[:k]:
                raise yaml.constructor.ConstructorError(None, None, f"key '{key}' is there twice", node.start_mark)
        return super().construct_mapping(node, deep=deep)

    def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
        """YAML 1.1 takes 010 for 8 and 1:30 for 90."""
        text = str(node.value)
        if not WHOLE.fullmatch(text):
            raise yaml.constructor.ConstructorError(None, None, f"'{text}' is no number in base 10", node.start_mark)
        return int(super().construct_yaml_int(node))


_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.construct_yaml_int)


def parsed(text: str, where: str) -> Any:
    """The content of a YAML text.

    Args:
        text: YAML.
        where: it is from, for the message.

    Raises:
        ConfigError: if it is no YAML.
    """
    try:
        return yaml.load(text, Loader=_Loader)
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
    except (OSError, ValueError) as error:  # no UTF-8; a path with a NUL
        raise ConfigError(f"{where}: cannot be read: {' '.join(str(error).split())}.") from error
    return parsed(text, where)
