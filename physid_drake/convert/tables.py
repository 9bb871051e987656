"""Tables of a log: which file, which table in it and which rows are each stream's, and what is one push of it."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.convert.arrays import READERS, read_array_table
from physid_drake.convert.columns import Columns
from physid_drake.convert.cutting import rows_by_value
from physid_drake.convert.mapping import ForceMap, Map, PoseMap, Rows, listed
from physid_drake.convert.text_table import read_text_table
from physid_drake.errors import RecordingError
from physid_drake.wording import named, shown

TEXTS: Final = (".csv", ".tsv", ".txt", ".dat", ".trc")
ARRAYS: Final = tuple(READERS)

Parts = list[tuple[str, Map, Mapping[str, Columns]]]
"""What of a log is cut on its own: a label, the map with the columns' names in it, and the columns of each stream."""

Logs = Iterator[tuple[str, Callable[[], Parts]]]
"""Logs by name, each read when it is its turn."""

_Tables = Mapping[str, Columns]


def read_columns(file: Path, chart: Map | None = None, section: int | None = None) -> Columns:
    """The columns of a table, by the kind of its file.

    Args:
        file: of the table.
        chart: which says how a text is written.
        section: which of several tables in one text, if that is not the map's.

    Raises:
        RecordingError: if it cannot be read.
    """
    if file.suffix.lower() in ARRAYS:
        return read_array_table(file)
    dialect = None if chart is None else chart.dialect
    if dialect is not None and section is not None:
        dialect = replace(dialect, section=section)
    return read_text_table(file, dialect)


def table_logs(files: Sequence[Path], chart: Map) -> Logs:
    """The logs that files are: each file is one, or those that the map's streams name belong together.

    Args:
        files: of the source, in the order of names.
        chart: the map.

    Raises:
        RecordingError: if a stream names no file, or one more than another does.
    """
    streams = _streams(chart)
    for key, stream in streams.items():
        if stream.topic is not None:
            raise RecordingError(f"{key}: topic is of bags; give columns, or use `convert bag`.")
    matched = {key: _matching(files, key, stream.rows.file) for key, stream in streams.items()}
    if len({len(some) for some in matched.values()}) > 1:
        said = listed([f"{key} has {len(some)}" for key, some in matched.items()])
        raise RecordingError(f"streams need equally many files, the first of each with the first, but {said}.")
    _check_pairs({key: stream.rows.file for key, stream in streams.items()}, matched)
    left = [file.name for file in files if not any(file in some for some in matched.values())]
    if left:
        warnings.warn(f"no stream is in {named(left[0])}{_more(left)}: left out.", UserWarning, stacklevel=2)
    for k, file in enumerate(matched["object"]):
        yield file.name, partial(_log, {key: some[k] for key, some in matched.items()}, chart)


def _streams(chart: Map) -> dict[str, PoseMap | ForceMap]:
    """Those that a map has, by key."""
    every = {"object": chart.object, "hand": chart.hand_path, "force": chart.force}
    return {key: stream for key, stream in every.items() if stream is not None}


def _matching(files: Sequence[Path], key: str, pattern: str | None) -> list[Path]:
    found = [file for file in files if pattern is None or pattern == file.name or fnmatchcase(file.name, pattern)]
    if not found:
        raise RecordingError(f"{key}: no file of the source is called {shown(pattern)}; it holds {_names(files)}.")
    return found


def _check_pairs(patterns: Mapping[str, str | None], matched: Mapping[str, Sequence[Path]]) -> None:
    """Warns where files that are taken together differ in what stands for the pattern's ``*``."""
    for files in zip(*matched.values(), strict=True):
        middles = {_middle(file.name, pattern) for file, pattern in zip(files, patterns.values(), strict=True)}
        if len(middles) > 1 and len(set(files)) > 1:
            said = listed([named(file.name) for file in dict.fromkeys(files)])
            warnings.warn(
                f"files are taken together in the order of their names, such as {said}; do they belong together?",
                UserWarning, stacklevel=3,
            )  # fmt: skip
            return


def _middle(name: str, pattern: str | None) -> str:
    """What stands for the ``*`` of a pattern; nothing where that has not just one."""
    before, star, after = (pattern or "").partition("*")
    return name[len(before) : len(name) - len(after)] if star and "*" not in after else ""


def _names(files: Sequence[Path]) -> str:
    return ", ".join(named(file.name) for file in files[:5]) + _more(files[4:])


def _more(some: Sequence[object]) -> str:
    return f" and {len(some) - 1} more" if len(some) > 1 else ""


def _log(where: Mapping[str, Path], chart: Map) -> Parts:
    """What of one log is cut on its own."""
    read: dict[tuple[Path, int | None], Columns] = {}
    tables: dict[str, Columns] = {}
    for key, stream in _streams(chart).items():
        place = where[key], stream.rows.section
        if place not in read:
            read[place] = read_columns(where[key], chart, stream.rows.section)
        tables[key] = _picked(key, read[place], stream.rows)
    if chart.cut.by == "sections":
        return _sections(where["object"], chart)
    _warn_of_more(tables, chart)
    if chart.cut.by == "rows":
        return [(f", row {row}", chart, dict.fromkeys(tables, part)) for row, part in _single_rows(tables["object"])]
    if chart.cut.by == "column" and chart.cut.column is not None:
        return _by_value(tables, chart.cut.column, chart)
    return [("", chart, tables)]


def _sections(file: Path, chart: Map) -> Parts:
    """Each table of a text as a push; those that hold nothing of the object are left out."""
    count = 1 + read_columns(file, chart, 1).others
    parts: Parts = []
    left: list[int] = []
    for k in range(1, count + 1):
        try:
            columns = read_columns(file, chart, k)
            columns.stack(chart.object.position.columns)
        except RecordingError:
            if count == 1:
                raise
            left.append(k)
            continue
        picked = {key: _picked(key, columns, stream.rows) for key, stream in _streams(chart).items()}
        parts.append((f", section {k}", chart, picked))
    if left:
        said = listed([str(k) for k in left[:5]])
        warnings.warn(
            f"{named(file.name)}: section {said}{_more(left[4:])} hold no places of the object: left out.",
            UserWarning, stacklevel=2,
        )  # fmt: skip
    return parts


def _warn_of_more(tables: _Tables, chart: Map) -> None:
    """Says that a text has more tables, where the map names none of them."""
    others = max(columns.others for columns in tables.values())
    if others and chart.dialect.section == 1 and all(one.rows.section is None for one in _streams(chart).values()):
        warnings.warn(
            f"{tables['object'].source}: {others} more tables are not read: a stream's section: 2 names another one,"
            " and pushes: {cut: sections} takes each for a push.",
            UserWarning, stacklevel=2,
        )  # fmt: skip


def _picked(key: str, columns: Columns, rows: Rows) -> Columns:
    """The rows in which columns have the values that a map asks for."""
    for name, value in rows.where:
        found = name if name in columns.texts else columns.find(name)
        there = np.array(columns.texts[found]) if found in columns.texts else columns.numbers[found]
        truth = {"True": 1.0, "False": 0.0}
        wanted = str(value) if found in columns.texts else truth.get(str(value), value)
        chosen = np.flatnonzero(there == wanted)
        if not len(chosen):
            some = sorted({str(one) if found in columns.texts else f"{one:g}" for one in there.tolist()})
            sought = shown(value) if isinstance(value, str) else f"{value:g}"
            raise RecordingError(f"{key}: no row has {named(found)} {sought}; there are {', '.join(some[:8])}.")
        columns = _rows(columns, chosen, len(there))
    return columns


def _rows(columns: Columns, chosen: NDArray[np.intp], count: int) -> Columns:
    """Some rows of the columns that have so many; the others go."""
    return replace(
        columns,
        numbers={name: values[chosen] for name, values in columns.numbers.items() if len(values) == count},
        texts={name: [texts[k] for k in chosen] for name, texts in columns.texts.items() if len(texts) == count},
        rows=[columns.rows[k] for k in chosen] if len(columns.rows) == count else (),
    )


def _by_value(tables: _Tables, column: str, chart: Map) -> Parts:
    """A table's rows by the value of a column; of several tables, those in which it has the same one."""
    runs: dict[str, list[tuple[str, NDArray[np.intp]]]] = {}
    for key, columns in tables.items():
        try:
            runs[key] = _runs(columns, column)
        except RecordingError as error:
            raise RecordingError(f"pushes: {error}") from error
        if [value for value, _ in runs[key]] != [value for value, _ in runs["object"]]:
            raise RecordingError(f"pushes: {shown(column)} has other values for {key} than for object.")
    body = tables["object"]
    name = column if column in body.texts else body.find(column)
    for value, count in Counter(value for value, _ in runs["object"]).items():
        if count > 1:
            warnings.warn(
                f"{body.source}: {name} {value} comes in {count} pieces, and each is taken for a push.",
                UserWarning, stacklevel=2,
            )  # fmt: skip
    parts: Parts = []
    for k, (value, _) in enumerate(runs["object"]):
        cut: dict[str, Columns] = {}
        for key, columns in tables.items():
            count = len(columns.texts.get(column) or columns.numbers[columns.find(column)])
            cut[key] = replace(_rows(columns, runs[key][k][1], count), texts={}, rows=())
        parts.append((f", {name} {value}", chart, cut))
    return parts


def _runs(columns: Columns, column: str) -> list[tuple[str, NDArray[np.intp]]]:
    """Rows in which a column keeps its number, or its text, and that; empty fields are between pushes."""
    if column not in columns.texts:
        return [(f"{value:g}", rows) for value, rows in rows_by_value(columns.numbers[columns.find(column)])]
    texts = np.array(columns.texts[column])
    edges = np.flatnonzero(texts[1:] != texts[:-1]) + 1
    runs = [(str(texts[rows[0]]), rows) for rows in np.split(np.arange(len(texts)), edges) if len(rows)]
    return [(text, rows) for text, rows in runs if text.strip()]


def _single_rows(columns: Columns) -> Iterator[tuple[int, Columns]]:
    """Each row of a table on its own, by its line."""
    for k in range(max(map(len, columns.numbers.values()))):
        numbers = {name: values[k : k + 1] for name, values in columns.numbers.items()}
        yield (columns.rows[k] if columns.rows else k), replace(columns, numbers=numbers, texts={}, rows=())
