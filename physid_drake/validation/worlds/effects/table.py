"""Effects of the table: its friction by speed, direction, place and order, and its tilt."""

# ruff: noqa: D102 - methods do what those of the base class say they do.

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from physid_drake.validation.worlds.effects.effect import Effect, Moment
from physid_drake.validation.worlds.shapes import Array
from physid_drake.validation.worlds.world_plan import Grain, Plan


@dataclass(frozen=True, kw_only=True)
class StribeckFriction(Effect):
    """mu = mu_k (1 + ``excess`` exp(-(v / ``speed``)^2)) at every foot."""

    name: ClassVar[str] = "stribeck_friction"
    strengths: ClassVar[tuple[str, ...]] = ("excess",)
    excess: float = 0.0
    speed: float = 0.05

    def friction(self, moment: Moment) -> Array:
        squares = (moment.foot_velocities**2).sum(axis=1) / self.speed**2
        factor: Array = 1.0 + self.excess * np.exp(-squares)
        return factor


@dataclass(frozen=True, kw_only=True)
class ViscousDrag(Effect):
    """Force -``coefficient`` v at the centre of mass, torque -``coefficient`` k^2 w; k is the uniform object's."""

    name: ClassVar[str] = "viscous_drag"
    strengths: ClassVar[tuple[str, ...]] = ("coefficient",)
    coefficient: float = 0.0

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        c = -self.coefficient
        return c * moment.vx, c * moment.vy, c * moment.gyration_squared * moment.spin


@dataclass(frozen=True, kw_only=True)
class AnisotropicTable(Effect):
    """Friction mu sqrt(``ratio``) across and mu / sqrt(``ratio``) along the low-friction axis at ``angle`` in W."""

    name: ClassVar[str] = "anisotropic_table"
    strengths: ClassVar[tuple[str, ...]] = ("ratio",)
    ratio: float = 1.0
    angle: float = 0.0

    def build(self, plan: Plan) -> Plan:
        return replace(plan, table_grain=Grain(ratio=self.ratio, angle=self.angle))


@dataclass(frozen=True, kw_only=True)
class FrictionPatch(Effect):
    """Feet within ``radius`` of (``x``, ``y``) have ``ratio`` times the friction."""

    name: ClassVar[str] = "friction_patch"
    strengths: ClassVar[tuple[str, ...]] = ("ratio",)
    ratio: float = 1.0
    x: float = 0.0
    y: float = 0.0
    radius: float = 0.05

    def friction(self, moment: Moment) -> Array:
        places = moment.foot_places
        inside = (places[:, 0] - self.x) ** 2 + (places[:, 1] - self.y) ** 2 < self.radius**2
        return np.where(inside, self.ratio, 1.0)


@dataclass(frozen=True, kw_only=True)
class FrictionGradient(Effect):
    """Factor 1 + ``slope_x`` x + ``slope_y`` y, at least 0.1."""

    name: ClassVar[str] = "friction_gradient"
    strengths: ClassVar[tuple[str, ...]] = ("slope_x", "slope_y")
    slope_x: float = 0.0
    slope_y: float = 0.0

    def friction(self, moment: Moment) -> Array:
        factor: Array = np.maximum(0.1, 1.0 + moment.foot_places @ np.array([self.slope_x, self.slope_y]))
        return factor


@dataclass(frozen=True, kw_only=True)
class FrictionDrift(Effect):
    """Factor 1 + ``per_push`` i in the i-th push, i from 0."""

    name: ClassVar[str] = "friction_drift"
    strengths: ClassVar[tuple[str, ...]] = ("per_push",)
    per_push: float = 0.0

    def friction(self, moment: Moment) -> float:
        return max(0.1, 1.0 + self.per_push * moment.push)


@dataclass(frozen=True, kw_only=True)
class TableTilt(Effect):
    """Gravity has components g sin(``x``), g sin(``y``) along the table [rad]."""

    name: ClassVar[str] = "table_tilt"
    strengths: ClassVar[tuple[str, ...]] = ("x", "y")
    x: float = 0.0
    y: float = 0.0

    def build(self, plan: Plan) -> Plan:
        return replace(plan, tilt=(plan.tilt[0] + math.sin(self.x), plan.tilt[1] + math.sin(self.y)))
