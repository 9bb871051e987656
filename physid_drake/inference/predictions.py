"""What rollouts predict of recorded pushes, as vectors in units of their noise."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Collection, Sequence
from copy import copy

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from physid_drake.inference.discrepancy import discrepancy, sensor_noise, way_of
from physid_drake.inference.rollouts import Ask, Physics, Rollouts
from physid_drake.pushes.case import Case
from physid_drake.pushes.problem import PushProblem
from physid_drake.pushes.rollouts import RolloutPool
from physid_drake.twin.twin import Wander

Array = NDArray[np.float64]
Index = NDArray[np.intp]

WANDER_STEP = 0.02  # relative change of a friction, for differences
HATS = 7  # places on a push's way between which a friction is linear
ALIKE = 0.02  # m: correlation length of friction along the way


class Predictor:
    """Predicts the features of a case's pushes.

    Attributes:
        case: the recording, made ready.
        rollouts: makes the rollouts.
        noise: per push (m, m), covariance of its features in the features' units: of the sensors, and of the
            simulator's own error.
        whitening: per push (m, m), multiplies features to give them in units of the noise, uncorrelated.
        recorded: per push (m,), the recorded features, whitened.
    """

    def __init__(self, case: Case, by_cell: Collection[int] = ()) -> None:
        self.case = case
        self.rollouts = Rollouts(case.pool, case.problems, case.nuisances, by_cell)
        self.noise = [sensor_noise(f) + discrepancy(p, f) for f, p in zip(case.features, case.problems, strict=True)]
        self.with_directions([np.zeros((len(f.recorded), 0)) for f in case.features])

    @property
    def count(self) -> int:
        """Number of rollouts that were made."""
        return self.rollouts.count

    @property
    def by_cell(self) -> frozenset[int]:
        """Indices of the pushes that the twin cannot roll out at any theta; the cell rolls them out."""
        return self.rollouts.by_cell

    def judging(self, pool: RolloutPool) -> Predictor:
        """A copy whose rollouts are all made by the cell of a pool."""
        other = copy(self)
        other.rollouts = self.rollouts.in_cell(pool)
        return other

    def apart(self) -> Predictor:
        """A copy that counts its rollouts from zero."""
        other = copy(self)
        other.rollouts = copy(self.rollouts)
        other.rollouts.count = 0
        return other

    def noisier(self, added: Sequence[Array]) -> Predictor:
        """A copy with covariances (m_i, m_i) added to the pushes' noise, in units of the noise as it is."""
        other = copy(self)
        roots = [np.linalg.inv(whitening) for whitening in self.whitening]
        other.noise = [n + r @ one @ r.T for n, r, one in zip(self.noise, roots, added, strict=True)]
        other.with_directions([np.zeros((len(f.recorded), 0)) for f in self.case.features])
        return other

    def with_directions(self, directions: Sequence[Array]) -> None:
        """Set the whitening; N(0, 1) multiples of columns (m_i, j), in the features' units, count as noise."""
        self.whitening = [
            solve_triangular(np.linalg.cholesky(noise + more @ more.T), np.eye(len(noise)), lower=True)
            for noise, more in zip(self.noise, directions, strict=True)
        ]
        self.recorded = [w @ f.recorded for w, f in zip(self.whitening, self.case.features, strict=True)]

    def vectors(self, asks: Sequence[Ask]) -> list[Array | None]:
        """Whitened features (m_i,) of each rollout; None where it cannot be made."""
        return [
            None if one is None else np.asarray(self.whitening[ask.push] @ self.case.features[ask.push].of(one))
            for ask, one in zip(asks, self.rollouts.predictions(asks), strict=True)
        ]

    def path_errors(self, nuisances: Sequence[Array], physics: Physics) -> list[Array]:
        """What each possible error of a hand's path changes: columns (m_i, e) per push, in the features' units.

        One column is for an error of one standard deviation.

        Args:
            nuisances: each push's nuisance parameters (k,).
            physics: theta and effects of the rollouts.
        """
        columns = []
        for i, problem in enumerate(self.case.problems):
            asks = [Ask(i, physics, nuisances[i], path_error=k) for k in range(-1, len(problem.path_errors))]
            sizes = np.array([error.stds for error in problem.path_errors])
            columns.append(np.linalg.inv(self.whitening[i]) @ self._differences(asks) / sizes)
        return columns

    def wanders(self, nuisances: Sequence[Array], physics: Physics) -> list[tuple[Array, Array]]:
        """What a friction that varies along a push's way changes: two arrays of columns (m_i, HATS) per push.

        The first is of the friction with the table, the second of that with the tip. Columns are in units of the
        noise and are to be multiplied with independent N(0, s^2) numbers, s being the friction's relative standard
        deviation; the correlation between neighbouring places is in the columns.

        Args:
            nuisances: each push's nuisance parameters (k,).
            physics: theta and effects of the rollouts.
        """
        made = []
        for i, problem in enumerate(self.case.problems):
            hats, root = wander_hats(problem)
            rest = Ask(i, physics, nuisances[i])
            for_table = [dc.replace(rest, wander=Wander(middle=t, width=w, support=WANDER_STEP)) for t, w in hats]
            at_tip = [dc.replace(rest, wander=Wander(middle=t, width=w, hand=WANDER_STEP)) for t, w in hats]
            columns = self._differences([rest, *for_table, *at_tip]) / WANDER_STEP
            made.append((columns[:, : len(hats)] @ root, columns[:, len(hats) :] @ root))
        return made

    def _differences(self, asks: Sequence[Ask]) -> Array:
        """How the rollouts after the first differ from it, as columns; zero where one cannot be made."""
        base, *moved = self.vectors(asks)
        none = np.zeros(len(self.recorded[asks[0].push]))
        found = [none if base is None or one is None else one - base for one in moved]
        return np.column_stack([np.zeros((len(none), 0)), *found])


def wander_hats(problem: PushProblem) -> tuple[list[tuple[float, float]], Array]:
    """Places on a push's way between which a friction is interpolated linearly.

    Returns:
        For each of ``HATS`` places the time at which the object is there and the half width of its hat function [s];
        and
        a Cholesky factor (HATS, HATS) of the places' correlation, which decays over ``ALIKE`` of way.
    """
    times = np.concatenate([[problem.begin], problem.times])
    way = way_of(np.vstack([problem.start.pose, problem.poses]))
    first, last = np.interp(np.clip(problem.moving, times[0], times[-1]), times, way)
    places = np.linspace(first, last, HATS)
    at = np.interp(places, way, times)
    gaps = np.diff(at)
    widths = np.maximum(0.5 * (np.append(gaps, gaps[-1]) + np.insert(gaps, 0, gaps[0])), 1e-3)
    alike = np.exp(-np.abs(places[:, None] - places[None, :]) / ALIKE)
    root = np.linalg.cholesky(alike + 1e-9 * np.eye(HATS))
    return list(zip(at.tolist(), widths.tolist(), strict=True)), root
