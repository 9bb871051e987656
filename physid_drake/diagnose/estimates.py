"""Values with intervals: of effects, of theta, and of the smallest effect that would have been detected."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.diagnose.decide import CONFIRMED
from physid_drake.diagnose.search import Found
from physid_drake.diagnose.values import Detectable, ParameterEstimate, ThetaEstimate
from physid_drake.effects import Coordinate, Effect, Surroundings
from physid_drake.identify.accuracy import rms
from physid_drake.identify.estimates import estimates_of, t_factor
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.hypothesis import Hypothesis, Part
from physid_drake.inference.push import weighed
from physid_drake.inference.replicates import gain_of
from physid_drake.inference.scores import Column
from physid_drake.pushes.case import Case
from physid_drake.pushes.theta import CELL_ERROR

Array = NDArray[np.float64]

SAMPLES = 400  # of an effect's chart, for the intervals of its parameters
JOINT_SAMPLES = 2000  # of theta and all charts, for how the estimates vary together
# Of its standard deviation: below, an amplitude may be nothing. What is known over an unweighed mass only is above.
DOUBTFUL = 0.5


def coordinates_of(h: Hypothesis, k: int) -> slice:
    """Slice of z that holds the free coordinates of effect ``k``."""
    begin = h.space.dimension + sum(len(part.free) for part in h.parts[:k])
    return slice(begin, begin + len(h.parts[k].free))


def parameters_of(fitter: Fitter, fit: Fit, k: int) -> dict[str, ParameterEstimate]:
    """Values and 90 % intervals of effect ``k``'s parameters, by samples of its coordinates."""
    h, part = fit.hypothesis, fit.hypothesis.parts[k]
    here, some = h.points(fit.point.z)[k], coordinates_of(h, k)
    seen = t_factor(fit) ** 2 * fitter.covariance(fit)[some, some]
    covariance = seen + np.diag(_own_error(part, here, h) ** 2)
    rng = np.random.default_rng(0)
    draws = rng.multivariate_normal(np.zeros(len(part.free)), covariance, SAMPLES, method="eigh")
    drawn = [_moved(part, here, h, d) for d in _more_than_nothing(part, here, h, draws)]
    effect = part.kind.at(here, h.around)
    return {
        name: ParameterEstimate(
            value=_plain(getattr(effect, name)),
            unit=unit,
            ci90=_interval(effect, name, [getattr(d, name) for d in drawn]),
            null=_plain(effect.nulls()[name]),
        )
        for name, unit in effect.units().items()
    }


def _moved(part: Part, here: Array, h: Hypothesis, change: Array) -> Effect:
    """The effect with its free coordinates moved, within their bounds."""
    point, chart = here.copy(), part.kind.chart(h.around)
    for j, step in zip(part.free, change.tolist(), strict=True):
        point[j] = float(np.clip(point[j] + step, chart[j].lower, chart[j].upper))
    return part.kind.at(point, h.around)


def _own_error(part: Part, here: Array, h: Hypothesis) -> Array:
    """The cell's own error (k,) of free coordinates: a share of an amplitude, or of a speed, size or frequency.

    Of a place, that share of what lies between two places that are looked at.
    """
    chart = part.kind.chart(h.around)
    return CELL_ERROR * np.array([_amount(chart[j], float(here[j])) for j in part.free])


def _amount(coordinate: Coordinate, value: float) -> float:
    if np.isinf(coordinate.std):
        return abs(value)
    return 1.0 if coordinate.log else coordinate.std


def _more_than_nothing(part: Part, here: Array, h: Hypothesis, moves: Array) -> Array:
    """Moves (n, k) of free coordinates; those of an amplitude that cannot be negative are made in its logarithm.

    An effect that is surely there is more than nothing, however little is known of its size: a drag, say, over a mass
    that nobody weighed. Little changes where an amplitude is well known, and nothing where it is doubtful.
    """
    made, chart = moves.copy(), part.kind.chart(h.around)
    for k, j in enumerate(part.free):
        coordinate, value = chart[j], here[j]
        one_sided = coordinate.name in part.kind.amplitudes and coordinate.lower == 0.0 and not coordinate.log
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


def theta_of(fitter: Fitter, fit: Fit, plain: Fit) -> dict[str, ThetaEstimate]:
    """Estimates of theta.

    Args:
        fitter: of the fits.
        fit: the model whose theta is reported.
        plain: the baseline model, for the values before.
    """
    before = plain.hypothesis.theta(plain.point.z)
    return {
        e.name: ThetaEstimate(value=e.value, unit=e.unit, ci90=e.ci90, identifiable=e.identifiable, before=float(was))
        for e, was in zip(estimates_of(fitter, fit), before, strict=True)
    }


def correlation_of(fitter: Fitter, fit: Fit) -> tuple[tuple[str, ...], Array]:
    """How a model's estimates vary together, by samples of theta and of the effects' coordinates.

    Returns:
        Names ``theta.<name>`` and ``<effect>.<parameter>`` of all estimates that are single numbers and vary, and the
        correlation (n, n) of their normal scores: the parameter of a Gaussian copula.
    """
    h, rng = fit.hypothesis, np.random.default_rng(0)
    count = h.simulated
    covariance = fitter.covariance(fit)[:count, :count]
    moves = rng.multivariate_normal(np.zeros(count), covariance, JOINT_SAMPLES, method="eigh") * t_factor(fit)
    drawn: dict[str, Array] = {f"theta.{name}": moves[:, j] for j, name in enumerate(h.space.names)}
    for k, (part, here) in enumerate(zip(h.parts, h.points(fit.point.z), strict=True)):
        effect = part.kind.at(here, h.around)
        some = _more_than_nothing(part, here, h, moves[:, coordinates_of(h, k)])
        effects = [_moved(part, here, h, move) for move in some]
        for name in effect.units():
            if isinstance(getattr(effect, name), float):
                drawn[f"{effect.name}.{name}"] = _near(effect, name, [getattr(one, name) for one in effects])
    varying = {name: values for name, values in drawn.items() if np.ptp(values) > 0.0}
    scores = [stats.norm.ppf((stats.rankdata(v) - 0.5) / len(v)) for v in varying.values()]
    return tuple(varying), np.atleast_2d(np.corrcoef(scores)) if scores else np.zeros((0, 0))


def smallest(found: Found) -> tuple[Detectable, ...]:
    """The smallest effect of each kind that would have been detected, in the unit of its parameter and as motion."""
    best: dict[str, Detectable] = {}
    for column, size in _sizes(found):
        one = _detectable(found, column, size)
        if one is not None and (one.name not in best or one.sigmas < best[one.name].sigmas):
            best[one.name] = one
    return tuple(best.values())


def least_motions(found: Found) -> dict[str, float]:
    """By kind: how far the object moves at least, where it would have been detected [standard deviations].

    Infinite of what would not have been detected at its strongest.
    """
    motions = dict.fromkeys((column.kind.name for column in found.columns), math.inf)
    for column, size in _sizes(found):
        name = column.kind.name
        motions[name] = min(motions[name], size * _motion(found, column))
    return motions


def _sizes(found: Found) -> list[tuple[Column, float]]:
    """Columns that would have been detected within their bounds, each with the size from which on.

    Half the information about its amplitude times the amplitude squared is the expected gain. The smallest amplitude
    is the one whose expected gain, with one push not counted, reaches what is needed to confirm the effect; it is
    confirmed with a probability of about one half.
    """
    pushes = len(found.baseline.pushes)
    counted = max(1, pushes - 1) / pushes
    sizes = []
    for column, information in zip(found.columns, _informations(found), strict=True):
        if information <= 0.0 or column.family.shares:
            continue
        needed = gain_of(-math.log(CONFIRMED), found.by_chance[column.kind.name]) / counted
        size = math.sqrt(2.0 * needed / information)
        # A one-sided amplitude can only grow; the others are the same either way.
        if column.coordinate.lower <= column.null + size <= column.coordinate.upper:
            sizes.append((column, size))
    return sizes


def _informations(found: Found) -> list[float]:
    """Of each column's amplitude: its precision, what theta and the per-push parameters imitate taken out."""
    fitter, fit = found.fitter, found.baseline
    n, count = fit.hypothesis.dimension, len(found.columns)
    precision = np.zeros((n + count,) * 2)
    precision[:n, :n] = fit.hypothesis.precision
    for i, (push, prior) in enumerate(zip(fit.pushes, fitter.priors(fit.scatter), strict=True)):
        shared = np.column_stack([push.shared, *(c.pushes[i] for c in found.columns)])
        precision += weighed(push.residual, shared, push.nuisance, prior, fit.noise_scale, fit.tail).precision
    imitated = np.linalg.pinv(precision[:n, :n])
    return [
        float(precision[n + k, n + k] - precision[n + k, :n] @ imitated @ precision[:n, n + k]) for k in range(count)
    ]


def _detectable(found: Found, column: Column, size: float) -> Detectable | None:
    """The effect of a column's size; None where its amplitude is none.

    A pull that is even over the table makes a tether of any stiffness, however little, whose end is far enough away.
    """
    around, kind = found.fitter.case.around, column.kind
    sigmas = size * _motion(found, column)
    numbers, half = (_amplitudes(kind, _point(column, part * size, around), around) for part in (1.0, 0.5))
    if not numbers:
        return Detectable(
            name=kind.name, parameter=column.coordinate.name, value=column.null + size, unit="-", sigmas=sigmas
        )
    name = max(numbers, key=lambda n: abs(numbers[n] - kind.nulls()[n]))
    if numbers[name] == half[name]:
        return None
    return Detectable(name=kind.name, parameter=name, value=numbers[name], unit=kind.units()[name], sigmas=sigmas)


def _point(column: Column, size: float, around: Surroundings) -> Array:
    """Where in the chart a column of some size leads."""
    point = np.array(column.family.point)
    point[column.index] += size
    chart = column.kind.chart(around)
    return np.array([np.clip(p, c.lower, c.upper) for p, c in zip(point, chart, strict=True)])


def _amplitudes(kind: type[Effect], point: Array, around: Surroundings) -> dict[str, float]:
    """Those that are one number."""
    effect = kind.at(point, around)
    return {name: getattr(effect, name) for name in kind.amplitudes if isinstance(getattr(effect, name), float)}


def _motion(found: Found, column: Column) -> float:
    """How far the object moves for a unit of a column, root mean square over all windows [standard deviations]."""
    case: Case = found.fitter.case
    poses = [
        np.linalg.solve(w, pushed)[: f.pose_numbers]
        for w, pushed, f in zip(found.fitter.predictor.whitening, column.pushes, case.features, strict=True)
    ]
    return rms(np.concatenate(poses))
