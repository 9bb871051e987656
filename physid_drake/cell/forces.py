"""Force laws: physics beyond weight, Coulomb friction and the hand, as functions of the object's state.

A law is written once. The stepper adds its impulse to the velocities at the start of a time step, which is where
Drake's solver would add the force of an input port, without the solver's linearisation of that port; friction
holds against it as against any force, since the time step's contact is solved after it.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Protocol, TypeGuard, runtime_checkable

import numpy as np

from physid_drake.cell.object_state import Array, Complex, ObjectState


@dataclass(frozen=True, kw_only=True)
class Wrench:
    """Planar force at the centre of mass in W, and torques about it.

    Attributes:
        fx, fy: N.
        torque: about the vertical [N m].
        tip_x, tip_y: about x and y of W [N m]: they do not move an upright object, but shift the pressure under it.
    """

    fx: float
    fy: float
    torque: float
    tip_x: float = 0.0
    tip_y: float = 0.0


class ForceLaw(Protocol):
    """Anything that pushes the object."""

    def wrench(self, state: ObjectState) -> Wrench:
        """The mean force over the time step that begins at a state, if nothing else acts on the object."""
        ...


@runtime_checkable
class Swinging(Protocol):
    """A law with a motion of its own, which goes on while the object rests."""

    def strongest(self) -> float:
        """Largest force [N] that it may yet bring."""
        ...


@runtime_checkable
class Braking(Protocol):
    """A law like dry friction, which holds what rests: what it does depends on what the others do."""

    def brake(self, state: ObjectState, others: Sequence[Wrench]) -> Wrench:
        """The mean force over the time step that begins at a state, beside the wrenches of all other laws."""
        ...


def brakes(law: ForceLaw) -> TypeGuard[Braking]:
    """Whether a law is ``Braking``; it is asked in every time step, and looking a protocol up is slow."""
    return _has(type(law), Braking)


def swings(law: ForceLaw) -> TypeGuard[Swinging]:
    """Whether a law is ``Swinging``, likewise."""
    return _has(type(law), Swinging)


@cache
def _has(kind: type, protocol: type) -> bool:
    return issubclass(kind, protocol)


class FrictionLaw(Protocol):
    """A friction that is not one Coulomb coefficient per cell.

    The contact itself is given ``largest`` times the cell's coefficient, which holds the object at rest; what is too
    much of it is given back, which vanishes at rest and is therefore never stiff.
    """

    @property
    def largest(self) -> float:
        """Largest ratio to the cell's coefficient that the law reaches, at least 1."""
        ...

    def ratio(self, state: ObjectState) -> Array | Complex:
        """True friction (n,) of the support points over the cell's.

        Its imaginary part turns friction to the left of where it would brake. A point that does not slip has the
        ratio with which it would begin to: slip may turn about it, and the part of the underside that it stands for
        slips.
        """
        ...


@dataclass(frozen=True)
class Frictions:
    """Several friction laws at once: their ratios to the cell's friction multiply, and their turns add."""

    laws: tuple[FrictionLaw, ...]

    @property
    def largest(self) -> float:
        """The product."""
        return math.prod(law.largest for law in self.laws)

    def ratio(self, state: ObjectState) -> Complex:
        """The product (n,)."""
        ratio = np.ones(len(state.underside.points), dtype=np.complex128)
        for law in self.laws:
            ratio *= law.ratio(state)
        # Two strong ellipses might turn friction until it drives.
        braking: Complex = np.maximum(ratio.real, 0.0) + 1j * ratio.imag
        return braking


def total_wrenches(state: ObjectState, laws: Sequence[ForceLaw], frictions: Sequence[FrictionLaw]) -> list[Wrench]:
    """What all laws do at a state; those of friction, and turning slip, give back what the contact has too much."""
    wrenches = [law.wrench(state) for law in laws if not brakes(law)]
    ratio = None
    if frictions:
        together = Frictions(tuple(frictions))
        ratio = together.ratio(state)
        wrenches.append(friction_wrench(state, together.largest - ratio))
    if state.turning:
        wrenches.append(_turning_wrench(state, ratio))
    for law in laws:
        if brakes(law):
            wrenches.append(law.brake(state, wrenches))
    return wrenches


def friction_wrench(state: ObjectState, share: Complex | float) -> Wrench:
    """The wrench of ``share`` (n,) times the cell's friction, along the slip."""
    pushes = share * state.holding * state.slip_directions
    # Imaginary part of conj(arm) force: the moment about Bo.
    return _wrench_at_table(state, complex(pushes.sum()), complex(np.vdot(state.arms, pushes)).imag)


def _turning_wrench(state: ObjectState, ratio: Complex | None) -> Wrench:
    """The friction that cancels where slip turns, given back, less the torque that is left.

    Args:
        state: where slip turns about points.
        ratio: (n,) of the friction that laws leave to the cell's; None without laws.
    """
    force, moment, turn, spin = 0j, 0.0, cmath.exp(1j * state.yaw), state.yaw_rate
    for one in state.turning:
        held = state.holding_at(one.point) * (1.0 if ratio is None else complex(ratio[one.point]))
        push = one.cancelled * held * state.slip_direction_at(one.point)
        force += push
        moment += ((turn * complex(state.underside.points[one.point])).conjugate() * push).imag
        # The direction fades where the point hardly slips; the rest of its disc slips on.
        moment -= one.arm * held.real * spin / math.hypot(spin, state.slow_spin)
    return _wrench_at_table(state, force, moment)


def _wrench_at_table(state: ObjectState, force: complex, moment: float) -> Wrench:
    """The wrench of forces in the table's plane: their sum, and their moment about Bo, then about Bcm."""
    lever = state.p_BoBcm_W
    return Wrench(
        fx=force.real,
        fy=force.imag,
        torque=moment - (lever.real * force.imag - lever.imag * force.real),
        tip_x=state.half_height * force.imag,
        tip_y=-state.half_height * force.real,
    )
