"""Which columns of a table are its times, and in which unit."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from physid_drake.convert.bodies import rises
from physid_drake.convert.columns import Array, Columns
from physid_drake.convert.map_text import listed, quoted
from physid_drake.convert.names import words_of
from physid_drake.convert.units import TIMES
from physid_drake.recording.clocks import LIKELY

FRAMES: Final = "frames"
"""Stands for a unit, of a column that counts them."""

_TIME: Final = re.compile(r"time|stamp|(^|[\s_/])t([\s_\[(]|$)|seconds|zeit", re.IGNORECASE)
_COUNTERS: Final = frozenset(
    ("seq", "sequence", "count", "counter", "index", "idx", "frame", "frames", "number", "nr")
)
SECOND: Final = 1e9
"""In nanoseconds."""


@dataclass(frozen=True, kw_only=True)
class Times:
    """Where times are.

    Attributes:
        columns: one, or two of whole seconds and of nanoseconds.
        unit: of one, or ``frames``.
    """

    columns: tuple[str, ...]
    unit: str = "s"

    def seconds(self, columns: Columns) -> Array | None:
        """The times of all rows in s; None if frames are counted."""
        if self.unit == FRAMES:
            return None
        if len(self.columns) == 1:
            return columns.numbers[self.columns[0]] * TIMES[self.unit]
        whole, part = (columns.numbers[name] for name in self.columns)
        return whole + 1e-9 * part if len(whole) == len(part) else None

    def text(self, more: str = "") -> str:
        """What a map says of them, with what it says besides."""
        if len(self.columns) > 1:
            return f"{{columns: {listed(self.columns)}{more}}}"
        rate = "rate_hz: 100" if self.unit == FRAMES else f"unit: {self.unit}"
        return f"{{column: {quoted(self.columns[0])}, {rate}{more}}}"


def times_of(columns: Columns) -> Times | None:
    """The times of a table, or what counts its frames; None if nothing looks like either."""
    rising = [name for name, values in columns.numbers.items() if rises(values)]
    split = _split_seconds(columns)
    likely = [
        name
        for name in rising
        if name not in (split or ()) and _TIME.search(name.rsplit("/", 1)[-1]) and not _counts(name, columns)
    ]
    if likely:
        return Times(columns=(likely[0],), unit=_unit(likely[0], columns))
    if split:
        return Times(columns=split)
    of_one = len({re.sub(r"\d+", "", name) for name in columns.numbers}) == 1
    nameless = [name for name in rising if of_one or re.fullmatch(r"column \d+", name)]
    frames = [name for name in rising if (np.diff(columns.numbers[name]) == 1.0).mean() > 0.9]
    if nameless and nameless[0] not in frames:
        return Times(columns=(nameless[0],), unit=_unit(nameless[0], columns))
    return Times(columns=(frames[0],), unit=FRAMES) if frames else None


def own_times(position: Sequence[str], others: Sequence[str], columns: Columns, shared: Times | None) -> Times | None:
    """Times that belong to one body by the beginning of their name, or by their count if the shared ones do not fit.

    Args:
        position: columns of the body's place.
        others: columns of the places of all other bodies.
        columns: of the log.
        shared: the times of all.
    """
    count = len(columns.numbers[position[0]])
    fitting = {name: values for name, values in columns.numbers.items() if len(values) == count}
    called = {name: v for name, v in fitting.items() if _TIME.search(name) and _belongs(name, position[0], others)}
    found = times_of(replace(columns, numbers=called)) if others else None
    if found is not None and found.unit != FRAMES and found != shared:
        return found
    if shared is not None and len(columns.numbers[shared.columns[0]]) == count:
        return None
    found = times_of(replace(columns, numbers=fitting))
    return None if found is None or found.unit == FRAMES else found


def fits(position: Sequence[str], columns: Columns, times: Times | None) -> bool:
    """Whether there are as many times as places."""
    return times is None or len(columns.numbers[times.columns[0]]) == len(columns.numbers[position[0]])


def step_of(times: Array) -> float:
    """The usual step of times (n,); NaN of too few."""
    steps = np.diff(times[np.isfinite(times)])
    return float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else np.nan


def _alike(one: str, other: str) -> int:
    """How many letters two names begin with alike, up to the last sign between words."""
    count = next((k for k, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))
    return max((k + 1 for k in range(count) if not one[k].isalnum()), default=0)


def _belongs(name: str, one: str, others: Sequence[str]) -> bool:
    """Whether a name begins like one, and less like all others."""
    alike = _alike(name, one)
    return alike > 0 and all(_alike(name, other) < alike for other in others)


def _counts(name: str, columns: Columns) -> bool:
    return bool(_COUNTERS & set(words_of(name))) and columns.units.get(name) not in TIMES


def _split_seconds(columns: Columns) -> tuple[str, ...] | None:
    """Two columns beside one another of whole seconds and of nanoseconds, as ROS writes them."""
    for (one, seconds), (other, parts) in pairwise(columns.numbers.items()):
        if len(seconds) != len(parts) or not rises(seconds + 1e-9 * parts) or rises(seconds):
            continue
        whole = np.isfinite(seconds).all() and (seconds == np.round(seconds)).all()
        within = parts.min() >= 0.0 and SECOND / 2.0 < parts.max() < SECOND
        steps = np.diff(seconds)
        # Nanoseconds fall where the next second begins, and nowhere else.
        fall = (steps > 0.0).any() and np.array_equal(steps > 0.0, np.diff(parts) < 0.0)
        if whole and within and fall and (steps >= 0.0).all():
            return one, other
    return None


def _unit(name: str, columns: Columns) -> str:
    if name in columns.units and columns.units[name] in TIMES:
        return columns.units[name]
    stated = re.search(r"[\[(_ ](ms|us|ns|s)[\])]?$", name)
    if stated:
        return stated[1]
    usual = step_of(columns.numbers[name])
    return next((unit for unit, size in TIMES.items() if usual * size <= LIKELY), "s")
