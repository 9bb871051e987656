"""The vocabulary of laws: values that the cell reads here and the compiled twin in its own way.

An effect writes down what it does in these words. A law that is none of them works, too, in the cell alone. Tables
are for what has no name: a friction or a force that changes smoothly with place, heading and speed.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.forces import Wrench
from physid_drake.cell.object_state import Complex, ObjectState
from physid_drake.cell.tables import Places, Row, Rows, Speeds, around, slopes_around

Array = NDArray[np.float64]
POINT = 1e-9  # m: of what stands for no disc, as under a lying cylinder
CLOSEST = 1e-9  # m: a spring to where the object is has no direction
CLOSEST_ATTRACTION = 1e-6  # m


def _mean_decay(share: float) -> float:
    """Mean of exp(-share t) over t in 0..1: the mean over a time step of a speed that decays from 1."""
    return -math.expm1(-share) / share if share > 0.0 else 1.0


@dataclass(frozen=True)
class Tilt:
    """A constant force at the centre of mass: shares of the weight along x and y of W [-]."""

    x: float
    y: float

    def wrench(self, state: ObjectState) -> Wrench:
        """The mean force over a time step."""
        return Wrench(fx=state.weight * self.x, fy=state.weight * self.y, torque=0.0)


@dataclass(frozen=True)
class Viscous:
    """A force -coefficient v [N s/m] at the centre of mass and a torque -coefficient polar w, polar in m^2."""

    coefficient: float
    polar: float

    def wrench(self, state: ObjectState) -> Wrench:
        """The mean over the time step of the exact decay, v exp(-c t / m): never drives backwards, however strong."""
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
        """The force midway through the time step."""
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
        """The force midway through the time step."""
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
        angle: of the low-friction axis [rad], in W, or in B where it is ``fixed_in_object``.
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
        # M^2 v of a plane vector v = x + iy with the low-friction axis at an angle a is mean v + half e^(2ia)
        # conj(v).
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


@dataclass(frozen=True)
class PlaceTable:
    """Friction times a factor that is bilinear between places on the table, and constant beyond the last.

    Attributes:
        factors: rows along x of W, of numbers along y [-]; not below 0.
        places: where they stand.
    """

    factors: Rows
    places: Places

    @property
    def largest(self) -> float:
        """Of the factor."""
        return max(1.0, *map(max, self.factors))

    def ratio(self, state: ObjectState) -> Array | Complex:
        """The factor (n,) of the support points."""
        return self.places.between(self.numbers, state.places)

    @cached_property
    def numbers(self) -> Array:
        """The factors as an array."""
        return np.array(self.factors)


@dataclass(frozen=True)
class SpeedTable:
    """Friction times a factor that is linear over the logarithm of the slip, and constant beyond the last.

    Attributes:
        factors: at slips in equal steps of their logarithm [-]; not below 0.
        speeds: the first slip and the last.
    """

    factors: Row
    speeds: Speeds

    @property
    def largest(self) -> float:
        """Of the factor."""
        return max(1.0, *self.factors)

    def ratio(self, state: ObjectState) -> Array | Complex:
        """The factor (n,) of the support points."""
        return self.speeds.between(self.numbers, np.abs(state.slips))

    @cached_property
    def numbers(self) -> Array:
        """The factors as an array."""
        return np.array(self.factors)


@dataclass(frozen=True)
class HeadingTable:
    """Friction -mu N (f u + f' w) of a point that slips along u, w being u turned left; f is a factor by u's heading.

    f is periodic and linear between equal angles, and so is f', its slope [1/rad] between a number's neighbours. The
    part across the slip does no work. Friction has it if it comes of a potential mu N f abs(v), as that of an ellipse
    does: a table of abs(M u) is an `Ellipse`. It resists a change of velocity across the slip by
    mu N (f + f'') / abs(v), and along it by nothing. That slope is symmetric, and does not drive where f + f'' is
    positive, as for convex limit curves: an implicit step has one solution. Without the part across it is neither.

    Attributes:
        factors: f [-] at angles of 2 pi k / n from x of W to y; not below 0.
    """

    factors: Row

    @property
    def slopes(self) -> Row:
        """Numbers f' at the same angles [1/rad]."""
        return slopes_around(self.factors)

    @cached_property
    def largest(self) -> float:
        """Of the factor's size."""
        return max(1.0, float(np.abs(self.numbers).max()))

    def ratio(self, state: ObjectState) -> Array | Complex:
        """The factor (n,) of the support points; its imaginary part turns friction to the left."""
        slips = state.slips
        numbers = around(self.numbers, np.angle(slips))
        return np.asarray(np.where(slips == 0.0, self.numbers.real.mean(), numbers))  # rest has no direction

    @cached_property
    def numbers(self) -> Complex:
        """Complex f + i f'."""
        return np.array(self.factors) + 1j * np.array(self.slopes)


@dataclass(frozen=True)
class ForceTable:
    """A force at the centre of mass in W that is bilinear between its places, and constant beyond the last.

    Attributes:
        x_forces, y_forces: rows along x of W, of numbers along y [N].
        places: where they stand.
    """

    x_forces: Rows
    y_forces: Rows
    places: Places

    def wrench(self, state: ObjectState) -> Wrench:
        """The force midway through the time step."""
        px, py = state.p_WBcm_held.tolist()
        force = complex(self.places.between(self.numbers, np.array([complex(px, py)]))[0])
        return Wrench(fx=force.real, fy=force.imag, torque=0.0)

    @cached_property
    def numbers(self) -> Complex:
        """Forces, x + iy [N]."""
        return np.array(self.x_forces) + 1j * np.array(self.y_forces)


@dataclass(frozen=True)
class MotionTable:
    """A force at the centre of mass along its velocity and across it, by the logarithm of its speed.

    It is linear over the logarithm, constant above the fastest speed, and below the slowest in proportion to the
    speed: what rests is not moved, and what creeps is held by a friction that is larger.

    Attributes:
        along: forces that drive [N]; below 0 where they brake.
        across: forces to the left [N].
        speeds: the first speed and the last, in equal steps of their logarithm.
    """

    along: Row
    across: Row
    speeds: Speeds

    def wrench(self, state: ObjectState) -> Wrench:
        """The mean force over the time step: of a speed that grows evenly or, below the slowest, by its own size.

        The velocity turns by what the force across says and keeps its size; a brake never drives backwards.
        """
        v, slowest = complex(*state.v_WBcm.tolist()), self.speeds.slowest
        speed = abs(v)
        force = complex(self.speeds.between(self.numbers, np.array([speed]))[0])
        change = state.span * force / (state.mass * max(speed, slowest))
        grown = max(1.0 + change.real, 0.0) if speed > slowest else math.exp(change.real)
        mean = state.mass / state.span * v * (grown * cmath.exp(1j * change.imag) - 1.0)
        return Wrench(fx=mean.real, fy=mean.imag, torque=0.0)

    @cached_property
    def numbers(self) -> Complex:
        """Forces, along + i across [N]."""
        return np.array(self.along) + 1j * np.array(self.across)


Law: TypeAlias = (
    Tilt | Viscous | Quadratic | Spring | Attraction | ForceTable | MotionTable
    | Falling | Ellipse | Patch | Gradient | PlaceTable | SpeedTable | HeadingTable
)  # fmt: skip
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
