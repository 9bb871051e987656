"""Whole turns of a heading that is recorded within one."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from physid_drake.recording.screening import find_gaps

Array = npt.NDArray[np.float64]

BRIDGED: Final = 0.5
"""A gap up to this long [s] is bridged at the rates on both its sides."""

RATED: Final = 8
"""Steps that tell a rate."""

FEWEST: Final = 5
"""Samples, of which fewer tell noise."""


def unwrapped(times: Array, angles: Array) -> Array:
    """Angles (n,) [rad] without steps of full turns, at times (n,) [s].

    Over a gap they make the turns that the rates on both sides tell, unless it is too long for that.
    """
    result: Array = np.unwrap(angles)
    gaps = find_gaps(times).tolist()
    edges, turns = [0, *(k + 1 for k in gaps), len(times)], np.zeros(len(times))
    for i, k in enumerate(gaps):
        gap = float(times[k + 1] - times[k])
        before = slice(max(edges[i], k - RATED), k + 1)
        after = slice(k + 1, min(edges[i + 2], k + 2 + RATED))
        rates = [_rate(times[part], result[part]) for part in (before, after) if part.stop - part.start >= FEWEST]
        step = float(result[k + 1] - result[k])
        # An object that is hit or stops meanwhile turns by something in between.
        if rates and gap <= BRIDGED and not min(rates) * gap <= step <= max(rates) * gap:
            missed = float(np.mean(rates)) * gap - step
            turns[k + 1] = np.round(missed / (2.0 * np.pi))
    return result + 2.0 * np.pi * np.cumsum(turns) if turns.any() else result


def _rate(times: Array, angles: Array) -> float:
    return float((angles[-1] - angles[0]) / (times[-1] - times[0]))
