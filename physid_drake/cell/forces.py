"""Force laws: physics beyond weight, Coulomb friction and the hand, as functions of the object's state.

A law is written once. The stepper adds its impulse to the velocities at the start of a tick, which is where
Drake's solver would add the force of an input port, without the solver's linearisation of that port; friction
holds against it as against any force, since the tick's contact is solved after it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.diagram import Scene
from physid_drake.cell.motion import planar_pose
from physid_drake.cell.setters import Body

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SLOWEST = 5e-4  # m/s: below this slip a point feels the contact's full friction, which holds it at rest


@dataclass(frozen=True, kw_only=True)
class Underside:
    """The support points of a rollout.

    Attributes:
        points: (n,) in B, as x + iy [m].
        weights: (n,) shares of the area.
        friction: (n,) the kinetic coefficient of each point's friction cell, without any law [-].
    """

    points: Complex
    weights: Array
    friction: Array


@dataclass(kw_only=True)
class ObjectState:
    """The object at the start of a tick, seen from above.

    What concerns the support points is computed when a law asks for it: most laws do not, and ticks are many. Plane
    vectors of points are complex numbers x + iy inside, for one numpy call instead of several.

    Attributes:
        time: since the rollout's start [s].
        span: how long the tick is [s]: what a law gives is held for so long.
        p_WBo: x + iy [m].
        v_WBo: x + iy [m/s].
        p_BoBcm_W: from Bo to the centre of mass, x + iy in W [m].
        yaw: heading of B [rad].
        yaw_rate: [rad/s].
        mass: kg.
        weight: on the table [N].
        half_height: of the centre of mass above the table [m].
        inertia: about the vertical through the centre of mass [kg m^2].
        underside: the support points.
        lean: depth of Bo's foot in the table [m], and how it grows along x and y of B [-].
    """

    time: float
    span: float
    p_WBo: complex
    v_WBo: complex
    p_BoBcm_W: complex
    yaw: float
    yaw_rate: float
    mass: float
    weight: float
    half_height: float
    inertia: float
    underside: Underside
    lean: tuple[float, float, float]

    @cached_property
    def p_WBcm(self) -> Array:
        """Centre of mass (2,) [m]."""
        p = self.p_WBo + self.p_BoBcm_W
        return np.array([p.real, p.imag])

    @cached_property
    def v_WBcm(self) -> Array:
        """Its velocity (2,) [m/s]."""
        v = self.v_WBo + 1j * self.yaw_rate * self.p_BoBcm_W
        return np.array([v.real, v.imag])

    @cached_property
    def arms(self) -> Complex:
        """From Bo to the support points (n,), x + iy in W [m]."""
        return self.underside.points * complex(math.cos(self.yaw), math.sin(self.yaw))

    @cached_property
    def places(self) -> Complex:
        """Support points (n,), x + iy in W [m]."""
        return self.arms + self.p_WBo

    @cached_property
    def slips(self) -> Complex:
        """Velocities (n,) of the support points, x + iy in W [m/s]."""
        return self.arms * (1j * self.yaw_rate) + self.v_WBo

    @cached_property
    def slip_directions(self) -> Complex:
        """Directions (n,) in which the support points slip, x + iy in W; they fade to zero at rest."""
        speeds = np.abs(self.slips)
        directions: Complex = self.slips / np.sqrt(speeds * speeds + SLOWEST**2)
        return directions

    @property
    def p_WQ(self) -> Array:
        """Support points (n, 2) in W [m]."""
        return as_plane(self.places)

    @property
    def v_WQ(self) -> Array:
        """Their velocities (n, 2) in W [m/s]."""
        return as_plane(self.slips)

    @property
    def friction(self) -> Array:
        """The kinetic coefficient (n,) of each point's friction cell, without any law [-]."""
        return self.underside.friction

    @cached_property
    def loads(self) -> Array:
        """Normal forces (n,) on the support points [N]: in proportion to depth, carrying the weight together."""
        foot, along_x, along_y = self.lean
        points = self.underside.points
        shares = self.underside.weights * np.maximum(foot + along_x * points.real + along_y * points.imag, 0.0)
        total = float(shares.sum())
        loads: Array = shares * (self.weight / total) if total > 0.0 else shares
        return loads

    @cached_property
    def holding(self) -> Array:
        """Largest friction (n,) of each support point without any law [N]."""
        held: Array = self.loads * self.underside.friction
        return held


@dataclass(frozen=True, kw_only=True)
class StateReader:
    """Sees the object from above in plant coordinates.

    Attributes:
        underside: the support points.
        mass: kg.
        weight: on the table [N].
        inertia: about the vertical through the centre of mass [kg m^2].
        p_BBcm: x + iy [m].
        half_height: of the object [m].
    """

    underside: Underside
    mass: float
    weight: float
    inertia: float
    p_BBcm: complex
    half_height: float

    def at(self, time: float, span: float, X_WB: Sequence[float], V_WB: Sequence[float]) -> ObjectState:
        """The state.

        Args:
            time: since the rollout's start [s].
            span: how long the tick is that begins then [s].
            X_WB: (7,) quaternion wxyz and position [m].
            V_WB: (6,) angular and linear velocity in W.
        """
        px, py, yaw = planar_pose(*X_WB[:6])
        return ObjectState(
            time=time,
            span=span,
            p_WBo=complex(px, py),
            v_WBo=complex(V_WB[3], V_WB[4]),
            p_BoBcm_W=self.p_BBcm * complex(math.cos(yaw), math.sin(yaw)),
            yaw=yaw,
            yaw_rate=float(V_WB[2]),
            mass=self.mass,
            weight=self.weight,
            half_height=self.half_height,
            inertia=self.inertia,
            underside=self.underside,
            lean=self.lean(X_WB),
        )

    def lean(self, X_WB: Sequence[float]) -> tuple[float, float, float]:
        """The plane of the underside: depth of Bo's foot in the table [m], and how it grows along x and y of B."""
        w, i, j, k, _, _, z = X_WB
        return self.half_height - z, 2.0 * (w * j - i * k), -2.0 * (w * i + j * k)


def reader_of(body: Body, scene: Scene) -> StateReader:
    """The reader for a body on a scene's support points."""
    support, solid = scene.support, scene.solid
    return StateReader(
        underside=Underside(
            points=as_complex(support.points),
            weights=support.weights,
            friction=body.support_friction[support.cells],
        ),
        mass=body.mass,
        weight=body.mass * scene.gravity,
        inertia=body.mass * body.inertia_ratio * solid.gyration[2],
        p_BBcm=complex(float(body.p_BBcm[0]), float(body.p_BBcm[1])),
        half_height=0.5 * solid.height,
    )


def total_wrenches(state: ObjectState, laws: Sequence[ForceLaw], frictions: Sequence[FrictionLaw]) -> list[Wrench]:
    """What all laws do at a state; those of friction give back what the contact has too much."""
    refunds = [refund_wrench(state, law.refund(state)) for law in frictions]
    return [law.wrench(state) for law in laws] + refunds


def as_plane(vectors: Complex) -> Array:
    """Vectors x + iy (n,) as an array (n, 2), without a copy."""
    plane: Array = vectors.view(np.float64).reshape(-1, 2)
    return plane


def as_complex(vectors: Array) -> Complex:
    """Vectors (n, 2) as x + iy (n,)."""
    flat: Complex = np.ascontiguousarray(vectors).view(np.complex128)[:, 0]
    return flat


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
        """The mean force over the tick that begins at a state, if nothing else acts on the object."""
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
    pushes = as_complex(forces)
    whole = complex(pushes.sum())
    # Imaginary part of conj(arm) force: the moment about Bo; then about the centre of mass.
    moment = complex(np.vdot(state.arms, pushes)).imag
    lever = state.p_BoBcm_W
    return Wrench(
        fx=whole.real,
        fy=whole.imag,
        torque=moment - (lever.real * whole.imag - lever.imag * whole.real),
        tip_x=state.half_height * whole.imag,
        tip_y=-state.half_height * whole.real,
    )
