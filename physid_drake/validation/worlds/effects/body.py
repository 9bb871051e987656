"""Effects of the object: its underside, its mass and how it is spread, its size."""

# ruff: noqa: D102 - methods do what those of the base class say they do.

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from physid_drake.validation.worlds.effects.effect import Effect
from physid_drake.validation.worlds.shapes import stretched
from physid_drake.validation.worlds.world_plan import Grain, Plan, Slosh


@dataclass(frozen=True, kw_only=True)
class AnisotropicObject(Effect):
    """The same, with the low-friction axis at ``angle`` in B."""

    name: ClassVar[str] = "anisotropic_object"
    strengths: ClassVar[tuple[str, ...]] = ("ratio",)
    ratio: float = 1.0
    angle: float = 0.0

    def build(self, plan: Plan) -> Plan:
        return replace(plan, underside_grain=Grain(ratio=self.ratio, angle=self.angle))


@dataclass(frozen=True, kw_only=True)
class UnevenSupport(Effect):
    """Stiffness of the underside by a regular grid of ``weights``: rows along x, columns along y of B.

    The load follows the weights, balanced linearly so that it stands under the centre of mass.
    """

    name: ClassVar[str] = "uneven_support"
    weights: tuple[tuple[float, ...], ...] = ((1.0,),)

    @property
    def is_null(self) -> bool:
        return len({weight for row in self.weights for weight in row}) == 1

    def build(self, plan: Plan) -> Plan:
        return replace(plan, pressure=self.weights)


@dataclass(frozen=True, kw_only=True)
class ComOffset(Effect):
    """The centre of mass is at (``x``, ``y``) in B; the pressure follows it."""

    name: ClassVar[str] = "com_offset"
    strengths: ClassVar[tuple[str, ...]] = ("x", "y")
    x: float = 0.0
    y: float = 0.0

    def build(self, plan: Plan) -> Plan:
        return replace(plan, com=(self.x, self.y))


@dataclass(frozen=True, kw_only=True)
class RotationalInertia(Effect):
    """Moment of inertia about the centre of mass, as a ``ratio`` to uniform density's."""

    name: ClassVar[str] = "rotational_inertia"
    strengths: ClassVar[tuple[str, ...]] = ("ratio",)
    ratio: float = 1.0

    def build(self, plan: Plan) -> Plan:
        return replace(plan, inertia_ratio=self.ratio)


@dataclass(frozen=True, kw_only=True)
class Sloshing(Effect):
    """A ``fraction`` of the mass swings on springs in B at ``frequency`` (of it alone) with ``damping`` ratio."""

    name: ClassVar[str] = "sloshing"
    strengths: ClassVar[tuple[str, ...]] = ("fraction",)
    fraction: float = 0.0
    frequency: float = 2.0
    damping: float = 0.1

    def build(self, plan: Plan) -> Plan:
        slosh = Slosh(fraction=self.fraction, frequency=self.frequency, damping=self.damping)
        return replace(plan, slosh=slosh)


@dataclass(frozen=True, kw_only=True)
class SizeError(Effect):
    """The real object's plan is ``ratio`` times the stated one; its height is as stated."""

    name: ClassVar[str] = "size_error"
    strengths: ClassVar[tuple[str, ...]] = ("ratio",)
    ratio: float = 1.0

    def build(self, plan: Plan) -> Plan:
        return replace(plan, shape=stretched(plan.shape, self.ratio))
