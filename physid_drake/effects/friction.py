"""Effects on the friction between object and table: by speed, direction, place and order."""

from __future__ import annotations

import dataclasses as dc
import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import Body
from physid_drake.cell.forces import FrictionLaw
from physid_drake.cell.laws import Ellipse, Falling, Gradient, Patch
from physid_drake.effects.effect import Coordinate, Effect, Family, PushFacts, Surroundings, parameter
from physid_drake.effects.places import close_grid_of_places
from physid_drake.ranges import POSITIVE, Range

Array = NDArray[np.float64]
LEAST_LEFT = 0.05  # of the friction of the first push
SLIGHT_SHARE = 0.015  # of the friction
BASE = 0.6  # of the distance between two places: a patch's radius that covers the gaps
WIDE = (2.0, 3.5)  # times that radius: larger patches are made of those


@dc.dataclass(frozen=True, kw_only=True)
class StribeckFriction(Effect):
    """Friction falls with slip: mu(v) = mu_k + (mu_s - mu_k) exp(-(v / v_s)^2), with excess = mu_s / mu_k - 1.

    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30, 1994, equation 5 with exponent 2.
    """

    name: ClassVar[str] = "stribeck_friction"
    element: ClassVar[str] = "table"
    statement: ClassVar[str] = "friction with the table falls as slip gets faster"
    frame: ClassVar[str] = "object_velocity"
    amplitudes: ClassVar[tuple[str, ...]] = ("excess",)

    excess: float = parameter(0.0, "-", values=Range(least=-1.0))
    speed: float = parameter(0.1, "m/s", values=POSITIVE)

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Excess and log speed."""
        del around
        return (
            Coordinate(name="excess", step=2.0 * SLIGHT_SHARE, lower=0.0, upper=3.0),
            Coordinate(name="speed", log=True, step=0.05, lower=math.log(2e-3), upper=math.log(1.0), std=1.0),
        )

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """A few speeds below the object's top speed."""
        speeds = [v for v in (0.01, 0.03, 0.07, 0.15, 0.3) if v < around.top_speed] or [0.3 * around.top_speed]
        return tuple(Family(point=(0.0, math.log(v)), free=(0,)) for v in speeds)

    def frictions(self, facts: PushFacts) -> tuple[FrictionLaw, ...]:
        """The law."""
        del facts
        return (Falling(self.excess, self.speed),)


@dc.dataclass(frozen=True, kw_only=True)
class _Anisotropic(Effect):
    """An elliptic limit curve: force = -N M^2 v / |M v|, M with mu sqrt(ratio) and mu / sqrt(ratio) on its axes.

    ``angle`` is that of the low-friction axis; the geometric mean of the two coefficients is the cell's. The force
    maximises dissipation. Source: S. Goyal, A. Ruina, J. Papadopoulos, Wear 143, 1991.
    """

    amplitudes: ClassVar[tuple[str, ...]] = ("ratio",)
    fixed_in_object: ClassVar[bool]

    ratio: float = parameter(1.0, "-", values=POSITIVE)
    angle: float = parameter(0.0, "rad", period=math.pi)

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Log ratio times cosine and sine of twice the angle: smooth where the ratio is 1."""
        del around
        return tuple(Coordinate(name=name, step=0.03, lower=-2.0, upper=2.0) for name in ("cosine", "sine"))

    @classmethod
    def at(cls, point: Array, around: Surroundings) -> _Anisotropic:
        """From cosine and sine."""
        del around
        log_ratio = math.hypot(point[0], point[1])
        angle = 0.5 * math.atan2(point[1], point[0]) % math.pi
        return cls(ratio=math.exp(log_ratio), angle=angle)

    def frictions(self, facts: PushFacts) -> tuple[FrictionLaw, ...]:
        """The law."""
        del facts
        return (Ellipse(self.ratio, self.angle, self.fixed_in_object),)


@dc.dataclass(frozen=True, kw_only=True)
class AnisotropicTable(_Anisotropic):
    """Friction is an ellipse fixed in the table: the grain of wood."""

    name: ClassVar[str] = "anisotropic_table"
    element: ClassVar[str] = "table"
    statement: ClassVar[str] = "friction depends on the direction of slip on the table: a grain"
    frame: ClassVar[str] = "world"
    fixed_in_object: ClassVar[bool] = False


@dc.dataclass(frozen=True, kw_only=True)
class AnisotropicObject(_Anisotropic):
    """Friction is an ellipse fixed in the object: a brushed or ribbed underside."""

    name: ClassVar[str] = "anisotropic_object"
    element: ClassVar[str] = "object"
    statement: ClassVar[str] = "friction depends on the direction of slip in the object: a ribbed underside"
    frame: ClassVar[str] = "object"
    fixed_in_object: ClassVar[bool] = True


@dc.dataclass(frozen=True, kw_only=True)
class FrictionPatch(Effect):
    """A round region of the table whose friction is ``ratio`` times that of the rest; its edge is sharp.

    Larger than what a support point stands for: that is how sharply the cell sees an edge.
    """

    name: ClassVar[str] = "friction_patch"
    element: ClassVar[str] = "table"
    statement: ClassVar[str] = "friction differs in one round region of the table"
    frame: ClassVar[str] = "world"
    amplitudes: ClassVar[tuple[str, ...]] = ("ratio",)

    ratio: float = parameter(1.0, "-", values=POSITIVE)
    x: float = parameter(0.0, "m")
    y: float = parameter(0.0, "m")
    radius: float = parameter(0.05, "m", values=POSITIVE)

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Log ratio, place, log radius."""
        _, spacing = close_grid_of_places(around)
        return (
            Coordinate(name="ratio", log=True, step=0.04, lower=math.log(0.05), upper=math.log(20.0)),
            Coordinate(name="x", step=0.05 * spacing, std=spacing),
            Coordinate(name="y", step=0.05 * spacing, std=spacing),
            Coordinate(name="radius", log=True, step=0.05, lower=math.log(0.005), upper=math.log(1.0), std=0.5),
        )

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """A grid of places, with a radius that covers the gaps between them, and wider patches made of these.

        A fit that starts from a patch of a third of the true radius does not find out.
        """
        places, spacing = close_grid_of_places(around)
        radius = BASE * spacing
        simulated = tuple(_patch_family((x, y), radius) for x, y in places.tolist())
        wide = (
            _patch_family((x, y), w * radius, _shares(places, np.array((x, y)), w, radius, spacing))
            for w in WIDE
            for x, y in places.tolist()
        )
        return (*simulated, *wide)

    def frictions(self, facts: PushFacts) -> tuple[FrictionLaw, ...]:
        """The law; none of a patch that the push does not reach: the contact holds no more friction than it must."""
        place = np.array([self.x, self.y])
        away = float(np.hypot(*(place - np.clip(place, *facts.region))))
        return (Patch(self.ratio, self.x, self.y, self.radius),) if away <= self.radius else ()


def _patch_family(place: tuple[float, float], radius: float, shares: tuple[float, ...] = ()) -> Family:
    return Family(point=(0.0, *place, math.log(radius)), free=(0,), shares=shares)


def _shares(places: Array, place: Array, wide: float, radius: float, spacing: float) -> tuple[float, ...]:
    """How much of each patch of the grid lies in one ``wide`` times as large at a place; overlaps count once."""
    away = np.hypot(*(places - place).T)
    inside = np.clip(0.5 + 0.5 * (wide - away / radius), 0.0, 1.0)
    overlap = math.pi * radius**2 / spacing**2
    return tuple((inside / overlap).tolist())


@dc.dataclass(frozen=True, kw_only=True)
class FrictionGradient(Effect):
    """Friction changes linearly across the table: mu (1 + slope_x x + slope_y y)."""

    name: ClassVar[str] = "friction_gradient"
    element: ClassVar[str] = "table"
    statement: ClassVar[str] = "friction changes from one side of the table to the other"
    frame: ClassVar[str] = "world"
    amplitudes: ClassVar[tuple[str, ...]] = ("slope_x", "slope_y")

    slope_x: float = parameter(0.0, "1/m")
    slope_y: float = parameter(0.0, "1/m")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The two slopes."""
        reach = np.maximum(np.abs(around.region).max(axis=0), 0.05)
        # Where the object goes, some friction is left; where all of it lies on one side of the origin, it may grow.
        lower = -0.95 / np.maximum(around.region[1], 0.05)
        upper = 0.95 / np.maximum(-around.region[0], 0.05)
        return tuple(
            Coordinate(name=name, step=2.0 * SLIGHT_SHARE / r, lower=low, upper=high)
            for name, r, low, high in zip(
                ("slope_x", "slope_y"), reach.tolist(), lower.tolist(), upper.tolist(), strict=True
            )
        )

    def frictions(self, facts: PushFacts) -> tuple[FrictionLaw, ...]:
        """The law."""
        slopes = np.array([self.slope_x, self.slope_y])
        # Of the places that the push may reach: the contact holds no more than it must.
        steepest = float(np.maximum(slopes * facts.region[0], slopes * facts.region[1]).sum())
        return (Gradient(self.slope_x, self.slope_y, 1.0 + max(0.0, steepest)),)


@dc.dataclass(frozen=True, kw_only=True)
class FrictionDrift(Effect):
    """Friction changes with the order of the pushes: mu (1 + per_push k), k from 0."""

    name: ClassVar[str] = "friction_drift"
    element: ClassVar[str] = "table"
    statement: ClassVar[str] = "friction changes between pushes: wear, dust, warming up"
    frame: ClassVar[str] = "push_order"
    amplitudes: ClassVar[tuple[str, ...]] = ("per_push",)

    per_push: float = parameter(0.0, "-")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The change per push."""
        count = max(1, around.pushes - 1)
        return (
            Coordinate(
                name="per_push", step=2.0 * SLIGHT_SHARE / count, lower=(LEAST_LEFT - 1.0) / count, upper=3.0 / count
            ),
        )

    def friction_change(self, order: int) -> float:
        """By which share friction differs in a push: by its number, and some is left after those still to come."""
        return max(LEAST_LEFT - 1.0, self.per_push * order)

    def body(self, body: Body, facts: PushFacts) -> Body:
        """The friction of this push."""
        return dc.replace(body, support_friction=(1.0 + self.friction_change(facts.order)) * body.support_friction)
