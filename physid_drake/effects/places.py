"""Places on the table at which an effect is looked for."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from physid_drake.effects.effect import Surroundings

Array = NDArray[np.float64]

FEWEST = 3  # places along a side
MOST = 36  # places
CLOSE = 1.2  # radii of the object: from further off a fit may not find a patch that is as large as the object


def grid_of_places(around: Surroundings) -> tuple[Array, float]:
    """A grid of three by three places (9, 2) over where the object was [m], and their spacing [m]."""
    return _grid(around, (FEWEST, FEWEST))


def close_grid_of_places(around: Surroundings) -> tuple[Array, float]:
    """A grid of places (n, 2) [m] no further apart than 1.2 radii of the object, as far as few do; their spacing."""
    low, high = around.region
    sides = (high - low).tolist()
    counts = [max(math.ceil(side / (CLOSE * around.radius)), FEWEST) for side in sides]
    # A long narrow region may have many along it: the cap is on all of them.
    narrow = int(counts[1] < counts[0])
    counts[narrow] = min(counts[narrow], math.isqrt(MOST))
    counts[1 - narrow] = min(counts[1 - narrow], MOST // counts[narrow])
    return _grid(around, (counts[0], counts[1]))


def _grid(around: Surroundings, counts: tuple[int, int]) -> tuple[Array, float]:
    low, high = around.region
    margin = 0.3 * around.radius
    # The middles of equal cells.
    x, y = (np.linspace(low[k] - margin, high[k] + margin, 2 * n + 1)[1::2] for k, n in enumerate(counts))
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    return places, float(max(0.5 * (x[1] - x[0] + y[1] - y[0]), 0.02))
