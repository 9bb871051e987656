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
    steps = [_steps(np.concatenate([stream[:, k] for stream in streams])) for k in range(streams[0].shape[1])]
    return max((_rounded_to(every) for every in steps), default=0.0) / math.sqrt(12.0)


def _steps(values: Array) -> Array:
    """What neighbouring values are apart."""
    apart: Array = np.diff(np.sort(values))
    return apart[apart > ALIKE]


def _rounded_to(steps: Array) -> float:
    """The step that all are multiples of; 0 where there is none."""
    if len(steps) < FEWEST:
        return 0.0
    finest = float(steps.min())
    multiples = steps[steps < SHORT * finest] / finest
    on_grid = np.abs(multiples - np.round(multiples)) < ON_GRID
    return finest if on_grid.mean() > NEARLY_ALL else 0.0
