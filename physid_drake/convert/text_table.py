"""Tables of text, as spreadsheets and motion-capture programs write them: any separator, decimal comma, preamble.

Where the numbers begin is found by looking: the first row of numbers that is followed by more of its width. What
stands right above it is the header, of one line or several: Motive writes kind, name, quantity and axis below one
another, Vicon writes names over the first column of each body and units below the axes.
"""

from __future__ import annotations

import contextlib
import csv
import io
import math
import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from physid_drake.convert.columns import Array, Columns, seconds_of, without_marks
from physid_drake.convert.notation import ANY, WRITTEN, decimal_of, is_empty, number_of, numbers_in
from physid_drake.convert.text_sections import Rows, states_units, tables_in, unit_said
from physid_drake.errors import RecordingError
from physid_drake.files import FileError, read_bytes
from physid_drake.wording import named, one_line, shown

MOST_BYTES: Final = 256_000_000
MOST_CELLS: Final = 40_000_000
"""Of a table: an hour of thirty columns at 360 Hz."""

MOST_COLUMNS: Final = 10_000

_REMARKS: Final = re.compile(r"(comment|remark|note|bemerkung|kommentar|commentaire)(s|en|e)?", re.IGNORECASE)
"""The last column's name, which rows may end before if all do: LabVIEW writes no field where nobody remarked."""

SEPARATORS: Final = (",", ";", "\t", "|", " ")
HEAD: Final = 20_000
"""Characters at the head of a file, in which its preamble is."""

LOOKED_AT: Final = 400
"""Lines at the head of a file that tell its separator and header."""


@dataclass(frozen=True, kw_only=True)
class Dialect:
    """How a table is written; None is found by looking.

    Attributes:
        separator: between fields.
        decimal: "." or ",".
        header_lines: lines above the first row of numbers that name the columns.
        encoding: of the text; UTF-8 with or without a byte-order mark, UTF-16 with one, else Latin-1.
        section: which of several tables in one file, from 1, as Vicon writes objects and markers below one another.
        skip_lines: at the top of the file.
    """

    separator: str | None = None
    decimal: str | None = None
    header_lines: int | None = None
    encoding: str | None = None
    section: int = 1
    skip_lines: int = 0


def read_text_table(path: Path, dialect: Dialect | None = None) -> Columns:
    """The columns of a file of text.

    Args:
        path: of the file.
        dialect: how it is written; what it leaves open is found by looking.

    Raises:
        RecordingError: if it cannot be read, or holds no table; one line that names the file.
    """
    dialect = dialect or Dialect()
    text = _read(path, dialect)
    if dialect.section > len(text.tables):
        raise RecordingError(
            f"{text.where}: has {len(text.tables)} table(s), but section {dialect.section} is asked for."
        )
    return replace(_table(text, dialect.section, dialect.header_lines), others=len(text.tables) - 1)


def read_text_tables(path: Path, most: int) -> dict[int, Columns]:
    """The tables of a file of text, by their number from 1 on; those behind the first only if they can be read.

    Args:
        path: of the file.
        most: tables that are read.

    Raises:
        RecordingError: if the first cannot be read; one line that names the file.
    """
    text = _read(path, Dialect())
    found = {1: _table(text, 1, None)}
    for section in range(2, min(len(text.tables), most) + 1):
        with contextlib.suppress(RecordingError):
            found[section] = _table(text, section, None)
    return found


@dataclass(frozen=True, kw_only=True)
class _Text:
    """What a file of text holds: its name, how it is written, a unit of length, headers and rows."""

    where: str
    separator: str
    decimal: str | None
    length: str | None
    tables: list[tuple[list[list[str]], Rows]]


def _read(path: Path, dialect: Dialect) -> _Text:
    try:
        text = _decoded(_unpacked(read_bytes(path, most=MOST_BYTES)), dialect.encoding)
    except FileError as error:
        raise RecordingError(f"{named(path)}: {error}.") from error
    where = named(path.name)
    text = "".join(text.splitlines(keepends=True)[dialect.skip_lines :])
    separator = dialect.separator or _separator(text)
    try:
        tables = tables_in(_split(text, separator))
    except csv.Error as error:
        raise RecordingError(f"{where}: no readable table: {one_line(error)}.") from error
    if not tables:
        raise RecordingError(
            f"{where}: no table of numbers was found, separated by {shown(separator)}; does it hold two columns and"
            " two rows of numbers? A map's 'source:' may say how it is written."
        )
    return _Text(where=where, separator=separator, decimal=dialect.decimal, length=_length_unit(text), tables=tables)


def _table(text: _Text, section: int, header_lines: int | None) -> Columns:
    """One of the tables, of whose header so many lines count."""
    header, body = text.tables[section - 1]
    if header_lines is not None:
        header = header[max(0, len(header) - header_lines) :]
    names, units = _names(header, _width(text.where, header, body))
    decimal = text.decimal or decimal_of(text.where, body.fields, text.separator)
    return replace(_columns(text.where, names, units, body, decimal), length=text.length)


def _width(where: str, header: list[list[str]], body: Rows) -> int:
    """How many columns a table has.

    Raises:
        RecordingError: if the header names more or fewer than the rows have fields, but for empty ones at their end:
            which name is which column's is then anybody's guess.
    """
    widths = [len(row) for row in body.fields]
    width = max(set(widths), key=widths.count)
    filled = max(len(_filled(row)) for row in body.fields)
    names = max((len(_filled(line)) for line in header), default=width)
    given = max(map(len, header), default=width)
    unremarked = set(widths) == {names - 1} and all(_REMARKS.fullmatch(line[-1]) for line in header[-1:] if line)
    if given < min(filled, width) or (names > max(widths) and not unremarked):
        raise RecordingError(
            f"{where}: row {body.lines[0]}: has {width} fields, but the header above it names {names} columns;"
            " correct the header, or give 'header_lines: 0' in the map's 'source:', which calls them column 1 to"
            f" column {width}."
        )
    if max(width, names) > MOST_COLUMNS:
        raise RecordingError(
            f"{where}: row {body.lines[0]}: has more than {MOST_COLUMNS:,} columns, which no log has."
        )
    return max(width, names if header else 0)


def _filled(fields: list[str]) -> list[str]:
    """Fields without the empty ones at their end."""
    last = max((k for k, field in enumerate(fields) if field), default=-1)
    return fields[: last + 1]


def _length_unit(text: str) -> str | None:
    """What a preamble says of lengths, as Motive does: ``Length Units,Millimeters``."""
    said = re.search(r"length\s+units?\W+(milli|centi)?met(?:er|re)s?\b", text[:HEAD], re.IGNORECASE)
    return None if said is None else {"milli": "mm", "centi": "cm"}.get((said[1] or "").lower(), "m")


def _unpacked(content: bytes) -> bytes:
    """What gzip packed, if it did."""
    if content[:2] != b"\x1f\x8b":
        return content
    unpack = zlib.decompressobj(zlib.MAX_WBITS | 16)
    try:
        text = unpack.decompress(content, MOST_BYTES)
    except zlib.error as error:
        raise FileError(f"cannot be read: it begins like gzip, but is not ({one_line(error)})") from error
    if not unpack.eof:
        raise FileError(f"cannot be read: it is cut off, or unpacks to more than {MOST_BYTES / 1e6:g} MB")
    return text


def _decoded(content: bytes, encoding: str | None) -> str:
    if encoding is not None:
        try:
            return content.decode(encoding)
        except (UnicodeDecodeError, LookupError) as error:
            raise FileError(f"cannot be read as {named(encoding)}: {one_line(error)}") from error
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        try:
            return content.decode("utf-16")
        except UnicodeDecodeError as error:
            raise FileError("cannot be read: it begins like UTF-16, but is not") from error
    if b"\0" in content[:4096]:
        raise FileError(
            "cannot be read: it is no text; it is a spreadsheet's or a program's own file: save it as CSV, or from"
            " Python as npz"
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _separator(text: str) -> str:
    """What cuts the lines into the most columns of numbers of equal count."""
    head = text[:200_000].splitlines()[:LOOKED_AT]

    def score(separator: str) -> tuple[int, int]:
        widths = [numbers_in(_fields(line, separator)) for line in head]
        usual = max(set(widths), key=lambda w: (widths.count(w) * (w > 1), w), default=0)
        # A decimal comma cuts numbers into two, so what separates without it goes first.
        clean = sum(numbers_in(_fields(line, separator)) == len(_fields(line, separator)) for line in head)
        return (widths.count(usual) if usual > 1 else 0, clean)

    if any(score(one)[0] > 1 for one in ("\t", ";", "|")):
        return max(("\t", ";", "|"), key=score)
    return max((",", " "), key=score)


def _fields(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    return [field.strip().strip('"') for field in line.split(separator)]


def _split(text: str, separator: str) -> Rows:
    fields: list[list[str]] = []
    lines: list[int] = []
    if separator == " ":
        for number, line in enumerate(text.splitlines(), 1):
            fields.append((re.sub(r"^(\s*#+)\s+", r"\1", line) if "#" in line else line).split())
            lines.append(number)
    else:
        reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
        for row in reader:
            fields.append([field.strip() for field in row])
            lines.append(reader.line_num)
    if sum(map(len, fields)) > MOST_CELLS:
        raise csv.Error(f"it has more than {MOST_CELLS:,} fields; cut the pushes out of it")
    return Rows(fields=fields, lines=lines)


def _names(header: list[list[str]], width: int) -> tuple[list[str], dict[str, str]]:
    """A name for every column, of all header lines, and the units that one of them states."""
    lines = [(line + [""] * width)[:width] for line in header]
    stated = [k for k, line in enumerate(lines) if states_units(line)]
    unit_line = lines.pop(stated[-1]) if stated and len(lines) > 1 else [""] * width
    for k, line in enumerate(lines[:-1]):
        lines[k] = _carried(line)
    names: dict[str, None] = {}
    for column in range(width):
        parts = [line[column] for line in lines if line[column]]
        name = "/".join(parts) or f"column {column + 1}"
        names[name if name not in names else f"{name} (column {column + 1})"] = None
    return list(names), {name: unit_said(unit) for name, unit in zip(names, unit_line, strict=True) if unit}


def _carried(line: list[str]) -> list[str]:
    """A line of a header whose names stand over the first column of each body only.

    What is named in every column from its first on has nothing to carry.
    """
    first = next((k for k, field in enumerate(line) if field), len(line))
    if all(line[first:]):
        return line
    carried, last = list(line), ""
    for k, field in enumerate(line):
        last = field or last
        carried[k] = last
    return carried


def _columns(where: str, names: Sequence[str], units: dict[str, str], body: Rows, decimal: str) -> Columns:
    numbers: dict[str, Array] = {}
    texts: dict[str, list[str]] = {}
    width = len(names)
    longer = next((k for k, row in enumerate(body.fields) if any(row[width:])), None)
    if longer is not None:
        raise RecordingError(f"{where}: row {body.lines[longer]}: has more fields than the table has columns.")
    for k, name in enumerate(names):
        fields = [row[k] if k < len(row) else "" for row in body.fields]
        values = np.array([number_of(field, decimal) for field in fields])
        there = [j for j, field in enumerate(fields) if not is_empty(field)]
        wrong = [j for j in there if not math.isfinite(values[j])]
        # Points in a table of decimal commas may be of either kind, so that no column of theirs is taken for words.
        words = [j for j in wrong if decimal == "." or math.isnan(number_of(fields[j], ANY))]
        if 2 * len(words) > len(there):
            times = seconds_of(["" if is_empty(field) else field for field in fields])
            if times is None:
                texts[name] = fields
            else:
                numbers[name], units[name] = times, "s"
            continue
        if wrong:
            raise _no_number(f"{where}: row {body.lines[wrong[0]]}: column {shown(name)}", fields[wrong[0]], decimal)
        numbers[name] = values
    numbers = without_marks(where, numbers)
    return Columns(source=where, numbers=numbers, texts=texts, units=units, rows=body.lines)


def _no_number(place: str, field: str, decimal: str) -> RecordingError:
    if WRITTEN.fullmatch(field):
        sign, other = ("comma", "point") if decimal == "," else ("point", "comma")
        return RecordingError(
            f"{place}: {shown(field)} is no number where a {sign} stands before decimals, as it does in this table,"
            f" and a {other} between groups of three digits; write all numbers alike."
        )
    return RecordingError(
        f"{place}: must be a finite number, but got {shown(field)}; leave the field empty if there is no sample."
    )
