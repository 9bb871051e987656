"""Effects of the hand: how it touches, and where its tip really goes."""

# ruff: noqa: D102 - methods do what those of the base class say they do.

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.signal import lfilter

from physid_drake.validation.worlds.effects.effect import Effect
from physid_drake.validation.worlds.shapes import Array
from physid_drake.validation.worlds.world_plan import Plan, SprungTip


@dataclass(frozen=True, kw_only=True)
class Restitution(Effect):
    """The tip's contact gives back ``coefficient`` of the speed of a central touch."""

    name: ClassVar[str] = "restitution"
    strengths: ClassVar[tuple[str, ...]] = ("coefficient",)
    coefficient: float = 0.0

    def build(self, plan: Plan) -> Plan:
        return replace(plan, restitution=self.coefficient)


@dataclass(frozen=True, kw_only=True)
class HandCompliance(Effect):
    """The tip is on springs of ``compliance`` [m/N]; ``damping`` is the ratio with the object's mass on them.

    What moves with it weighs ``share`` of the object.
    """

    name: ClassVar[str] = "hand_compliance"
    strengths: ClassVar[tuple[str, ...]] = ("compliance",)
    compliance: float = 0.0
    damping: float = 0.3
    share: float = 0.2

    def build(self, plan: Plan) -> Plan:
        tip = SprungTip(compliance=self.compliance, damping=self.damping, share=self.share)
        return replace(plan, sprung_tip=tip)


@dataclass(frozen=True, kw_only=True)
class ActuatorLag(Effect):
    """The tip follows the hand columns with a first-order lag of ``time_constant``."""

    name: ClassVar[str] = "actuator_lag"
    strengths: ClassVar[tuple[str, ...]] = ("time_constant",)
    time_constant: float = 0.0

    def tip(self, times: Array, places: Array) -> Array:
        return first_order_lag(times, places, self.time_constant)


@dataclass(frozen=True, kw_only=True)
class HandOffset(Effect):
    """The tip is at (``x``, ``y``) in P, whose axes are W's, from where the hand columns say."""

    name: ClassVar[str] = "hand_offset"
    strengths: ClassVar[tuple[str, ...]] = ("x", "y")
    x: float = 0.0
    y: float = 0.0

    def tip(self, times: Array, places: Array) -> Array:
        moved: Array = places + np.array([self.x, self.y])
        return moved


def first_order_lag(times: Array, values: Array, time_constant: float) -> Array:
    """Response of a first-order lag to values (n, m) on even times, linear between them, at rest at the start."""
    step = float(times[1] - times[0])
    keep = math.exp(-step / time_constant)
    ahead = 1.0 - time_constant / step * (1.0 - keep)
    start = values[0]
    filtered: Array = lfilter([ahead, 1.0 - keep - ahead], [1.0, -keep], values - start, axis=0) + start
    return filtered
