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

WANDER_STEP = 0.02  # of a friction, for differences
HATS = 7  # places on a push's way between which a friction is linear
ALIKE = 0.02  # m of way: over which a friction that wanders is the same


class Predictor:
    """Predicts a case's pushes.

    Attributes:
        case: whose.
        rollouts: makes them.
        noise: per push (m, m), of its features in their units: the sensors', and what the simulator may be off by.
        whitening: per push (m, m), takes features to units of the noise.
        recorded: per push (m,), in units of the noise.
    """

    def __init__(self, case: Case, by_cell: Collection[int] = ()) -> None:
        self.case = case
        self.rollouts = Rollouts(case.pool, case.problems, case.nuisances, by_cell)
        self.noise = [sensor_noise(f) + discrepancy(p, f) for f, p in zip(case.features, case.problems, strict=True)]
        self.with_directions([np.zeros((len(f.recorded), 0)) for f in case.features])

    @property
    def count(self) -> int:
        """Of rollouts."""
        return self.rollouts.count

    @property
    def by_cell(self) -> frozenset[int]:
        """The pushes that the twin cannot roll out, whatever theta; the cell does."""
        return self.rollouts.by_cell

    def judging(self, pool: RolloutPool) -> Predictor:
        """The same in another cell, of which a pool makes all rollouts."""
        other = copy(self)
        other.rollouts = self.rollouts.in_cell(pool)
        return other

    def apart(self) -> Predictor:
        """The same, with a count of its own."""
        other = copy(self)
        other.rollouts = copy(self.rollouts)
        other.rollouts.count = 0
        return other

    def noisier(self, added: Sequence[Array]) -> Predictor:
        """The same, with covariances (m_i, m_i) added to the pushes' noise, in units of what it is."""
        other = copy(self)
        roots = [np.linalg.inv(whitening) for whitening in self.whitening]
        other.noise = [n + r @ one @ r.T for n, r, one in zip(self.noise, roots, added, strict=True)]
        other.with_directions([np.zeros((len(f.recorded), 0)) for f in self.case.features])
        return other

    def with_directions(self, directions: Sequence[Array]) -> None:
        """Count N(0, 1) multiples of columns (m_i, j) of features, in their units, as noise."""
        self.whitening = [
            solve_triangular(np.linalg.cholesky(noise + more @ more.T), np.eye(len(noise)), lower=True)
            for noise, more in zip(self.noise, directions, strict=True)
        ]
        self.recorded = [w @ f.recorded for w, f in zip(self.whitening, self.case.features, strict=True)]

    def vectors(self, asks: Sequence[Ask]) -> list[Array | None]:
        """Features (m_i,) of each rollout, in units of the noise; None of one that cannot be made."""
        return [
            None if one is None else np.asarray(self.whitening[ask.push] @ self.case.features[ask.push].of(one))
            for ask, one in zip(asks, self.rollouts.predictions(asks), strict=True)
        ]

    def path_errors(self, nuisances: Sequence[Array], physics: Physics) -> list[Array]:
        """Columns (m_i, e) of features, in their units: what each error that a hand's path may have changes."""
        columns = []
        for i, problem in enumerate(self.case.problems):
            asks = [Ask(i, physics, nuisances[i], path_error=k) for k in range(-1, len(problem.path_errors))]
            sizes = np.array([error.stds for error in problem.path_errors])
            columns.append(np.linalg.inv(self.whitening[i]) @ self._differences(asks) / sizes)
        return columns

    def wanders(self, nuisances: Sequence[Array], physics: Physics) -> list[tuple[Array, Array]]:
        """What frictions change that wander on a push's way: columns (m_i, HATS), of table and tip.

        In units of the noise, for a friction that differs by all of itself. The columns are independent; frictions at
        neighbouring places are not.
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
    """When a push comes by places on its way [s], how long it is near them [s], and a root of their correlation."""
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
