"""Effects that push or pull the object: drag, tilt, tether, magnet, sloshing, rolling resistance."""

from __future__ import annotations

import cmath
import dataclasses as dc
import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import Body
from physid_drake.cell.diagram import GRAVITY
from physid_drake.cell.forces import ForceLaw, ObjectState, Wrench
from physid_drake.effects.effect import Coordinate, Effect, Family, PushFacts, Surroundings, parameter
from physid_drake.effects.places import grid_of_places

Array = NDArray[np.float64]
WEAKEST = 1e-9  # N/m: a spring weaker than this has no anchor
TICK = 2e-3  # s: the rollout's longest; a drag is damped as if it acted so long, so that it never drives backwards
ROLLING_EDGE = 1e-3  # m/s: below it rolling resistance fades, so that it never drives backwards


@dc.dataclass(frozen=True, kw_only=True)
class ViscousDrag(Effect):
    """A force -c v at the centre of mass and a torque -c k^2 w, k^2 the mean square radius of the underside."""

    name: ClassVar[str] = "viscous_drag"
    element: ClassVar[str] = "table"
    statement: ClassVar[str] = "a drag in proportion to the object's speed"
    frame: ClassVar[str] = "object_velocity"
    amplitudes: ClassVar[tuple[str, ...]] = ("coefficient",)

    coefficient: float = parameter(0.0, "N*s/m")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The coefficient."""
        return (Coordinate(name="coefficient", step=around.slight / (0.5 * around.top_speed), lower=0.0),)

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """The drag."""
        return (_ViscousLaw(self.coefficient, facts.polar),)


@dc.dataclass(frozen=True)
class _ViscousLaw:
    coefficient: float
    polar: float

    def wrench(self, state: ObjectState) -> Wrench:
        half = 0.5 * TICK * self.coefficient
        # The impulse is that of the mean speed over the tick: of second order, and stable for any coefficient.
        fx, fy = (-self.coefficient / (1.0 + half / state.mass) * state.v_WBcm).tolist()
        turning = self.coefficient * self.polar / (1.0 + half * self.polar / state.inertia)
        return Wrench(fx=fx, fy=fy, torque=-turning * state.yaw_rate)


@dc.dataclass(frozen=True, kw_only=True)
class QuadraticDrag(Effect):
    """A force -c v abs(v) at the centre of mass: air."""

    name: ClassVar[str] = "quadratic_drag"
    element: ClassVar[str] = "world"
    statement: ClassVar[str] = "a drag in proportion to the square of the object's speed"
    frame: ClassVar[str] = "object_velocity"
    amplitudes: ClassVar[tuple[str, ...]] = ("coefficient",)

    coefficient: float = parameter(0.0, "N*s^2/m^2")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The coefficient."""
        return (Coordinate(name="coefficient", step=around.slight / (0.4 * around.top_speed**2), lower=0.0),)

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """The drag."""
        del facts
        return (_QuadraticLaw(self.coefficient),)


@dc.dataclass(frozen=True)
class _QuadraticLaw:
    coefficient: float

    def wrench(self, state: ObjectState) -> Wrench:
        vx, vy = state.v_WBcm.tolist()
        drag = self.coefficient * math.hypot(vx, vy)
        factor = -drag / (1.0 + 0.5 * TICK * drag / state.mass)
        return Wrench(fx=factor * vx, fy=factor * vy, torque=0.0)


@dc.dataclass(frozen=True, kw_only=True)
class TableTilt(Effect):
    """Gravity has a component along the table: m g sin(x) along x of W, m g sin(y) along y."""

    name: ClassVar[str] = "table_tilt"
    element: ClassVar[str] = "table"
    statement: ClassVar[str] = "a constant force along one direction of the table: it is not level"
    frame: ClassVar[str] = "world"
    amplitudes: ClassVar[tuple[str, ...]] = ("x", "y")

    x: float = parameter(0.0, "rad")
    y: float = parameter(0.0, "rad")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The two angles."""
        step, most = 0.015 * around.friction, 0.9 * math.atan(around.friction)
        return tuple(Coordinate(name=name, step=step, lower=-most, upper=most) for name in ("x", "y"))

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """Gravity's component."""
        del facts
        return (_TiltLaw(math.sin(self.x), math.sin(self.y)),)


@dc.dataclass(frozen=True)
class _TiltLaw:
    x: float  # of the weight
    y: float

    def wrench(self, state: ObjectState) -> Wrench:
        return Wrench(fx=state.weight * self.x, fy=state.weight * self.y, torque=0.0)


@dc.dataclass(frozen=True, kw_only=True)
class Tether(Effect):
    """A spring or cable to a point of the world: pulls with stiffness (d - rest_length) where it is taut."""

    name: ClassVar[str] = "tether"
    element: ClassVar[str] = "world"
    statement: ClassVar[str] = "a pull towards a point of the world that grows with the distance: a spring or a cable"
    frame: ClassVar[str] = "world"
    amplitudes: ClassVar[tuple[str, ...]] = ("stiffness",)

    stiffness: float = parameter(0.0, "N/m")
    x: float = parameter(0.0, "m")
    y: float = parameter(0.0, "m")
    rest_length: float = parameter(0.0, "m")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Stiffness, the force at the region's middle, and the rest length: linear where the rest length is 0."""
        reach = float(np.max(around.region[1] - around.region[0]))
        force, most = around.slight, 0.8 * around.friction * around.weight
        return (
            Coordinate(name="stiffness", step=2.0 * force / reach, lower=0.0),
            Coordinate(name="force_x", step=force, lower=-most, upper=most),
            Coordinate(name="force_y", step=force, lower=-most, upper=most),
            Coordinate(name="rest_length", step=0.02 * reach, lower=0.0, upper=2.0 * reach, std=0.3 * reach),
        )

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """With rest length 0."""
        return (Family(point=(0.0, 0.0, 0.0, 0.0), free=(0, 1, 2)),)

    @classmethod
    def at(cls, point: Array, around: Surroundings) -> Tether:
        """The spring whose pull at the region's middle is the chart's force."""
        stiffness, fx, fy, rest = point.tolist()
        if stiffness == fx == fy == 0.0:
            return cls(rest_length=rest)
        middle = 0.5 * (around.region[0] + around.region[1])
        k = max(stiffness, WEAKEST)
        pull = math.hypot(fx, fy)
        # Taut at the middle: pull = k (d - rest), towards the anchor.
        stretch = 1.0 + (k * rest / pull if pull > 0.0 else 0.0)
        x, y = middle + stretch * np.array([fx, fy]) / k
        return cls(stiffness=k, x=float(x), y=float(y), rest_length=rest)

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """The spring."""
        del facts
        return (_SpringLaw(self.stiffness, self.x, self.y, self.rest_length),)


@dc.dataclass(frozen=True)
class _SpringLaw:
    stiffness: float
    x: float
    y: float
    rest_length: float

    def wrench(self, state: ObjectState) -> Wrench:
        px, py = state.p_WBcm.tolist()
        dx, dy = self.x - px, self.y - py
        if self.rest_length == 0.0:
            return Wrench(fx=self.stiffness * dx, fy=self.stiffness * dy, torque=0.0)
        distance = math.hypot(dx, dy)
        pull = self.stiffness * max(0.0, distance - self.rest_length) / max(distance, 1e-9)
        return Wrench(fx=pull * dx, fy=pull * dy, torque=0.0)


@dc.dataclass(frozen=True, kw_only=True)
class Magnet(Effect):
    """A short-range attraction to a point of the table: F = strength / (d^2 + core^2)."""

    name: ClassVar[str] = "magnet"
    element: ClassVar[str] = "world"
    statement: ClassVar[str] = "an attraction to a point of the table that fades with distance"
    frame: ClassVar[str] = "world"
    amplitudes: ClassVar[tuple[str, ...]] = ("strength",)

    strength: float = parameter(0.0, "N*m^2")
    x: float = parameter(0.0, "m")
    y: float = parameter(0.0, "m")
    core: float = parameter(0.03, "m")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Strength, place, log of the core."""
        _, spacing = grid_of_places(around)
        return (
            Coordinate(name="strength", step=1.0 * around.slight * spacing**2, lower=0.0),
            Coordinate(name="x", step=0.05 * spacing, std=spacing),
            Coordinate(name="y", step=0.05 * spacing, std=spacing),
            Coordinate(name="core", log=True, step=0.1, lower=math.log(0.002), upper=math.log(0.3), std=0.7),
        )

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """A grid of places."""
        places, _ = grid_of_places(around)
        return tuple(Family(point=(0.0, float(x), float(y), math.log(0.03)), free=(0,)) for x, y in places)

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """The attraction."""
        del facts
        return (_MagnetLaw(self.strength, self.x, self.y, self.core),)


@dc.dataclass(frozen=True)
class _MagnetLaw:
    strength: float
    x: float
    y: float
    core: float

    def wrench(self, state: ObjectState) -> Wrench:
        px, py = state.p_WBcm.tolist()
        dx, dy = self.x - px, self.y - py
        square = dx * dx + dy * dy
        pull = self.strength / (square + self.core**2) / max(math.sqrt(square), 1e-6)
        return Wrench(fx=pull * dx, fy=pull * dy, torque=0.0)


@dc.dataclass(frozen=True, kw_only=True)
class Sloshing(Effect):
    """A part of the mass hangs on a spring and damper inside: liquid in a bottle.

    The whole weight stands on the table, and the moving part's moves with it: the pressure under the object shifts
    by ``fraction`` times the swing. ``frequency`` and ``damping`` are those in an object that is held.

    Assumed, and only roughly true of a bottle: one linear mode, the same along x and y (a round bottle's first, while
    it swings little); its pull acts at half the object's height; and it rests under the centre of mass when the push
    begins. A lying cylinder keeps its liquid low as it rolls: there the moving weight tips nothing.

    ``turning`` is not in the catalogue, which leaves it open: the share of the liquid's moment of inertia that turns
    with the object, most of it in a box, next to none in a round bottle.
    """

    name: ClassVar[str] = "sloshing"
    element: ClassVar[str] = "object"
    statement: ClassVar[str] = "a part of the mass swings inside the object"
    frame: ClassVar[str] = "object_acceleration"
    amplitudes: ClassVar[tuple[str, ...]] = ("fraction",)

    fraction: float = parameter(0.0, "-")
    frequency: float = parameter(4.0, "Hz")
    damping: float = parameter(0.05, "-")
    turning: float = parameter(1.0, "-")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Fraction, log frequency, log damping, turning."""
        del around
        return (
            Coordinate(name="fraction", step=0.02, lower=0.0, upper=0.8),
            Coordinate(name="frequency", log=True, step=0.02, lower=math.log(0.3), upper=math.log(40.0), std=0.7),
            Coordinate(name="damping", log=True, step=0.2, lower=math.log(1e-3), upper=math.log(2.0), std=1.0),
            Coordinate(name="turning", step=0.2, lower=0.0, upper=1.0, std=0.5),
        )

    @classmethod
    def leading(cls, around: Surroundings) -> tuple[int, ...]:
        """All but what turns."""
        del around
        return (0, 1, 2)

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """Frequencies half an octave apart: at twice the right one a liquid looks like another effect."""
        del around
        return tuple(
            Family(point=(0.0, math.log(frequency), math.log(0.05), 0.5), free=(0,), size=3.0)
            for frequency in (1.5, 2.1, 3.0, 4.2, 6.0, 9.0)
        )

    def heaviness(self) -> float:
        """The rigid rest carries the whole weight: under more than the earth's gravity, since it is lighter."""
        return 1.0 / (1.0 - self.fraction)

    def body(self, body: Body, facts: PushFacts) -> Body:
        """The rigid rest: lighter, with the moment of inertia of all that turns."""
        del facts
        rest, turns = 1.0 - self.fraction, 1.0 - self.fraction * (1.0 - self.turning)
        return dc.replace(body, mass=rest * body.mass, inertia_ratio=body.inertia_ratio * turns / rest)

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """A fresh oscillator for each rollout."""
        mass = self.fraction * facts.mass
        load = mass * GRAVITY if facts.rolling_radius is None else 0.0
        return (_SloshLaw(mass, 2.0 * math.pi * self.frequency, self.damping, load),)


class _SloshLaw:
    """Swinging mass: its place and velocity are the law's own state.

    Over a tick the object is taken to keep its velocity and spin, on which the oscillator's motion is exact; the
    object gets the momentum and the angular momentum that the oscillator loses. The spring's anchor is the centre of
    mass, and the damper opposes the motion that is seen from the turning object. Vectors are x + iy in W.
    """

    def __init__(self, mass: float, frequency: float, damping: float, load: float) -> None:
        """``mass`` kg, ``frequency`` rad/s, ``damping`` ratio, ``load`` on the base that moves with the mass [N]."""
        self._mass, self._frequency, self._damping, self._load = mass, frequency, damping, load
        self._time = math.inf  # before any call
        self._span = TICK
        # Of the swinging mass: place [m], velocity [m/s]; of the object at the last call: place, velocity, spin.
        self._place = self._velocity = self._from = self._anchor = 0j
        self._spin = 0.0
        self._force = 0j  # on the object [N]
        self._wrench = Wrench(fx=0.0, fy=0.0, torque=0.0)

    def wrench(self, state: ObjectState) -> Wrench:
        if state.time < self._time:  # a rollout begins
            self._place, self._velocity = complex(*state.p_WBcm), complex(*state.v_WBcm)
            self._time, self._span = state.time, TICK
            self._look_ahead(state)
        elif state.time > self._time:
            self._advance(state, state.time - self._time)
            self._time = state.time
            self._look_ahead(state)
        return self._wrench

    def strongest(self) -> float:
        """Largest force [N] that the swing will yet bring while the object rests."""
        swing = math.hypot(abs(self._place - self._from), abs(self._velocity) / self._frequency)
        return self._mass * self._frequency**2 * swing

    def _advance(self, state: ObjectState, span: float) -> None:
        """Move by the tick that has passed."""
        if span > 2.0 * TICK:  # the object stood still, and the rollout skipped it
            start = complex(*state.p_WBcm)
            offset, self._velocity = self._flow(self._place - start, self._velocity, 0.0, span)
            self._place, self._span = start + offset, TICK
            return
        offset, _ = self._flow(self._place - self._from, self._velocity - self._anchor, self._spin, span)
        self._place = self._from + span * self._anchor + offset
        self._velocity -= span * self._force / self._mass
        self._span = span

    def _look_ahead(self, state: ObjectState) -> None:
        """The mean wrench of the next tick, as long as the last one."""
        self._from, self._anchor, self._spin = complex(*state.p_WBcm), complex(*state.v_WBcm), state.yaw_rate
        offset, rate = self._place - self._from, self._velocity - self._anchor
        later, slower = self._flow(offset, rate, self._spin, self._span)
        gain = self._mass / self._span
        self._force = gain * (rate - slower)
        moved = self._load * 0.5 * (offset + later)
        self._wrench = Wrench(
            fx=self._force.real,
            fy=self._force.imag,
            torque=gain * (_cross(offset, rate) - _cross(later, slower)),
            tip_x=-moved.imag,
            tip_y=moved.real,
        )

    def _flow(self, offset: complex, rate: complex, spin: float, span: float) -> tuple[complex, complex]:
        """Offset and rate of the free oscillator after a span [s], its damper turning with ``spin`` [rad/s].

        d'' + 2 z w (d' - i spin d) + w^2 d = 0.
        """
        w, z = self._frequency, self._damping
        root = w * cmath.sqrt(z * z - 1.0 + 2j * z * spin / w) or 1e-9
        slow, fast = -z * w + root, -z * w - root
        a = (rate - fast * offset) / (slow - fast)
        b = offset - a
        first, second = a * cmath.exp(slow * span), b * cmath.exp(fast * span)
        return first + second, slow * first + fast * second


def _cross(a: complex, b: complex) -> float:
    """The vertical part of a x b."""
    return (a.conjugate() * b).imag


@dc.dataclass(frozen=True, kw_only=True)
class RollingResistance(Effect):
    """A rolling object loses speed: the contact force leads by ``coefficient``, so a moment N b opposes the roll.

    On a cylinder that rolls without slip the moment is a force N b / R at the centre of mass.
    """

    name: ClassVar[str] = "rolling_resistance"
    element: ClassVar[str] = "object"
    statement: ClassVar[str] = "a rolling object slows down"
    frame: ClassVar[str] = "object_velocity"
    amplitudes: ClassVar[tuple[str, ...]] = ("coefficient",)

    coefficient: float = parameter(0.0, "m")

    @classmethod
    def applies(cls, around: Surroundings) -> bool:
        """On lying cylinders."""
        return around.rolls

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The coefficient."""
        return (Coordinate(name="coefficient", step=5e-4 * around.height, lower=0.0, upper=0.2 * around.height),)

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """The force."""
        return (_RollingLaw(self.coefficient / facts.rolling_radius),) if facts.rolling_radius else ()


@dc.dataclass(frozen=True)
class _RollingLaw:
    share: float  # of the weight

    def wrench(self, state: ObjectState) -> Wrench:
        # Across the axis (y of B) it rolls; along the axis it slides.
        across = np.array([math.cos(state.yaw), math.sin(state.yaw)])
        speed = float(across @ state.v_WBcm)
        edge = max(ROLLING_EDGE, self.share * state.weight / state.mass * TICK)
        force = -self.share * state.weight * speed / math.hypot(speed, edge)
        return Wrench(fx=force * across[0], fy=force * across[1], torque=0.0)
