"""What the laws of an effect say at a state of the object, for drawings and tables.

A rollout asks the same laws, so that no formula stands in a drawing again.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.diagram import GRAVITY
from physid_drake.cell.forces import Frictions
from physid_drake.cell.object_state import Complex, ObjectState, Underside
from physid_drake.effects.effect import Effect, PushFacts

Array = NDArray[np.float64]
DISC = 0.005  # m: of what one support point stands for, about that of a box of 0.1 m on 100 points
GYRATION = 0.05  # m: radius of gyration of the object
ROLLING = 1.5  # of a solid cylinder that rolls: what a force across its axis sets in motion, over its mass


def object_at(
    *, place: complex = 0j, velocity: complex = 0j, yaw_rate: float = 0.0,
    points: Sequence[complex] | Complex = (0j,), mass: float = 1.0, time: float = 0.0, span: float = 1e-4,
) -> ObjectState:  # fmt: skip
    """An object on a level table as a law sees it, with its axes along those of W and its mass in the middle.

    Args:
        place: of Bo in W, x + iy [m].
        velocity: of Bo in W, x + iy [m/s].
        yaw_rate: rad/s.
        points: (n,) of the underside, x + iy in B [m], which carry equal shares of the weight.
        mass: [kg].
        time: since the rollout's start [s].
        span: of the time step over which a law gives its mean force [s].
    """
    count = len(points)
    underside = Underside(
        points=np.array(points, dtype=np.complex128), weights=np.full(count, 1.0 / count),
        friction=np.ones(count), radii=np.full(count, DISC),
    )  # fmt: skip
    return ObjectState(
        time=time, span=span, p_WBo=place, v_WBo=velocity, p_BoBcm_W=0j, yaw=0.0, yaw_rate=yaw_rate, mass=mass,
        weight=mass * GRAVITY, half_height=0.03, inertia=mass * GYRATION**2, underside=underside,
        lean=(0.0, 0.0, 0.0), stiffness=1e6, rolling_mass=ROLLING * mass,
    )  # fmt: skip


def force_on(state: ObjectState, effect: Effect, facts: PushFacts) -> complex:
    """The force at the centre of mass in W, x + iy [N], of all force laws of an effect."""
    wrenches = [law.wrench(state) for law in effect.laws(facts)]
    return complex(sum(w.fx for w in wrenches), sum(w.fy for w in wrenches))


def friction_factors(state: ObjectState, effect: Effect, facts: PushFacts) -> Complex:
    """Friction (n,) of each point of the underside over that of the baseline model [-].

    The imaginary part turns friction to the left of where it would brake: a point that slips with the velocity v has
    the friction -mu N factor v / abs(v) in W, as complex numbers.
    """
    return Frictions(tuple(effect.frictions(facts))).ratio(state)
