"""Force laws: physics beyond weight, Coulomb friction and the hand, as functions of the object's state.

A law is written once. The stepper adds its impulse to the velocities at the start of a tick, which is where
Drake's solver would add the force of an input port, without the solver's linearisation of that port; friction
holds against it as against any force, since the tick's contact is solved after it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class ObjectState:
    """The object at the start of a tick, seen from above.

    Attributes:
        time: since the rollout's start [s].
        p_WBcm: (2,) centre of mass [m].
        v_WBcm: (2,) its velocity [m/s].
        yaw: heading of B [rad].
        yaw_rate: [rad/s].
        mass: kg.
        inertia: about the vertical through the centre of mass [kg m^2].
        p_WQ: (n, 2) support points [m].
        v_WQ: (n, 2) their velocities [m/s].
        loads: (n,) their normal forces [N].
        friction: (n,) the kinetic coefficient of each point's friction cell, without any law [-].
    """

    time: float
    p_WBcm: Array
    v_WBcm: Array
    yaw: float
    yaw_rate: float
    mass: float
    inertia: float
    p_WQ: Array
    v_WQ: Array
    loads: Array
    friction: Array


@dataclass(frozen=True, kw_only=True)
class Wrench:
    """Planar force [N] at the centre of mass in W, torque [N m] about the vertical through it."""

    fx: float
    fy: float
    torque: float
    at_table: bool = False
    """Whether the force acts at the table, and so also tips the object, or at the centre of mass's height."""


class ForceLaw(Protocol):
    """Anything that pushes the object."""

    def wrench(self, state: ObjectState) -> Wrench:
        """The force at a state."""
        ...


@runtime_checkable
class Swinging(Protocol):
    """A law with a motion of its own, which goes on while the object rests."""

    def strongest(self) -> float:
        """Largest force [N] that it may yet bring."""
        ...


class FrictionLaw(Protocol):
    """A friction that is not one Coulomb coefficient per cell.

    The contact itself is given ``largest`` times the cell's coefficient, which holds the object at rest; the law
    gives back what is too much of it, which vanishes at rest and is therefore never stiff.
    """

    @property
    def largest(self) -> float:
        """Largest ratio to the cell's coefficient that the law reaches, at least 1."""
        ...

    def refund(self, state: ObjectState) -> Array:
        """Forces (n, 2) on the support points [N], along their slip: the contact's friction less the true one."""
        ...


def refund_wrench(state: ObjectState, forces: Array) -> Wrench:
    """The wrench of forces (n, 2) at the support points."""
    arms = state.p_WQ - state.p_WBcm
    torque = float((arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]).sum())
    fx, fy = forces.sum(axis=0).tolist()
    return Wrench(fx=fx, fy=fy, torque=torque, at_table=True)
