"""The hand's path: piecewise-linear velocity."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


RUN_UP = 0.05  # s: of a hand that is seen late


@dataclass(frozen=True, kw_only=True)
class HandPath:
    """A planar path ``p_WP(t)`` whose velocity is linear between knots; at rest before and after them.

    Attributes:
        times: (k,) knots, increasing [s].
        velocities: (k, 2) at the knots [m/s]; what is not zero at an end stops there at once.
        start: (2,) position at ``times[0]`` [m].
        pieces: so many of them draw one ramp from speed to speed, of a hand whose acceleration does not jump.
    """

    times: Array
    velocities: Array
    start: Array
    pieces: int = 1

    def knot_positions(self) -> Array:
        """Positions (k, 2) at the knots [m]; not to be written to."""
        return self._knot_positions

    @cached_property
    def _knot_positions(self) -> Array:
        steps: Array = np.diff(self.times)[:, None] * 0.5 * (self.velocities[1:] + self.velocities[:-1])
        positions: Array = self.start + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
        return positions

    def __getstate__(self) -> dict[str, Any]:
        """Without what was kept for speed: equal paths have equal pickles, which name their rollouts."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @property
    def heading(self) -> float:
        """Of the way from its first knot to its last, in W [rad]."""
        places = self.knot_positions()
        dx, dy = (places[-1] - places[0]).tolist()
        return math.atan2(dy, dx)

    def positions(self, times: Array) -> Array:
        """Positions (n, 2) at any times (n,) [m]."""
        t = np.clip(times, self.times[0], self.times[-1])
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        into = (t - self.times[k])[:, None]
        slope = (self.velocities[k + 1] - self.velocities[k]) / (self.times[k + 1] - self.times[k])[:, None]
        result: Array = self.knot_positions()[k] + into * (self.velocities[k] + 0.5 * into * slope)
        return result

    def top_speed(self, begin: float = -math.inf, end: float = math.inf) -> float:
        """The largest speed between two times [m/s]; before and after the path, that of its ends."""
        inner = self.times[(self.times > begin) & (self.times < end)]
        times = np.clip(np.array([begin, *inner, end]), self.times[0], self.times[-1])
        return float(np.hypot(*(np.interp(times, self.times, v) for v in self.velocities.T)).max())

    def faster(self, share: float) -> HandPath:
        """All velocities larger by ``share``; the middle of the path keeps its place.

        Args:
            share: relative change of speed [-].
        """
        middle = 0.5 * (self.knot_positions()[0] + self.knot_positions()[-1])
        start = middle + (1.0 + share) * (self.start - middle)
        return replace(self, velocities=(1.0 + share) * self.velocities, start=start)

    def braking(self, share: float, brake: tuple[int, int] | None) -> HandPath:
        """A brake longer by ``share`` about its middle, so that the hand stops at the same place.

        The object leaves the hand at the first instant of braking, so this is what a 100 Hz stream knows least.

        Args:
            share: relative change of the brake's duration [-].
            brake: as ``last_brake`` has it; None changes nothing.
        """
        if brake is None or share == 0.0:
            return self
        first, last = (knot // self.pieces for knot in brake)
        times = self.times[:: self.pieces].copy()
        half = 0.5 * share * (times[last] - times[first])
        if first > 0:
            half = min(half, times[first] - times[first - 1] - 1e-4)
        times[first] -= half
        times[last] += half
        times[last + 1 :] = np.maximum(times[last + 1 :], times[last] + 1e-4 * np.arange(1, len(times) - last))
        moved = replace(self, times=subdivided(times, self.pieces))
        return replace(moved, start=moved.start + self.knot_positions()[-1] - moved.knot_positions()[-1])

    def with_run_up(self, begin: float) -> HandPath:
        """The same, come as fast as it is at its first knot, from ``begin`` on [s] or for a while.

        Of a stream that begins in motion: a hand that stood where it is seen first would stand in the object.
        """
        lead, velocity = min(float(self.times[0]) - begin, RUN_UP), self.velocities[0]
        if lead <= 0.0 or not velocity.any():
            return self
        earlier = self.times[0] - lead * (1.0 - np.arange(self.pieces) / self.pieces)
        return replace(
            self, times=np.concatenate([earlier, self.times]), start=self.start - lead * velocity,
            velocities=np.vstack([np.tile(velocity, (self.pieces, 1)), self.velocities]),
        )  # fmt: skip

    def last_brake(self, begin: float = -math.inf, end: float = math.inf) -> tuple[int, int] | None:
        """Indices of the knots between which the speed falls for the last time, or None.

        Args:
            begin: when the object begins to move [s]: a hand that came faster braked before.
            end: when it has come to rest [s]: one that withdraws goes back, and brakes later.
        """
        if (begin, end) not in self._brakes:
            self._brakes[begin, end] = self._last_brake(begin, end)
        return self._brakes[begin, end]

    @cached_property
    def _brakes(self) -> dict[tuple[float, float], tuple[int, int] | None]:
        return {}

    def _last_brake(self, begin: float, end: float) -> tuple[int, int] | None:
        way = np.diff(self.positions(np.array([begin, end])), axis=0)[0]
        velocities, times = self.velocities[:: self.pieces], self.times[:: self.pieces]
        speed = np.where(velocities @ way > 0.0, np.linalg.norm(velocities, axis=1), 0.0)
        seen = np.concatenate([speed[(times > begin) & (times < end)], np.interp([begin, end], times, speed)])
        top = float(seen.max())
        fast = (speed[:-1] > 0.3 * top) & (speed[1:] < 0.5 * speed[:-1])
        falls = np.flatnonzero(fast & (times[1:] > begin) & (times[:-1] < end)).tolist()
        return (falls[-1] * self.pieces, (falls[-1] + 1) * self.pieces) if falls and top > 0.0 else None


@dataclass(frozen=True, kw_only=True)
class PathError:
    """One of the independent errors of a path that was fitted to a noisy stream.

    Attributes:
        path: the path with that error.
        stds: so many standard deviations of it, at most 1: less where more would carry knots past each other.
    """

    path: HandPath
    stds: float


def subdivided(times: Array, pieces: int) -> Array:
    """Times (k,) with each interval cut into equal pieces: ((k - 1) pieces + 1,)."""
    inner = np.arange((len(times) - 1) * pieces + 1) / pieces
    return times.copy() if pieces == 1 else np.interp(inner, np.arange(len(times)), times)


def straight_path(start: Array, end: Array, begin: float, duration: float) -> HandPath:
    """A straight path at constant speed from ``start`` to ``end`` (2,) [m]."""
    velocity = (end - start) / duration
    return HandPath(times=np.array([begin, begin + duration]), velocities=np.array([velocity, velocity]), start=start)
