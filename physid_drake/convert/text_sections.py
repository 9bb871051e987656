"""Where the tables of a text are: their headers, of one line or several, and their rows of numbers.

A line that begins with ``#`` is a header if it names every column, as NumPy's and TUM's do, and a comment otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from physid_drake.convert.notation import is_empty, numbers_in
from physid_drake.convert.units import UNITS


@dataclass(frozen=True, kw_only=True)
class Rows:
    """Fields of the lines of a table, and each line's number in the file."""

    fields: list[list[str]]
    lines: list[int]


def _begins(rows: Rows, k: int) -> bool:
    """Whether a table's numbers may begin with a row: two or more, half of what is there, and more below.

    Where all but the first are empty, nothing was seen yet.
    """
    fields = rows.fields[k]
    if len(fields) < 2:
        return False
    numbers, there = numbers_in(fields), sum(not is_empty(field) for field in fields)
    following = rows.fields[k + 1] if k + 1 < len(rows.fields) else []
    if fields and fields[0].startswith("#") and not (following and following[0].startswith("#")):
        return False
    if numbers == there == 1 and len(fields) == len(following):
        return numbers_in(fields[:1]) == numbers_in(following[:1]) == 1
    return numbers >= 2 and 2 * numbers >= there and numbers_in(following) > 0


def tables_in(rows: Rows) -> list[tuple[list[list[str]], Rows]]:
    """Header lines and body of every table in the file: a body lasts until a line with one word."""
    found: list[tuple[list[list[str]], Rows]] = []
    k, bottom = 0, 0
    while k < len(rows.fields):
        if not _begins(rows, k):
            k += 1
            continue
        header = _header(rows, k, bottom)
        bottom = _end(rows, k)
        width = len(rows.fields[k])
        kept = [j for j in range(k, bottom) if _there(rows.fields[j]) and not _is_remark(rows.fields[j], width)]
        body = Rows(fields=[rows.fields[j] for j in kept], lines=[rows.lines[j] for j in kept])
        found.append((header, body))
        k = bottom
    return found


def _header(rows: Rows, k: int, bottom: int) -> list[list[str]]:
    """Lines of the header of the numbers from row ``k`` on, none above ``bottom``; of comments, one that names."""
    width, header = len(rows.fields[k]), list[list[str]]()
    for j in range(_below_header(rows, k, bottom) - 1, bottom - 1, -1):
        line = rows.fields[j]
        if line and line[0].startswith("#") and (line[0] != "#" or len(line) != width):
            line = _bare(line, width)
        if not _is_header(line, width):
            break
        header.insert(0, line)
        if line is not rows.fields[j] and not states_units(line):
            break
    return header


def _below_header(rows: Rows, k: int, bottom: int) -> int:
    """Index behind the header of the numbers from row ``k`` on: TRC files leave a line between."""
    blank = k - 1 > bottom and not _there(rows.fields[k - 1])
    return k - 1 if blank and len(_there(rows.fields[k - 2])) > 1 and _as_wide(rows, k - 2, k) else k


def _as_wide(rows: Rows, j: int, k: int) -> bool:
    """Whether two rows have equally many fields, but for a separator at the end."""
    return abs(len(rows.fields[j]) - len(rows.fields[k])) <= 1


def _is_remark(fields: Sequence[str], width: int) -> bool:
    """Whether a line between rows is a comment; a table's first column may hold #1, #2, ..."""
    return fields[0].startswith("#") and len(fields) != width


def _bare(fields: Sequence[str], width: int) -> list[str]:
    """A comment's names of all columns; none if it does not name each."""
    first = fields[0].lstrip("#").strip()
    names = [first, *fields[1:]] if first else list(fields[1:])
    return names if len(names) == width and not numbers_in(names) else []


def _is_header(fields: Sequence[str], width: int) -> bool:
    """Whether a line is one of a header, and not of the preamble's pairs of a key and its value above it."""
    there = len(_there(fields))
    if len(fields) == width or (len(fields) == width - 1 and there > 1):
        return there > 0
    # Names over the first column of each body may end before the table does.
    carried = not fields or not fields[0]
    return there > 0 and not numbers_in(fields) and (carried or 2 * len(fields) >= width)


def _end(rows: Rows, start: int) -> int:
    """Index behind the last row of a table; a blank line within it is none of its rows."""
    width, k = len(rows.fields[start]), start
    while k < len(rows.fields):
        fields = rows.fields[k]
        if not _there(fields):
            after = next((j for j in range(k, len(rows.fields)) if _there(rows.fields[j])), len(rows.fields))
            if after == len(rows.fields) or len(rows.fields[after]) != width:
                return k
            k = after if numbers_in(rows.fields[after]) else len(rows.fields)
            continue
        if len(_there(fields)) == 1 and not numbers_in(fields):
            return k
        k += 1
    return k


def _there(fields: Sequence[str]) -> list[str]:
    return [field for field in fields if field]


def states_units(line: Sequence[str]) -> bool:
    """Whether a line of a header holds nothing but units."""
    return bool(_there(line)) and all(unit_said(field) in UNITS for field in _there(line))


def unit_said(field: str) -> str:
    """The unit in a field, which may stand in brackets."""
    return field.strip("()[] ")
