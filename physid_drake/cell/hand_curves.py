"""Curves through the stream of a hand, by least squares: few knots, placed where they explain most."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import ClassVar, Final, NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.optimize import least_squares

from physid_drake.cell.hand_path import HandPath, subdivided
from physid_drake.cell.variable_projection import ROUND_OFF_SHARE, VariableProjection

Array = NDArray[np.float64]

MOST_KNOTS, KNOTS_PER_SECOND = 24, 12.0  # whichever is more: an approach, a push and a retreat take twelve
SHORTEST_PIECE = 2e-3  # s between knots
PIECES = 24  # of a smooth ramp: speeds to 0.2 % of its height
WIDER = 0.2  # at either end: where the fit of a smooth ramp starts
ASIDE, AWHILE = 2, 0.02  # samples, s: to either side, over which a stream tells its speed
ROUND_OFF = 1e-9  # s: a piece no longer than this has parts of no length
LEAST_GAIN = 1.0  # of the criterion: what is less is no reason to go on

STRAIGHT: Final = Polynomial([0, 1])


class Curve(NamedTuple):
    """The best curve with given knots: its coefficients (m, 2), chi-square, and their space, columns of (m, f)."""

    coefficients: Array
    chi2: float
    space: Array

    @property
    def rests(self) -> bool:
        """Whether it was made to rest after its last knot."""
        return bool(self.space.shape[1] < len(self.space))


class StraightFit:
    """Least squares of truncated parabolas: position = p0 + v0 t + sum c_j (t - k_j)_+^2."""

    rest_worth: ClassVar[float] = 3.0  # prices of a knot: what rest after the last knot may cost

    def __init__(self, times: Array, positions: Array, sigmas: Array, memory: float = 0.0) -> None:
        self._take(times, positions, sigmas, memory)
        self._moving = self._starts_moving()
        self.unsplit = self._settle(self._prune(self._place(self._grow())))
        self.knots = self._split(self.unsplit)

    def _take(self, times: Array, positions: Array, sigmas: Array, memory: float) -> None:
        """Times (n,) from 0, positions (n, 2), and their noise: standard deviations (n,) and correlation time [s]."""
        self.times, self._p, self._sigmas, self._memory = times, positions, sigmas, memory
        self._keeps = np.exp(-np.diff(times) / memory) if memory > 0.0 else np.zeros(len(times) - 1)
        self._scaled = self._white(positions)
        self._span = float(times[-1])
        # One knot costs its place and two coefficients.
        self._price = 3.0 * np.log(len(times)) + 4.0

    @property
    def _most_knots(self) -> float:
        return max(MOST_KNOTS, KNOTS_PER_SECOND * self._span)

    @property
    def criterion(self) -> float:
        """Chi-square and the knots' price."""
        return self._worth(self.knots)

    def _white(self, columns: Array) -> Array:
        """Samples (n, c) in standard deviations, less what each keeps of the noise of the one before."""
        scaled: Array = columns / self._sigmas[:, None]
        if self._memory <= 0.0:
            return scaled
        keeps = self._keeps[:, None]
        return np.vstack([scaled[:1], (scaled[1:] - keeps * scaled[:-1]) / np.sqrt(1.0 - keeps**2)])

    def curve(self) -> Curve:
        """The best one with the knots that were found."""
        return self._solve(self.knots, ended=True)

    def path(self, origin: float) -> HandPath:
        """The path, ``origin`` being the time of the stream's first sample [s]."""
        return self.as_path(self.knots, self.curve().coefficients, origin)

    def residuals(self) -> NDArray[np.complex128]:
        """Recorded less fitted (n,), x + iy [m]."""
        left = self._p - self._columns(self.knots) @ self.curve().coefficients
        return np.asarray(left[:, 0] + 1j * left[:, 1])

    def velocities(self) -> NDArray[np.complex128]:
        """About those of the hand at the samples (n,), x + iy [m/s].

        Of the stream and not of the fit, which takes stamps that are late or early for a hand that flies.
        """
        samples = np.arange(len(self.times))
        aside = max(ASIDE, math.ceil(AWHILE / float(np.median(np.diff(self.times)))))
        first, last = np.maximum(samples - aside, 0), np.minimum(samples + aside, len(samples) - 1)
        moved = self._p[last] - self._p[first]
        return np.asarray((moved[:, 0] + 1j * moved[:, 1]) / (self.times[last] - self.times[first]))

    def with_jitter(self, jitter: float) -> StraightFit:
        """The stream fitted again, its time stamps being late or early by a standard deviation [s]."""
        sigmas = np.hypot(self._sigmas, jitter * np.abs(self.velocities()))
        return StraightFit(self.times, self._p, sigmas, self._memory)

    def _starts_moving(self) -> bool:
        """Whether the stream begins in motion: a line through its first samples rises above the noise."""
        line = self._white(np.column_stack([np.ones_like(self.times), self.times]))[:12]
        spread = np.linalg.inv(line.T @ line)
        slope = spread[1] @ line.T @ self._scaled[:12]
        return bool(np.linalg.norm(slope) > 5.0 * np.sqrt(spread[1, 1]))

    def design(self, knots: Array) -> Array:
        """What each coefficient does to the samples (n, m), in their standard deviations."""
        return self._white(self._columns(knots))

    def _columns(self, knots: Array) -> Array:
        lead = 2 if self._moving else 1
        columns = np.empty((len(self.times), lead + len(knots)))
        columns[:, 0] = 1.0
        if self._moving:
            columns[:, 1] = self.times / self._span
        columns[:, lead:] = (np.maximum(self.times[:, None] - knots, 0.0) / self._span) ** 2
        return columns

    def at_rest(self, knots: Array) -> Array:
        """The space (m, m - 2) of coefficients with which velocity and acceleration vanish after the last knot."""
        lead = 2 if self._moving else 1
        rows = np.zeros((2, lead + len(knots)))
        rows[0, lead:] = 1.0
        rows[1, lead:] = -2.0 * knots / self._span
        if self._moving:
            rows[1, 1] = 1.0
        return np.asarray(np.linalg.svd(rows)[2][2:].T, dtype=np.float64)

    def _solve(self, knots: Array, *, ended: bool) -> Curve:
        """The best curve; with rest after the last knot if the stream allows it."""
        design = self.design(knots)
        free = self._within(design, np.eye(design.shape[1]))
        if not ended or len(knots) < 3:
            return free
        held = self._within(design, self.at_rest(knots))
        return held if self._may_rest(held, free) else free

    def _may_rest(self, held: Curve, free: Curve) -> bool:
        """Whether a curve that rests after its last knot is good enough, beside one that goes on."""
        return bool(held.chi2 - free.chi2 < 4.0 + self.rest_worth * self._price)

    def _within(self, design: Array, space: Array) -> Curve:
        """The best curve with coefficients in a space (m, f)."""
        inner, *_ = np.linalg.lstsq(design @ space, self._scaled, rcond=ROUND_OFF_SHARE)
        coefficients: Array = space @ inner
        return Curve(coefficients, float(((self._scaled - design @ coefficients) ** 2).sum()), space)

    def _grow(self) -> Array:
        candidates = self.times[1:-1]
        columns = self._white(np.maximum(self.times[:, None] - candidates, 0.0) ** 2 / self._span**2)
        knots = np.array([], dtype=np.float64)
        while len(knots) < self._most_knots:
            design = self.design(knots)
            q, _ = np.linalg.qr(design)
            residual = self._scaled - q @ (q.T @ self._scaled)
            if float((residual**2).sum()) < 2.0 * len(self.times):
                break
            free = columns - q @ (q.T @ columns)
            norms = np.einsum("ij,ij->j", free, free)
            gains = ((free.T @ residual) ** 2).sum(axis=1) / np.where(norms > 1e-18, norms, np.inf)
            if len(knots):
                gains[np.abs(candidates[:, None] - knots).min(axis=1) < SHORTEST_PIECE] = 0.0
            best = int(np.argmax(gains))
            if gains[best] < self._price:
                break
            knots = np.sort(np.append(knots, candidates[best]))
            if len(knots) % 2 == 0:
                placed = self._place(knots, evaluations=8)
                # Two knots that merged would be added and merged again without end.
                knots = placed if len(placed) == len(knots) else knots
        return knots

    def _place(self, knots: Array, evaluations: int = 40) -> Array:
        """Move the knots to where the residual is least."""
        if not len(knots):
            return knots
        moved = self._least(knots, evaluations, ended=False)
        # Knots that merged must have been worth less than their price, or both are needed where they were.
        allowed = (len(knots) - len(moved)) * self._price
        if self._solve(moved, ended=False).chi2 > self._solve(knots, ended=False).chi2 + allowed:
            return knots
        return moved

    def _settle(self, knots: Array) -> Array:
        """Knots of a hand that rests at the end where they are best for that.

        Where one that goes on would like them, rest takes the difference out of the speed before.
        """
        if len(knots) < 3:
            return knots
        moved = self._least(knots, 40, ended=True)
        held, free = self._within(self.design(moved), self.at_rest(moved)), self._solve(knots, ended=False)
        better = held.chi2 < self._within(self.design(knots), self.at_rest(knots)).chi2
        return moved if len(moved) == len(knots) and better and self._may_rest(held, free) else knots

    def _least(self, knots: Array, evaluations: int, *, ended: bool) -> Array:
        """Knots of the least residual near others; fewer if some meet."""
        projection = VariableProjection(self._scaled, self.design, self.at_rest if ended else None)
        found = least_squares(
            projection.residual,
            knots,
            jac=projection.jacobian,
            bounds=(-0.5 * SHORTEST_PIECE, self._span),
            x_scale=0.01,
            max_nfev=evaluations,
        )
        return self._separate(np.sort(found.x))

    def _separate(self, knots: Array) -> Array:
        kept = [float(knots[0])]
        for k in knots[1:]:
            if k - kept[-1] >= SHORTEST_PIECE:
                kept.append(float(k))
        return np.array(kept)

    def _prune(self, knots: Array) -> Array:
        """Take away knots that are not worth their price."""
        while len(knots) > 2:
            chi2 = self._solve(knots, ended=True).chi2
            trials = [np.delete(knots, j) for j in range(len(knots))]
            values = [self._solve(trial, ended=True).chi2 for trial in trials]
            best = int(np.argmin(values))
            if values[best] - chi2 > self._price:
                moved = self._place(trials[best], evaluations=15)
                if self._solve(moved, ended=True).chi2 - chi2 > self._price:
                    return knots
                knots = moved
            else:
                knots = self._place(trials[best], evaluations=15)
        return knots

    def _split(self, knots: Array) -> Array:
        """Put two knots in the place of one, or into a piece, while that is worth its price.

        A triangle of speed over a trapezoid is the best that three knots can do, as a ramp over a short halt is of
        two, and no further knot is worth its price alone while they stay.
        """
        fine = 2.0 * len(self.times) + self._price
        while 2 < len(knots) < self._most_knots and self._solve(knots, ended=True).chi2 > fine:
            doubled = [_doubled(knots, j) for j in range(1, len(knots) - 1)]
            parted = [_parted(knots, j) for j in range(len(knots) - 1)]
            placed = [self._place(min(trials, key=self._worth), evaluations=15) for trials in (doubled, parted)]
            # Where knots settle may be worth less than where they were placed.
            best = min((self._settle(one) for one in placed), key=self._worth)
            if self._worth(best) > self._worth(knots) - LEAST_GAIN:
                break
            knots = best
        return knots

    def _worth(self, knots: Array) -> float:
        """The criterion with other knots."""
        return float(self._solve(knots, ended=True).chi2 + self._price * len(knots))

    def as_path(self, knots: Array, coefficients: Array, origin: float) -> HandPath:
        """The path of any knots and coefficients, ``origin`` being the time of the stream's first sample [s]."""
        lead = 2 if self._moving else 1
        v0 = coefficients[1] / self._span if self._moving else np.zeros(2)
        ends = np.array([0.0, *knots, max(self._span, float(knots[-1]) + SHORTEST_PIECE if len(knots) else 0.0)])
        grid = np.unique(np.maximum(ends, 0.0))
        slopes = 2.0 * np.maximum(grid[:, None] - knots, 0.0) / self._span**2
        velocities = v0 + slopes @ coefficients[lead:]
        velocities[np.linalg.norm(velocities, axis=1) < 1e-6] = 0.0
        shift = np.maximum(0.0 - knots, 0.0) ** 2 / self._span**2 @ coefficients[lead:]
        return HandPath(times=origin + grid, velocities=velocities, start=coefficients[0] + shift)


class SmoothFit(StraightFit):
    """The same where the hand starts and brakes along smooth ramps of speed: position = p0 + sum v_k Phi_k(t)."""

    rest_worth: ClassVar[float] = 1.0

    def __init__(self, straight: StraightFit, ramp: Polynomial) -> None:
        self._take(straight.times, straight._p, straight._sigmas, straight._memory)
        self._moving = straight._moving
        self._ramp, self._way = ramp, ramp.integ()
        # More knots than a straight robot needs may be pieces of a ramp.
        wide = np.clip(_widened(straight.unsplit), 0.0, self._span)
        self.unsplit = self._settle(self._prune(self._place(wide)))
        self.knots = self._split(self.unsplit)

    def _ramp_after(self, k: int, count: int) -> Polynomial:
        """The shape of the speed between knots k and k + 1: smooth from and to rest, else straight."""
        return self._ramp if self._is_smooth(k, count) else STRAIGHT

    def _is_smooth(self, k: int, count: int) -> bool:
        return (k == 0 and not self._moving) or k == count - 2

    def _columns(self, knots: Array) -> Array:
        """As of straight ramps; the coefficients are speeds at the knots."""
        rises, still = self._rises(knots), np.zeros((len(self.times), 1))
        # The way of a hand whose speed is 1 at a knot and 0 at the others; before and after them it does not change.
        ways = np.hstack([self.times[:, None], rises]) - np.hstack([rises, still]) if len(knots) else still[:, :0]
        # A hand that rests before the first knot has no speed there.
        return np.hstack([still + 1.0, ways if self._moving else ways[:, 1:]])

    def _rises(self, knots: Array) -> Array:
        """Ways (n, k - 1) of hands at rest before a knot, whose speed rises to 1 until the next."""
        begins, spans = knots[:-1], np.diff(knots)
        x = np.clip((self.times[:, None] - begins) / np.maximum(spans, 1e-9), 0.0, 1.0)
        ways = 0.5 * x**2
        smooth = [k for k in range(len(spans)) if self._is_smooth(k, len(knots))]
        ways[:, smooth] = self._way(x[:, smooth])
        return np.asarray(spans * ways + np.maximum(self.times[:, None] - knots[1:], 0.0))

    def at_rest(self, knots: Array) -> Array:
        """The space of coefficients with which the hand has no speed at the last knot."""
        return np.eye(len(knots) + (1 if self._moving else 0))[:, :-1]

    def as_path(self, knots: Array, coefficients: Array, origin: float) -> HandPath:
        """As of straight ramps; those that are smooth are short straight pieces.

        Before the first knot and after the last the speed does not change.
        """
        speeds = coefficients[1:] if self._moving else np.vstack([np.zeros(2), coefficients[1:]])
        ramps = [STRAIGHT, *(self._ramp_after(k, len(knots)) for k in range(len(knots) - 1))]
        ends, speeds = np.array([min(0.0, knots[0] - SHORTEST_PIECE), *knots]), np.vstack([speeds[:1], speeds])
        if self._span > knots[-1] + ROUND_OFF:
            ends, speeds = np.append(ends, self._span), np.vstack([speeds, speeds[-1:]])
            ramps.append(STRAIGHT)
        parts = np.arange(PIECES) / PIECES
        inner = [a + (b - a) * ramp(parts)[:, None] for ramp, (a, b) in zip(ramps, pairwise(speeds), strict=True)]
        velocities = np.vstack([*inner, speeds[-1:]])
        velocities[np.linalg.norm(velocities, axis=1) < 1e-6] = 0.0
        path = HandPath(times=subdivided(ends, PIECES), velocities=velocities, start=coefficients[0], pieces=PIECES)
        # The coefficients say where the hand is at time 0.
        start = 2.0 * path.start - path.positions(np.zeros(1))[0]
        return replace(path, times=origin + path.times, start=start)


def _doubled(knots: Array, k: int) -> Array:
    """Knots with two in the place of one that is between others, each a quarter of the way to its neighbour."""
    return np.concatenate([knots[:k], 0.75 * knots[k] + 0.25 * knots[[k - 1, k + 1]], knots[k + 1 :]])


def _parted(knots: Array, k: int) -> Array:
    """Knots with two more between one and the next, at a third of the way from either."""
    return np.insert(knots, k + 1, knots[k] + np.diff(knots)[k] * np.array([1.0, 2.0]) / 3.0)


def _widened(knots: Array) -> Array:
    """Knots (k,) with longer first and last pieces: straight ones lie along the steep part of a smooth ramp."""
    wide = knots.copy()
    if len(knots) < 4:
        return wide
    for first, last in ((0, 1), (-2, -1)):
        more = WIDER * (knots[last] - knots[first])
        wide[first], wide[last] = knots[first] - more, knots[last] + more
    inner = 0.25 * (knots[-2] - knots[1])  # what stands between the ramps keeps half of its length
    wide[1], wide[-2] = min(wide[1], knots[1] + inner), max(wide[-2], knots[-2] - inner)
    wide[2:-2] = np.clip(wide[2:-2], wide[1] + SHORTEST_PIECE, wide[-2] - SHORTEST_PIECE)
    return np.asarray(np.sort(wide))
