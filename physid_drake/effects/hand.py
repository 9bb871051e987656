"""Effects on the hand's path: a lag, an offset, a spring."""

from __future__ import annotations

import dataclasses as dc
import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import HandPath, Motion
from physid_drake.effects.effect import Coordinate, Effect, Family, PushFacts, Surroundings, parameter

Array = NDArray[np.float64]
FINE = 2e-3  # s between knots of a path that was changed
FASTEST = 8e-3  # s: the tip's spring is taken to settle no faster


@dc.dataclass(frozen=True, kw_only=True)
class _HandEffect(Effect):
    """An effect that needs a hand."""

    @classmethod
    def applies(cls, around: Surroundings) -> bool:
        """With a hand."""
        return around.has_hand


@dc.dataclass(frozen=True, kw_only=True)
class HandCompliance(_HandEffect):
    """The tip is on a spring: it is behind where the robot says by compliance times the force.

    The force is that of the pass before (a fixed-point iteration on the whole path), followed with the time constant
    2 damping sqrt(mass compliance) of a spring and damper under the object's mass, at least ``FASTEST``.
    """

    name: ClassVar[str] = "hand_compliance"
    element: ClassVar[str] = "hand"
    statement: ClassVar[str] = "the tip gives way under the force of the contact"
    frame: ClassVar[str] = "contact"
    passes: ClassVar[int] = 3
    amplitudes: ClassVar[tuple[str, ...]] = ("compliance",)

    compliance: float = parameter(0.0, "m/N")
    damping: float = parameter(0.5, "-")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The compliance; the damping is hardly seen and keeps its value."""
        force = around.friction * around.weight
        return (Coordinate(name="compliance", step=2e-4 / force, lower=0.0, upper=0.05 / force),)

    def hand(self, path: HandPath, facts: PushFacts, before: Motion | None) -> HandPath:
        """The path less what the spring gives."""
        if before is None or len(before.times) < 3:
            return path
        times = _fine_times(path, float(before.times[-1]))
        force = before.forces_at(times)[:, :2]
        constant = max(2.0 * self.damping * math.sqrt(facts.mass * self.compliance), FASTEST)
        deflection = -self.compliance * _lagged(times, force, constant)
        rates = np.gradient(deflection, times, axis=0)
        return _path_through(times, path.positions(times)[0], _velocities(path, times) + rates)


@dc.dataclass(frozen=True, kw_only=True)
class ActuatorLag(_HandEffect):
    """The hand columns are commands; the tip follows with a first-order lag."""

    name: ClassVar[str] = "actuator_lag"
    element: ClassVar[str] = "hand"
    statement: ClassVar[str] = "the tip is behind the recorded hand by a constant time"
    frame: ClassVar[str] = "time"
    amplitudes: ClassVar[tuple[str, ...]] = ("time_constant",)

    time_constant: float = parameter(0.0, "s")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The time constant."""
        return (Coordinate(name="time_constant", step=2e-3, lower=0.0, upper=0.3),)

    def hand(self, path: HandPath, facts: PushFacts, before: Motion | None) -> HandPath:
        """The path, lagged."""
        del facts, before
        times = _fine_times(path, float(path.times[-1]) + 8.0 * self.time_constant)
        velocities = _lagged(times, _velocities(path, times), self.time_constant)
        velocities[-1] = 0.0
        return _path_through(times, path.start, velocities)


@dc.dataclass(frozen=True, kw_only=True)
class HandOffset(_HandEffect):
    """The tip is not where its calibration says: an offset in P.

    The axes of P are those of W where the recording has no rotation of the hand.
    """

    name: ClassVar[str] = "hand_offset"
    element: ClassVar[str] = "hand"
    statement: ClassVar[str] = "the tip is not where the recording says"
    frame: ClassVar[str] = "hand"
    amplitudes: ClassVar[tuple[str, ...]] = ("x", "y")

    x: float = parameter(0.0, "m")
    y: float = parameter(0.0, "m")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The offsets."""
        most = 0.5 * around.radius
        return tuple(Coordinate(name=name, step=4e-4, lower=-most, upper=most) for name in ("x", "y"))

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """Both together."""
        del around
        return (Family(point=(0.0, 0.0), free=(0, 1)),)

    def hand(self, path: HandPath, facts: PushFacts, before: Motion | None) -> HandPath:
        """The path, shifted."""
        del facts, before
        return dc.replace(path, start=path.start + np.array([self.x, self.y]))


def _fine_times(path: HandPath, end: float) -> Array:
    """Knots: the path's own and a fine grid over it (n,) [s]."""
    first, last = float(path.times[0]), max(float(path.times[-1]), end)
    count = max(2, math.ceil((last - first) / FINE) + 1)
    times = np.unique(np.concatenate([np.linspace(first, last, count), path.times]))
    kept: Array = times[np.concatenate([[True], np.diff(times) > 1e-6])]
    return kept


def _velocities(path: HandPath, times: Array) -> Array:
    """Velocities (n, 2) [m/s]; at rest outside the path's knots."""
    inside = (times >= path.times[0]) & (times <= path.times[-1])
    columns = [np.interp(times, path.times, column) for column in path.velocities.T]
    velocities: Array = np.column_stack(columns) * inside[:, None]
    return velocities


def _lagged(times: Array, values: Array, constant: float) -> Array:
    """First-order lag of values (n, k) that are linear between times (n,): exact over each piece."""
    result = values.copy()
    if constant <= 0.0:
        return result
    for k in range(1, len(times)):
        h = times[k] - times[k - 1]
        decay = math.exp(-h / constant)
        slope = (values[k] - values[k - 1]) / h
        # y' = (u - y) / T with u linear: y = u - T u' + (y0 - u0 + T u') exp(-h / T).
        result[k] = values[k] - constant * slope + decay * (result[k - 1] - values[k - 1] + constant * slope)
    return result


def _path_through(times: Array, start: Array, velocities: Array) -> HandPath:
    return HandPath(times=times, velocities=velocities, start=start)
