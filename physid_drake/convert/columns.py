"""What a foreign log holds once its format is out of the way: named columns of numbers, some of them of one clock."""

from __future__ import annotations

import difflib
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.convert.time_words import is_timecode, seconds_of
from physid_drake.convert.units import UNITS, symbol_of
from physid_drake.errors import RecordingError
from physid_drake.wording import shown

__all__ = ["Array", "Columns", "seconds_of", "without_marks"]

Array = NDArray[np.float64]

_BRACKETED: Final = re.compile(r"[\[(]([^\[\]()]+)[\])]\s*$")
MOST_NAMED = 3
"""Names offered where one is unknown."""

NO_MEASUREMENT: Final = 1e20
"""Nothing is measured to be so large in any unit, times in ns since 1970 included: programs write such numbers, as
the largest that a float can hold, where there was no sample."""


@dataclass(frozen=True, kw_only=True)
class Columns:
    """Columns of one log; those of one length belong together, row by row.

    Attributes:
        source: the log, for messages: a file's name, or that of a topic in it.
        numbers: (n,) by name; NaN where a field is empty.
        texts: columns that hold what is no number, as it stands there.
        units: of the columns whose header states one.
        length: the unit of all lengths, where the file's preamble states one.
        rows: (n,) the line of each row in a text, or its index, for messages.
        unread: what else the log holds, by name, and why it is no column.
        others: further tables in the same text.
    """

    source: str
    numbers: Mapping[str, Array]
    texts: Mapping[str, Sequence[str]] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    length: str | None = None
    rows: Sequence[int] = ()
    unread: Mapping[str, str] = field(default_factory=dict)
    others: int = 0

    def find(self, name: str) -> str:
        """The column that a map means: by its whole name, or by the end of it where only one has that end.

        Raises:
            RecordingError: if there is none, more than one, or it holds text.
        """
        if name in self.numbers:
            return name
        ends = [one for one in self.numbers if one.endswith(name) and name]
        if len(ends) == 1:
            return ends[0]
        if len(ends) > 1:
            raise RecordingError(f"column {shown(name)} is the end of {_listed(ends)}; give more of the name.")
        if name in self.texts:
            first = next((text for text in self.texts[name] if text), "")
            said = f"column {shown(name)} holds text, such as {shown(first)}; give one of numbers."
            if is_timecode(self.texts[name]):
                said = (
                    f"column {shown(name)} holds timecode, with frames behind the seconds, such as {shown(first)};"
                    " give a column that counts, or rate_hz."
                )
            raise RecordingError(said)
        if name in self.unread:
            raise RecordingError(f"column {shown(name)} cannot be read: {self.unread[name]}.")
        raise RecordingError(f"{self.source} has no column {shown(name)}; {self._offer(name)}")

    def unit_of(self, name: str) -> str | None:
        """The unit of a column that a map means: of a line of the header, or in brackets at the end of its name."""
        found = self.find(name)
        bracketed = _BRACKETED.search(found)
        inside = bracketed[1].strip() if bracketed else None
        said = self.units.get(found) or (inside if inside in UNITS else None)
        return None if said is None else symbol_of(said)

    def stack(self, names: Sequence[str]) -> Array:
        """Columns (n, k) side by side.

        Raises:
            RecordingError: if one is not there, or they are not equally long.
        """
        found = [self.find(name) for name in names]
        lengths = {len(self.numbers[name]) for name in found}
        if len(lengths) > 1:
            said = ", ".join(f"{shown(name)} has {len(self.numbers[name])}" for name in found)
            raise RecordingError(f"columns of one quantity must have equally many rows, but {said}.")
        return np.column_stack([self.numbers[name] for name in found])

    def _offer(self, name: str) -> str:
        known = [*self.numbers, *self.texts, *self.unread]
        alike = [one for one in known if one.lower() == name.lower()]
        close = alike or difflib.get_close_matches(name, known, n=MOST_NAMED, cutoff=0.5)
        if close:
            return f"did you mean {_listed(close)}?"
        return f"its columns are {_listed(known)}." if known else "it has none."


def without_marks(where: str, numbers: Mapping[str, Array]) -> dict[str, Array]:
    """Columns in which the marks of lost samples are empty, which a ``UserWarning`` says."""
    marked = {name: np.abs(values) > NO_MEASUREMENT for name, values in numbers.items()}
    marked = {name: there for name, there in marked.items() if there.any()}
    if marked:
        count = sum(int(there.sum()) for there in marked.values())
        warnings.warn(
            f"{where}: {count} numbers beyond {NO_MEASUREMENT:g} in {_listed(list(marked))} stand for samples that"
            " were lost, and are taken for empty.",
            stacklevel=2,
        )
    return {name: np.where(marked[name], np.nan, v) if name in marked else v for name, v in numbers.items()}


def _listed(names: Sequence[str], most: int = 8) -> str:
    said = ", ".join(shown(name) for name in names[:most])
    return said + (f" and {len(names) - most} more" if len(names) > most else "")
