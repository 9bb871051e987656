"""Estimates of theta with 90 % intervals, from the fit of any hypothesis."""

from __future__ import annotations

import dataclasses as dc
import math

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.inference.fit import Fit, Fitter
from physid_drake.pushes.theta import cell_error, range_of
from physid_drake.space import Parameter, ParameterSpace

Array = NDArray[np.float64]

Z90 = float(stats.norm.ppf(0.95))
MOST_PRIOR_LEFT = 0.5  # posterior over prior standard deviation, below which a parameter is identifiable
AT_BOUND = 2e-3  # of the unit cube


@dc.dataclass(frozen=True, kw_only=True)
class Estimate:
    """The estimate of one parameter of theta.

    Attributes:
        name: of the parameter.
        unit: of the values.
        value: the estimate.
        ci90: 90 % interval; of a parameter that is not identifiable, no wider than the prior's.
        identifiable: whether the posterior standard deviation is less than ``MOST_PRIOR_LEFT`` of the prior's.
        prior: the prior's value.
        at_bound: whether the value is at a bound of the search that physics does not set: the true one may lie
            beyond.
    """

    name: str
    unit: str
    value: float
    ci90: tuple[float, float]
    identifiable: bool
    prior: float
    at_bound: bool = False


def t_factor(fit: Fit) -> float:
    """Width of a 90 % interval of Student's t over that of a normal distribution.

    The degrees of freedom are pushes less coordinates that rollouts depend on, at least 2.
    """
    free = max(2, len(fit.pushes) - fit.hypothesis.simulated)
    return float(stats.t.ppf(0.95, free)) / Z90


def estimates_of(fitter: Fitter, fit: Fit) -> tuple[Estimate, ...]:
    """Estimates of theta, by the curvature of the posterior with the nuisance parameters integrated out.

    An interval is that of Student's t for so few pushes, with the simulator's own error added, which all pushes
    share. Of a parameter that is not identifiable it is the prior's where that is uniform.

    Args:
        fitter: of the fit.
        fit: of any hypothesis.
    """
    h = fit.hypothesis
    space, u, here = h.space, fit.point.z[: h.space.dimension], h.theta(fit.point.z)
    stds = np.sqrt(np.diag(fitter.covariance(fit)))
    made = []
    for j, parameter in enumerate(space.parameters):
        narrowed = bool(stds[j] < MOST_PRIOR_LEFT * h.std[j])
        if narrowed or parameter.prior_std is not None:
            reach = Z90 * min(math.hypot(t_factor(fit) * stds[j], cell_error(space, here, j)), h.std[j])
            ends = max(0.0, u[j] - reach), min(1.0, u[j] + reach)
        else:
            ends = min(0.05, u[j]), max(0.95, u[j])  # of a uniform prior, and where the value is
        low, high = (_moved(space, u, j, end) for end in ends)
        made.append(Estimate(
            name=parameter.name, unit=parameter.unit, value=float(here[j]), ci90=(low, high), identifiable=narrowed,
            prior=parameter.prior_mean, at_bound=_may_lie_beyond(parameter, float(u[j])),
        ))  # fmt: skip
    return tuple(made)


def _moved(space: ParameterSpace, u: Array, j: int, value: float) -> float:
    """Parameter j of the point u (d,) of the unit cube with its entry j moved to ``value``."""
    point = u.copy()
    point[j] = value
    return float(space.from_unit(point)[j])


def _may_lie_beyond(parameter: Parameter, place: float) -> bool:
    """Whether a value, at a place in its bounds from 0 to 1, is at one that the search chose, and not physics."""
    beyond = range_of(parameter.name)
    low = place < AT_BOUND and parameter.lower > max(beyond.above, beyond.least)
    return low or (place > 1.0 - AT_BOUND and parameter.upper < min(beyond.most, beyond.below))
