"""Places on the table at which an effect is looked for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from physid_drake.effects.effect import Surroundings

Array = NDArray[np.float64]


def grid_of_places(around: Surroundings) -> tuple[Array, float]:
    """A grid of three by three places (9, 2) over where the object was [m], and their spacing [m]."""
    low, high = around.region
    margin = 0.3 * around.radius
    x, y = (np.linspace(low[k] - margin, high[k] + margin, 7)[[1, 3, 5]] for k in (0, 1))
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    return places, float(max(0.5 * (x[1] - x[0] + y[1] - y[0]), 0.02))
