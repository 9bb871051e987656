"""An effect of what is inside an object: liquid that sloshes."""

from __future__ import annotations

import cmath
import dataclasses as dc
import math
from typing import ClassVar

from physid_drake.cell import Body
from physid_drake.cell.diagram import GRAVITY
from physid_drake.cell.forces import ForceLaw, Wrench
from physid_drake.cell.object_state import ObjectState
from physid_drake.effects.effect import Coordinate, Effect, Family, PushFacts, Surroundings, parameter
from physid_drake.ranges import NOT_NEGATIVE, POSITIVE, SHARE


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
    beyond: ClassVar[tuple[str, ...]] = ("turning",)

    fraction: float = parameter(0.0, "-", values=SHARE)
    frequency: float = parameter(4.0, "Hz", values=POSITIVE)
    damping: float = parameter(0.05, "-", values=NOT_NEGATIVE)
    turning: float = parameter(1.0, "-", values=NOT_NEGATIVE)

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
        return (Swing(mass, 2.0 * math.pi * self.frequency, self.damping, load),)


class Swing:
    """Swinging mass: its place and velocity are the law's own state.

    Over a time step the object is taken to keep its velocity and spin, on which the oscillator's motion is exact; the
    object gets the momentum and the angular momentum that the oscillator loses. The spring's anchor is the centre of
    mass, and the damper opposes the motion that is seen from the turning object. Vectors are x + iy in W.
    """

    def __init__(self, mass: float, frequency: float, damping: float, load: float) -> None:
        """``mass`` kg, ``frequency`` rad/s, ``damping`` ratio, ``load`` on the base that moves with the mass [N]."""
        self.mass, self.frequency, self.damping, self.load = mass, frequency, damping, load
        self._time, self._span = math.inf, 0.0  # of the time step that was looked at last; before any call
        # Of the swinging mass: place [m], velocity [m/s]; of the object at the last call: place, velocity, spin.
        self._place = self._velocity = self._from = self._anchor = 0j
        self._spin = 0.0
        self._force = 0j  # on the object [N]
        self._wrench = Wrench(fx=0.0, fy=0.0, torque=0.0)

    def wrench(self, state: ObjectState) -> Wrench:
        """The mean force over a time step, and what it shifts of the pressure."""
        if state.time < self._time:  # a rollout begins
            self._place, self._velocity = complex(*state.p_WBcm), complex(*state.v_WBcm)
        elif state.time > self._time:
            self._advance(state, state.time - self._time)
        moved = (complex(*state.v_WBcm), state.yaw_rate) != (self._anchor, self._spin)  # a strike in between
        if moved or (state.time, state.span) != (self._time, self._span):
            self._time, self._span = state.time, state.span
            self._look_ahead(state)
        return self._wrench

    def strongest(self) -> float:
        """Largest force [N] that the swing will yet bring while the object rests."""
        swing = math.hypot(abs(self._place - self._from), abs(self._velocity) / self.frequency)
        return self.mass * self.frequency**2 * swing

    def _advance(self, state: ObjectState, span: float) -> None:
        """Move by what has passed since the last look."""
        if span > 1.001 * self._span:  # more than its time step: the object stood still, and the rollout skipped it
            start = complex(*state.p_WBcm)
            offset, self._velocity = self._flow(self._place - start, self._velocity, 0.0, span)
            self._place = start + offset
            return
        offset, _ = self._flow(self._place - self._from, self._velocity - self._anchor, self._spin, span)
        self._place = self._from + span * self._anchor + offset
        self._velocity -= span * self._force / self.mass

    def _look_ahead(self, state: ObjectState) -> None:
        """The mean wrench of the next time step."""
        self._from, self._anchor, self._spin = complex(*state.p_WBcm), complex(*state.v_WBcm), state.yaw_rate
        offset, rate = self._place - self._from, self._velocity - self._anchor
        later, slower = self._flow(offset, rate, self._spin, self._span)
        gain = self.mass / self._span
        self._force = gain * (rate - slower)
        moved = self.load * 0.5 * (offset + later)
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
        w, z = self.frequency, self.damping
        root = w * cmath.sqrt(z * z - 1.0 + 2j * z * spin / w) or 1e-9
        slow, fast = -z * w + root, -z * w - root
        a = (rate - fast * offset) / (slow - fast)
        b = offset - a
        first, second = a * cmath.exp(slow * span), b * cmath.exp(fast * span)
        return first + second, slow * first + fast * second


def _cross(a: complex, b: complex) -> float:
    """The vertical part of a x b."""
    return (a.conjugate() * b).imag
