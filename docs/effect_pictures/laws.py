"""The laws of an effect, asked about the object of the pictures."""

from __future__ import annotations

from typing import Any

from physid_drake.effects import Effect, PushFacts
from physid_drake.effects.law_values import force_on, friction_factors, object_at

from .scenes import BOX, EVERYWHERE, MASS, twin_of


def facts(order: int = 0, rolling_radius: float | None = None) -> PushFacts:
    """What effects know of a push of the box."""
    return PushFacts(
        order=order, mass=MASS, polar=twin_of(BOX).polar, rolling_radius=rolling_radius, region=EVERYWHERE
    )


def force_at(effect: Effect, *, rolling_radius: float | None = None, **state: Any) -> complex:
    """The force of an effect, x + iy [N], at a state that `object_at` takes."""
    return force_on(object_at(mass=MASS, **state), effect, facts(rolling_radius=rolling_radius))


def factor_at(effect: Effect, slip: complex) -> complex:
    """Friction over the baseline model's where one point slips, x + iy [m/s]."""
    return complex(friction_factors(object_at(velocity=slip, mass=MASS), effect, facts())[0])
