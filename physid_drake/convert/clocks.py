"""Rows of a table in the order of their times, and what it means that several have one time."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.convert.columns import Array, Columns
from physid_drake.errors import RecordingError
from physid_drake.wording import named, shown

MOST_BODIES: Final = 50
"""Bodies of one table that a column may tell apart."""


def increasing(times: Array, columns: Columns, seen: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Indices of rows whose times increase: of rows with one time, the first.

    Args:
        times: (n,) [s].
        columns: of the table.
        seen: which of all rows (m,) these n are.

    Raises:
        RecordingError: if the clock steps back, or the rows are of several bodies that a column tells apart.
    """
    back = np.flatnonzero(np.diff(times) < 0.0)
    if len(back):
        one, other = float(times[back[0]]), float(times[back[0] + 1])
        raise RecordingError(
            f"its clock steps back by {one - other:.6g} s, from {one:.15g} to {other:.15g} s; if it begins anew with"
            " every push, cut by a column that counts them, or give a folder with one file for each; if it counts"
            " arrivals, or only to a day or a largest number, name another clock."
        )
    later = np.diff(times, prepend=-np.inf) > 0.0
    if not later.all():
        for name, values in _telling(columns, seen):
            if _tells_apart(values, times):
                some = list(dict.fromkeys(values.tolist()))
                said = ", ".join(shown(one) for one in some[:4])
                raise RecordingError(
                    f"rows of one time are of several bodies, which column {shown(name)} tells apart ({said}); pick"
                    f" one of them: where: {{{named(name)}: {shown(some[0])}}}."
                )
        warnings.warn(
            f"{columns.source}: {int((~later).sum())} of {len(times)} rows have the time of the row before, and are"
            " left out; are times written with enough digits?",
            UserWarning, stacklevel=2,
        )  # fmt: skip
    return np.flatnonzero(later)


def _telling(columns: Columns, seen: NDArray[np.bool_]) -> Iterator[tuple[str, NDArray[np.generic]]]:
    """Columns of few whole numbers or texts, in the rows that were seen."""
    for name, texts in columns.texts.items():
        if len(texts) == len(seen) and len(set(texts)) <= MOST_BODIES:
            yield name, np.array(texts)[seen]
    for name, numbers in columns.numbers.items():
        if len(numbers) == len(seen):
            values = numbers[seen]
            if np.isfinite(values).all() and (values == np.round(values)).all():
                yield name, values.astype(np.int64)


def _tells_apart(values: NDArray[np.generic], times: Array) -> bool:
    """Whether each of a few values has rows of increasing times, and several at that."""
    some, counts = np.unique(values, return_counts=True)
    if not 2 <= len(some) <= MOST_BODIES or counts.max() < 3:
        return False
    return all((np.diff(times[values == one]) > 0.0).all() for one in some)
