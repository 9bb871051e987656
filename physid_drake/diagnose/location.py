"""Windows of pushes in words that a person can check: push, place, heading, speed."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from pathlib import PurePosixPath

from physid_drake.diagnose.values import Window

NEAR = 0.06  # m: windows so close together are around one place
ALL_ROUND = math.radians(120.0)  # of headings on either side of their mean: they are no one way


def windows_in_words(windows: Sequence[Window]) -> str:
    """Where the windows are; an empty text for no windows."""
    if not windows:
        return ""
    pushes = list(dict.fromkeys(number_of(w.push) for w in sorted(windows, key=lambda w: w.push)))
    listed = ", ".join(pushes[:-1]) + (" and " if len(pushes) > 1 else "") + pushes[-1]
    parts = [
        _places(windows),
        headings_of([w.heading for w in windows]),
        "at " + speeds_of([w.speed for w in windows]),
    ]
    return f"clearest in push{'es' if len(pushes) > 1 else ''} {listed}: {', '.join(parts)}"


def number_of(push: str) -> str:
    """A push's number: the name of its file without folder and ending."""
    return PurePosixPath(push).stem


def _places(windows: Sequence[Window]) -> str:
    x, y = ([round(1e3 * w.place[k]) for w in windows] for k in (0, 1))
    wide, deep = max(x) - min(x), max(y) - min(y)
    if max(wide, deep) <= 1e3 * NEAR:
        return f"around ({round(0.5 * (min(x) + max(x)))}, {round(0.5 * (min(y) + max(y)))}) mm"
    return f"between ({min(x)}, {min(y)}) and ({max(x)}, {max(y)}) mm"


def headings_of(headings: Sequence[float]) -> str:
    """The arc of all headings [rad], in degrees, in words."""
    mean = cmath.phase(sum((cmath.rect(1.0, h) for h in headings), 0j))
    off = [math.remainder(h - mean, 2.0 * math.pi) for h in headings]
    if max(map(abs, off)) > ALL_ROUND:
        return "all headings"
    low, high = (round(math.degrees(mean + edge)) for edge in (min(off), max(off)))
    turn = 360 * math.floor(low / 360)
    low, high = low - turn, high - turn
    if low == high:
        return f"heading {low} deg"
    return f"headings {low} to {high} deg" if high < 360 else f"headings {low} through 0 to {high - 360} deg"


def speeds_of(speeds: Sequence[float]) -> str:
    """The range of speeds [m/s], in mm/s, in words."""
    low, high = 1e3 * min(speeds), 1e3 * max(speeds)
    texts = [f"{value:.2g}" if value < 100.0 else f"{value:.0f}" for value in (low, high)]
    return f"{texts[0]} mm/s" if texts[0] == texts[1] else f"{texts[0]} to {texts[1]} mm/s"
