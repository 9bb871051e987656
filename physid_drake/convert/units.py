"""Units that logs are in, as factors to m, rad, N, s and kg; no more than people write over columns."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.errors import RecordingError
from physid_drake.wording import shown

WORDS: Final[Mapping[str, str]] = {
    **{f"{prefix}met{end}": f"{sign}m" for prefix, sign in (("", ""), ("milli", "m"), ("centi", "c"), ("micro", "u"))
       for end in ("er", "ers", "re", "res")},
    "micron": "um", "microns": "um", "\u00b5m": "um", "\u03bcm": "um", "inches": "inch",
    "degree": "deg", "degrees": "deg", "degs": "deg", "\u00b0": "deg", "radian": "rad", "radians": "rad",
    "rads": "rad", "milliradian": "mrad", "milliradians": "mrad",
    "newton": "N", "newtons": "N", "millinewton": "mN", "millinewtons": "mN", "kilonewton": "kN", "kilonewtons": "kN",
    **{f"{prefix}{word}": f"{sign}s" for prefix, sign in (("", ""), ("milli", "m"), ("micro", "u"), ("nano", "n"))
       for word in ("sec", "secs", "second", "seconds")},
    **{f"{sign}{word}": f"{sign}s" for sign in "mun" for word in ("sec", "secs")},
    "\u00b5s": "us", "\u03bcs": "us", "\u00b5sec": "us", "\u03bcsec": "us",
}  # fmt: skip
"""What headers write for a symbol, in small letters."""


def symbol_of(unit: str) -> str:
    """The symbol of a unit that a header may write as a word, in letters of any size; itself if it is no word."""
    return WORDS.get(unit.lower(), unit)


class Units(Mapping[str, float]):
    """Sizes of units of one kind, by symbol or by word; its keys are the symbols alone, and so is what is in it."""

    def __init__(self, sizes: Mapping[str, float]) -> None:
        """Takes sizes by symbol."""
        self._sizes = dict(sizes)

    def __getitem__(self, unit: str) -> float:
        """The size of a symbol or word."""
        return self._sizes[symbol_of(unit)]

    def __contains__(self, unit: object) -> bool:
        """Whether there is such a symbol."""
        return unit in self._sizes

    def __iter__(self) -> Iterator[str]:
        """The symbols."""
        return iter(self._sizes)

    def __len__(self) -> int:
        """The number of symbols."""
        return len(self._sizes)


class _Written(Units):
    """Units as headers write them: words are in it, too."""

    def __contains__(self, unit: object) -> bool:
        return isinstance(unit, str) and super().__contains__(symbol_of(unit))


LENGTHS: Final = Units(
    {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "inch": 0.0254, "in": 0.0254, "ft": 0.3048}
)  # fmt: skip
ANGLES: Final = Units({"rad": 1.0, "deg": math.pi / 180.0, "mrad": 1e-3})
FORCES: Final = Units({"N": 1.0, "mN": 1e-3, "kN": 1e3, "kgf": 9.80665, "gf": 9.80665e-3, "lbf": 4.4482216152605})
TIMES: Final = Units({"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9})
"""Seconds since 1970 are seconds: where a clock begins does not matter."""

SPEEDS: Final = Units({"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2})

METRES, CENTIMETRES = 5.0, 60.0
"""Places on a table that are nowhere larger are in m, or in cm."""

UNITS: Final = _Written({**LENGTHS, **ANGLES, **FORCES, **TIMES})


def likely_length(places: NDArray[np.float64]) -> str:
    """The unit that places on a table have by how large they are."""
    largest = float(np.nanmax(np.abs(places), initial=0.0))
    return "m" if largest < METRES else "cm" if largest < CENTIMETRES else "mm"


def factor(unit: str, kind: Mapping[str, float], what: str) -> float:
    """How many SI units one of these is.

    Args:
        unit: its symbol, or a word for it.
        kind: ``LENGTHS``, ``ANGLES``, ``FORCES`` or ``TIMES``.
        what: of what, for the message.

    Raises:
        RecordingError: if there is no such unit of that kind.
    """
    if symbol_of(unit) not in kind:
        raise RecordingError(f"{what} must be in one of {', '.join(kind)}, but is in {shown(unit)}.")
    return kind[unit]
