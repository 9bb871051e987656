"""Fits of many hypotheses at once: Levenberg-Marquardt within bounds, over z and all pushes' nuisance parameters.

Source: K. Levenberg, Quart. Appl. Math. 2, 1944; D. Marquardt, J. SIAM 11, 1963.
"""

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

MOST_OWN, MOST_FRICTION = 3.0, 8.0  # standard deviations: largest size of nuisance parameters
MOST_THETA_MOVE = 0.25  # of the unit cube in one step
RENEWED = 5.0  # of the cost, per push: derivatives are computed anew after a step that gained more
SETTLED = 0.3  # of the cost: a step that gained less is the last
FIRST_DAMPING, EASED, HARDENED, HARDEST = 1e-3, 0.2, 8.0, 1e4
QUIETEST = 1e-3  # smallest noise scale where the noise is not known
MIDDLE = int(np.argmin(np.abs(np.log(SCATTERS))))  # of the scatters: the prior's median


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Point:
    """A point of a hypothesis, and what rollouts there predict.

    Attributes:
        z: (n,) coordinates that all pushes share.
        nuisance: each push's nuisance parameters (k,), in units of ``Nuisance.stds``.
        predicted: each push's features (m,), whitened: in units of the noise.
    """

    z: Array
    nuisance: Nuisances
    predicted: tuple[Array, ...]


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A hypothesis at a point, with derivatives there and what follows from them.

    Attributes:
        hypothesis: what is fitted.
        point: where.
        pushes: residuals and derivatives of each push at the point.
        scatter: standard deviation of friction between pushes, in units of ``pushes.case.UNIT_SCATTER``.
        noise_scale: errors over what the noise model says [-]; 1 where the hypothesis explains the pushes.
        tail: degrees of freedom of the t distribution of a push's errors.
        weighed: each push with its nuisance parameters integrated out.
        cost: of the point: twice the negative log posterior of z and of all nuisance parameters, up to a constant.
        damping: Levenberg-Marquardt parameter of the next step [-].
        done: whether further steps gain nothing.
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
        """Log likelihood with nuisance parameters integrated out, plus log priors of z and scatter."""
        z, h = self.point.z, self.hypothesis
        prior = -0.5 * h.surprise(z) + log_prior_of_scatter(self.scatter)
        return sum(one.log_density for one in self.weighed) + prior

    @property
    def degrees(self) -> int:
        """Degrees of freedom, at least 1: residuals less coordinates that rollouts depend on."""
        return max(1, sum(len(push.residual) for push in self.pushes) - self.hypothesis.simulated)

    @property
    def reduced_chi2(self) -> float:
        """Squared residuals in units of the noise, plus the prior's squares, over the degrees of freedom."""
        squares = self.hypothesis.surprise(self.point.z) + sum(one.square for one in self.weighed)
        return squares / self.degrees

    def again(self) -> Fit:
        """The same fit with the initial damping, from which further steps can be made."""
        return dc.replace(self, damping=FIRST_DAMPING, done=False)


class Fitter:
    """Fits hypotheses to a case's pushes.

    Attributes:
        case: the recording, made ready.
        predictor: makes rollouts and compares them with the recording.
        count: number of pushes.
        least: smallest noise scale [-].
        tolerances: per push (m, t): what the features change by one standard deviation of each of the t errors that
            all pushes may share without its being physics (slight errors of sizes, centres and clocks).
        most: per push (k,): largest size of each nuisance parameter, in standard deviations.
    """

    def __init__(self, case: Case, predictor: Predictor) -> None:
        self.case, self.predictor = case, predictor
        self.count = len(case.problems)
        self.least = 1.0 if case.noise.known else QUIETEST
        self.tolerances = tuple(np.zeros((len(y), 0)) for y in predictor.recorded)
        self.most = [
            np.array([MOST_FRICTION if name == "friction" else MOST_OWN for name in n.names]) for n in case.nuisances
        ]

    def shared_by_all(self, columns: Sequence[Array]) -> None:
        """Set the errors that all pushes share: columns (m_i, t) per push; the t coefficients are N(0, 1)."""
        self.tolerances = tuple(columns)

    def priors(self, scatter: float) -> list[Array]:
        """Standard deviations (k,) of each push's nuisance parameters, at a scatter in units of the unit scatter."""
        return [np.where(np.array(n.names) == "friction", scatter, 1.0) for n in self.case.nuisances]

    def at_rest(self) -> Nuisances:
        """All nuisance parameters at zero, per push (k,)."""
        return tuple(np.zeros(len(n.names)) for n in self.case.nuisances)

    def points(
        self, hypotheses: Sequence[Hypothesis], zs: Sequence[Array], nuisances: Sequence[Nuisances]
    ) -> list[Point | None]:
        """Rollouts of all pushes, in one batch.

        Args:
            hypotheses: one for each point.
            zs: (n,) of each.
            nuisances: of each point, every push's nuisance parameters (k,).

        Returns:
            A point for each hypothesis; None where a push could not be rolled out.
        """
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
        """Twice the negative log posterior of z and of all nuisance parameters, up to a constant.

        Args:
            hypothesis: for the prior of z.
            point: where.
            scatter: of friction between pushes, in units of the unit scatter.
            noise_scale: errors over what the noise model says [-].
            tail: degrees of freedom of a push's errors.
        """
        total = hypothesis.surprise(point.z)
        for i, prior in enumerate(self.priors(scatter)):
            total += self.cost_of_push(i, point.nuisance[i], point.predicted[i], prior, noise_scale, tail)
        return total

    def cost_of_push(
        self, i: int, nuisance: Array, predicted: Array, prior: Array, noise_scale: float, tail: float
    ) -> float:
        """The part of ``cost`` that belongs to push ``i``.

        Args:
            i: index of the push.
            nuisance: (k,) its nuisance parameters.
            predicted: (m,) its whitened features.
            prior: (k,) standard deviations of the nuisance parameters.
            noise_scale: errors over what the noise model says [-].
            tail: degrees of freedom of the push's errors.
        """
        error = self.predictor.recorded[i] - predicted
        return cost_of(float(error @ error), len(error), noise_scale, tail) + float(np.sum((nuisance / prior) ** 2))

    def roughly(self, point: Point) -> float:
        """Distance of a point from the recording, for ranking: sum over pushes of m log(1 + mean squared error).

        With the logarithm, one push that is far off does not decide.
        """
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
        """Fits at points, with derivatives by differences of rollouts, all in one batch.

        Args:
            hypotheses: one for each point.
            points: where.
            like: for each point a fit whose derivatives with respect to the nuisance parameters are taken over; None
                computes them.
            tail: degrees of freedom of a push's errors.
            theta: whether derivatives with respect to theta are computed where ``like`` has a fit; otherwise they are
                taken over from it, too.
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
        """The same fits with all derivatives computed anew; they must all have the same tail."""
        hypotheses, points = [fit.hypothesis for fit in fits], [fit.point for fit in fits]
        return self.started(hypotheses, points, [None] * len(fits), fits[0].tail) if fits else []

    def robust(self, fits: Sequence[Fit]) -> list[Fit]:
        """The same fits with the heavy-tailed distribution of a push's errors (``push.TAIL``)."""
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
        """The fits after at most ``rounds`` steps each, all of them in one batch.

        Args:
            fits: where they begin.
            rounds: largest number of steps.
            roughly: keep the derivatives with respect to theta and to nuisance parameters, however far a step leads.
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
        """Where a damped Gauss-Newton step within bounds leads: z (n,), and nuisance parameters (k,) per push."""
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
        """Log predictive density (n,) of each held-out push, given the other pushes or those outside its fold.

        From each an equal part of the prior's cost of theta, of the shared errors and of the scatter of friction is
        taken. Otherwise a hypothesis could place, say, the centre of mass ten tolerances off at no cost, since all
        pushes agree on it and predict each other.

        Args:
            fit: at which the pushes are linearised.
            folds: indices of pushes that are held out together; None holds out each alone.
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
        """The most probable z (n,) for all pushes but one, linearised, within bounds and within reach of one step."""
        h = fit.hypothesis
        dz, _ = without([push], h.mean - fit.point.z, h.precision, fit.weighed)
        reach = self._reach(h)
        return np.clip(fit.point.z + np.clip(dz, -reach, reach), *h.bounds)

    def seen_at(self, fit: Fit, point: Point) -> Fit:
        """A fit at another point of the same hypothesis, with the derivatives of the given fit."""
        pushes = tuple(
            dc.replace(push, residual=y - f + push.nuisance @ nuisance)
            for push, y, f, nuisance in zip(
                fit.pushes, self.predictor.recorded, point.predicted, point.nuisance, strict=True
            )
        )
        return self._found(fit.hypothesis, point, pushes, fit, fit.tail)

    def frictions(self, fit: Fit) -> Array:
        """Each push's deviation (count,) of friction from the shared one, in units of the unit scatter."""
        return np.array(
            [
                nuisance[n.index("friction")]
                for nuisance, n in zip(fit.point.nuisance, self.case.nuisances, strict=True)
            ]
        )

    def covariance(self, fit: Fit) -> Array:
        """Covariance (n, n) of z, with the nuisance parameters integrated out."""
        h = fit.hypothesis
        precision, _ = normal_equations(fit.weighed, h.mean - fit.point.z, h.precision)
        return np.asarray(np.linalg.inv(precision))
