"""The tables that a log consists of: its files, the tables of a text, and the rows of each body of a long table."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.convert.bodies import Body, bodies_of, rises
from physid_drake.convert.columns import Columns
from physid_drake.convert.map_text import quoted
from physid_drake.convert.names import words_of
from physid_drake.convert.tables import ARRAYS, TEXTS, read_columns
from physid_drake.convert.text_table import read_text_tables
from physid_drake.convert.times import FRAMES, Times, times_of
from physid_drake.errors import RecordingError
from physid_drake.recording.adapters.sources import source_files
from physid_drake.wording import named

MOST_TABLES: Final = 8
"""Of one log that are looked at."""

ID_WORDS: Final = frozenset(("id", "marker", "tag", "body", "sensor", "station", "tool", "track", "name", "object"))
MOST_IDS: Final = 12
"""Bodies that take turns in the rows of a table."""


@dataclass(kw_only=True)
class Table:
    """Columns of one clock or more that a map reads as one.

    Attributes:
        columns: of it.
        keys: what a stream of a map says to read it, as ``file: "tip.csv"``.
        label: what it is called in lists; nothing if it is the only one.
        repeats: whether it holds what another one does at another time, so that its bodies are no others.
        times: its times.
        bodies: in it.
    """

    columns: Columns
    keys: tuple[str, ...] = ()
    label: str = ""
    repeats: bool = False
    times: Times | None = None
    bodies: list[Body] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Looks for times and bodies."""
        self.times = self.times or times_of(self.columns)
        self.bodies = [] if self.repeats else bodies_of(self.columns)
        for body in self.bodies:
            body.name = f"{self.label} {body.name}".removesuffix(" ?") if self.label else body.name


@dataclass(frozen=True, kw_only=True)
class Log:
    """What is looked at of a log.

    Attributes:
        tables: of its first push, or of all.
        whole: whether one file, or one of each kind, is one push.
    """

    tables: Sequence[Table]
    whole: bool


def log_of(source: Path) -> Log:
    """Reads what a first map is made of.

    Raises:
        RecordingError: if it cannot be read.
    """
    if source.is_dir() and any((source / name).exists() for name in (".zgroup", ".zattrs", "zarr.json")):
        raise RecordingError(f"{named(source)}: holds zarr, which is not read; save its arrays as npz.")
    files = source_files(source, *TEXTS, *ARRAYS)
    kinds = _kinds(files) if source.is_dir() and len(files) > 1 else {}
    if len(kinds) > 1:
        tables = [
            Table(columns=read_columns(group[0]), keys=(f"file: {quoted(pattern)}",), label=group[0].stem)
            for pattern, group in list(kinds.items())[:MOST_TABLES]
        ]
        return Log(tables=tables, whole=len(next(iter(kinds.values()))) > 1)
    pattern, alike = _most(files)
    return Log(tables=_tables(alike[0], pattern), whole=len(files) > 1)


def _most(files: Sequence[Path]) -> tuple[str | None, Sequence[Path]]:
    """The files of the kind of most, by their names, and a pattern for them if others lie beside them."""
    alike = max(_by_name(files).values(), key=len)
    others = [file for file in files if file not in alike]
    usual = _names_in(alike[0]) if len(alike) > len(others) else None
    if usual is None or all(_names_in(file) == usual for file in others[:MOST_TABLES]):
        return None, files
    pattern = next(iter(_patterns([list(alike)], files)), None)
    return pattern, files if pattern is None else alike


def _names_in(file: Path) -> frozenset[str] | None:
    """The columns of numbers of a file; None if it holds no table."""
    try:
        return frozenset(read_columns(file).numbers)
    except RecordingError:
        return None


def _by_name(files: Sequence[Path]) -> dict[str, list[Path]]:
    """Files by their names, which may differ in numbers."""
    found: dict[str, list[Path]] = {}
    for file in files:
        found.setdefault(re.sub(r"\d+", "0", file.name), []).append(file)
    return found


def _tables(file: Path, pattern: str | None = None) -> list[Table]:
    """The tables of one file; ``pattern`` is that of all that are like it, where others lie beside them."""
    tables = _tables_in(file)
    for table in tables if pattern else ():
        table.keys = (f"file: {quoted(pattern or '')}", *table.keys)
    return tables


def _tables_in(file: Path) -> list[Table]:
    texts = {} if file.suffix.lower() in ARRAYS else read_text_tables(file, MOST_TABLES)
    if len(texts) > 1:
        return [
            Table(
                columns=one,
                keys=(f"section: {k}",) if k > 1 else (),
                label=f"section {k}",
                repeats=any(set(one.numbers) == set(texts[j].numbers) for j in texts if j < k),
            )
            for k, one in texts.items()
        ]
    columns = texts.get(1) or read_columns(file)
    tables = [Table(columns=columns)]
    if tables[0].times is None or tables[0].times.unit == FRAMES:
        return _by_id(columns) or tables
    return tables


def _by_id(columns: Columns) -> list[Table]:
    """Rows of each body, where bodies take turns and the times rise in those of each; none if they do not."""
    for name in [*columns.numbers, *columns.texts]:
        called = ID_WORDS & set(words_of(name)) or name == "column 1"
        if not called and not _takes_turns(columns.texts.get(name, ())):
            continue
        values: Sequence[Any] = columns.texts[name] if name in columns.texts else columns.numbers[name].tolist()
        own = sorted(set(values))
        if not 1 < len(own) <= MOST_IDS or len(values) < 3 * len(own):
            continue
        tables = [_rows_of(columns, name, value) for value in own]
        if all(table.times is not None and table.times.unit != FRAMES for table in tables):
            return tables
    return []


def _takes_turns(texts: Sequence[str]) -> bool:
    """Whether words change from most rows to the next, as the names of bodies do; what is valid does not."""
    changes = sum(one != other for one, other in pairwise(texts))
    return all(texts) and 2 * changes > len(texts)


def _rows_of(columns: Columns, name: str, value: float | str) -> Table:
    """The rows in which a column has a value."""
    kept = np.array([one == value for one in (columns.texts if name in columns.texts else columns.numbers)[name]])
    numbers = {n: v[kept] for n, v in columns.numbers.items() if len(v) == len(kept) and n != name}
    texts = {n: _picked(v, kept) for n, v in columns.texts.items() if len(v) == len(kept) and n != name}
    said = quoted(value) if isinstance(value, str) else f"{value:g}"
    return Table(
        columns=replace(columns, numbers=numbers, texts=texts),
        keys=(f"where: {{{quoted(name)}: {said}}}",),
        label=f"{name} {value if isinstance(value, str) else said}",
    )


def _picked(texts: Sequence[str], kept: NDArray[np.bool_]) -> list[str]:
    return [text for text, there in zip(texts, kept, strict=True) if there]


def _kinds(files: Sequence[Path]) -> Mapping[str, list[Path]]:
    """Files by kind, each called by a name or a pattern, if each kind holds one stream; none if files are pushes.

    Those of a kind have the same columns, or names that differ in numbers only; there are equally many of each.
    """
    by_name = _by_name(files)
    most = max(map(len, by_name.values()))
    # A file of notes beside many of pushes is none of them.
    groups = [group for group in by_name.values() if len(group) == most or most == 1]
    if sum(map(len, groups)) < len(files) - most or not 1 < len(groups) <= MOST_TABLES:
        return {}
    numbers = {tuple(tuple(re.findall(r"\d+", file.name)) for file in group) for group in groups}
    if len(groups[0]) > 1 and len(numbers) == 1:
        return _patterns(groups, files)
    if len(groups[0]) > 1:
        return {}
    columns = [read_columns(group[0]) for group in groups]
    if len({frozenset(one.numbers) for one in columns}) == len(columns) or _overlap(columns):
        return _patterns(groups, files)
    return {}


def _overlap(columns: Sequence[Columns]) -> bool:
    """Whether all tables were written at the same time, by clocks that did not begin with them, or row by row."""
    clocks = [times_of(one) for one in columns]
    if not any(clocks):
        return len({len(values) for one in columns for values in one.numbers.values()}) == 1
    spans = []
    for one, times in zip(columns, clocks, strict=True):
        seconds = None if times is None else times.seconds(one)
        if seconds is None or not rises(seconds):
            return False
        spans.append((float(np.nanmin(seconds)), float(np.nanmax(seconds))))
    begin, end = max(span[0] for span in spans), min(span[1] for span in spans)
    return begin < end and min(span[0] for span in spans) > max(last - first for first, last in spans)


def _patterns(groups: Sequence[list[Path]], files: Sequence[Path]) -> dict[str, list[Path]]:
    """A name for one file, a pattern for several; none if a pattern takes in other files."""
    found: dict[str, list[Path]] = {}
    for group in groups:
        pattern = group[0].name if len(group) == 1 else re.sub(r"\d+", "*", group[0].name)
        if len(group) > 1 and sum(fnmatchcase(file.name, pattern) for file in files) != len(group):
            return {}
        found[pattern] = group
    return found
