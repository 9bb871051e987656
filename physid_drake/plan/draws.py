"""Models drawn from what is believed about one: its 90 % intervals, and friction's scatter from push to push."""

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
from physid_drake.identify.theta import friction_names
from physid_drake.model import Model

Array = NDArray[np.float64]

Z90 = float(stats.norm.ppf(0.95))
FURTHEST = 3.0  # standard deviations
LEAST_FRICTION = 0.01
_POSITIVE = ("mass", "hand_friction", "support_friction", "inertia_ratio", "static_ratio")


def uncertain_names(model: Model) -> list[str]:
    """What the model gives an interval for that draws can use: two numbers, not an interval for each cell."""
    names = []
    for name, interval in model.intervals.items():
        numbers = _interval(name, interval)
        if numbers is not None:
            names.append(name)
    return names


def draw_models(
    model: Model, count: int, rng: np.random.Generator, *, friction_scatter: float = 0.0
) -> tuple[Model, ...]:
    """Models from the belief that the intervals are: independent normals, log-normal where a value is positive.

    Args:
        model: with its intervals.
        count: how many.
        rng: scrambles a Sobol sequence, so that few draws cover the belief evenly.
        friction_scatter: standard deviation of one push's support friction over that of theta [-].

    Raises:
        ConfigError: if an interval is not two numbers or names what the model has not.
    """
    names = uncertain_names(model)
    if count < 1 or (not names and friction_scatter == 0.0):
        return (model,) * max(0, count)
    sobol = qmc.Sobol(len(names) + 1, scramble=True, seed=rng).random_base2(max(1, math.ceil(math.log2(count))))
    scores = np.clip(stats.norm.ppf(np.clip(sobol[:count], 1e-6, 1.0 - 1e-6)), -FURTHEST, FURTHEST)
    return tuple(_moved(model, dict(zip(names, row[:-1], strict=True)), friction_scatter * row[-1]) for row in scores)


def _interval(name: str, interval: Any) -> tuple[float, float] | None:
    if not isinstance(interval, list | tuple) or not interval:
        raise ConfigError(f"model: the interval of '{name}' must be two numbers, but is {interval!r}.")
    if isinstance(interval[0], list | tuple):
        return None
    try:
        low, high = (float(v) for v in interval)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"model: the interval of '{name}' must be two numbers, but is {interval!r}.") from error
    if not (math.isfinite(low) and math.isfinite(high) and low <= high):
        raise ConfigError(f"model: the interval of '{name}' must be finite and ordered, but is {interval!r}.")
    return low, high


def _moved(model: Model, scores: dict[str, float], scatter: float) -> Model:
    """The model with every uncertain value moved by its score, in standard deviations."""
    body, effects = model.body, {e.name: e for e in model.effects}
    for name, score in scores.items():
        owner, _, parameter = name.partition(".")
        interval = _interval(name, model.intervals[name])
        assert interval is not None

        def shift(value: float, interval: tuple[float, float] = interval, score: float = score,
                  positive: bool = owner == "theta" and parameter.startswith(_POSITIVE)) -> float:  # fmt: skip
            return _shifted(value, interval, score, positive=positive)

        if owner == "theta":
            body = _body(body, parameter, model, shift)
        elif owner in effects and hasattr(effects[owner], parameter):
            value = float(getattr(effects[owner], parameter))
            effects[owner] = dc.replace(effects[owner], **{parameter: shift(value)})
        elif owner not in effects:
            continue  # of an effect that was left out
        else:
            raise ConfigError(f"model: the interval '{name}' belongs to no parameter.")
    friction = np.maximum(LEAST_FRICTION, body.support_friction * (1.0 + scatter))
    return dc.replace(model, body=dc.replace(body, support_friction=friction), effects=tuple(effects.values()))


def _shifted(value: float, interval: tuple[float, float], score: float, *, positive: bool) -> float:
    low, high = interval
    if positive and low > 0.0 and value > 0.0:
        return value * math.exp(score * math.log(high / low) / (2.0 * Z90))
    moved = value + score * (high - low) / (2.0 * Z90)
    # An interval that stays on one side of zero is of something that has a sign.
    if low >= 0.0:
        return max(0.0, moved)
    return min(0.0, moved) if high <= 0.0 else moved


def _body(body: Body, parameter: str, model: Model, shift: Callable[[float], float]) -> Body:
    cells = friction_names((model.config.friction_cells[0], model.config.friction_cells[1]))
    if parameter in cells:
        friction = body.support_friction.copy()
        friction[cells.index(parameter)] = shift(float(friction[cells.index(parameter)]))
        return dc.replace(body, support_friction=friction)
    if parameter in ("com_x", "com_y"):
        p_BBcm = body.p_BBcm.copy()
        axis = "xy".index(parameter[-1])
        p_BBcm[axis] = shift(float(p_BBcm[axis]))
        return dc.replace(body, p_BBcm=p_BBcm)
    if parameter not in ("mass", "inertia_ratio", "hand_friction", "static_ratio", "restitution"):
        raise ConfigError(f"model: the interval 'theta.{parameter}' belongs to no parameter.")
    value = shift(float(getattr(body, parameter)))
    if parameter == "static_ratio":
        value = max(1.0, value)
    if parameter == "restitution":
        value = min(1.0, value)
    changes: dict[str, Any] = {parameter: value}
    return dc.replace(body, **changes)
