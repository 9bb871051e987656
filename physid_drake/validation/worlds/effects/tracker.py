"""Effects of the tracker: what it says of where the object was."""

# ruff: noqa: D102 - methods do what those of the base class say they do.

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from physid_drake.validation.worlds.effects.effect import Effect
from physid_drake.validation.worlds.shapes import Array


@dataclass(frozen=True, kw_only=True)
class TrackerLatency(Effect):
    """What is stamped t was so at t - ``delay``."""

    name: ClassVar[str] = "tracker_latency"
    strengths: ClassVar[tuple[str, ...]] = ("delay",)
    delay: float = 0.0

    def tracked(self, times: Array, poses: Array) -> Array:
        return _shifted(times, poses, self.delay)


@dataclass(frozen=True, kw_only=True)
class TrackerBias(Effect):
    """The tracked frame is at (``x``, ``y``, ``yaw``) in B."""

    name: ClassVar[str] = "tracker_bias"
    strengths: ClassVar[tuple[str, ...]] = ("x", "y", "yaw")
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def tracked(self, times: Array, poses: Array) -> Array:
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        shift = np.column_stack([c * self.x - s * self.y, s * self.x + c * self.y, np.full(len(c), self.yaw)])
        seen: Array = poses + shift
        return seen


@dataclass(frozen=True, kw_only=True)
class TrackerScale(Effect):
    """Places of the object are measured ``ratio`` times as far from the origin of W."""

    name: ClassVar[str] = "tracker_scale"
    strengths: ClassVar[tuple[str, ...]] = ("ratio",)
    ratio: float = 1.0

    def tracked(self, times: Array, poses: Array) -> Array:
        seen: Array = poses * np.array([self.ratio, self.ratio, 1.0])
        return seen


def _shifted(times: Array, values: Array, delay: float) -> Array:
    at = times - delay
    return np.column_stack([np.interp(at, times, column) for column in values.T])
