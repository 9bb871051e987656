"""Units that logs are in, as factors to m, rad, N, s and kg; no more than people write over columns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from physid_drake.errors import RecordingError
from physid_drake.wording import shown

LENGTHS: Final[Mapping[str, float]] = {
    "m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "inch": 0.0254, "in": 0.0254, "ft": 0.3048,
}  # fmt: skip
ANGLES: Final[Mapping[str, float]] = {"rad": 1.0, "deg": math.pi / 180.0, "mrad": 1e-3}
FORCES: Final[Mapping[str, float]] = {
    "N": 1.0, "mN": 1e-3, "kN": 1e3, "kgf": 9.80665, "gf": 9.80665e-3, "lbf": 4.4482216152605,
}  # fmt: skip
TIMES: Final[Mapping[str, float]] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Seconds since 1970 are seconds: where a clock begins does not matter."""

SPEEDS: Final[Mapping[str, float]] = {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2}

UNITS: Final[Mapping[str, float]] = {**LENGTHS, **ANGLES, **FORCES, **TIMES}


def factor(unit: str, kind: Mapping[str, float], what: str) -> float:
    """How many SI units one of these is.

    Args:
        unit: its symbol.
        kind: ``LENGTHS``, ``ANGLES``, ``FORCES`` or ``TIMES``.
        what: of what, for the message.

    Raises:
        RecordingError: if there is no such unit of that kind.
    """
    if unit not in kind:
        raise RecordingError(f"{what} must be in one of {', '.join(kind)}, but is in {shown(unit)}.")
    return kind[unit]
