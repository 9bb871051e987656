"""YAML of a recording or a map: its values, and the line on which each key stands."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import yaml

from physid_drake.errors import RecordingError
from physid_drake.wording import named
from physid_drake.yaml_text import NO_YAML, PlainLoader, cause

_TEXT_KEYS: Final = ("name", "description", "file", "note", "source", "source_sha256", "map", "map_sha256")
_LOOKS: Final = tuple(f"tag:yaml.org,2002:{kind}" for kind in ("int", "float", "bool", "timestamp"))


class _Loader(PlainLoader):
    """Reads ``1e-3`` as a number, which YAML 1.1 takes for text."""


class Dumper(yaml.SafeDumper):
    """Quotes a text that other readers would take for a number: a name like ``66e70658``."""


for _resolves in (_Loader, Dumper):
    _resolves.add_implicit_resolver(
        "tag:yaml.org,2002:float",
        re.compile(r"^[-+]?[0-9][0-9]*(\.[0-9]*)?[eE][-+]?[0-9]+$"),
        list("-+0123456789"),
    )


def values_and_lines(text: str, file: Path) -> tuple[object, dict[str, int]]:
    """The content of a YAML text, and the line of each key by its path: ``object.size_m``, ``pushes[3].file``.

    Args:
        text: YAML.
        file: it is from, for the message.

    Raises:
        RecordingError: if it is no YAML, or a key stands twice; one line that names file and line.
    """
    place = named(file)
    try:
        loader = _Loader(text)
        node = loader.get_single_node()
        lines: dict[str, int] = {}
        _number_lines(file, node, "", lines)
        _keep_texts(node)
        return None if node is None else loader.construct_document(node), lines
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line, problem = mark.line + 1 if mark is not None else 1, named(error.problem or error.context)
        raise RecordingError(f"{place}: line {line}: not valid YAML: {problem}; correct it.") from error
    except NO_YAML as error:
        if isinstance(error, RecordingError):
            raise
        raise RecordingError(f"{place}: line 1: not valid YAML: {cause(error)}; correct it.") from error


def _number_lines(file: Path, node: yaml.Node | None, path: str, lines: dict[str, int]) -> None:
    """Notes the line of every key, and refuses a key that stands twice."""
    if node is None:
        return
    lines.setdefault(path, node.start_mark.line + 1)
    if isinstance(node, yaml.SequenceNode):
        for k, child in enumerate(node.value):
            _number_lines(file, child, f"{path}[{k}]", lines)
    elif isinstance(node, yaml.MappingNode):
        seen = set()
        for key, child in node.value:
            inner = f"{path}.{key.value}".strip(".")
            line = key.start_mark.line + 1
            if not isinstance(key, yaml.ScalarNode):
                place = f"{named(file)}: line {line}: {named(path) or 'the file'}"
                raise RecordingError(f"{place}: a key must be one word; correct it.")
            if key.value in seen:
                raise RecordingError(f"{named(file)}: line {line}: {named(inner)}: the key stands twice; remove one.")
            seen.add(key.value)
            lines[inner] = line
            _number_lines(file, child, inner, lines)


def _keep_texts(node: yaml.Node | None) -> None:
    """Keeps a name as it was written where it looks like a number, a date or a truth value: ``12345678``, ``3e8``."""
    if isinstance(node, yaml.SequenceNode):
        for child in node.value:
            _keep_texts(child)
    elif isinstance(node, yaml.MappingNode):
        for key, child in node.value:
            if key.value in _TEXT_KEYS and child.tag in _LOOKS:
                child.tag = "tag:yaml.org,2002:str"
            _keep_texts(child)
