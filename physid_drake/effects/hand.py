"""Effects on the hand's path: a lag, an offset, a spring."""

from __future__ import annotations

import dataclasses as dc
import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import HandPath, Motion
from physid_drake.effects.effect import (
    Coordinate,
    Effect,
    Family,
    PushFacts,
    Surroundings,
    families_of_sizes,
    parameter,
)

Array = NDArray[np.float64]
FINE = 2e-3  # s between knots of a path that was changed
FASTEST = 8e-3  # s: the tip's spring is taken to settle no faster
AT_ONCE = 5e-4  # s: a tip that picks the object up in less leaves that to the impact law
PARTING = 4  # ticks before the tip leaves the object whose forces are not those of a push
STANDING = 0.02  # of its top speed: a slower hand stands
FINE_SPRING = 5e-4  # s: step of the tip's spring
SHORTEST = 1e-7  # s between knots


@dc.dataclass(frozen=True, kw_only=True)
class _HandEffect(Effect):
    """An effect that needs a hand."""

    @classmethod
    def applies(cls, around: Surroundings) -> bool:
        """With a hand."""
        return around.has_hand


@dc.dataclass(frozen=True, kw_only=True)
class HandCompliance(_HandEffect):
    """The tip is on a spring and a damper: it is behind where the robot says by compliance times the force.

    A first pass with a stiff tip gives the force G that keeps the object on the hand's path. Relative to that path
    the object is then a mass on the spring, driven by G along its direction, and the second pass follows the tip.
    The damper's time constant is 2 damping sqrt(mass compliance), at least ``FASTEST``: a stiff spring is
    overdamped, so that a vanishing compliance ends at the stiff tip and not at one that bounces.
    """

    name: ClassVar[str] = "hand_compliance"
    element: ClassVar[str] = "hand"
    statement: ClassVar[str] = "the tip gives way under the force of the contact"
    frame: ClassVar[str] = "contact"
    passes: ClassVar[int] = 2
    amplitudes: ClassVar[tuple[str, ...]] = ("compliance",)

    compliance: float = parameter(0.0, "m/N")
    damping: float = parameter(0.5, "-")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The compliance; the damping is hardly seen and keeps its value."""
        force = around.friction * around.weight
        return (Coordinate(name="compliance", step=2e-4 / force, lower=0.0, upper=0.05 / force),)

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """Small and large."""
        del around
        return families_of_sizes(1.0, 5.0, 25.0)

    def hand(self, path: HandPath, facts: PushFacts, before: Motion | None) -> HandPath:
        """The path less what the spring gives."""
        if before is None or len(before.times) < 3:
            return path
        push = _push_of(path, before, facts)
        if push is None:
            return path
        constant = max(2.0 * self.damping * math.sqrt(facts.mass * self.compliance), FASTEST)
        behind = _behind(push, self.compliance, constant)
        return _path_along(push.times, path.positions(push.times) + behind[:, None] * push.directions)


@dc.dataclass(frozen=True, kw_only=True)
class _Contact:
    """What the pass with a stiff tip says of the push.

    Attributes:
        times: (n,) s.
        directions: (n, 2) of the force.
        speeds: (n,) of the hand along them [m/s].
        forces: (n,) that keep the object on the hand's path, against its friction and its inertia [N].
        masses: (n,) that the tip feels: less than the object's where the push also turns it [kg].
        first: index of the first touch.
    """

    times: Array
    directions: Array
    speeds: Array
    forces: Array
    masses: Array
    first: int


def _push_of(path: HandPath, before: Motion, facts: PushFacts) -> _Contact | None:
    """What the pass with a stiff tip says, or None if it never touched."""
    ticks = np.sqrt((before.forces[:, :2] ** 2).sum(axis=1))
    touches = np.flatnonzero(ticks > 0.0)
    if len(touches) < 3:
        return None
    touch = min([float(before.times[touches[0] - 1]), *before.impacts])
    last = max(float(path.times[-1]), float(before.times[-1]))
    times = np.unique(np.concatenate([path.times, np.arange(touch, last, FINE_SPRING), [last]]))
    times = times[np.concatenate([[True], np.diff(times) > SHORTEST])]
    # A tick's force is its mean; the last of a contact are cut short, and a hand that stands tells no friction.
    hand = _velocities(path, before.times)
    fast = np.sqrt((hand**2).sum(axis=1))
    later = np.append(ticks, np.zeros(PARTING))
    whole = fast > STANDING * float(fast.max())
    for i in range(PARTING + 1):
        whole &= later[i : len(ticks) + i] > 0.0
    whole[touches[0]] = False  # the contact is still settling
    first = int(np.argmax(whole)) if whole.any() else int(touches[0])
    tick = np.maximum.accumulate(np.where(whole, np.arange(len(ticks)), first))
    tick = tick[np.clip(np.searchsorted(before.times, times), 0, len(ticks) - 1)]
    directions = before.forces[tick, :2] / ticks[tick, None]
    arms = path.positions(times) - before.planar_at(times)[:, :2]
    lever = arms[:, 0] * directions[:, 1] - arms[:, 1] * directions[:, 0]
    masses = facts.mass / (1.0 + lever**2 / facts.polar)
    # The table's friction, as of the tick; where the stiff tip had left the object it is taken to be what it was.
    gained = np.diff(hand, axis=0) / np.diff(before.times)[:, None]
    change = _slopes(path, times) - gained[tick - 1]
    forces = ticks[tick] + masses * (change * directions).sum(axis=1)
    speeds = (_velocities(path, times) * directions).sum(axis=1)
    return _Contact(
        times=times, directions=directions, speeds=speeds, forces=forces, masses=masses,
        first=int(np.searchsorted(times, touch - SHORTEST)),
    )  # fmt: skip


def _behind(push: _Contact, compliance: float, constant: float) -> Array:
    """Displacement (n,) of the tip along the push [m]: that of the mass on the spring, or of the free tip."""
    behind = np.zeros(len(push.times))
    tip = place = 0.0
    # The light tip stops where it meets the object, unless it is so stiff that the object starts within a tick.
    pickup = float(push.masses[push.first]) * compliance / constant
    rate = -float(push.speeds[push.first]) * pickup**2 / (pickup**2 + AT_ONCE**2)
    held = True
    for k in range(push.first + 1, len(push.times)):
        h = float(push.times[k] - push.times[k - 1])
        mass, drive = float(push.masses[k]), float(push.forces[k])
        slowest = -float(push.speeds[k])  # friction stops the object, and does not drive it back
        if held:
            # Implicit in the spring and the damper, which may be stiff.
            weight = mass * compliance
            rate = (weight * rate - h * (place + compliance * drive)) / (weight + h * constant + h * h)
            rate = max(rate, slowest)
            place += h * rate
            tip = place
            held = place + constant * rate < 0.0
        else:
            rate = max(rate - h * drive / mass, slowest)
            place += h * rate
            tip *= math.exp(-h / constant)
            if place <= tip:
                held, place = True, tip
        behind[k] = tip
    return behind


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
        return (Coordinate(name="time_constant", step=2e-3, lower=0.0, upper=0.3, tolerance=2e-4),)

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """Small and large."""
        del around
        return families_of_sizes(1.0, 8.0, 30.0)

    def hand(self, path: HandPath, facts: PushFacts, before: Motion | None) -> HandPath:
        """The path, lagged."""
        del facts, before
        times = _fine_times(path, float(path.times[-1]) + 8.0 * self.time_constant)
        velocities = _lagged(times, _velocities(path, times), self.time_constant)
        velocities[-1] = 0.0
        # A path that begins in motion is followed from behind.
        return _path_through(times, path.start - self.time_constant * velocities[0], velocities)


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
        return tuple(Coordinate(name=name, step=4e-4, lower=-most, upper=most, tolerance=5e-5) for name in ("x", "y"))

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
    # Just after the path's end, where what is left of the velocity stops at once.
    times = np.unique(np.concatenate([np.linspace(first, last, count), path.times, path.times[-1:] + 1e-6]))
    kept: Array = times[np.concatenate([[True], np.diff(times) > SHORTEST])]
    return kept


def _velocities(path: HandPath, times: Array) -> Array:
    """Velocities (n, 2) [m/s]; at rest outside the path's knots."""
    inside = (times >= path.times[0]) & (times <= path.times[-1])
    columns = [np.interp(times, path.times, column) for column in path.velocities.T]
    velocities: Array = np.column_stack(columns) * inside[:, None]
    return velocities


def _slopes(path: HandPath, times: Array) -> Array:
    """Accelerations (n, 2) [m/s^2] of the piece before each time; zero outside the path's knots."""
    k = np.clip(np.searchsorted(path.times, times, side="left"), 1, len(path.times) - 1)
    inside = (times > path.times[0]) & (times <= path.times[-1])
    slopes = (path.velocities[k] - path.velocities[k - 1]) / (path.times[k] - path.times[k - 1])[:, None]
    accelerations: Array = slopes * inside[:, None]
    return accelerations


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


def _path_along(times: Array, places: Array) -> HandPath:
    """The path through places (n, 2), straight between them: two knots at each."""
    speeds = np.diff(places, axis=0) / np.diff(times)[:, None]
    knots = np.column_stack([times[:-1] + 1e-9, times[1:]]).ravel()
    return HandPath(times=knots, velocities=np.repeat(speeds, 2, axis=0), start=places[0])


def _path_through(times: Array, start: Array, velocities: Array) -> HandPath:
    return HandPath(times=times, velocities=velocities, start=start)
