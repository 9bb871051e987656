"""What the object looks like from above within a rollout, as force and friction laws see it."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.diagram import Scene
from physid_drake.cell.motion import planar_pose
from physid_drake.cell.setters import Body
from physid_drake.cell.turning import CANCELS, Turning

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# m/s: below this slip friction fades, as Drake's does (the default stiction tolerance of a cell). Where laws fade at
# other slips than the contact that they give friction back of, slow pushes feel the difference.
SLOWEST = 1e-4


@dataclass(frozen=True, kw_only=True)
class Underside:
    """The support points of a rollout.

    Attributes:
        points: (n,) in B, as x + iy [m].
        weights: (n,) shares of the load.
        friction: (n,) the kinetic coefficient of each point's friction cell, without any law [-].
        radii: (n,) of a disc as large as what each point stands for [m].
    """

    points: Complex
    weights: Array
    friction: Array
    radii: Array

    @cached_property
    def reach(self) -> float:
        """From Bo, how far away a place may be about which slip turns within what a point stands for [m]."""
        return float((np.abs(self.points) + CANCELS * self.radii).max())


@dataclass(kw_only=True)
class ObjectState:
    """The object at the start of a time step, seen from above.

    What concerns the support points is computed when a law asks for it: most laws do not, and time steps are many.
    Plane vectors of points are complex numbers x + iy inside, for one numpy call instead of several.

    Attributes:
        time: since the rollout's start [s].
        span: how long the time step is [s]: what a law gives is held for so long.
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
        stiffness: of the whole support [N/m].
        lifted: whether the contact takes friction from depths that are larger than the loads (``lifts``).
        v_rolling: of the underside against Bo, in an object that rolls, x + iy [m/s].
        rolling_mass: what a force across its axis sets in motion [kg]; 0 of what does not roll.
        lead: how far ahead a force by the object's place is taken, in time steps [-].
        edge: lower and upper corner of a table that ends, x + iy [m]; None where it does not.
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
    stiffness: float
    lifted: bool = False
    v_rolling: complex = 0j
    rolling_mass: float = 0.0
    lead: float = 0.5
    edge: tuple[complex, complex] | None = None

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

    @property
    def p_WBcm_held(self) -> Array:
        """Centre of mass (2,) where a force by its place is taken, that is held over the time step [m].

        A rollout's slide moves by the mean velocity. With the force of where a time step begins, the map of an
        oscillator over a time step has the determinant 1 + (w dt)^2 / 2, and energy is fed in; half a time step later
        it is 1. Drake's own step moves by the velocity at its end: there it is 1 with the force of where the time
        step begins, and half a time step later 1 - (w dt)^2 / 2.
        """
        return np.asarray(self.p_WBcm + self.lead * self.span * self.v_WBcm)

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
        return self.arms * (1j * self.yaw_rate) + (self.v_WBo + self.v_rolling)

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
    def depths(self) -> Array:
        """Of the support points (n,) in the table [m]; none where the table has ended."""
        foot, along_x, along_y = self.lean
        points = self.underside.points
        depths: Array = np.maximum(foot + along_x * points.real + along_y * points.imag, 0.0)
        if self.edge is not None:
            low, high = (self.places - corner for corner in self.edge)
            depths[(low.real < 0.0) | (low.imag < 0.0) | (high.real > 0.0) | (high.imag > 0.0)] = 0.0
        return depths

    @cached_property
    def lifts(self) -> Array:
        """How much deeper than their loads the support points (n,) are [m]: see `physid_drake.cell.lift`."""
        return lifts_of(self.underside.points, self.slips * cmath.exp(-1j * self.yaw), self.span, self.lean)

    @cached_property
    def loads(self) -> Array:
        """Normal forces (n,) on the support points [N]: in proportion to depth.

        They are the contact's own: what laws give back of its friction must be a share of what it has. Of loads that
        always carry the weight together, the difference leans a tall object that is pushed, and that makes it larger.
        """
        depths = self.depths - self.lifts if self.lifted else self.depths
        loads: Array = self.stiffness * self.underside.weights * depths
        return loads

    def holding_at(self, i: int) -> float:
        """Largest friction of support point i without any law [N]: one of ``holding``, where few are asked for."""
        base, (foot, along_x, along_y) = self.underside, self.lean
        deep = foot > math.hypot(along_x, along_y) * base.reach
        if "holding" in self.__dict__ or self.lifted or not deep or self.edge is not None:
            return float(self.holding[i])
        point = complex(base.points[i])  # on the table, as all of them
        depth = foot + along_x * point.real + along_y * point.imag
        return float(base.friction[i] * base.weights[i]) * self.stiffness * depth

    def slip_direction_at(self, i: int) -> complex:
        """Direction in which support point i slips, x + iy in W: that of ``slip_directions``."""
        arm = complex(self.underside.points[i]) * cmath.exp(1j * self.yaw)
        slip = self.v_WBo + 1j * self.yaw_rate * arm
        return slip / math.hypot(abs(slip), SLOWEST)

    @cached_property
    def turning(self) -> list[Turning]:
        """Support points that slip nearly turns about.

        A point has friction of full size and of one direction. Over the part of the underside that it stands for,
        slip points all ways where it turns about a place within: most of the friction cancels, and leaves a torque.
        Without this, three times as many points or more are needed (``benchmarks/turning.py``).
        """
        base, spin = self.underside, self.yaw_rate
        if not abs(self.v_WBo) < abs(spin) * base.reach:
            return []
        distances = np.abs(base.points - self._centre)
        near = np.flatnonzero(distances < CANCELS * base.radii).tolist()
        return [Turning.of(i, float(distances[i]), float(base.radii[i])) for i in near]

    @property
    def slow_spin(self) -> float:
        """Spin below which the base's rim slips more slowly than what the contact holds [rad/s]."""
        return SLOWEST / self.underside.reach

    @property
    def _centre(self) -> complex:
        """The place about which slip turns, x + iy in B [m]."""
        return 1j * self.v_WBo * cmath.exp(-1j * self.yaw) / self.yaw_rate

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
        stiffness: of the whole support [N/m].
        rolling_radius: of a lying cylinder [m]; None of what does not roll.
        rolling_mass: its mass, and its inertia about the axis over the radius squared [kg].
        edge: lower and upper corner of a table that ends, x + iy [m]; None where it does not.
        lead: how far ahead a force by the object's place is taken, in time steps [-]: half of one in a rollout.
        lifted: whether the contact takes friction from depths that are larger than the loads.
    """

    underside: Underside
    mass: float
    weight: float
    inertia: float
    p_BBcm: complex
    half_height: float
    stiffness: float
    rolling_radius: float | None = None
    rolling_mass: float = 0.0
    edge: tuple[complex, complex] | None = None
    lead: float = 0.5
    lifted: bool = False

    def at(self, time: float, span: float, X_WB: Sequence[float], V_WB: Sequence[float]) -> ObjectState:
        """The state.

        Args:
            time: since the rollout's start [s].
            span: how long the time step is that begins then [s].
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
            stiffness=self.stiffness,
            lifted=self.lifted,
            v_rolling=0j if self.rolling_radius is None else self.rolling_radius * complex(-V_WB[1], V_WB[0]),
            rolling_mass=self.rolling_mass,
            edge=self.edge,
            lead=self.lead,
        )

    def lean(self, X_WB: Sequence[float]) -> tuple[float, float, float]:
        """The plane of the underside: depth of Bo's foot in the table [m], and how it grows along x and y of B."""
        w, i, j, k, _, _, z = X_WB
        return self.half_height - z, 2.0 * (w * j - i * k), -2.0 * (w * i + j * k)


def reader_of(body: Body, scene: Scene) -> StateReader:
    """The reader for a body on a scene's support points."""
    support, solid = scene.support, scene.solid
    radius, rolling_mass = solid.rolling_radius, 0.0
    if radius is not None:
        rolling_mass = body.mass * (1.0 + body.inertia_ratio * solid.gyration[1] / radius**2)
    return StateReader(
        underside=Underside(
            points=as_complex(support.points),
            weights=support.weights,
            friction=body.support_friction[support.cells],
            radii=support.radii,
        ),
        mass=body.mass,
        weight=body.mass * scene.gravity,
        inertia=body.mass * body.inertia_ratio * solid.gyration[2],
        p_BBcm=complex(float(body.p_BBcm[0]), float(body.p_BBcm[1])),
        half_height=0.5 * solid.height,
        stiffness=body.mass * scene.gravity / scene.rest_depth,
        rolling_radius=radius,
        rolling_mass=rolling_mass,
        edge=scene.edge,
        lifted=scene.lifts,
    )


def as_plane(vectors: Complex) -> Array:
    """Vectors x + iy (n,) as an array (n, 2), without a copy."""
    plane: Array = vectors.view(np.float64).reshape(-1, 2)
    return plane


def as_complex(vectors: Array) -> Complex:
    """Vectors (n, 2) as x + iy (n,)."""
    flat: Complex = np.ascontiguousarray(vectors).view(np.complex128)[:, 0]
    return flat


def lifts_of(points: Complex, slips: Complex, span: float, lean: tuple[float, float, float]) -> Array:
    """How much deeper than their loads points (n,) are [m].

    Args:
        points: x + iy in B [m].
        slips: their velocities, x + iy in B [m/s].
        span: of the time step [s].
        lean: depth of Bo's foot in the table [m], and how it grows along x and y of B [-].
    """
    foot, along_x, along_y = lean
    depths = np.maximum(foot + along_x * points.real + along_y * points.imag, 0.0)
    return np.asarray(np.minimum(span * (along_x * slips.real + along_y * slips.imag), depths))
