"""Posterior samples of a push: of the model's parameters, of this push's friction and of the object's start."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.stats import qmc

from physid_drake.cell import Body
from physid_drake.errors import ConfigError
from physid_drake.model import Model
from physid_drake.plan.trajectory import Situation
from physid_drake.pushes.theta import RANGES, friction_names
from physid_drake.ranges import POSITIVE, Range
from physid_drake.wording import shown

Array = NDArray[np.float64]

Z90 = float(stats.norm.ppf(0.95))
FURTHEST = 3.0  # standard deviations
LEAST_FRICTION = 0.01
FIRST_GUESS = 4.0  # pushes that the prior guess of friction's scatter counts as


def uncertain_names(model: Model) -> list[str]:
    """Names of the values that samples vary: those with an interval of two numbers.

    A name is ``theta.<name>`` or ``<effect>.<name>``.

    Raises:
        ConfigError: if an interval is neither two ordered numbers nor rows of them.
    """
    names = []
    for name, interval in model.intervals.items():
        numbers = _interval(name, interval)
        if numbers is not None:
            names.append(name)
    return names


@dc.dataclass(frozen=True, kw_only=True)
class Draw:
    """One posterior sample of a push.

    Attributes:
        model: with sampled parameters and this push's friction.
        situation: with the sampled start of the object.
    """

    model: Model
    situation: Situation


def scatter_freedom(pushes: int) -> float:
    """Degrees of freedom of an estimate of the scatter of friction from so many pushes.

    A prior guess counts as ``FIRST_GUESS`` further pushes.
    """
    return FIRST_GUESS + pushes


def draws_of(
    model: Model,
    situation: Situation,
    count: int,
    rng: np.random.Generator,
    *,
    friction_scatter: float = 0.0,
    scatter_freedom: float = math.inf,
) -> tuple[Draw, ...]:
    """Posterior samples of a push.

    Each value has its interval as 90 % interval. It is normal to either side of the estimate, or log-normal if it is
    positive or its interval is symmetric about the estimate's logarithm. A Gaussian copula with the model's
    correlation joins the values; those that it does not hold are independent. The relative deviation of this push's
    friction has Student's t distribution, that of a normal variable whose variance was estimated.

    Args:
        model: with its intervals.
        situation: where the object is seen, and with which standard deviation.
        count: number of samples.
        rng: scrambles a Sobol sequence, so that few samples cover the posterior evenly.
        friction_scatter: relative standard deviation of friction between pushes [-].
        scatter_freedom: degrees of freedom of that estimate; infinite if it is exact.

    Raises:
        ConfigError: if an interval is not two ordered numbers, or belongs to no parameter of the model.

    Source: A. Gelman et al., Bayesian Data Analysis, 3rd ed., 2013, section 3.2, for the predictive distribution; R.
    B. Nelsen, An Introduction to Copulas, 2nd ed., 2006, for the copula.
    """
    names = uncertain_names(model)
    if count < 1:
        return ()
    sobol = qmc.Sobol(len(names) + 4, scramble=True, seed=rng).random_base2(max(1, math.ceil(math.log2(count))))
    scores = stats.norm.ppf(np.clip(sobol[:count], 1e-6, 1.0 - 1e-6))
    tied = np.eye(len(names)) if model.correlation is None else model.correlation.among(names)
    estimates = np.clip(scores[:, :-4] @ root_of(tied), -FURTHEST, FURTHEST)
    own = np.clip(scores[:, -4:], -FURTHEST, FURTHEST)
    departures = friction_scatter * stats.t.ppf(stats.norm.cdf(own[:, 0]), scatter_freedom)
    starts = np.array(situation.start) + own[:, 1:] * situation.start_std
    return tuple(
        Draw(
            model=moved(model, dict(zip(names, row, strict=True)), float(departure)),
            situation=dc.replace(situation, start=(float(x), float(y), float(yaw))),
        )
        for row, departure, (x, y, yaw) in zip(estimates, departures, starts, strict=True)
    )


def root_of(correlation: Array) -> Array:
    """The symmetric square root (n, n) of a correlation (n, n), which may be singular."""
    values, vectors = np.linalg.eigh(correlation)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T)


def _interval(name: str, interval: Any) -> tuple[float, float] | None:
    if not isinstance(interval, list | tuple) or not interval:
        raise ConfigError(f"model: the interval of '{name}' must be two numbers, but is {shown(interval)}.")
    if isinstance(interval[0], list | tuple):
        return None
    try:
        low, high = (float(v) for v in interval)
    except (TypeError, ValueError) as error:
        raise ConfigError(
            f"model: the interval of '{name}' must be two numbers, but is {shown(interval)}."
        ) from error
    if not (math.isfinite(low) and math.isfinite(high) and low <= high):
        raise ConfigError(f"model: the interval of '{name}' must be finite and ordered, but is {shown(interval)}.")
    return low, high


def value_of(model: Model, name: str) -> float:
    """The model's value to which an interval belongs, by the interval's name.

    Raises:
        ConfigError: if the model has no such value.
    """
    owner, _, parameter = name.partition(".")
    if owner != "theta":
        for effect in model.effects:
            if effect.name == owner and hasattr(effect, parameter):
                return float(getattr(effect, parameter))
    elif parameter in ("com_x", "com_y"):
        return float(model.body.p_BBcm["xy".index(parameter[-1])])
    else:
        cells = friction_names((model.config.friction_cells[0], model.config.friction_cells[1]))
        if parameter in cells:
            return float(model.body.support_friction[cells.index(parameter)])
        if parameter in RANGES:
            return float(getattr(model.body, parameter))
    raise ConfigError(f"model: the interval '{name}' belongs to no parameter.")


def moved(model: Model, scores: dict[str, float], scatter: float) -> Model:
    """The model with its uncertain values at given scores.

    Args:
        model: with intervals.
        scores: by an interval's name, how many standard deviations the value is moved by.
        scatter: relative deviation of this push's friction [-].

    Raises:
        ConfigError: if an interval belongs to no parameter of the model.
    """
    body, effects = model.body, {e.name: e for e in model.effects}
    for name, score in scores.items():
        owner, _, parameter = name.partition(".")
        interval = _interval(name, model.intervals[name])
        assert interval is not None

        def shift(value: float, allowed: Range, by: tuple[tuple[float, float], float] = (interval, score)) -> float:
            return _shifted(value, *by, allowed)

        if owner == "theta":
            body = _body(body, parameter, model, shift)
        elif owner in effects and hasattr(effects[owner], parameter):
            value, allowed = float(getattr(effects[owner], parameter)), effects[owner].ranges()[parameter]
            effects[owner] = dc.replace(effects[owner], **{parameter: shift(value, allowed)})
        elif owner not in effects:
            continue  # of an effect that was left out
        else:
            raise ConfigError(f"model: the interval '{name}' belongs to no parameter.")
    friction = np.maximum(LEAST_FRICTION, body.support_friction * (1.0 + scatter))
    return dc.replace(model, body=dc.replace(body, support_friction=friction), effects=tuple(effects.values()))


def _shifted(value: float, interval: tuple[float, float], score: float, allowed: Range) -> float:
    low, high = interval
    if low > 0.0 and value > 0.0 and (allowed.above == 0.0 or _is_logarithms(value, low, high)):
        return allowed.nearest(math.exp(_drawn(math.log(value), math.log(low), math.log(high), score)))
    if high < 0.0 and value < 0.0 and _is_logarithms(-value, -high, -low):
        return allowed.nearest(-math.exp(_drawn(math.log(-value), math.log(-high), math.log(-low), -score)))
    moved = _drawn(value, low, high, score)
    # An interval on one side of zero belongs to a value whose sign is known.
    if low >= 0.0:
        return allowed.nearest(max(0.0, moved))
    return allowed.nearest(min(0.0, moved) if high <= 0.0 else moved)


def _drawn(value: float, low: float, high: float, score: float) -> float:
    """As far towards an end of an interval as the score is, from the value, or from the middle if it is beside it."""
    centre = value if low <= value <= high else 0.5 * (low + high)
    return centre + score * (high - centre if score > 0.0 else centre - low) / Z90


def _is_logarithms(value: float, low: float, high: float) -> bool:
    """Whether an interval lies about a value as one in the logarithm does."""
    return abs(math.sqrt(low * high) - value) < abs(0.5 * (low + high) - value)


def _body(body: Body, parameter: str, model: Model, shift: Callable[[float, Range], float]) -> Body:
    cells = friction_names((model.config.friction_cells[0], model.config.friction_cells[1]))
    if parameter in cells:
        friction = body.support_friction.copy()
        friction[cells.index(parameter)] = shift(float(friction[cells.index(parameter)]), POSITIVE)
        return dc.replace(body, support_friction=friction)
    if parameter not in RANGES:
        raise ConfigError(f"model: the interval 'theta.{parameter}' belongs to no parameter.")
    allowed = RANGES[parameter]
    if parameter in ("com_x", "com_y"):
        p_BBcm = body.p_BBcm.copy()
        axis = "xy".index(parameter[-1])
        p_BBcm[axis] = shift(float(p_BBcm[axis]), allowed)
        return dc.replace(body, p_BBcm=p_BBcm)
    changes: dict[str, Any] = {parameter: shift(float(getattr(body, parameter)), allowed)}
    return dc.replace(body, **changes)
