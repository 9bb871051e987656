"""Routh's closed-form planar impact of a rigid body with a hand that does not give way.

Drake's CENIC takes the friction of a step from the normal force at its start, which is zero on
touch-down, so its impacts are frictionless. The rollout stops at the touch and applies this law.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Impulse:
    """What the hand gives to the object at the contact point: ``normal`` >= 0 along n, ``tangent`` along t [N s]."""

    normal: float
    tangent: float


def routh_impulse(
    *,
    lever_n: float,
    lever_t: float,
    approach: float,
    slip: float,
    mass: float,
    inertia: float,
    friction: float,
    restitution: float,
) -> Impulse:
    """Impulse on a planar body struck at one point, with Coulomb friction and Poisson restitution.

    n points from the hand into the object, t is n turned by +90 degrees; ``lever_n``, ``lever_t`` are the
    components [m] of the contact point relative to the centre of mass.

    Args:
        lever_n: component of the lever along n [m].
        lever_t: component of the lever along t [m].
        approach: normal velocity of the object's contact point relative to the hand [m/s]; negative closes.
        slip: tangential relative velocity [m/s].
        mass: mass [kg].
        inertia: yaw inertia about the centre of mass [kg m^2].
        friction: Coulomb coefficient between hand and object [-].
        restitution: Poisson's ratio of impulses, restitution over compression [-], in [0, 1].

    Returns:
        The impulse [N s]; zero if the point is not approaching.

    Source: E. J. Routh, Dynamics of a System of Rigid Bodies, 1860 (the impulse-plane method), in the form of
    Y. Wang and M. T. Mason, Two-dimensional rigid-body collisions with friction, J. Appl. Mech. 59, 1992.
    """
    yields = (
        1.0 / mass + lever_t * lever_t / inertia,
        1.0 / mass + lever_n * lever_n / inertia,
        lever_n * lever_t / inertia,
    )
    return impulse_between(
        yields=yields, approach=approach, slip=slip, friction=friction, restitution=restitution
    )  # fmt: skip


def impulse_between(
    *, yields: tuple[float, float, float], approach: float, slip: float, friction: float, restitution: float
) -> Impulse:
    """The same of two bodies that meet at one point.

    Args:
        yields: what the relative velocity gains by impulses, normal by normal, tangent by tangent, and less crosswise
            [1/kg].
        approach: of the second along n, relative to the first [m/s]; negative closes.
        slip: along t, likewise [m/s].
        friction: Coulomb coefficient [-].
        restitution: Poisson's ratio of impulses [-].
    """
    if approach >= 0.0:
        return Impulse(normal=0.0, tangent=0.0)
    # Relative velocity changes by [b1 -b3; -b3 b2] (tangent, normal) per unit impulse.
    b2, b1, b3 = yields
    sign = math.copysign(1.0, slip) if slip != 0.0 else 0.0

    # Walk along the impulse path: first the line of sliding, then that of sticking or of reverse slip.
    # Along a phase the tangent impulse grows by `ratio` per unit of normal impulse.
    if sign == 0.0:
        phases = [(math.inf, _after_slip(b1, b3, friction))]
    else:
        ratio = -sign * friction
        slip_rate = b1 * ratio - b3  # d slip / d normal impulse while sliding
        until = -slip / slip_rate if slip_rate * sign < 0.0 else math.inf
        phases = [(until, ratio), (math.inf, _after_slip(b1, b3, friction))]

    compression = _normal_impulse_at(phases, target=-approach, b2=b2, b3=b3)
    total = (1.0 + restitution) * compression
    return Impulse(normal=total, tangent=_tangent_at(phases, total))


def _after_slip(b1: float, b3: float, friction: float) -> float:
    """Tangent over normal impulse once slip has stopped: sticking if friction can, else reverse slip."""
    sticking = b3 / b1
    if abs(sticking) <= friction:
        return sticking
    # Friction cannot hold: slip starts in the direction in which -b3 drives it.
    direction = math.copysign(1.0, -b3)
    return -direction * friction


def _normal_impulse_at(phases: list[tuple[float, float]], *, target: float, b2: float, b3: float) -> float:
    """Normal impulse at which the accumulated change of normal velocity reaches ``target`` [m/s]."""
    start, gained = 0.0, 0.0
    for end, ratio in phases:
        rate = b2 - b3 * ratio  # d normal velocity / d normal impulse
        if rate > 0.0 and (gained + rate * (end - start) >= target or end == math.inf):
            return start + (target - gained) / rate
        gained += rate * (end - start)
        start = end
    raise ArithmeticError("an impact has no end: normal velocity never recovers")  # b2 b1 > b3^2 forbids it


def _tangent_at(phases: list[tuple[float, float]], normal: float) -> float:
    tangent, start = 0.0, 0.0
    for end, ratio in phases:
        tangent += ratio * (min(normal, end) - start)
        if normal <= end:
            return tangent
        start = end
    return tangent
