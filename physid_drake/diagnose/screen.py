"""Score tests of the whole catalogue: what each effect would change, against what is left over.

One or a few rollouts per effect and push give its signature at the null; what theta and the pushes' own unknowns can
imitate is projected out of it. How many independent looks the catalogue amounts to comes from pushes drawn from the
fitted model and refitted, in the same linear algebra.
"""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.linear import LinearPush, Whitened, best_scatter, solve, told_frictions
from physid_drake.diagnose.model import Fitted
from physid_drake.effects import Effect, Family
from physid_drake.pushes.case import UNIT_SCATTER, Case
from physid_drake.pushes.misfit import difference
from physid_drake.pushes.task import Task

Array = NDArray[np.float64]
Tick = Callable[[int, int], None]

DRAWS = 1000
FEWEST_FOR_A_TREND = 6  # pushes
IN_ORDER = 1e-4  # p-value
STRIDE = 0.01  # m: an object is somewhere at least so often


@dc.dataclass(frozen=True, kw_only=True)
class Signature:
    """What one family of one effect changes, per push, in units of its chart's steps.

    Attributes:
        kind: the effect.
        family: where in its chart.
        columns: per push (m, p).
        one_sided: (p,) whether a direction may only be followed forwards.
        stds: (p,) prior standard deviations; inf where nothing is known.
        friction_changes: (n,) by which share the step changes the friction of each push, if that is all it does.
    """

    kind: type[Effect]
    family: Family
    columns: tuple[Array, ...]
    one_sided: tuple[bool, ...]
    stds: tuple[float, ...]
    friction_changes: tuple[float, ...] = ()

    @property
    def steps(self) -> int:
        """Number of directions."""
        return len(self.family.free)


@dc.dataclass(frozen=True, kw_only=True)
class Score:
    """How much one family explains.

    Attributes:
        signature: the family's.
        kept: indices of its directions that may be used (one-sided ones only if their sign is right).
        coefficients: (p,) best steps; 0 in directions not kept.
        gain: twice the gain in log likelihood, or what is as unlikely as the rank correlation that was found.
        log_p: of that gain, by an F distribution with the push as the unit (``log_probability``).
        others: the scores of the effect's other families.
        log_p_of_order: of the rank correlation of the pushes' frictions with the effect, in the right direction.
    """

    signature: Signature
    kept: tuple[int, ...]
    coefficients: Array
    gain: float
    log_p: float
    others: tuple[Score, ...] = ()
    log_p_of_order: float = 0.0

    @property
    def kind(self) -> type[Effect]:
        """The effect."""
        return self.signature.kind

    @property
    def in_order(self) -> bool:
        """Whether the frictions of whole pushes follow the effect, which is all that it changes, beyond chance."""
        return self.log_p_of_order < math.log(IN_ORDER)


@dc.dataclass(frozen=True, kw_only=True)
class Screening:
    """All score tests.

    Attributes:
        scores: the best family of each effect, best first.
        p_value: of the best, the whole catalogue having been looked at.
        looks: how many independent effects the catalogue amounts to, from draws of the fitted model.
    """

    scores: tuple[Score, ...]
    p_value: float
    looks: float

    def score_of(self, name: str) -> Score | None:
        """The score of an effect."""
        return next((s for s in self.scores if s.kind.name == name), None)


def signatures(
    fitter: Fitter, fitted: Fitted, kinds: Sequence[type[Effect]], tick: Tick | None = None
) -> list[Signature]:
    """The signatures of effects at a fitted model, its own effects staying where they are.

    Args:
        fitter: makes the rollouts; that of a coarse case will do.
        fitted: the model.
        kinds: the effects.
        tick: told how many rollouts are done, and of how many.
    """
    return filled(fitter, fitted, empty_signatures(fitter, kinds), tick)


def filled(fitter: Fitter, fitted: Fitted, blank: Sequence[Signature], tick: Tick | None = None) -> list[Signature]:
    """Signatures that have no columns yet, with them."""
    case, state = fitter.case, fitted.state
    base = fitter.vectors([fitter.task(state, i) for i in range(len(case.problems))])
    present = [e.effect(case) for e in state.effects]
    plan: list[tuple[int, int, int]] = []  # signature, push, direction
    tasks: list[Task] = []
    for s, (kind, family) in enumerate((b.kind, b.family) for b in blank):
        chart = kind.chart(case.around)
        for i in range(len(case.problems)):
            if blank[s].friction_changes or family.shares or not _reaches(fitter, kind, family, i):
                continue
            for d, j in enumerate(family.free):
                plan.append((s, i, d))
                for sign in (-1.0, 1.0) if family.central else (1.0,):
                    point = np.array(family.point)
                    point[j] += sign * family.size * chart[j].step
                    tasks.append(fitter.task(state, i, effects=[*present, kind.at(point, case.around)]))
    vectors: list[Array] = []
    for k in range(0, len(tasks), 64):
        vectors += fitter.vectors(tasks[k : k + 64])
        if tick is not None:
            tick(min(k + 64, len(tasks)), len(tasks))
    columns = [[np.zeros((len(f.recorded), b.steps)) for f in case.features] for b in blank]
    seen = iter(vectors)
    for s, i, d in plan:
        central = blank[s].family.central
        before = next(seen) if central else base[i]
        columns[s][i][:, d] = (0.5 if central else 1.0) * difference(before, next(seen))
    for s, one in enumerate(blank):
        if one.family.shares:
            simulated = [columns[k] for k, b in enumerate(blank) if b.kind is one.kind and not b.family.shares]
            columns[s] = _added_up(simulated, one.family.shares)
    return [with_frictions(fitted, dc.replace(b, columns=tuple(c))) for b, c in zip(blank, columns, strict=True)]


def _added_up(simulated: Sequence[Sequence[Array]], shares: Sequence[float]) -> list[Array]:
    """Columns per push (m, p): so much of each of the families' (small effects add up)."""
    total = [np.zeros_like(column) for column in simulated[0]]
    for columns, share in zip(simulated, shares, strict=True):
        for i, column in enumerate(columns):
            total[i] += share * column
    return total


def with_frictions(fitted: Fitted, signature: Signature) -> Signature:
    """The signature of an effect that only changes the friction of whole pushes, from the pushes' own frictions.

    Such an effect is told from a push's own friction by how pushes compare, so that it has to be the very same
    direction: where motion has a kink, two differences are not.
    """
    if not signature.friction_changes:
        return signature
    columns = tuple(
        push.own[:, [push.friction]] * (change / UNIT_SCATTER)
        for push, change in zip(fitted.pushes, signature.friction_changes, strict=True)
    )
    return dc.replace(signature, columns=columns)


def _friction_changes(fitter: Fitter, kind: type[Effect], family: Family) -> tuple[float, ...]:
    """Shares by which an effect of one coordinate changes the frictions of pushes in a step; empty for others."""
    around, point = fitter.case.around, np.array(family.point)
    if len(point) != 1:
        return ()
    stepped = kind.at(point + family.size * kind.chart(around)[0].step, around)
    changes = [stepped.friction_change(problem.order) for problem in fitter.case.problems]
    return tuple(c for c in changes if c is not None)


def by_trend(fitted: Fitted, one: Score) -> Score:
    """The score test or the rank correlation of the pushes' own frictions with the effect's, two looks.

    Frictions that differ much from push to push are far from where the pushes were linearised; their order is not.
    The p-value of Kendall's correlation is exact for few pushes. Those that do not tell their friction have no order.
    """
    told, frictions = told_frictions(fitted.pushes, fitted.state.scatter, fitted.solution.beta)
    changes = np.array(one.signature.friction_changes)[told] / UNIT_SCATTER
    if len(frictions) < FEWEST_FOR_A_TREND or np.ptp(frictions) == 0.0 or np.ptp(changes) == 0.0:
        return one
    by_rank = math.log(max(1e-300, float(stats.kendalltau(frictions, changes).pvalue)))
    slope = float(stats.theilslopes(frictions, changes).slope)
    two_looks = math.log(2.0)
    if one.signature.one_sided[0] and slope < 0.0:
        return dc.replace(one, log_p=min(0.0, one.log_p + two_looks))
    log_p = min(0.0, by_rank + two_looks)
    if by_rank >= one.log_p:
        return dc.replace(one, log_p=min(0.0, one.log_p + two_looks), log_p_of_order=log_p)
    return dc.replace(
        one, kept=(0,), coefficients=np.array([slope]), log_p=log_p, log_p_of_order=log_p,
        gain=max(one.gain, _gain_at(log_p, 1, len(fitted.pushes), fitted.own_dimension)),
    )  # fmt: skip


def _gain_at(log_p: float, directions: int, pushes: int, spent: int) -> float:
    """The gain that has a p-value: the inverse of `log_probability`."""
    free = max(1, pushes - spent - directions)
    ratio = float(stats.f.isf(math.exp(log_p), directions, free))
    return pushes * math.log1p(ratio * directions / free)


def empty_signatures(fitter: Fitter, kinds: Sequence[type[Effect]]) -> list[Signature]:
    """All families of the effects, their columns still to be found."""
    return [empty_signature(fitter, kind, family) for kind in kinds for family in kind.families(fitter.case.around)]


def empty_signature(fitter: Fitter, kind: type[Effect], family: Family) -> Signature:
    """One family of an effect, its columns still to be found."""
    chart = kind.chart(fitter.case.around)
    return Signature(
        kind=kind,
        family=family,
        columns=(),
        one_sided=tuple(chart[j].lower >= family.point[j] for j in family.free),
        stds=tuple(chart[j].std / (chart[j].step * family.size) for j in family.free),
        friction_changes=_friction_changes(fitter, kind, family),
    )


def _reaches(fitter: Fitter, kind: type[Effect], family: Family, i: int) -> bool:
    """Whether an effect in one place can be felt in a push."""
    problem, around = fitter.case.problems[i], fitter.case.around
    places = np.vstack([np.array(problem.start.pose[:2]), problem.poses[:, :2]])
    return kind.at(np.array(family.point), around).reaches(_on_the_way(places), around)


def _on_the_way(places: Array) -> Array:
    """Places (n, 2) [m] and those between them on straight lines: of some pushes only both ends are known."""
    ways = np.diff(places, axis=0)
    counts = np.ceil(np.linalg.norm(ways, axis=1) / STRIDE).astype(int)
    parts = np.concatenate([np.arange(count) / count for count in counts if count] or [np.zeros(0)])
    between = np.repeat(places[:-1], counts, axis=0) + parts[:, None] * np.repeat(ways, counts, axis=0)
    return np.vstack([between, places[-1:]])


def tolerances(case: Case, found: Sequence[Signature]) -> tuple[Array, ...]:
    """Per push (m, t): what all pushes may share without its being physics, one standard deviation each."""
    chosen = []
    for s in found:
        chart = s.kind.chart(case.around)
        for d, j in enumerate(s.family.free):
            if chart[j].tolerance > 0.0 and s.family.size == 1.0:
                chosen.append((s, d, chart[j].tolerance / chart[j].step))
    count = len(case.problems)
    empty = [np.zeros((len(f.recorded), 0)) for f in case.features]
    return tuple(
        np.column_stack([empty[i], *(share * s.columns[i][:, d] for s, d, share in chosen)]) for i in range(count)
    )


def extended(pushes: Sequence[LinearPush], columns: Sequence[Array]) -> tuple[LinearPush, ...]:
    """The pushes with further shared columns."""
    return tuple(
        dc.replace(push, shared=np.column_stack([push.shared, more]))
        for push, more in zip(pushes, columns, strict=True)
    )


def score(fitted: Fitted, signature: Signature) -> Score:
    """The score test of one family: the gain in likelihood, theta, scatter and the pushes' unknowns refitted."""
    kept = list(range(signature.steps))
    coefficients = np.zeros(signature.steps)
    while kept:
        pushes = extended(fitted.pushes, [c[:, kept] for c in signature.columns])
        mean = np.concatenate([fitted.prior_mean, np.zeros(len(kept))])
        std = np.concatenate([fitted.prior_std, np.array(signature.stds)[kept]])
        scatter, value = best_scatter(pushes, mean, std, bounds=fitted.bounds)
        beta = solve(Whitened.of(pushes, scatter), mean, std, fitted.bounds).beta[len(fitted.prior_mean) :]
        wrong = [k for k, b in zip(kept, beta, strict=True) if signature.one_sided[k] and b < 0.0]
        if not wrong:
            coefficients[kept] = beta
            gain = max(0.0, 2.0 * (value - fitted.score))
            log_p = log_probability(gain, len(kept), len(pushes), fitted.own_dimension)
            return Score(
                signature=signature, kept=tuple(kept), coefficients=coefficients, gain=gain, log_p=log_p
            )  # fmt: skip
        kept = [k for k in kept if k not in wrong]
    return Score(signature=signature, kept=(), coefficients=coefficients, gain=0.0, log_p=0.0)


def log_probability(gain: float, directions: int, pushes: int, spent: int) -> float:
    """Log p-value of a gain in twice the log likelihood, with the push as the unit.

    Friction scatters from push to push, so that a gain is a ratio of variances between pushes and follows an F
    distribution with few degrees of freedom rather than a chi-square one.
    """
    free = max(1, pushes - spent - directions)
    ratio = np.expm1(min(gain / pushes, 500.0)) * free / directions
    return float(max(stats.f.logsf(ratio, directions, free), -700.0))


def screen(fitted: Fitted, found: Sequence[Signature], rng: np.random.Generator) -> Screening:
    """All score tests, and the distribution of the best of them where the fitted model is true."""
    if not found:  # every effect that was to be looked at is in the model
        return Screening(scores=(), p_value=1.0, looks=1.0)
    families: dict[str, list[Score]] = {}
    for signature in found:
        one = score(fitted, signature)
        if signature.friction_changes:
            one = by_trend(fitted, one)
        families.setdefault(signature.kind.name, []).append(one)
    scores = tuple(sorted((best_family(every) for every in families.values()), key=_rank))
    null = _null_draws(fitted, found, rng)
    # As many independent looks as give the draws' median of the smallest p.
    looks = max(1.0, float(np.log(2.0) / np.exp(np.median(null))))
    seen = scores[0].log_p if scores else 0.0
    p_value = float(-np.expm1(looks * np.log1p(-np.exp(min(seen, -1e-12)))))
    return Screening(scores=scores, p_value=p_value, looks=looks)


def _rank(one: Score) -> tuple[float, float]:
    return one.log_p, -one.gain


def best_family(every: Sequence[Score]) -> Score:
    """The best of the scores of an effect's families, with the others."""
    best, *others = sorted(every, key=_rank)
    return dc.replace(best, others=tuple(others))


def _null_draws(fitted: Fitted, found: Sequence[Signature], rng: np.random.Generator) -> Array:
    """Smallest log p (draws,) over all families, in draws of white noise with theta refitted."""
    theta, blocks = projected(fitted, [s.columns for s in found])
    draws = rng.standard_normal((theta.shape[0], DRAWS))
    draws -= theta @ (theta.T @ draws)
    best = np.zeros(DRAWS)
    for signature, block in zip(found, blocks, strict=True):
        q, r = np.linalg.qr(block)
        told = np.abs(np.diag(r)) > 1e-9
        if not told.any():
            continue
        part = (q[:, told] * np.sign(np.diag(r)[told])).T @ draws
        if signature.steps == 1 and signature.one_sided[0]:
            part = np.maximum(part, 0.0)
        best = np.minimum(best, stats.chi2.logsf((part**2).sum(axis=0), int(told.sum())))
    return best


def projected(fitted: Fitted, columns: Sequence[Sequence[Array]]) -> tuple[Array, list[Array]]:
    """Whitened signatures without what theta, tolerances and the pushes' unknowns imitate.

    What has a prior imitates no more than that allows: it is an observation of its own, a row for each (f of them). A
    tolerance that were taken away whole would take the effect with it that it is a little of.

    Args:
        fitted: the model.
        columns: per signature, per push (m, p).

    Returns:
        An orthonormal basis (M + f, d) of the shared directions, and per signature (M + f, p).
    """
    count = fitted.pushes[0].shared.shape[1]
    stacked = [np.column_stack([c[i] for c in columns]) for i in range(len(fitted.pushes))]
    x = Whitened.of(extended(fitted.pushes, stacked), fitted.state.scatter).x
    known = np.flatnonzero(np.isfinite(fitted.prior_std))
    if len(known):
        priors = np.zeros((len(known), x.shape[1]))
        priors[np.arange(len(known)), known] = 1.0 / fitted.prior_std[known]
        x = np.vstack([x, priors])
    theta, _ = np.linalg.qr(x[:, :count])
    rest = x[:, count:] - theta @ (theta.T @ x[:, count:])
    edges = np.cumsum([c[0].shape[1] for c in columns])[:-1]
    return theta, np.split(rest, edges, axis=1)


def cosine(fitted: Fitted, first: Score, second: Score) -> float:
    """Cosine between two fitted signatures, theta and the pushes' unknowns projected out."""
    columns = [[(c @ one.coefficients)[:, None] for c in one.signature.columns] for one in (first, second)]
    _, (a, b) = projected(fitted, columns)
    norms = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float((a * b).sum()) / norms if norms > 0.0 else 0.0
