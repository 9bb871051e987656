"""How coarsely a stream was rounded before it was written: at rest that is no noise, and in motion it is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from physid_drake.recording.values import Array

ALIKE: Final = 1e-6  # m, rad: values nearer to each other are one; no tracker is finer
FEWEST: Final = 5  # steps between values that show a grid: of others one in five lies on it
SHORT: Final = 20.0  # finest steps: of longer ones the error of the finest adds up
ON_GRID: Final = 0.1  # of the finest step
NEARLY_ALL: Final = 0.95  # of the steps


def rounding_std(streams: Sequence[Array]) -> float:
    """Standard deviation of the rounding of values (n, k), a column for each coordinate; 0 where none is seen.

    Values that were rounded to a step are whole numbers of it apart, and off by a uniform error of step / sqrt(12).
    """
    columns = [[stream[:, k] for stream in streams] for k in range(streams[0].shape[1])]
    return max((_rounded_to(every) for every in columns), default=0.0) / math.sqrt(12.0)


def _rounded_to(pieces: Sequence[Array]) -> float:
    """The step that the values of one coordinate are whole multiples of; 0 where there is none."""
    apart = np.diff(np.sort(np.concatenate(pieces)))
    steps = apart[apart > ALIKE]
    if len(steps) < FEWEST:
        return 0.0
    finest = float(steps.min())
    multiples = steps[steps < SHORT * finest] / finest
    on_grid = np.abs(multiples - np.round(multiples)) < ON_GRID
    return finest if on_grid.mean() > NEARLY_ALL and not _is_even(pieces, finest) else 0.0


def _is_even(pieces: Sequence[Array], step: float) -> bool:
    """Whether values go on as they came: a steady speed puts even samples on a grid, too."""
    moved, turned = (
        sum(int((np.abs(np.diff(piece, order)) > 0.5 * step).sum()) for piece in pieces if len(piece) > 2)
        for order in (1, 2)
    )
    return turned < (1.0 - NEARLY_ALL) * moved
