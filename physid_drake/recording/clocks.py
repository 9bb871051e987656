"""Whether times can be seconds, and how many samples a time holds; from stamps (n,) alone, whatever they are."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from physid_drake.errors import RecordingError

Array = npt.NDArray[np.float64]

FEWEST: Final = 4
"""Samples of a stream: fewer are places that somebody looked at, before and after a push."""

SLOWEST: Final = 1.5
"""In s: a stream that is sampled less often on the median is in another unit, or none of a push. A logger of one
sample a second is still read, with stamps that are late."""

FASTEST: Final = 1e-5
"""In s: no tracker, robot or force sensor is sampled more often; such stamps are of messages that came together."""

SELDOM: Final = 0.5
"""In s between samples. What is sampled as seldom, and for longer than LONGEST, is a log at 1 kHz in ms."""

LONGEST: Final = 600.0
"""In s: no push takes ten minutes, and nobody waits that long between two samples of one."""

LIKELY: Final = 0.2
"""In s between samples: a unit that makes them follow one another so fast is the likely one."""

UNITS: Final = (("milliseconds", 1e-3), ("microseconds", 1e-6), ("nanoseconds", 1e-9))


def check_seconds(times: Array, what: str) -> None:
    """Refuse times that are in no seconds, by how far they are apart.

    Where they begin says nothing: seconds since 1970 are seconds. The poses before and after a push may be far apart.

    Args:
        times: (n,) increasing.
        what: whose, for the message: "the object's samples".

    Raises:
        RecordingError: if samples follow one another too seldom or too fast, or the stream stops for too long.
    """
    if len(times) < 2:
        return
    with np.errstate(over="ignore"):
        intervals = np.diff(times)
        usual, span = float(np.median(intervals)), float(times[-1] - times[0])
    if len(times) >= FEWEST and (usual > SLOWEST or (usual >= SELDOM and span > LONGEST)):
        raise RecordingError(f"{what} are {_number(usual)} apart on the median: {_likely(usual)}.")
    if len(times) >= FEWEST and usual < FASTEST:
        raise RecordingError(
            f"{what} are {usual:.2g} apart on the median, and no sensor is sampled so fast; give the times of the"
            " measurement, not of its arrival, in seconds."
        )
    longest = int(np.argmax(intervals))
    if not intervals[longest] <= LONGEST:
        gap = float(intervals[longest])
        raise RecordingError(
            f"{what} must not stop for more than {LONGEST:g} s, but {_number(gap)} are between"
            f" {float(times[longest])!r} and {float(times[longest + 1])!r}; give seconds, all by"
            " one clock, and leave out what is no part of the push."
        )


def samples_within(seconds: float, interval: float, most: int) -> int:
    """How many samples come in a time, at most ``most``, whatever the interval between them [s]."""
    if interval <= 0.0 or seconds >= most * interval:
        return most
    # Seconds since 1970 are exact to 0.2 us: 12.5 samples must not be 12 by one clock and 13 by another.
    return round(round(seconds / interval, 2))


def _likely(usual: float) -> str:
    """What unit such intervals are in."""
    unit = next((name for name, size in UNITS if usual * size <= LIKELY), None)
    return "times must be in seconds" if unit is None else f"times look to be in {unit}; give seconds"


def _number(value: float) -> str:
    return f"{value:,.6g}" if math.isfinite(value) and value < 1e12 else f"{value:.3g}"
