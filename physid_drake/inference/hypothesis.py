"""A hypothesis: which effects are added to the baseline model, and the coordinates z in which it is fitted."""

from __future__ import annotations

import dataclasses as dc
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from physid_drake.effects import Coordinate, Effect, Surroundings
from physid_drake.inference.rollouts import Physics
from physid_drake.space import ParameterSpace

Array = NDArray[np.float64]
Index = NDArray[np.intp]

THETA_STEP = 0.006  # of the unit cube, for differences
THETA_WITHIN = (1e-3, 1.0 - 1e-3)  # of the unit cube


@dc.dataclass(frozen=True, kw_only=True)
class Part:
    """An effect of a hypothesis.

    Attributes:
        kind: its class.
        point: (k,) in its chart: the values of coordinates that are not fitted, and the prior mean of the others.
        free: indices in the chart of the coordinates that are fitted.
    """

    kind: type[Effect]
    point: tuple[float, ...]
    free: tuple[int, ...]


@dc.dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """The baseline model with some effects, none for the baseline itself.

    z (n,) is the point theta (d,) in the parameters' unit cube, followed by the free coordinates of each effect's
    chart, followed by the coefficients of the errors that all pushes may share, in standard deviations.

    Attributes:
        space: of theta.
        around: object, table and speeds of the recording, from which effects make their charts.
        parts: the effects.
        tolerances: number of errors that all pushes may share.
    """

    space: ParameterSpace
    around: Surroundings
    parts: tuple[Part, ...] = ()
    tolerances: int = 0

    @property
    def name(self) -> str:
        """The effects' names in alphabetical order, joined with ``+``; ``baseline`` without any."""
        return " + ".join(sorted(part.kind.name for part in self.parts)) or "baseline"

    @property
    def dimension(self) -> int:
        """Number n of coordinates."""
        return len(self.mean)

    @cached_property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The effects' free coordinates, in the order of z."""
        return tuple(
            chart[j] for part, chart in zip(self.parts, self._charts, strict=True) for j in part.free
        )  # fmt: skip

    @cached_property
    def _charts(self) -> tuple[tuple[Coordinate, ...], ...]:
        return tuple(part.kind.chart(self.around) for part in self.parts)

    @cached_property
    def mean(self) -> Array:
        """Prior mean (n,) of z."""
        theta = np.asarray(self.space.to_unit(self.space.nominal))
        effects = [part.point[j] for part in self.parts for j in part.free]
        return np.concatenate([theta, effects, np.zeros(self.tolerances)])

    @cached_property
    def std(self) -> Array:
        """Prior standard deviations (n,) of z; infinite where nothing is known."""
        return np.concatenate(
            [self.space.prior_std_unit, [c.std for c in self.coordinates], np.ones(self.tolerances)]
        )

    @cached_property
    def whitening(self) -> Array:
        """Matrix W (n, n): W (z - mean) is N(0, I) under the prior; rows are zero where nothing is known."""
        d = self.space.dimension
        made = np.diag(1.0 / self.std)
        if self.space.correlation:
            covariance = np.array(self.space.correlation) * np.outer(self.std[:d], self.std[:d])
            made[:d, :d] = np.linalg.inv(np.linalg.cholesky(covariance))
        return made

    @cached_property
    def precision(self) -> Array:
        """Prior precision (n, n) of z, the inverse of its covariance; 0 where nothing is known."""
        return np.asarray(self.whitening.T @ self.whitening)

    def surprise(self, z: Array) -> float:
        """Squared Mahalanobis distance of z (n,) from the prior's mean: twice the negative log density."""
        return float(np.sum((self.whitening @ (z - self.mean)) ** 2))

    @property
    def known(self) -> Index:
        """Indices in z of theta and of the shared errors, whose priors are informative in every recording."""
        return np.concatenate([np.arange(self.space.dimension), np.arange(self.simulated, self.dimension)])

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Least and greatest z, (n,) each."""
        d, t = self.space.dimension, np.full(self.tolerances, np.inf)
        least = np.concatenate([np.full(d, THETA_WITHIN[0]), [c.lower for c in self.coordinates], -t])
        most = np.concatenate([np.full(d, THETA_WITHIN[1]), [c.upper for c in self.coordinates], t])
        return least, most

    @property
    def simulated(self) -> int:
        """Number of coordinates that a rollout depends on, the first ones: all but the shared errors."""
        return self.dimension - self.tolerances

    def steps(self, z: Array) -> Array:
        """Step sizes (simulated,) for differences at z, with signs that lead away from the nearer bound."""
        d, n = self.space.dimension, self.simulated
        sizes = np.concatenate([np.full(d, THETA_STEP), [c.step for c in self.coordinates]])
        middle = np.concatenate([np.full(d, 0.5), self.bounds[1][d:n] - sizes[d:]])
        return np.asarray(np.where(z[:n] <= middle, sizes, -sizes))

    def physics(self, z: Array) -> Physics:
        """Theta and effects at z."""
        return Physics(self.theta(z), self.effects(z))

    def theta(self, z: Array) -> Array:
        """The baseline model's parameters (d,) at z, each in its unit."""
        return np.asarray(self.space.from_unit(z[: self.space.dimension]))

    def points(self, z: Array) -> list[Array]:
        """The point (k,) at z in each effect's chart."""
        points, at = [], self.space.dimension
        for part in self.parts:
            point = np.array(part.point)
            point[list(part.free)] = z[at : at + len(part.free)]
            points.append(point)
            at += len(part.free)
        return points

    def effects(self, z: Array) -> tuple[Effect, ...]:
        """The effects at z."""
        return tuple(
            part.kind.at(point, self.around) for part, point in zip(self.parts, self.points(z), strict=True)
        )  # fmt: skip
