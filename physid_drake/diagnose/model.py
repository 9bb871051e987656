"""A model in a fit: theta, effects at points of their charts, the pushes' own unknowns, and all of it linearised."""

from __future__ import annotations

import dataclasses as dc

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.linear import LinearPush, Solution, Whitened
from physid_drake.effects import Coordinate, Effect
from physid_drake.inference.bounded import Bounds
from physid_drake.inference.scatter import log_prior_of_scatter
from physid_drake.pushes.case import Case

Array = NDArray[np.float64]


@dc.dataclass(frozen=True, kw_only=True)
class EffectPoint:
    """An effect in a model.

    Attributes:
        kind: its class.
        point: (k,) where in its chart it is.
        free: which coordinates a fit may move.
        origin: (k,) where the fit started: the middle of the shape coordinates' prior.
    """

    kind: type[Effect]
    point: Array
    free: tuple[int, ...]
    origin: Array

    def effect(self, case: Case) -> Effect:
        """The effect itself."""
        return self.kind.at(self.point, case.around)

    def chart(self, case: Case) -> tuple[Coordinate, ...]:
        """All coordinates."""
        return self.kind.chart(case.around)

    def moved(self, case: Case, change: Array) -> EffectPoint:
        """Free coordinates moved by ``change``, within their bounds."""
        point = self.point.copy()
        chart = self.chart(case)
        for j, step in zip(self.free, change.tolist(), strict=True):
            point[j] = float(np.clip(point[j] + step, chart[j].lower, chart[j].upper))
        return dc.replace(self, point=point)

    def heavier(self, case: Case, ratio: float) -> EffectPoint:
        """What moves an object ``ratio`` times as heavy as this moves it, as far as free coordinates can."""
        powers = self._mass_powers(case)
        return dc.replace(self, point=self.point * ratio**powers)

    def with_mass(self, case: Case) -> Array:
        """Derivatives of the free coordinates of ``heavier`` with respect to the logarithm of the mass."""
        return (self._mass_powers(case) * self.point)[list(self.free)]

    def _mass_powers(self, case: Case) -> Array:
        names = [c.name for c in self.chart(case)]
        return np.array([self.kind.mass_powers.get(n, 0) if j in self.free else 0 for j, n in enumerate(names)])

    def freed(self, case: Case) -> EffectPoint:
        """All coordinates free."""
        return dc.replace(self, free=tuple(range(len(self.chart(case)))))


@dc.dataclass(frozen=True, kw_only=True)
class State:
    """Where a fit is.

    Attributes:
        u: (d,) theta in the unit cube.
        effects: the effects of the model.
        own: per push (k,), the unknowns in units of their priors.
        scatter: of friction, in units of ``UNIT_SCATTER``.
    """

    u: Array
    effects: tuple[EffectPoint, ...]
    own: tuple[Array, ...]
    scatter: float


@dc.dataclass(frozen=True, kw_only=True)
class Fitted:
    """A model fitted to all pushes.

    Attributes:
        state: where.
        pushes: linearised there; columns of ``shared``: theta, the effects' free coordinates, tolerances.
        prior_mean, prior_std: (d,) of a change of the shared parameters.
        solution: of the linear problem at the state; its beta is what was left to move.
        predicted: per push (m,), features at the state, unknowns included.
        score: log likelihood with the scatter's prior.
        doubt: standard deviation of the logarithm of the noise's variance [-].
        bounds: least and greatest change of theta and the effects' coordinates; None for none.
    """

    state: State
    pushes: tuple[LinearPush, ...]
    prior_mean: Array
    prior_std: Array
    solution: Solution
    predicted: tuple[Array, ...]
    score: float
    doubt: float = 0.0
    bounds: Bounds | None = None

    @property
    def own_dimension(self) -> int:
        """Shared parameters that the model has: theta and the effects' coordinates."""
        return len(self.state.u) + sum(len(e.free) for e in self.state.effects)

    @property
    def tolerance_cost(self) -> float:
        """How unlikely the use is that the model makes of its tolerances: half their squares, in deviations."""
        return 0.5 * float(np.sum(self.solution.beta[self.own_dimension :] ** 2))

    @property
    def degrees(self) -> int:
        """Residuals less shared parameters."""
        return sum(len(p.residual) for p in self.pushes) - self.own_dimension

    @property
    def reduced_chi2(self) -> float:
        """Cost per degree of freedom; 1 where the model explains the pushes."""
        return self.solution.chi2 / max(1, self.degrees)

    @property
    def excess(self) -> float:
        """Cost beyond what noise would leave."""
        return self.solution.chi2 - self.degrees

    @property
    def cost_here(self) -> float:
        """Twice the negative log posterior at the state itself, nothing left to move: what iterations compare."""
        white = Whitened.of(self.pushes, self.state.scatter)
        prior = float(np.sum((self.prior_mean / self.prior_std) ** 2)) - 2.0 * log_prior_of_scatter(
            self.state.scatter
        )
        return float(white.y @ white.y) + white.log_determinant + prior

    @property
    def excess_here(self) -> float:
        """Squares at the state itself, in deviations, beyond what noise would leave."""
        y = Whitened.of(self.pushes, self.state.scatter).y
        return float(y @ y) - self.degrees
