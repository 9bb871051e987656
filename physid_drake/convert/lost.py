"""Rows of a log in which a tracker that lost its body wrote one and the same place instead."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.convert.columns import Array

LEAP: Final = 0.05
"""m to a place that stands for none, and back: no body goes so far from one sample to the next."""

BACK: Final = 0.5
"""Of that leap: a body is found again nearer than this to where it was lost."""


def lost_rows(places: Array) -> NDArray[np.bool_]:
    """Which of places (n, k) [m] stand for none: the same to the last digit twice or more, far from before and after.

    At the ends of a log there is no before or after; a place of zeros counts as far from it there, too.
    """
    lost = np.zeros(len(places), dtype=np.bool_)
    if len(places) < 3:
        return lost
    edges = np.flatnonzero((np.diff(places, axis=0) != 0.0).any(axis=1)) + 1
    firsts, lasts = np.append(0, edges), np.append(edges, len(places)) - 1
    for first, last in zip(firsts.tolist(), lasts.tolist(), strict=True):
        if last > first and _stands_for_none(places, first, last):
            lost[first : last + 1] = True
    return lost


def _stands_for_none(places: Array, first: int, last: int) -> bool:
    beside = [places[k] for k in (first - 1, last + 1) if 0 <= k < len(places)]
    leaps = [float(np.linalg.norm(one - places[first])) for one in beside]
    if not leaps or min(leaps) < LEAP:
        return False
    if len(beside) == 1:
        return not places[first].any()
    return float(np.linalg.norm(beside[1] - beside[0])) < BACK * min(leaps)
