"""The vocabulary of laws: values that the cell reads here and the compiled twin in its own way.

An effect writes down what it does in these words. A law that is none of them works, too, in the cell alone.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.forces import Wrench
from physid_drake.cell.object_state import Complex, ObjectState

Array = NDArray[np.float64]
POINT = 1e-9  # m: of what stands for no disc, as under a lying cylinder
CLOSEST = 1e-9  # m: a spring to where the object is has no direction
CLOSEST_ATTRACTION = 1e-6  # m


def _mean_decay(share: float) -> float:
    """Mean of exp(-share t) over t in 0..1: what is left, on the average of a tick, of a speed that decays so."""
    return -math.expm1(-share) / share if share > 0.0 else 1.0


@dataclass(frozen=True)
class Tilt:
    """A constant force at the centre of mass: shares of the weight along x and y of W [-]."""

    x: float
    y: float

    def wrench(self, state: ObjectState) -> Wrench:
        """The mean force over a tick."""
        return Wrench(fx=state.weight * self.x, fy=state.weight * self.y, torque=0.0)


@dataclass(frozen=True)
class Viscous:
    """A force -coefficient v [N s/m] at the centre of mass and a torque -coefficient polar w, polar in m^2."""

    coefficient: float
    polar: float

    def wrench(self, state: ObjectState) -> Wrench:
        """The mean over the tick of the exact decay, v exp(-c t / m): never drives backwards, however strong."""
        turning = self.coefficient * self.polar
        force = self.coefficient * _mean_decay(self.coefficient * state.span / state.mass)
        torque = turning * _mean_decay(turning * state.span / state.inertia)
        fx, fy = (-force * state.v_WBcm).tolist()
        return Wrench(fx=fx, fy=fy, torque=-torque * state.yaw_rate)


@dataclass(frozen=True)
class Quadratic:
    """A force -coefficient v abs(v) [N s^2/m^2] at the centre of mass."""

    coefficient: float

    def wrench(self, state: ObjectState) -> Wrench:
        """From the exact decay, v / (1 + k v t / m)."""
        vx, vy = state.v_WBcm.tolist()
        drag = self.coefficient * math.hypot(vx, vy)
        factor = -drag / (1.0 + state.span * drag / state.mass)
        return Wrench(fx=factor * vx, fy=factor * vy, torque=0.0)


@dataclass(frozen=True)
class Spring:
    """A pull to (x, y) [m]: stiffness [N/m] times what the distance exceeds ``rest_length`` by [m]."""

    stiffness: float
    x: float
    y: float
    rest_length: float

    def wrench(self, state: ObjectState) -> Wrench:
        """The force midway through the tick."""
        px, py = state.p_WBcm_held.tolist()
        dx, dy = self.x - px, self.y - py
        if self.rest_length == 0.0:
            return Wrench(fx=self.stiffness * dx, fy=self.stiffness * dy, torque=0.0)
        distance = math.hypot(dx, dy)
        pull = self.stiffness * max(0.0, distance - self.rest_length) / max(distance, CLOSEST)
        return Wrench(fx=pull * dx, fy=pull * dy, torque=0.0)


@dataclass(frozen=True)
class Attraction:
    """A pull to (x, y) [m]: strength [N m^2] / (distance^2 + core^2)."""

    strength: float
    x: float
    y: float
    core: float

    def wrench(self, state: ObjectState) -> Wrench:
        """The force midway through the tick."""
        px, py = state.p_WBcm_held.tolist()
        dx, dy = self.x - px, self.y - py
        square = dx * dx + dy * dy
        pull = self.strength / (square + self.core**2) / max(math.sqrt(square), CLOSEST_ATTRACTION)
        return Wrench(fx=pull * dx, fy=pull * dy, torque=0.0)


@dataclass(frozen=True)
class Falling:
    """Friction times 1 + excess exp(-(slip / speed)^2), speed in m/s."""

    excess: float
    speed: float

    @property
    def largest(self) -> float:
        """Of the factor."""
        return 1.0 + max(0.0, self.excess)

    def ratio(self, state: ObjectState) -> Array | Complex:
        """The factor (n,) of the support points."""
        speeds = np.abs(state.slips)
        return np.asarray(1.0 + self.excess * np.exp(-((speeds / self.speed) ** 2)))


@dataclass(frozen=True)
class Ellipse:
    """Friction -N M^2 v / |M v|, M with mu sqrt(ratio) and mu / sqrt(ratio) on its axes.

    Attributes:
        axes: largest over least friction [-].
        angle: of the slippery axis [rad], in W, or in B where it is ``fixed_in_object``.
    """

    axes: float
    angle: float
    fixed_in_object: bool

    @property
    def largest(self) -> float:
        """Of the factor."""
        return math.sqrt(max(self.axes, 1.0 / self.axes))

    def ratio(self, state: ObjectState) -> Array | Complex:
        """The factor (n,) of the support points; its imaginary part turns friction to the left."""
        angle = self.angle + (state.yaw if self.fixed_in_object else 0.0)
        # M^2 v of a plane vector v = x + iy with the slippery axis at an angle a is mean v + half e^(2ia) conj(v).
        mean, half = 0.5 * (1.0 / self.axes + self.axes), 0.5 * (1.0 / self.axes - self.axes)
        slips = state.slips
        moving = slips != 0.0
        squeezed = np.ones(len(slips), dtype=np.complex128)  # M^2 v / v; rest has no direction
        squeezed[moving] = mean + (half * cmath.exp(2j * angle)) * (slips[moving].conj() / slips[moving])
        # |M v|^2 = v . M^2 v
        return np.asarray(squeezed / np.sqrt(squeezed.real))


@dataclass(frozen=True)
class Patch:
    """Friction times ``inside`` within a circle about (x, y) on the table [m]."""

    inside: float
    x: float
    y: float
    radius: float

    @property
    def largest(self) -> float:
        """Of the factor."""
        return max(1.0, self.inside)

    def ratio(self, state: ObjectState) -> Array | Complex:
        """The factor (n,) of the support points."""
        away = np.abs(state.places - complex(self.x, self.y))
        radii = np.maximum(state.underside.radii, POINT)
        return 1.0 + (self.inside - 1.0) * share_inside(away, self.radius, radii)


@dataclass(frozen=True)
class Gradient:
    """Friction times 1 + slope_x x + slope_y y [1/m], within 0 and ``largest``."""

    slope_x: float
    slope_y: float
    largest: float

    def ratio(self, state: ObjectState) -> Array | Complex:
        """The factor (n,) of the support points."""
        places = state.places
        return np.asarray(np.clip(1.0 + self.slope_x * places.real + self.slope_y * places.imag, 0.0, self.largest))


Law: TypeAlias = Tilt | Viscous | Quadratic | Spring | Attraction | Falling | Ellipse | Patch | Gradient
"""What both integrators know."""


def share_inside(away: Array, radius: float, radii: Array) -> Array:
    """Shares (n,) of discs that lie in a circle: areas of lenses, which two circular segments make.

    An edge of the table is sharp, and crosses the disc that a support point stands for little by little.

    Args:
        away: (n,) from the circle's middle to those of the discs [m].
        radius: of the circle [m].
        radii: (n,) of the discs [m].
    """
    d = np.maximum(away, 1e-9)
    of_disc = np.clip((d**2 + radii**2 - radius**2) / (2.0 * d * radii), -1.0, 1.0)
    of_circle = np.clip((d**2 + radius**2 - radii**2) / (2.0 * d * radius), -1.0, 1.0)
    kite = (radii + radius - d) * (d + radii - radius) * (d - radii + radius) * (d + radii + radius)
    lens = radii**2 * np.arccos(of_disc) + radius**2 * np.arccos(of_circle) - 0.5 * np.sqrt(np.maximum(kite, 0.0))
    # Of points the quotient is noise where the circle's edge goes through them.
    inside: Array = np.clip(lens / (math.pi * radii**2), 0.0, 1.0)
    return inside
