"""A hand's path as samples and as a file that a controller plays."""

from __future__ import annotations

import dataclasses as dc

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import HandPath

Array = NDArray[np.float64]

RATE = 250.0  # Hz
COLUMNS = ("time_s", "hand_x_m", "hand_y_m", "hand_z_m")


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class HandSamples:
    """A path at a fixed rate: times (n,) [s] from 0, positions (n, 3) of the tip's centre in W [m]."""

    times: Array
    positions: Array


def hand_samples(path: HandPath, hand_height: float, *, rate: float = RATE) -> HandSamples:
    """Samples from time 0 until the hand has stopped.

    Args:
        path: of the tip.
        hand_height: of the tip's centre above the table [m].
        rate: samples a second [Hz].
    """
    count = int(np.ceil(float(path.times[-1]) * rate - 1e-9)) + 1
    times = np.arange(count) / rate
    positions = np.column_stack([path.positions(times), np.full(count, hand_height)])
    return HandSamples(times=times, positions=positions)


def push_csv(path: HandPath, hand_height: float) -> str:
    """The samples as CSV with the columns ``time_s, hand_x_m, hand_y_m, hand_z_m``; arguments as above."""
    samples = hand_samples(path, hand_height)
    rows = [f"{t:.6f},{x:.7f},{y:.7f},{z:.7f}" for t, (x, y, z) in zip(samples.times, samples.positions, strict=True)]
    return "\n".join([",".join(COLUMNS), *rows]) + "\n"
