"""Values with intervals: of effects, of theta, and of the smallest effect that would have shown."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.diagnose.evidence import Evidence
from physid_drake.diagnose.model import EffectPoint, Fitted
from physid_drake.diagnose.screen import (
    log_probability,
    projected,
)
from physid_drake.diagnose.values import (
    Detectable,
    ParameterEstimate,
    ThetaEstimate,
)
from physid_drake.effects import Effect
from physid_drake.effects.effect import Coordinate
from physid_drake.identify.cells import TOLD
from physid_drake.pushes.case import Case
from physid_drake.pushes.theta import CELL_ERROR, cell_error

Array = NDArray[np.float64]

Z90 = float(stats.norm.ppf(0.95))
SAMPLES = 400  # of an effect's chart, for the intervals of its parameters
JOINT_SAMPLES = 2000  # of theta and all charts, for how the estimates vary together
# Of its standard deviation: below, an amplitude may be nothing. What is known over an unweighed mass only is above.
DOUBTFUL = 0.5


def shared_covariance(fitted: Fitted) -> Array:
    """Covariance (d, d) of theta and the effects' coordinates, widened where the model does not fit."""
    covariance: Array = np.asarray(np.linalg.pinv(fitted.solution.precision), dtype=np.float64)
    widened: Array = covariance * max(1.0, fitted.reduced_chi2)
    return widened


def _t_factor(fitted: Fitted) -> float:
    """How much wider than a normal interval one is with so few pushes; the cell's own error does not grow with it."""
    free = max(2, len(fitted.pushes) - fitted.own_dimension)
    return float(stats.t.ppf(0.95, free)) / Z90


def parameters_of(evidence: Evidence, k: int) -> dict[str, ParameterEstimate]:
    """Values and intervals of the k-th effect, by drawing its chart point."""
    final, case = evidence.final, evidence.case
    here = final.state.effects[k]
    at = len(final.state.u) + sum(len(e.free) for e in final.state.effects[:k])
    part = slice(at, at + len(here.free))
    seen = _t_factor(final) ** 2 * shared_covariance(final)[part, part]
    covariance = seen + np.diag(_own_error(here, case) ** 2)
    rng = np.random.default_rng(0)
    draws = rng.multivariate_normal(np.zeros(len(here.free)), covariance, SAMPLES, method="eigh")
    drawn = [here.moved(case, d).effect(case) for d in _more_than_nothing(here, case, draws)]
    effect = here.effect(case)
    return {
        name: ParameterEstimate(
            value=_plain(getattr(effect, name)),
            unit=unit,
            ci90=_interval(effect, name, [getattr(d, name) for d in drawn]),
            null=_plain(effect.nulls()[name]),
        )
        for name, unit in effect.units().items()
    }


def _own_error(here: EffectPoint, case: Case) -> Array:
    """The cell's own error (k,) of free coordinates: a share of an amplitude, or of a speed, size or frequency.

    Of a place, that share of what lies between two places that are looked at.
    """
    chart = here.chart(case)
    amounts = [_amount(chart[j], float(here.point[j])) for j in here.free]
    return CELL_ERROR * np.array(amounts)


def _amount(coordinate: Coordinate, value: float) -> float:
    if np.isinf(coordinate.std):
        return abs(value)
    return 1.0 if coordinate.log else coordinate.std


def _more_than_nothing(here: EffectPoint, case: Case, moves: Array) -> Array:
    """Moves (n, k) of free coordinates; those of an amplitude that cannot be negative are made in its logarithm.

    An effect that is surely there is more than nothing, however little is known of its size: a drag, say, over a mass
    that nobody weighed. Little changes where an amplitude is well known, and nothing where it is doubtful.
    """
    made = moves.copy()
    for k, j in enumerate(here.free):
        coordinate, value = here.chart(case)[j], here.point[j]
        one_sided = coordinate.name in here.kind.amplitudes and coordinate.lower == 0.0 and not coordinate.log
        if one_sided and value > DOUBTFUL * np.std(moves[:, k]):
            made[:, k] = value * np.expm1(moves[:, k] / value)
    return made


def _plain(value: Any) -> Any:
    return [list(row) for row in value] if isinstance(value, tuple) else value


def _near(effect: Effect, name: str, values: Sequence[Any]) -> Array:
    """Draws of a parameter; of a periodic one, those within half a period of the effect's value."""
    drawn, period = np.asarray(values, dtype=np.float64), effect.periods()[name]
    if period is None:
        return drawn
    here = float(getattr(effect, name))
    return np.asarray(here + (drawn - here + 0.5 * period) % period - 0.5 * period)


def _interval(effect: Effect, name: str, values: Sequence[Any]) -> Any:
    low, high = np.quantile(_near(effect, name, values), [0.05, 0.95], axis=0)
    return [low.tolist(), high.tolist()]


def theta_of(evidence: Evidence, fitted: Fitted) -> dict[str, ThetaEstimate]:
    """Theta under a model, and which of it these pushes tell."""
    space = evidence.case.thetas.space
    covariance = shared_covariance(fitted)
    _, prior = evidence.fitter.priors(fitted.state)
    before = np.asarray(space.from_unit(evidence.nearest.state.u))
    here = np.asarray(space.from_unit(fitted.state.u))
    intervals = theta_intervals(evidence, fitted)
    result = {}
    for j, parameter in enumerate(space.parameters):
        told = math.sqrt(covariance[j, j]) < TOLD * prior[j]
        result[parameter.name] = ThetaEstimate(
            value=float(here[j]) if told else None,
            unit=parameter.unit,
            ci90=intervals[parameter.name] if told else None,
            identifiable=bool(told),
            before=float(before[j]),
        )
    return result


def theta_intervals(evidence: Evidence, fitted: Fitted) -> dict[str, tuple[float, float]]:
    """90 % intervals of theta, told or not, the cell's own error in them, and none wider than the prior's."""
    space, u = evidence.case.thetas.space, fitted.state.u
    _, prior = evidence.fitter.priors(fitted.state)
    seen = _t_factor(fitted) * np.sqrt(np.diag(shared_covariance(fitted)))
    here = np.asarray(space.from_unit(u))
    intervals = {}
    for j, name in enumerate(space.names):
        std = math.hypot(seen[j], cell_error(space, here, j))
        along = Z90 * min(std, prior[j]) * np.eye(len(u))[j]
        low, high = (float(space.from_unit(np.clip(end, 0.0, 1.0))[j]) for end in (u - along, u + along))
        intervals[name] = (low, high)
    return intervals


def correlation_of(case: Case, fitted: Fitted) -> tuple[tuple[str, ...], Array]:
    """How the estimates of a model vary together, by drawing theta and the effects' chart points.

    Returns:
        Names, ``theta.<name>`` and ``<effect>.<parameter>``, of what is one number and varies; and the correlation
        (n, n) of their normal scores, which does not depend on the coordinates.
    """
    state, rng = fitted.state, np.random.default_rng(0)
    count = fitted.own_dimension
    covariance = shared_covariance(fitted)[:count, :count]
    moves = rng.multivariate_normal(np.zeros(count), covariance, JOINT_SAMPLES, method="eigh") * _t_factor(fitted)
    names = case.thetas.space.names
    drawn: dict[str, Array] = {f"theta.{name}": moves[:, j] for j, name in enumerate(names)}
    at = len(names)
    for point in state.effects:
        here = point.effect(case)
        drawn_moves = _more_than_nothing(point, case, moves[:, at : at + len(point.free)])
        effects = [point.moved(case, move).effect(case) for move in drawn_moves]
        at += len(point.free)
        for name in here.units():
            if isinstance(getattr(here, name), float):
                values = [getattr(effect, name) for effect in effects]
                drawn[f"{here.name}.{name}"] = _near(here, name, values)
    varying = {name: values for name, values in drawn.items() if np.ptp(values) > 0.0}
    scores = [stats.norm.ppf((stats.rankdata(v) - 0.5) / len(v)) for v in varying.values()]
    return tuple(varying), np.atleast_2d(np.corrcoef(scores)) if scores else np.zeros((0, 0))


def smallest(evidence: Evidence, alpha: float, least: float) -> tuple[Detectable, ...]:
    """The smallest effect of each kind that would have been shown, in its own unit and in motion.

    Args:
        evidence: signatures at the plain model.
        alpha: false-alarm rate of the score tests.
        least: motion that left-out pushes would have to show [standard deviations].
    """
    plain, case = evidence.plain, evidence.case
    found = list(evidence.signatures)
    if not found:
        return ()
    threshold = _gain_needed(len(plain.pushes), plain.own_dimension, evidence.screening.looks, alpha)
    _, blocks = projected(plain, [s.columns for s in found])
    best: dict[str, Detectable] = {}
    for signature, block in zip(found, blocks, strict=True):
        amplitudes = signature.family.free[:1] if signature.one_sided[0] else signature.family.free
        for d, j in enumerate(amplitudes):
            norm = float(np.linalg.norm(block[:, d]))
            if norm < 1e-9:
                continue
            # Poses only: forces may follow them.
            poses = [c[: 3 * len(f.middles), d] for c, f in zip(signature.columns, case.features, strict=True)]
            a_step = rms(np.concatenate(poses))
            steps = max(math.sqrt(threshold) / norm, least / max(a_step, 1e-9))
            coordinate = signature.kind.chart(case.around)[j]
            point = np.array(signature.family.point)
            point[j] += steps * signature.family.size * coordinate.step
            if not coordinate.lower <= point[j] <= coordinate.upper:
                continue  # not even the strongest would have shown
            one = _detectable(case, signature.kind, point, j, steps * a_step)
            if one.name not in best or one.sigmas < best[one.name].sigmas:
                best[one.name] = one
    return tuple(best.values())


def _detectable(case: Case, kind: type[Effect], point: Array, j: int, sigmas: float) -> Detectable:
    """The effect at a chart point that left its null along coordinate j."""
    chart = kind.chart(case.around)
    within = np.array([np.clip(p, c.lower, c.upper) for p, c in zip(point, chart, strict=True)])
    effect = kind.at(within, case.around)
    numbers = {n: getattr(effect, n) for n in kind.amplitudes if isinstance(getattr(effect, n), float)}
    if not numbers:
        return Detectable(
            name=kind.name, parameter=chart[j].name, value=float(within[j]), unit="-", sigmas=sigmas
        )  # fmt: skip
    name = max(numbers, key=lambda n: abs(numbers[n] - kind.nulls()[n]))
    return Detectable(name=kind.name, parameter=name, value=numbers[name], unit=kind.units()[name], sigmas=sigmas)


def _gain_needed(pushes: int, spent: int, looks: float, alpha: float) -> float:
    """Gain at which an effect of one direction is seen with even odds."""
    wanted = math.log(alpha / (2.0 * looks))
    gains = np.linspace(0.0, 400.0, 2001)
    seen = [log_probability(float(g), 1, pushes, spent) <= wanted for g in gains]
    return float(gains[int(np.argmax(seen))]) if any(seen) else float(gains[-1])


def rms(values: Array) -> float:
    """Root mean square; NaN of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else math.nan
