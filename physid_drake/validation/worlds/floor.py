"""How well pushes could be predicted at best: by the true world itself, against what was recorded."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from physid_drake.recording import Push
from physid_drake.validation.worlds.shapes import Array

WINDOWS = 14
"""Means over so many windows of the motion and the rest after it are compared, as a diagnosis does."""
_STILL = 1e-5  # m, rad: noise-free poses that differ by less are at rest


def floor_of(
    recorded: Sequence[Push], predicted: Sequence[Array], rate: float, deviations: Array
) -> dict[str, float]:
    """Root mean square of recorded minus predicted window means.

    Args:
        recorded: the pushes with their noise.
        predicted: per push, noise-free poses (n, 3) at even times from 0: x, y [m] and yaw [rad].
        rate: of their samples [Hz].
        deviations: (3,) of the tracker's noise.

    Returns:
        ``rms`` over all in standard deviations, ``position_m`` in the plane, ``rotation_rad``.
    """
    every = np.concatenate([_residuals(push, poses, rate) for push, poses in zip(recorded, predicted, strict=True)])
    return {
        "rms": _rms(every / deviations),
        "position_m": math.sqrt(2.0) * _rms(every[:, :2]),
        "rotation_rad": _rms(every[:, 2]),
    }


def _residuals(push: Push, poses: Array, rate: float) -> Array:
    samples = np.rint(push.object.times * rate).astype(int)
    # A world that comes to rest earlier than the recorded one stays there.
    expected = poses[np.clip(samples, 0, len(poses) - 1)]
    measured = push.object.planar
    turns = np.round((expected[0, 2] - measured[0, 2]) / (2.0 * math.pi))
    errors = measured + np.array([0.0, 0.0, 2.0 * math.pi * turns]) - expected
    moving = np.flatnonzero((np.abs(expected - expected[0]) > _STILL).any(axis=1))
    going = np.flatnonzero((np.abs(expected - expected[-1]) > _STILL).any(axis=1))
    if not len(moving) or not len(going):
        means: Array = errors.mean(axis=0, keepdims=True)
        return means
    first, last = int(moving[0]), int(going[-1]) + 1
    windows = max(1, min(WINDOWS, (last - first) // 2))
    parts = [*np.array_split(errors[first:last], windows), errors[last:]]
    return np.array([part.mean(axis=0) for part in parts if len(part)])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
