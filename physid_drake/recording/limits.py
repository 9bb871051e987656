"""What no object, hand, table or sensor of a recording has: refused in one line that asks for the unit."""

from __future__ import annotations

import unicodedata
from typing import Final

import numpy as np

from physid_drake.errors import RecordingError
from physid_drake.recording.checks import Array
from physid_drake.wording import shown

SHORTEST: Final = 1e-4
"""m: a side of an object, or of a tip, that is thinner than paper is in another unit."""

LONGEST: Final = 10.0
"""m: an object that a hand pushes over a table, or a tip, is smaller than a lorry."""

LARGEST_TABLE: Final = 100.0
"""m: a hall's floor. A table of 1.2 m by 0.8 m in mm is larger."""

FURTHEST: Final = 1000.0
"""m from the origin of W, which is on the table's top: no tracker of poses sees as far."""

STRONGEST: Final = 1e6
"""N: no hand pushes so hard."""

LOUDEST_POSITION: Final = 0.05
"""m, one standard deviation: a tracker or robot of 50 mm sees no push on a table. 0.3 mm for m is more."""

LOUDEST_ROTATION: Final = 0.5
"""rad, one standard deviation: of 29 degrees. 0.6 degrees for rad is more."""

LOUDEST_FORCE: Final = 100.0
"""N, one standard deviation: louder than the friction of all that a hand pushes. 0.2 N in mN is more."""

_BREAKS: Final = ("Cc", "Cs", "Zl", "Zp")  # control, half of a pair, line and paragraph separators
_TURNS: Final = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


def check_lengths(name: str, *lengths: float | None) -> None:
    """Refuse a length of an object or a tip that is in no m; None is passed over.

    Raises:
        RecordingError: if one is shorter than 0.1 mm or longer than 10 m.
    """
    for length in lengths:
        if length is not None and not SHORTEST <= length <= LONGEST:
            raise RecordingError(
                f"{name} must be between {SHORTEST:g} and {LONGEST:g} m, but got {length:.6g} m; is it in m?"
            )


def check_table(size: tuple[float, float], centre: tuple[float, float]) -> None:
    """Refuse a table that is larger than a hall or thinner than paper, or kilometres away.

    Raises:
        RecordingError: if it is.
    """
    for side in size:
        if not SHORTEST <= side <= LARGEST_TABLE:
            raise RecordingError(
                f"size_m must be between {SHORTEST:g} and {LARGEST_TABLE:g} m, but got {side:.6g} m; is it in m?"
            )
    for place in centre:
        if not abs(place) <= FURTHEST:
            raise RecordingError(
                f"centre_m must be within {FURTHEST:g} m of the origin of W, but got {place:.6g} m; is it in m?"
            )


def check_places(positions: Array) -> None:
    """Refuse positions (n, 3) that are kilometres away.

    Raises:
        RecordingError: if one is.
    """
    row = first_beyond(positions, FURTHEST)
    if row is not None:
        far = float(np.abs(positions[row]).max())
        raise RecordingError(
            f"positions must be within {FURTHEST:g} m of the origin of W, but row {row} is {far:.6g} m away;"
            " are they in m?"
        )


def check_forces(forces: Array) -> None:
    """Refuse forces (n, 3) that no hand has.

    Raises:
        RecordingError: if one is.
    """
    row = first_beyond(forces, STRONGEST)
    if row is not None:
        strong = float(np.abs(forces[row]).max())
        raise RecordingError(
            f"forces must be at most {STRONGEST:g} N, but row {row} has {strong:.6g} N; are they in N?"
        )


def first_beyond(values: Array, most: float) -> int | None:
    """The first row of values (n, k) of which one is further than that from 0; None where none is."""
    rows = np.flatnonzero((np.abs(values) > most).any(axis=1))
    return int(rows[0]) if len(rows) else None


def check_loudness(name: str, unit: str, std: float | None, most: float) -> None:
    """Refuse a standard deviation that no sensor of pushes has; None is passed over.

    Raises:
        RecordingError: if it is larger than ``most``, in ``unit``.
    """
    if std is not None and std > most:
        raise RecordingError(
            f"{name} must be at most {most:g} {unit}, one standard deviation, but got {std:.6g} {unit};"
            f" is it in {unit}? Leave it out if nobody knows it."
        )


def check_text(name: str, text: str, *, lines: bool = False) -> None:
    """Refuse a text that no file can hold, or that would move a terminal's cursor or turn its writing round.

    Args:
        name: what the text is, for the message.
        text: of a person.
        lines: whether it may have line breaks and tabs.

    Raises:
        RecordingError: if it has control characters, marks that turn writing round, or half of a surrogate pair.
    """
    allowed = "\n\t" if lines else ""
    wrong = next((c for c in text if (unicodedata.category(c) in _BREAKS or c in _TURNS) and c not in allowed), None)
    if wrong is not None:
        half = unicodedata.category(wrong) == "Cs"
        what = "half of a pair, which UTF-8 cannot hold" if half else "a control character"
        raise RecordingError(f"{name} must be plain text, but {shown(text)} has {shown(wrong)}, {what}; remove it.")
