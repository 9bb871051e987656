"""The hand's path: piecewise-linear velocity with few knots.

A recorded path is not a polygon: linear interpolation of 0.05 mm of noise at 100 Hz is 7 mm/s of velocity
noise, on which the object bounces, and smoothing splines overshoot at the brake and throw it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

Array = NDArray[np.float64]

MOST_KNOTS = 24
SMALLEST_STD = 2e-5  # m: a stream recorded without noise is still sampled and rounded
SHORTEST_PIECE = 2e-3  # s between knots


@dataclass(frozen=True, kw_only=True)
class HandPath:
    """A planar path ``p_WP(t)`` whose velocity is linear between knots; at rest before and after them.

    Attributes:
        times: (k,) knots, increasing [s].
        velocities: (k, 2) at the knots [m/s]; what is not zero at an end stops there at once.
        start: (2,) position at ``times[0]`` [m].
    """

    times: Array
    velocities: Array
    start: Array

    def knot_positions(self) -> Array:
        """Positions (k, 2) at the knots [m]."""
        steps: Array = np.diff(self.times)[:, None] * 0.5 * (self.velocities[1:] + self.velocities[:-1])
        positions: Array = self.start + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
        return positions

    def positions(self, times: Array) -> Array:
        """Positions (n, 2) at any times (n,) [m]."""
        t = np.clip(times, self.times[0], self.times[-1])
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        into = (t - self.times[k])[:, None]
        slope = (self.velocities[k + 1] - self.velocities[k]) / (self.times[k + 1] - self.times[k])[:, None]
        result: Array = self.knot_positions()[k] + into * (self.velocities[k] + 0.5 * into * slope)
        return result

    def faster(self, share: float) -> HandPath:
        """All velocities larger by ``share``; the middle of the path keeps its place.

        Args:
            share: relative change of speed [-].
        """
        middle = 0.5 * (self.knot_positions()[0] + self.knot_positions()[-1])
        start = middle + (1.0 + share) * (self.start - middle)
        return replace(self, velocities=(1.0 + share) * self.velocities, start=start)

    def braking(self, share: float) -> HandPath:
        """The last brake longer by ``share`` about its middle, so that the hand stops at the same place.

        The object leaves the hand at the first instant of braking, so this is what a 100 Hz stream knows least.

        Args:
            share: relative change of the brake's duration [-].
        """
        brake = self.last_brake()
        if brake is None:
            return self
        first, last = brake
        times = self.times.copy()
        half = 0.5 * share * (times[last] - times[first])
        if first > 0:
            half = min(half, times[first] - times[first - 1] - 1e-4)
        times[first] -= half
        times[last] += half
        times[last + 1 :] = np.maximum(times[last + 1 :], times[last] + 1e-4 * np.arange(1, len(times) - last))
        moved = replace(self, times=times)
        return replace(moved, start=moved.start + self.knot_positions()[-1] - moved.knot_positions()[-1])

    def last_brake(self) -> tuple[int, int] | None:
        """Indices of the knots between which the speed falls for the last time, or None."""
        speed = np.linalg.norm(self.velocities, axis=1)
        top = float(speed.max(initial=0.0))
        falls = [k for k in range(len(speed) - 1) if speed[k] > 0.3 * top and speed[k + 1] < 0.5 * speed[k]]
        return (falls[-1], falls[-1] + 1) if falls and top > 0.0 else None


def straight_path(start: Array, end: Array, begin: float, duration: float) -> HandPath:
    """A straight path at constant speed from ``start`` to ``end`` (2,) [m]."""
    velocity = (end - start) / duration
    return HandPath(times=np.array([begin, begin + duration]), velocities=np.array([velocity, velocity]), start=start)


def fit_hand_path(times: Array, positions: Array, std: float | None) -> HandPath:
    """The path with the fewest knots that explains a recorded stream.

    Knots are added where they explain most (orthogonal matching pursuit over all sample times), moved to
    where they fit best, and taken away again while the Bayesian information criterion falls.

    Args:
        times: (n,) [s], n >= 2.
        positions: (n, 2) [m].
        std: standard deviation of one position [m]; None estimates it from third differences.
    """
    if len(times) < 6:
        return _polygon_path(times, positions)
    sigma = max(std if std is not None else stream_std(positions), SMALLEST_STD)
    fit = _Fit(times - times[0], positions, sigma)
    return fit.path(float(times[0]))


def stream_std(positions: Array) -> float:
    """Noise of a stream (n, 2) [m] from its third differences, which a path hardly has: variance 20 sigma^2."""
    third = np.diff(positions, 3, axis=0)
    return float(1.4826 * np.median(np.abs(third)) / np.sqrt(20.0))


def _polygon_path(times: Array, positions: Array) -> HandPath:
    """Constant velocity between few samples; a knot pair at each corner keeps the velocity a function."""
    knots, velocities = [], []
    for k in range(len(times) - 1):
        v = (positions[k + 1] - positions[k]) / (times[k + 1] - times[k])
        knots += [times[k] + (1e-6 if k else 0.0), times[k + 1]]
        velocities += [v, v]
    return HandPath(times=np.array(knots), velocities=np.array(velocities), start=positions[0].copy())


class _Fit:
    """Least squares of truncated parabolas: position = p0 + v0 t + sum c_j (t - k_j)_+^2."""

    def __init__(self, times: Array, positions: Array, sigma: float) -> None:
        self._t, self._p, self._sigma = times, positions, sigma
        self._span = float(times[-1])
        self._moving = self._starts_moving()
        # One knot costs its place and two coefficients.
        self._price = 3.0 * np.log(len(times)) + 4.0

    def path(self, origin: float) -> HandPath:
        knots = self._prune(self._place(self._grow()))
        coefficients, _ = self._solve(knots, ended=True)
        return self._as_path(knots, coefficients, origin)

    def _starts_moving(self) -> bool:
        """Whether the stream begins in motion: a line through its first samples rises above the noise."""
        n = min(len(self._t), 12)
        t = self._t[:n] - self._t[:n].mean()
        slope = t @ (self._p[:n] - self._p[:n].mean(axis=0)) / (t @ t)
        return bool(np.linalg.norm(slope) > 5.0 * self._sigma / np.sqrt(t @ t))

    def _design(self, knots: Array) -> Array:
        columns = [np.ones_like(self._t)]
        if self._moving:
            columns += [self._t / self._span]
        columns += [np.maximum(self._t - k, 0.0) ** 2 / self._span**2 for k in knots]
        return np.column_stack(columns)

    def _ending(self, knots: Array) -> Array:
        """Rows that make velocity and acceleration vanish after the last knot (in the design's scaling)."""
        lead = 2 if self._moving else 1
        rows = np.zeros((2, lead + len(knots)))
        rows[0, lead:] = 1.0
        rows[1, lead:] = -2.0 * knots / self._span
        if self._moving:
            rows[1, 1] = 1.0
        return rows

    def _solve(self, knots: Array, *, ended: bool) -> tuple[Array, float]:
        """Coefficients (m, 2) and chi-square; with rest after the last knot if the stream allows it."""
        design = self._design(knots)
        free, *_ = np.linalg.lstsq(design, self._p, rcond=1e-13)
        chi2 = float(((self._p - design @ free) ** 2).sum()) / self._sigma**2
        if not ended or len(knots) < 3:
            return np.asarray(free, dtype=np.float64), chi2
        rows = self._ending(knots)
        _, _, vt = np.linalg.svd(rows)
        null = vt[2:].T
        inner, *_ = np.linalg.lstsq(design @ null, self._p, rcond=1e-13)
        held: Array = np.asarray(null @ inner, dtype=np.float64)
        held_chi2 = float(((self._p - design @ held) ** 2).sum()) / self._sigma**2
        if held_chi2 - chi2 < 4.0 + 3.0 * self._price:
            return held, held_chi2
        return np.asarray(free, dtype=np.float64), chi2

    def _grow(self) -> Array:
        candidates = self._t[1:-1]
        columns = np.maximum(self._t[:, None] - candidates, 0.0) ** 2 / self._span**2
        knots = np.array([], dtype=np.float64)
        while len(knots) < MOST_KNOTS:
            design = self._design(knots)
            q, _ = np.linalg.qr(design)
            residual = self._p - q @ (q.T @ self._p)
            if float((residual**2).sum()) / self._sigma**2 < 2.0 * len(self._t):
                break
            free = columns - q @ (q.T @ columns)
            norms = np.einsum("ij,ij->j", free, free)
            gains = ((free.T @ residual) ** 2).sum(axis=1) / np.where(norms > 1e-18, norms, np.inf)
            if len(knots):
                gains[np.abs(candidates[:, None] - knots).min(axis=1) < SHORTEST_PIECE] = 0.0
            best = int(np.argmax(gains))
            if gains[best] / self._sigma**2 < self._price:
                break
            knots = np.sort(np.append(knots, candidates[best]))
            if len(knots) % 2 == 0:
                placed = self._place(knots, evaluations=8)
                # Two knots that merged would be added and merged again without end.
                knots = placed if len(placed) == len(knots) else knots
        return knots

    def _place(self, knots: Array, evaluations: int = 40) -> Array:
        """Move the knots to where the residual is least (variable projection, numerical Jacobian)."""
        if not len(knots):
            return knots

        def residual(places: Array) -> Array:
            design = self._design(np.sort(places))
            coefficients, *_ = np.linalg.lstsq(design, self._p, rcond=1e-13)
            return ((self._p - design @ coefficients) / self._sigma).ravel()

        found = least_squares(
            residual, knots, bounds=(-0.5 * SHORTEST_PIECE, self._span), x_scale=0.01, max_nfev=evaluations
        )
        moved = self._separate(np.sort(found.x))
        # Knots that merged must have been worth less than their price, or both are needed where they were.
        allowed = (len(knots) - len(moved)) * self._price
        if self._solve(moved, ended=False)[1] > self._solve(knots, ended=False)[1] + allowed:
            return knots
        return moved

    def _separate(self, knots: Array) -> Array:
        kept = [float(knots[0])]
        for k in knots[1:]:
            if k - kept[-1] >= SHORTEST_PIECE:
                kept.append(float(k))
        return np.array(kept)

    def _prune(self, knots: Array) -> Array:
        """Take away knots that are not worth their price."""
        while len(knots) > 2:
            _, chi2 = self._solve(knots, ended=True)
            trials = [np.delete(knots, j) for j in range(len(knots))]
            values = [self._solve(trial, ended=True)[1] for trial in trials]
            best = int(np.argmin(values))
            if values[best] - chi2 > self._price:
                moved = self._place(trials[best], evaluations=15)
                if self._solve(moved, ended=True)[1] - chi2 > self._price:
                    return knots
                knots = moved
            else:
                knots = self._place(trials[best], evaluations=15)
        return knots

    def _as_path(self, knots: Array, coefficients: Array, origin: float) -> HandPath:
        lead = 2 if self._moving else 1
        v0 = coefficients[1] / self._span if self._moving else np.zeros(2)
        ends = np.array([0.0, *knots, max(self._span, float(knots[-1]) + SHORTEST_PIECE if len(knots) else 0.0)])
        grid = np.unique(np.maximum(ends, 0.0))
        slopes = 2.0 * np.maximum(grid[:, None] - knots, 0.0) / self._span**2
        velocities = v0 + slopes @ coefficients[lead:]
        velocities[np.linalg.norm(velocities, axis=1) < 1e-6] = 0.0
        shift = np.maximum(0.0 - knots, 0.0) ** 2 / self._span**2 @ coefficients[lead:]
        return HandPath(times=origin + grid, velocities=velocities, start=coefficients[0] + shift)
