"""JSON as a table: arrays by name, or one record for each sample, in one file (json) or one a line (jsonl).

What nests is named by its path: ``object/position[0]``. A list of records whose lists differ in length holds one push
each, and is read as groups ``pushes[0]``, ``pushes[1]``, which are joined.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from physid_drake.convert.groups import Unread
from physid_drake.files import FileError, read_bytes
from physid_drake.wording import one_line

MOST_BYTES: Final = 100_000_000
"""Of text; Python takes ten times as much for what it says."""
MOST_DEPTH: Final = 8
MOST_ARRAYS: Final = 50_000
MOST_NUMBERS: Final = 40_000_000
_PLAIN: Final = (int, float, bool, str, type(None))


def read_json(path: Path) -> dict[str, Any]:
    """What a file of JSON holds, by path.

    Raises:
        FileError: if it is too large, no JSON, or nests deeper or holds more arrays than a log does.
    """
    found: dict[str, Any] = {}
    _collect("", _parsed(_text(path)), found, depth=0)
    return found


def read_json_lines(path: Path) -> dict[str, Any]:
    """What a file holds that has one record in every line, by path; raises as ``read_json`` does."""
    lines = [(k, line) for k, line in enumerate(_text(path).splitlines(), 1) if line.strip()]
    found: dict[str, Any] = {}
    _collect("", [_parsed(line, f"line {k}: ") for k, line in lines], found, depth=0)
    return found


def _text(path: Path) -> str:
    try:
        return read_bytes(path, most=MOST_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError(f"cannot be read: no text in UTF-8 ({one_line(error)})") from error


def _parsed(text: str, where: str = "") -> Any:
    try:
        return json.loads(text)
    except RecursionError as error:
        raise FileError(f"cannot be read: {where}nests deeper than a log does") from error
    except ValueError as error:
        raise FileError(f"cannot be read: {where}no JSON, or damaged ({one_line(error)})") from error


def _collect(path: str, value: Any, found: dict[str, Any], depth: int) -> None:
    """Adds the arrays of a value to those found."""
    if depth > MOST_DEPTH or len(found) > MOST_ARRAYS:
        raise FileError("it nests deeper, or holds more arrays, than a log does")
    if isinstance(value, dict):
        for name, inner in value.items():
            _collect(f"{path}/{name}" if path else name, inner, found, depth + 1)
    elif isinstance(value, list) and value and all(isinstance(one, dict) for one in value):
        _collect_records(path, value, found, depth + 1)
    elif isinstance(value, list):
        found[path or "array"] = _array(value)
    else:
        found[path or "value"] = Unread(why="it is a single value")


def _collect_records(path: str, records: Sequence[Mapping[str, Any]], found: dict[str, Any], depth: int) -> None:
    leaves: dict[str, list[Any]] = {}
    for k, record in enumerate(records):
        for name, value in _leaves("", record, depth):
            column = leaves.setdefault(name, [])
            column.extend([*[None] * (k - len(column)), value])
            _check_size(len(leaves) * len(records))
    for column in leaves.values():
        column.extend([None] * (len(records) - len(column)))
    if any(len({len(value) for value in column if isinstance(value, list)}) > 1 for column in leaves.values()):
        for k, record in enumerate(records):
            _collect(f"{path or 'pushes'}[{k}]", dict(record), found, depth)
        return
    for name, column in leaves.items():
        found[f"{path}/{name}" if path else name] = _array(column)


def _leaves(path: str, value: Any, depth: int) -> list[tuple[str, Any]]:
    """What a record says, by path: plain values, and lists of them."""
    if depth > MOST_DEPTH:
        raise FileError("it nests deeper, or holds more arrays, than a log does")
    if isinstance(value, dict):
        inner = [(f"{path}/{name}" if path else name, one) for name, one in value.items()]
    elif isinstance(value, list) and value and all(isinstance(one, dict) for one in value):
        inner = [(f"{path}[{k}]", one) for k, one in enumerate(value)]
    else:
        return [(path, value)]
    return [leaf for name, one in inner for leaf in _leaves(name, one, depth + 1)]


def _check_size(numbers: int) -> None:
    """Missing values take as much as others, and no letter of the file."""
    if numbers > MOST_NUMBERS:
        raise FileError(f"it has more than {MOST_NUMBERS:,} numbers; cut the pushes out of it")


def _array(values: Sequence[Any]) -> Any:
    """An array of equal values or lists, NaN where one is missing; or why there is none."""
    there = next((value for value in values if value is not None), None)
    if any(isinstance(value, str) for value in values):
        plain = all(isinstance(value, _PLAIN) for value in values)
        texts = ["" if value is None else str(value) for value in values]
        return np.array(texts, dtype=object) if plain else Unread(why="it holds lists among words")
    try:
        empty = np.full(np.shape(there), np.nan) if isinstance(there, list) else np.nan
        _check_size(len(values) * np.size(empty))
        return np.array([empty if value is None else value for value in values], dtype=np.float64)
    except (ValueError, TypeError, OverflowError) as error:
        return Unread(why=f"its values are no numbers of one shape ({one_line(error)})")
