"""Fits of many hypotheses at once: bounded Levenberg-Marquardt over z and all per-push parameters."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.inference.bounded import bounded
from physid_drake.inference.hypothesis import Hypothesis
from physid_drake.inference.predictions import Predictor
from physid_drake.inference.push import (
    NO_TAIL,
    TAIL,
    LinearPush,
    Weighed,
    cost_of,
    held_out,
    noise_scale_of,
    normal_equations,
    weighed,
    without,
)
from physid_drake.inference.rollouts import Ask
from physid_drake.inference.scatter import SCATTERS, log_prior_of_scatter
from physid_drake.inference.slopes import nuisance_slopes, nuisance_steps, slope
from physid_drake.pushes.case import Case

Array = NDArray[np.float64]
Nuisances = tuple[Array, ...]

MOST_OWN, MOST_FRICTION = 3.0, 8.0  # standard deviations: unknowns go no further out
MOST_THETA_MOVE = 0.25  # of the unit cube in one step
RENEWED = 5.0  # of the cost, per push: a step that gained as much has left the place of its derivatives
SETTLED = 0.3  # of the cost: a step that gained less is the last
FIRST_DAMPING, EASED, HARDENED, HARDEST = 1e-3, 0.2, 8.0, 1e4
QUIETEST = 1e-3  # a noise that nobody knows may be as small as this share of what is taken for it
MIDDLE = int(np.argmin(np.abs(np.log(SCATTERS))))  # of the scatters: the prior's median


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Point:
    """Where a fit is, and what it predicts there.

    Attributes:
        z: (n,).
        nuisance: each push's nuisance parameters (k,).
        predicted: each push's whitened features (m,).
    """

    z: Array
    nuisance: Nuisances
    predicted: tuple[Array, ...]


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A hypothesis at a point, linearised there.

    Attributes:
        hypothesis: what is fitted.
        point: where.
        pushes: linearised at it.
        scatter: of friction, push to push, in units of the columns'.
        noise_scale: how many times as large as noise errors are; 1 of a hypothesis that explains the pushes.
        tail: degrees of freedom of a push's errors.
        weighed: the pushes with their unknowns integrated out.
        cost: of the point: twice the negative log posterior of z and the per-push parameters, but for a constant.
        damping: of the next step.
        done: whether steps gain nothing any more.
    """

    hypothesis: Hypothesis
    point: Point
    pushes: tuple[LinearPush, ...]
    scatter: float
    noise_scale: float
    tail: float
    weighed: tuple[Weighed, ...]
    cost: float
    damping: float = FIRST_DAMPING
    done: bool = False

    @property
    def log_likelihood(self) -> float:
        """Marginal over the per-push parameters, with the priors of z and scatter."""
        z, h = self.point.z, self.hypothesis
        prior = -0.5 * h.surprise(z) + log_prior_of_scatter(self.scatter)
        return sum(one.log_density for one in self.weighed) + prior

    @property
    def degrees(self) -> int:
        """Residuals less shared parameters, at least 1."""
        return max(1, sum(len(push.residual) for push in self.pushes) - self.hypothesis.simulated)

    @property
    def reduced_chi2(self) -> float:
        """Squares that are left, in units of noise, with what the priors cost, per degree of freedom."""
        squares = self.hypothesis.surprise(self.point.z) + sum(one.square for one in self.weighed)
        return squares / self.degrees

    def again(self) -> Fit:
        """The fit, to be stepped on from."""
        return dc.replace(self, damping=FIRST_DAMPING, done=False)


class Fitter:
    """Fits hypotheses to a case's pushes."""

    def __init__(self, case: Case, predictor: Predictor) -> None:
        self.case, self.predictor = case, predictor
        self.count = len(case.problems)
        self.least = 1.0 if case.noise.known else QUIETEST
        self.tolerances = tuple(np.zeros((len(y), 0)) for y in predictor.recorded)
        self.most = [
            np.array([MOST_FRICTION if name == "friction" else MOST_OWN for name in n.names]) for n in case.nuisances
        ]

    def shared_by_all(self, columns: Sequence[Array]) -> None:
        """Let predictions have N(0, 1) multiples of columns (m_i, t), the same for all pushes."""
        self.tolerances = tuple(columns)

    def priors(self, scatter: float) -> list[Array]:
        """Standard deviations (k,) of each push's nuisance parameters."""
        return [np.where(np.array(n.names) == "friction", scatter, 1.0) for n in self.case.nuisances]

    def at_rest(self) -> Nuisances:
        """All per-push parameters at zero."""
        return tuple(np.zeros(len(n.names)) for n in self.case.nuisances)

    def points(
        self, hypotheses: Sequence[Hypothesis], zs: Sequence[Array], nuisances: Sequence[Nuisances]
    ) -> list[Point | None]:
        """What hypotheses predict at z with the per-push parameters; None where the twin cannot say it of a push."""
        asks = []
        for h, z, nuisance in zip(hypotheses, zs, nuisances, strict=True):
            physics = h.physics(z)
            asks += [Ask(i, physics, nuisance[i]) for i in range(self.count)]
        vectors = iter(self.predictor.vectors(asks))
        points: list[Point | None] = []
        for h, z, nuisance in zip(hypotheses, zs, nuisances, strict=True):
            found = [next(vectors) for _ in range(self.count)]
            predicted = tuple(
                vector + more @ z[h.simulated :]
                for vector, more in zip(found, self.tolerances, strict=True)
                if vector is not None
            )
            points.append(
                Point(z=z, nuisance=nuisance, predicted=predicted) if len(predicted) == self.count else None
            )
        return points

    def cost(self, hypothesis: Hypothesis, point: Point, scatter: float, noise_scale: float, tail: float) -> float:
        """Twice the negative log posterior of z and the per-push parameters, but for a constant."""
        total = hypothesis.surprise(point.z)
        for i, prior in enumerate(self.priors(scatter)):
            total += self.cost_of_push(i, point.nuisance[i], point.predicted[i], prior, noise_scale, tail)
        return total

    def cost_of_push(
        self, i: int, nuisance: Array, predicted: Array, prior: Array, noise_scale: float, tail: float
    ) -> float:
        """The part of the cost that is push i's."""
        error = self.predictor.recorded[i] - predicted
        return cost_of(float(error @ error), len(error), noise_scale, tail) + float(np.sum((nuisance / prior) ** 2))

    def roughly(self, point: Point) -> float:
        """How far a point is from the recording, for rankings: pushes that are far off count by their logarithm."""
        total = 0.0
        for y, f in zip(self.predictor.recorded, point.predicted, strict=True):
            total += len(y) * math.log1p(float((y - f) @ (y - f)) / len(y))
        return total

    # Linearisation.

    def started(
        self,
        hypotheses: Sequence[Hypothesis],
        points: Sequence[Point],
        like: Sequence[Fit | None],
        tail: float = NO_TAIL,
        *,
        theta: bool = True,
    ) -> list[Fit]:
        """Fits at points, with derivatives by differences.

        Args:
            hypotheses: of each point.
            points: where.
            like: fits whose derivatives by the per-push parameters are near enough; None takes them anew.
            tail: degrees of freedom of a push's errors.
            theta: take derivatives by theta anew beside such a fit, too.
        """
        asks: list[Ask] = []
        kept = [0 if theta or near is None else h.space.dimension for h, near in zip(hypotheses, like, strict=True)]
        for h, point, near, skipped in zip(hypotheses, points, like, kept, strict=True):
            asks += self._asks(h, point, skipped, nuisance=near is None)
        vectors = iter(self.predictor.vectors(asks))
        return [
            self._found(h, point, self._linear(h, point, vectors, near, skipped), near, tail)
            for h, point, near, skipped in zip(hypotheses, points, like, kept, strict=True)
        ]

    def renewed(self, fits: Sequence[Fit]) -> list[Fit]:
        """The fits, all with the same tail, with all derivatives anew."""
        hypotheses, points = [fit.hypothesis for fit in fits], [fit.point for fit in fits]
        return self.started(hypotheses, points, [None] * len(fits), fits[0].tail) if fits else []

    def robust(self, fits: Sequence[Fit]) -> list[Fit]:
        """The fits with pushes that have heavy tails."""
        return [self._found(fit.hypothesis, fit.point, fit.pushes, fit, TAIL) for fit in fits]

    def _asks(self, h: Hypothesis, point: Point, skipped: int, *, nuisance: bool) -> list[Ask]:
        """One rollout per push for a step of each coordinate that is simulated, and of each per-push parameter.

        Not for the first coordinates, so many of which are skipped.
        """
        moved = []
        for step in np.diag(h.steps(point.z))[skipped:]:
            z = point.z.copy()
            z[: h.simulated] += step
            moved.append(h.physics(z))
        here = h.physics(point.z)
        asks = []
        for i in range(self.count):
            asks += [Ask(i, physics, point.nuisance[i]) for physics in moved]
            asks += [Ask(i, here, seat) for seat in nuisance_steps(point.nuisance[i])] if nuisance else []
        return asks

    def _linear(
        self, h: Hypothesis, point: Point, vectors: Iterator[Array | None], near: Fit | None, skipped: int
    ) -> tuple[LinearPush, ...]:
        """All pushes from the rollouts of ``_asks``; what was skipped is as in the fit that is near."""
        pushes = []
        for i, (whole, more) in enumerate(zip(point.predicted, self.tolerances, strict=True)):
            base = whole - more @ point.z[h.simulated :]
            moved = [slope(base, next(vectors), size) for size in h.steps(point.z)[skipped:]]
            known = [] if near is None else [near.pushes[i].shared[:, :skipped]]
            shared = np.column_stack([*known, *moved, more])
            nuisance = (
                near.pushes[i].nuisance if near is not None else nuisance_slopes(base, point.nuisance[i], vectors)
            )
            residual = self.predictor.recorded[i] - whole + nuisance @ point.nuisance[i]
            pushes.append(LinearPush(residual=residual, shared=shared, nuisance=nuisance))
        return tuple(pushes)

    def _found(
        self, h: Hypothesis, point: Point, pushes: tuple[LinearPush, ...], near: Fit | None, tail: float
    ) -> Fit:
        """The fit with its scatter, searched for from that of a fit that is near, and its noise scale."""
        counts = [len(push.residual) for push in pushes]
        errors = [
            push.residual - push.nuisance @ nuisance for push, nuisance in zip(pushes, point.nuisance, strict=True)
        ]
        noise_scale = noise_scale_of([float(e @ e) for e in errors], counts, self.least, tail)
        best = MIDDLE if near is None else SCATTERS.index(near.scatter)
        for _ in range(2):
            best, found = self._scattered(h, point, pushes, best, noise_scale, tail)
            noise_scale = noise_scale_of([one.square for one in found], counts, self.least, tail)
        scatter = SCATTERS[best]
        return Fit(
            hypothesis=h, point=point, pushes=pushes, scatter=scatter, noise_scale=noise_scale, tail=tail,
            weighed=self._weighed(pushes, scatter, noise_scale, tail),
            cost=self.cost(h, point, scatter, noise_scale, tail),
        )  # fmt: skip

    def _scattered(
        self, h: Hypothesis, point: Point, pushes: Sequence[LinearPush], start: int, noise_scale: float, tail: float
    ) -> tuple[int, tuple[Weighed, ...]]:
        """The likeliest scatter's place in the grid, uphill from a start, and the pushes weighed with it."""
        values: dict[int, tuple[float, tuple[Weighed, ...]]] = {}
        best, last = start, -1
        while best != last:
            last = best
            for k in (best - 1, best, best + 1):
                if 0 <= k < len(SCATTERS) and k not in values:
                    found = self._weighed(pushes, SCATTERS[k], noise_scale, tail)
                    precision, right = normal_equations(found, h.mean - point.z, h.precision)
                    gained = 0.5 * float(right @ bounded(precision, right, None))  # when z has moved
                    likelihood = sum(one.log_density for one in found)
                    values[k] = likelihood + gained + log_prior_of_scatter(SCATTERS[k]), found
            best = max(values, key=lambda k: values[k][0])
        return best, values[best][1]

    def _weighed(
        self, pushes: Sequence[LinearPush], scatter: float, noise_scale: float, tail: float
    ) -> tuple[Weighed, ...]:
        return tuple(
            weighed(push.residual, push.shared, push.nuisance, prior, noise_scale, tail)
            for push, prior in zip(pushes, self.priors(scatter), strict=True)
        )

    # Iteration.

    def fitted(self, fits: Sequence[Fit], rounds: int, *, roughly: bool = False) -> list[Fit]:
        """The fits after so many steps at most, all of them in one batch.

        Args:
            fits: where they are.
            rounds: at most.
            roughly: keep the derivatives by theta and by the per-push parameters, however far a step leads.
        """
        now = list(fits)
        for _ in range(rounds):
            going = [k for k, fit in enumerate(now) if not fit.done]
            for k, fit in zip(going, self._stepped([now[k] for k in going], roughly=roughly), strict=True):
                now[k] = fit
        return now

    def _stepped(self, fits: Sequence[Fit], *, roughly: bool) -> list[Fit]:
        """One step of each fit: the better point, linearised, or the same fit with shorter steps to come."""
        steps = [self.step(fit) for fit in fits]
        points = self.points([f.hypothesis for f in fits], [z for z, _ in steps], [nuisance for _, nuisance in steps])
        results, better = list(fits), list[tuple[int, Point, Fit | None]]()
        for k, (fit, point) in enumerate(zip(fits, points, strict=True)):
            cost = math.inf if point is None else self._cost_as(fit, point)
            if point is not None and fit.cost - cost > SETTLED:
                far = not roughly and fit.cost - cost > RENEWED * self.count
                better.append((k, point, None if far else fit))
            else:
                damping = fit.damping * HARDENED
                results[k] = dc.replace(fit, damping=damping, done=cost <= fit.cost or damping > HARDEST)
        for tail in {fits[k].tail for k, _, _ in better}:
            some = [one for one in better if fits[one[0]].tail == tail]
            hypotheses = [fits[k].hypothesis for k, _, _ in some]
            points_of, near_of = [point for _, point, _ in some], [near for *_, near in some]
            again = self.started(hypotheses, points_of, near_of, tail, theta=not roughly)
            for (k, _, _), fit in zip(some, again, strict=True):
                results[k] = dc.replace(fit, damping=fits[k].damping * EASED)
        return results

    def _cost_as(self, fit: Fit, point: Point) -> float:
        """Of another point, with a fit's scatter and noise scale."""
        return self.cost(fit.hypothesis, point, fit.scatter, fit.noise_scale, fit.tail)

    def _reach(self, h: Hypothesis) -> Array:
        """How far (n,) a step goes: shapes (a place, a speed) no further than their prior says they are unsure."""
        of_theta, free = np.full(h.space.dimension, MOST_THETA_MOVE), np.full(h.tolerances, np.inf)
        return np.concatenate([of_theta, [c.std for c in h.coordinates], free])

    def step(self, fit: Fit) -> tuple[Array, Nuisances]:
        """Where a damped Gauss-Newton step leads, within bounds."""
        h, point = fit.hypothesis, fit.point
        precision, right = normal_equations(fit.weighed, h.mean - point.z, h.precision)
        damped = precision + np.diag(fit.damping * np.diag(precision))
        reach = self._reach(h)
        least, most = np.maximum(h.bounds[0] - point.z, -reach), np.minimum(h.bounds[1] - point.z, reach)
        dz = bounded(damped, right, (least, most))
        nuisance = tuple(
            np.clip(one.nuisance + one.to_nuisance @ dz, -furthest, furthest)
            for one, furthest in zip(fit.weighed, self.most, strict=True)
        )
        return np.clip(point.z + dz, *h.bounds), nuisance

    def held_out(self, fit: Fit, folds: Sequence[Sequence[int]] | None = None) -> Array:
        """Log predictive density (n,) of each push given the others, or given those outside its fold.

        Each bears its part of how unlikely theta, the tolerances and the scatter of friction are: where all pushes
        agree on a centre of mass that is off by ten tolerances, the others would predict each of them at no cost.
        """
        h = fit.hypothesis
        scores = held_out(
            fit.pushes, self.priors(fit.scatter), h.mean - fit.point.z, h.precision, fit.noise_scale, fit.weighed,
            fit.tail, folds,
        )  # fmt: skip
        known = (h.whitening @ (fit.point.z - h.mean))[h.known]
        cost = 0.5 * float(known @ known) - log_prior_of_scatter(fit.scatter)
        return np.asarray(scores - cost / len(scores))

    def without(self, fit: Fit, push: int) -> Array:
        """Where z (n,) is likeliest for all pushes but one, within bounds and no further than a step goes."""
        h = fit.hypothesis
        dz, _ = without([push], h.mean - fit.point.z, h.precision, fit.weighed)
        reach = self._reach(h)
        return np.clip(fit.point.z + np.clip(dz, -reach, reach), *h.bounds)

    def seen_at(self, fit: Fit, point: Point) -> Fit:
        """A fit at another point of its hypothesis, with the derivatives that it has."""
        pushes = tuple(
            dc.replace(push, residual=y - f + push.nuisance @ nuisance)
            for push, y, f, nuisance in zip(
                fit.pushes, self.predictor.recorded, point.predicted, point.nuisance, strict=True
            )
        )
        return self._found(fit.hypothesis, point, pushes, fit, fit.tail)

    def frictions(self, fit: Fit) -> Array:
        """Each push's own share (n,) of friction beside what all share, in units of the columns' scatter."""
        return np.array(
            [
                nuisance[n.index("friction")]
                for nuisance, n in zip(fit.point.nuisance, self.case.nuisances, strict=True)
            ]
        )

    def covariance(self, fit: Fit) -> Array:
        """Of z (n, n), the per-push parameters integrated out."""
        h = fit.hypothesis
        precision, _ = normal_equations(fit.weighed, h.mean - fit.point.z, h.precision)
        return np.asarray(np.linalg.inv(precision))
