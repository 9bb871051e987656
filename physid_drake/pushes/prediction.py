"""What a rollout says about a recorded push."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """What a rollout says about what was recorded: poses (n, 3) and mean forces (k, 2), and whether it ``fell``."""

    poses: Array
    forces: Array
    fell: bool = False
