"""A hypothesis: which physics is added to the baseline, and the coordinates z in which it is fitted."""

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
        point: (k,) of its chart: where coordinates that are not free stay, and the middle of the others' prior.
        free: indices of the coordinates that are fitted.
    """

    kind: type[Effect]
    point: tuple[float, ...]
    free: tuple[int, ...]


@dc.dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """Baseline parameters and the effects beside them.

    z is the point of the unit cube of theta (d,), followed by the free coordinates of each part's chart, and by how
    much there is of what all pushes may share without its being physics, in standard deviations.
    """

    space: ParameterSpace
    around: Surroundings
    parts: tuple[Part, ...] = ()
    tolerances: int = 0

    @property
    def name(self) -> str:
        """The effects' names, in the order of the alphabet, joined."""
        return " + ".join(sorted(part.kind.name for part in self.parts)) or "baseline"

    @property
    def dimension(self) -> int:
        """Of z."""
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
        """Of the prior (n,)."""
        theta = np.asarray(self.space.to_unit(self.space.nominal))
        effects = [part.point[j] for part in self.parts for j in part.free]
        return np.concatenate([theta, effects, np.zeros(self.tolerances)])

    @cached_property
    def std(self) -> Array:
        """Of the prior (n,); infinite where nothing is known."""
        return np.concatenate(
            [self.space.prior_std_unit, [c.std for c in self.coordinates], np.ones(self.tolerances)]
        )

    @cached_property
    def whitening(self) -> Array:
        """What (n, n) takes z less its mean to independent numbers of unit variance; 0 where nothing is known."""
        d = self.space.dimension
        made = np.diag(1.0 / self.std)
        if self.space.correlation:
            covariance = np.array(self.space.correlation) * np.outer(self.std[:d], self.std[:d])
            made[:d, :d] = np.linalg.inv(np.linalg.cholesky(covariance))
        return made

    @cached_property
    def precision(self) -> Array:
        """Of the prior (n, n)."""
        return np.asarray(self.whitening.T @ self.whitening)

    def surprise(self, z: Array) -> float:
        """Twice the negative log prior density of z (n,), but for a constant."""
        return float(np.sum((self.whitening @ (z - self.mean)) ** 2))

    @property
    def known(self) -> Index:
        """Indices in z of what something is known of beforehand: theta and the tolerances."""
        return np.concatenate([np.arange(self.space.dimension), np.arange(self.simulated, self.dimension)])

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Least and greatest z (n,)."""
        d, t = self.space.dimension, np.full(self.tolerances, np.inf)
        least = np.concatenate([np.full(d, THETA_WITHIN[0]), [c.lower for c in self.coordinates], -t])
        most = np.concatenate([np.full(d, THETA_WITHIN[1]), [c.upper for c in self.coordinates], t])
        return least, most

    @property
    def simulated(self) -> int:
        """How many coordinates, the first, a rollout depends on."""
        return self.dimension - self.tolerances

    def steps(self, z: Array) -> Array:
        """Of differences (simulated,), away from bounds."""
        d, n = self.space.dimension, self.simulated
        sizes = np.concatenate([np.full(d, THETA_STEP), [c.step for c in self.coordinates]])
        middle = np.concatenate([np.full(d, 0.5), self.bounds[1][d:n] - sizes[d:]])
        return np.asarray(np.where(z[:n] <= middle, sizes, -sizes))

    def physics(self, z: Array) -> Physics:
        """What all pushes share at z."""
        return Physics(self.theta(z), self.effects(z))

    def theta(self, z: Array) -> Array:
        """The baseline's parameters (d,), each in its unit."""
        return np.asarray(self.space.from_unit(z[: self.space.dimension]))

    def points(self, z: Array) -> list[Array]:
        """Where each effect is in its chart."""
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
