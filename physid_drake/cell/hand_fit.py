"""The path behind recorded streams of a hand: few knots, and a shape for the ramps of speed between them.

A recorded path is not a polygon: linear interpolation of 0.05 mm of noise at 100 Hz is 7 mm/s of velocity
noise, on which the object bounces, and smoothing splines overshoot at the brake and throw it. Few straight pieces
of a smooth ramp are off by some percent of the speed at which the object is let go, and bias its friction by as much.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.optimize import least_squares

from physid_drake.cell.hand_path import HandPath, subdivided

Array = NDArray[np.float64]

MOST_KNOTS, KNOTS_PER_SECOND = 24, 12.0  # whichever is more: an approach, a push and a retreat take twelve
SMALLEST_STD = 2e-5  # m: a stream recorded without noise is still sampled and rounded
SHORTEST_PIECE = 2e-3  # s between knots
PIECES = 24  # of a smooth ramp: speeds to 0.2 % of its height
WIDER = 0.2  # at either end: where the fit of a smooth ramp starts
SURE = 10.0  # of the criterion, in all streams: smooth ramps must be that much better
MOST = 20.0  # what one stream may say for or against them; one of a smooth robot that says more keeps straight ones
VOTERS = 12  # about so many streams of a robot are asked
FAST = 0.3  # of the largest speed: samples that show whether time stamps are late or early
FEWEST_FAST = 40  # of them
NOTABLE = 1.3  # times as far off along the way as across it
MEDIAN_OF_NORMAL = 0.6745  # of the absolute value, over the standard deviation
HAIR = 1e-4  # s: for differences

STRAIGHT: Final = Polynomial([0, 1])
# Speeds s(x) from 0 to 1 over a ramp, x from 0 to 1: limited jerk, and least jerk (Flash and Hogan 1985).
SMOOTH_RAMPS: Final = (Polynomial([0, 0, 3, -2]), Polynomial([0, 0, 0, 10, -15, 6]))


def fit_hand_paths(streams: Sequence[tuple[Array, Array]], std: float | None) -> tuple[HandPath, ...]:
    """The paths with the fewest knots that explain the streams of one robot.

    Knots are added where they explain most (orthogonal matching pursuit over all sample times), moved to
    where they fit best, and taken away again while the Bayesian information criterion falls. Where time stamps are
    late or early, fast samples count for less. The same criterion, summed over all streams, tells whether the robot's
    ramps of speed are straight or smooth.

    Args:
        streams: per push times (n,) [s], n >= 2, and positions (n, 2) [m].
        std: standard deviation of one position [m]; None estimates it from third differences.
    """
    best = {k: _fit_of(*stream, std) for k, stream in enumerate(streams) if len(stream[0]) >= 6}
    jitter = _jitter_of(list(best.values()))
    if jitter > 0.0:
        best = {k: fit.with_jitter(jitter) for k, fit in best.items()}
    asked = list(best.values())[:: max(1, len(best) // VOTERS)]
    votes = [sum(_vote(fit, _SmoothFit(fit, ramp)) for fit in asked) for ramp in SMOOTH_RAMPS]
    if max(votes) > SURE:
        ramp = SMOOTH_RAMPS[int(np.argmax(votes))]
        best = {k: _smoother(fit, ramp) for k, fit in best.items()}
    return tuple(
        best[k].path(float(times[0])) if k in best else _polygon_path(times, positions)
        for k, (times, positions) in enumerate(streams)
    )


def _jitter_of(fits: Sequence[_Fit]) -> float:
    """Standard deviation of the time stamps [s]: what fast samples are off by along their way more than across it."""
    if not fits:
        return 0.0
    fastest = max(float(np.abs(fit.velocities()).max()) for fit in fits)
    along, across = [], []
    for fit in fits:
        velocities = fit.velocities()
        fast = np.abs(velocities) > FAST * fastest
        turned = fit.residuals()[fast] * np.conj(velocities[fast])  # a velocity as x + iy: parts along it and across
        along.append(turned.real / np.abs(velocities[fast]) ** 2)
        across.append(turned.imag / np.abs(velocities[fast]) ** 2)
    late, beside = np.concatenate(along), np.concatenate(across)
    if len(late) < FEWEST_FAST:
        return 0.0
    own, other = (float(np.median(np.abs(values))) / MEDIAN_OF_NORMAL for values in (late, beside))
    return math.sqrt(own**2 - other**2) if own > NOTABLE * other else 0.0


def _vote(straight: _Fit, smooth: _Fit) -> float:
    """By how much smooth ramps are better for a stream; one that is stuck in a bad fit does not decide."""
    return float(np.clip(straight.criterion - smooth.criterion, -MOST, MOST))


def _smoother(straight: _Fit, ramp: Polynomial) -> _Fit:
    """A smooth robot's stream: smooth ramps, unless the hand has none or straight ones are much better."""
    smooth = _SmoothFit(straight, ramp)
    return smooth if len(smooth.knots) > 1 and _vote(straight, smooth) > -MOST else straight


def fit_hand_path(times: Array, positions: Array, std: float | None) -> HandPath:
    """The path of one stream alone, as in ``fit_hand_paths``."""
    return fit_hand_paths([(times, positions)], std)[0]


def _fit_of(times: Array, positions: Array, std: float | None) -> _Fit:
    sigma = max(std if std is not None else stream_std(positions), SMALLEST_STD)
    return _Fit(times - times[0], positions, np.full(len(times), sigma))


def stream_std(positions: Array) -> float:
    """Noise of a stream (n, 2) [m] from its third differences, which a path hardly has: variance 20 sigma^2."""
    third = np.diff(positions, 3, axis=0)
    return float(np.median(np.abs(third)) / MEDIAN_OF_NORMAL / np.sqrt(20.0))


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

    def __init__(self, times: Array, positions: Array, sigmas: Array) -> None:
        self._take(times, positions, sigmas)
        self._moving = self._starts_moving()
        self.knots = self._prune(self._place(self._grow()))

    def _take(self, times: Array, positions: Array, sigmas: Array) -> None:
        """Times (n,) from 0, positions (n, 2) and the standard deviations (n,) in units of which all is fitted."""
        self._t, self._p, self._sigmas = times, positions, sigmas
        self._scaled = positions / sigmas[:, None]
        self._span = float(times[-1])
        # One knot costs its place and two coefficients.
        self._price = 3.0 * np.log(len(times)) + 4.0

    @property
    def criterion(self) -> float:
        """Chi-square and the knots' price."""
        return float(self._solve(self.knots, ended=True)[1] + self._price * len(self.knots))

    def path(self, origin: float) -> HandPath:
        """The path, ``origin`` being the time of the stream's first sample [s]."""
        coefficients, _ = self._solve(self.knots, ended=True)
        return self._as_path(self.knots, coefficients, origin)

    def residuals(self) -> NDArray[np.complex128]:
        """Recorded less fitted (n,), x + iy [m]."""
        coefficients, _ = self._solve(self.knots, ended=True)
        left = (self._scaled - self._design(self.knots) @ coefficients) * self._sigmas[:, None]
        return np.asarray(left[:, 0] + 1j * left[:, 1])

    def velocities(self) -> NDArray[np.complex128]:
        """Of the fit at the samples (n,), x + iy [m/s]."""
        path = self.path(0.0)
        moved = path.positions(self._t + HAIR) - path.positions(self._t - HAIR)
        return np.asarray((moved[:, 0] + 1j * moved[:, 1]) / (2.0 * HAIR))

    def with_jitter(self, jitter: float) -> _Fit:
        """The stream fitted again, its time stamps being late or early by a standard deviation [s]."""
        return _Fit(self._t, self._p, np.hypot(self._sigmas, jitter * np.abs(self.velocities())))

    def _starts_moving(self) -> bool:
        """Whether the stream begins in motion: a line through its first samples rises above the noise."""
        n = min(len(self._t), 12)
        t = self._t[:n] - self._t[:n].mean()
        slope = t @ (self._p[:n] - self._p[:n].mean(axis=0)) / (t @ t)
        return bool(np.linalg.norm(slope) > 5.0 * self._sigmas[:n].max() / np.sqrt(t @ t))

    def _design(self, knots: Array) -> Array:
        columns = [np.ones_like(self._t)]
        if self._moving:
            columns += [self._t / self._span]
        columns += [np.maximum(self._t - k, 0.0) ** 2 / self._span**2 for k in knots]
        return np.column_stack(columns) / self._sigmas[:, None]

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
        free, *_ = np.linalg.lstsq(design, self._scaled, rcond=1e-13)
        chi2 = float(((self._scaled - design @ free) ** 2).sum())
        if not ended or len(knots) < 3:
            return np.asarray(free, dtype=np.float64), chi2
        rows = self._ending(knots)
        _, _, vt = np.linalg.svd(rows)
        null = vt[2:].T
        inner, *_ = np.linalg.lstsq(design @ null, self._scaled, rcond=1e-13)
        held: Array = np.asarray(null @ inner, dtype=np.float64)
        held_chi2 = float(((self._scaled - design @ held) ** 2).sum())
        if held_chi2 - chi2 < 4.0 + 3.0 * self._price:
            return held, held_chi2
        return np.asarray(free, dtype=np.float64), chi2

    def _grow(self) -> Array:
        candidates = self._t[1:-1]
        columns = np.maximum(self._t[:, None] - candidates, 0.0) ** 2 / self._span**2 / self._sigmas[:, None]
        knots = np.array([], dtype=np.float64)
        while len(knots) < max(MOST_KNOTS, KNOTS_PER_SECOND * self._span):
            design = self._design(knots)
            q, _ = np.linalg.qr(design)
            residual = self._scaled - q @ (q.T @ self._scaled)
            if float((residual**2).sum()) < 2.0 * len(self._t):
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
        """Move the knots to where the residual is least (variable projection, numerical Jacobian)."""
        if not len(knots):
            return knots

        def residual(places: Array) -> Array:
            design = self._design(np.sort(places))
            coefficients, *_ = np.linalg.lstsq(design, self._scaled, rcond=1e-13)
            return (self._scaled - design @ coefficients).ravel()

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


class _SmoothFit(_Fit):
    """The same where the hand starts and brakes along smooth ramps of speed: position = p0 + sum v_k Phi_k(t)."""

    def __init__(self, straight: _Fit, ramp: Polynomial) -> None:
        self._take(straight._t, straight._p, straight._sigmas)
        self._moving = straight._moving
        self._ramp = ramp
        self._straight_way, self._smooth_way = STRAIGHT.integ(), ramp.integ()
        self.knots = self._prune(self._place(np.clip(_widened(straight.knots), 0.0, self._span)))

    def _ramp_after(self, k: int, count: int) -> Polynomial:
        """The shape of the speed between knots k and k + 1: smooth from and to rest, else straight."""
        return self._ramp if self._is_smooth(k, count) else STRAIGHT

    def _is_smooth(self, k: int, count: int) -> bool:
        return (k == 0 and not self._moving) or k == count - 2

    def _design(self, knots: Array) -> Array:
        spans = pairwise(knots.tolist())
        count = len(knots)
        rises = [self._rise(*span, smooth=self._is_smooth(k, count)) for k, span in enumerate(spans)]
        # The way of a hand whose speed is 1 at a knot and 0 at the others; before and after them it does not change.
        ups, downs = [self._t, *rises], [*rises, np.zeros_like(self._t)]
        columns = [up - down for up, down in zip(ups, downs, strict=True)] if len(knots) else []
        # A hand that rests before the first knot has no speed there.
        columns = [np.ones_like(self._t), *(columns if self._moving else columns[1:])]
        return np.column_stack(columns) / self._sigmas[:, None]

    def _rise(self, begin: float, end: float, *, smooth: bool) -> Array:
        """Way (n,) of a hand that is at rest before ``begin`` and has the speed 1 after ``end``."""
        x = np.clip((self._t - begin) / max(end - begin, 1e-9), 0.0, 1.0)
        along = self._smooth_way if smooth else self._straight_way
        way: Array = (end - begin) * along(x) + np.maximum(self._t - end, 0.0)
        return way

    def _solve(self, knots: Array, *, ended: bool) -> tuple[Array, float]:
        design = self._design(knots)
        found = []
        for columns in (design, design[:, :-1]) if ended and len(knots) >= 3 else (design,):
            coefficients, *_ = np.linalg.lstsq(columns, self._scaled, rcond=1e-13)
            found.append((coefficients, float(((self._scaled - columns @ coefficients) ** 2).sum())))
        (free, chi2), (held, held_chi2) = found[0], found[-1]
        if held_chi2 - chi2 < 4.0 + self._price:
            return np.pad(held, ((0, len(free) - len(held)), (0, 0))), held_chi2
        return np.asarray(free), chi2

    def _as_path(self, knots: Array, coefficients: Array, origin: float) -> HandPath:
        """The ramps as short straight pieces; before the first knot and after the last the speed does not change."""
        speeds = coefficients[1:] if self._moving else np.vstack([np.zeros(2), coefficients[1:]])
        ramps = [STRAIGHT, *(self._ramp_after(k, len(knots)) for k in range(len(knots) - 1))]
        ends, speeds = np.array([min(0.0, knots[0] - SHORTEST_PIECE), *knots]), np.vstack([speeds[:1], speeds])
        if self._span > knots[-1]:
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
