"""How a table writes its numbers: which sign stands before decimals, and which between groups of three digits."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Final

from physid_drake.errors import RecordingError
from physid_drake.wording import shown

EMPTY: Final = frozenset({"", "nan", "na", "n/a", "#n/a", "#na", "null", "none", "lost", "-", "--"})
"""Words in lower case that stand where there is no sample."""

ANY: Final = ".,"
"""Either sign, where it is not known yet which stands before decimals."""

WRITTEN: Final = re.compile(r"[+-]?[\d.,]*\d[\d.,]*(?:[eE][+-]?\d+)?")
"""What is meant for a number, whether or not its signs are in their places."""

_USUAL: Final = re.compile(r"[+-]?\d+([.,])\d*")
_ONE_GROUP: Final = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")
_SPACED: Final = re.compile(r"[+-]?[1-9]\d{0,2}(?:[ \u00a0\u202f]\d{3})+[.,]\d*")
"""Without decimals, two numbers in one field look the same."""

_QUOTED: Final = re.compile(r"[+-]?[1-9]\d{0,2}(?:['\u2019]\d{3})+(?:[.,]\d*)?")
_GROUPED: Final = {
    ".": re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+(?:\.\d*)?"),
    ",": re.compile(r"[+-]?[1-9]\d{0,2}(?:\.\d{3})+(?:,\d*)?"),
}
_OTHER: Final = {".": ",", ",": "."}


def number_of(field: str, decimal: str) -> float:
    """A field's number; NaN where it holds none. Python alone reads 1_000 and other scripts' digits.

    Args:
        field: as it is written.
        decimal: the sign before decimals, or ``ANY``; the other one stands between groups of three digits.
    """
    if decimal == ANY:
        value = number_of(field, ".")
        return number_of(field, ",") if math.isnan(value) else value
    field = _ungrouped(field)
    other = _OTHER[decimal]
    if other in field:
        if not _GROUPED[decimal].fullmatch(field):
            return math.nan
        field = field.replace(other, "")
    field = field.replace(decimal, ".")
    if not field or "_" in field or not field.isascii():
        return math.nan
    try:
        value = float(field)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan


def numbers_in(fields: Sequence[str], decimal: str = ANY) -> int:
    """How many fields hold numbers."""
    return sum(math.isfinite(number_of(field, decimal)) for field in fields)


def is_empty(field: str) -> bool:
    """Whether a field says that there is no sample."""
    return field.lower() in EMPTY


def decimal_of(where: str, rows: Iterable[Sequence[str]], separator: str) -> str:
    """The sign before decimals in all numbers of a table.

    A number with both signs tells it; else one whose sign has other than a group of three digits behind it.

    Raises:
        RecordingError: if it is either, and numbers are a thousand times larger by one than by the other.
    """
    fields = [field for row in rows for field in row if "," in field or field.count(".") > 1]
    if not fields:
        return "."
    said = Counter(filter(None, (_said(field) for row in rows for field in row)))
    for surest in ("both", "one"):
        if said[surest, "."] or said[surest, ","]:
            return "," if said[surest, ","] > said[surest, "."] else "."
    if not said["either", ","]:
        return "."
    if said["either", "."] or separator == ",":
        raise RecordingError(
            f"{where}: its numbers, such as {shown(fields[0])}, do not tell whether a comma stands before decimals or"
            " between thousands; give 'decimal: \".\"' or 'decimal: \",\"' in a map's 'source:'."
        )
    return ","


def _ungrouped(field: str) -> str:
    """A field without the spaces or quotes between its groups of digits."""
    if field.isascii() and " " not in field and "'" not in field:
        return field
    if _SPACED.fullmatch(field) or _QUOTED.fullmatch(field):
        return re.sub("[ '\u00a0\u202f\u2019]", "", field)
    return field


def _said(field: str) -> tuple[str, str] | None:
    """How surely a number tells the sign before decimals, and which; None if it tells nothing."""
    usual = _USUAL.fullmatch(field)
    if usual:
        return ("either" if _ONE_GROUP.fullmatch(field) else "one", usual[1])
    bare = _ungrouped(field)
    sign = max(".,", key=bare.rfind)
    if sign not in bare or not WRITTEN.fullmatch(bare):
        return None
    if _OTHER[sign] in bare:
        return ("both", sign) if bare.count(sign) == 1 else None
    if bare.count(sign) > 1:
        return ("both", _OTHER[sign]) if _GROUPED[_OTHER[sign]].fullmatch(bare) else None
    return "one", sign
