"""Times that a table writes in words: dates of ISO 8601, times of the day, minutes and seconds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime, time
from typing import Final

import numpy as np
from numpy.typing import NDArray

_OF_DAY: Final = re.compile(r"\d{1,2}:\d\d:\d\d([.,]\d+)?(Z|[+-]\d\d:?\d\d)?")
_SHORT: Final = re.compile(r"(\d+):([0-5]\d(?:[.,]\d+)?)")
"""Minutes and seconds if a fraction is behind the last of any; else nobody can tell them from hours and minutes."""

_COLONS: Final = re.compile(r"(.*\d{1,2}:\d\d:\d\d)[:;](\d{2,3})")
"""A time of day and, behind a third colon, frames of a video, or milliseconds."""

MOST_FRAMES: Final = 480
"""Per second that a timecode counts; where three digits go beyond, they are milliseconds."""


def seconds_of(texts: Sequence[str]) -> NDArray[np.float64] | None:
    """Dates and times of ISO 8601 as seconds since 1970, times of the day as seconds; None if one is neither.

    Where no zone is given, it is that of Greenwich: where a clock begins does not matter. Empty ones are NaN.
    """
    if not any(texts) or is_timecode(texts):
        return None
    short = any(("." in text or "," in text) and _SHORT.fullmatch(text) for text in texts)
    try:
        return np.array([_second(text, short) if text else np.nan for text in texts])
    except (ValueError, OverflowError):
        return None


def is_timecode(texts: Sequence[str]) -> bool:
    """Whether all are a video's timecode: frames stand behind the seconds, of which nobody says how many make one."""
    found = [_COLONS.fullmatch(text) for text in texts if text]
    if not found or not found[0]:
        return False
    behind = [match[2] for match in found if match]
    milliseconds = all(len(one) == 3 for one in behind) and max(map(int, behind)) >= MOST_FRAMES
    return len(behind) == len(found) and not milliseconds


def _second(text: str, short: bool) -> float:
    counted = _COLONS.fullmatch(text)
    if counted and len(counted[2]) == 3:
        text = f"{counted[1]}.{counted[2]}"
    elif counted:
        raise ValueError(text)
    minutes = _SHORT.fullmatch(text)
    if minutes and short:
        return 60.0 * int(minutes[1]) + float(minutes[2].replace(",", "."))
    if len(text) > 2 and ":" in text[1:3]:
        return _second_of_day(text)
    date = datetime.fromisoformat(text)
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()


def _second_of_day(text: str) -> float:
    bare, _, half = text.partition(" ")
    if not _OF_DAY.fullmatch(bare):
        raise ValueError(text)
    day = time.fromisoformat(bare.zfill(len(bare) + (bare[1] == ":")))
    hour = {"": day.hour, "AM": day.hour % 12, "PM": day.hour % 12 + 12}.get(half.upper())
    if hour is None:
        raise ValueError(half)
    return 3600.0 * hour + 60.0 * day.minute + day.second + 1e-6 * day.microsecond
