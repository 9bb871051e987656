"""Effects of what is around: air, a cable, a magnet."""

# ruff: noqa: D102 - methods do what those of the base class say they do.

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from physid_drake.validation.worlds.effects.effect import Effect, Moment


@dataclass(frozen=True, kw_only=True)
class QuadraticDrag(Effect):
    """Force -``coefficient`` v abs(v) at the centre of mass."""

    name: ClassVar[str] = "quadratic_drag"
    strengths: ClassVar[tuple[str, ...]] = ("coefficient",)
    coefficient: float = 0.0

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        c = -self.coefficient * math.hypot(moment.vx, moment.vy)
        return c * moment.vx, c * moment.vy, 0.0


@dataclass(frozen=True, kw_only=True)
class Tether(Effect):
    """A cable's pull at the centre of mass: ``stiffness`` times what exceeds ``rest_length``, towards a point."""

    name: ClassVar[str] = "tether"
    strengths: ClassVar[tuple[str, ...]] = ("stiffness",)
    stiffness: float = 0.0
    x: float = 0.0
    y: float = 0.0
    rest_length: float = 0.0

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        dx, dy = self.x - moment.com_x, self.y - moment.com_y
        distance = math.hypot(dx, dy)
        pull = self.stiffness * max(0.0, distance - self.rest_length) / max(distance, 1e-9)
        return pull * dx, pull * dy, 0.0


@dataclass(frozen=True, kw_only=True)
class Magnet(Effect):
    """Attraction ``strength`` / (d^2 + ``core``^2) of the centre of mass to a point at distance d."""

    name: ClassVar[str] = "magnet"
    strengths: ClassVar[tuple[str, ...]] = ("strength",)
    strength: float = 0.0
    x: float = 0.0
    y: float = 0.0
    core: float = 0.03

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        dx, dy = self.x - moment.com_x, self.y - moment.com_y
        squared = dx * dx + dy * dy
        # The unit vector jumps at the point itself; within a millimetre it is faded out.
        pull = self.strength / (squared + self.core**2) / math.sqrt(squared + 1e-6)
        return pull * dx, pull * dy, 0.0
