"""The named unknowns: parameters with unit, bounds, scale and prior, and the space they span."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, final

import numpy as np
import numpy.typing as npt
from scipy.stats import qmc, truncnorm

from physid_drake.errors import ParameterError

Array = npt.NDArray[np.float64]

_ROUND_OFF = 1e-9


def read_only(values: npt.ArrayLike) -> Array:
    """Copies `values` into a float array that cannot be written to."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


@final
@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One named unknown.

    Bounds, prior and unit cube all live on the parameter's *scale*: `x = theta` when `scale` is "linear",
    `x = ln(theta)` when it is "log". The prior on `x` is a normal truncated to the bounds, or uniform.

    Attributes:
        name: A Python identifier, unique in its space.
        unit: SI unit as text, "-" for a ratio, "rad" for an angle.
        lower: Least value allowed, in `unit`.
        upper: Greatest value allowed, in `unit`.
        prior_mean: Centre of the prior, in `unit`; on a log scale it is the median of the untruncated
            prior. The nominal value in any case.
        prior_std: Standard deviation of the prior on the scale: in `unit` when linear, dimensionless (of
            `ln(theta)`, about the relative uncertainty) when log. None makes the prior uniform on the scale.
        scale: "linear" or "log".
        description: One sentence for a person.

    Raises:
        ParameterError: When name, bounds, prior or scale break the rules above.
    """

    name: str
    unit: str
    lower: float
    upper: float
    prior_mean: float
    prior_std: float | None = None
    scale: Literal["linear", "log"] = "linear"
    description: str = ""

    def __post_init__(self) -> None:
        who = f"parameter '{self.name}'"
        if not self.name.isidentifier():
            raise ParameterError(f"{who}: a name is a Python identifier; use letters, digits and '_'.")
        if self.scale not in ("linear", "log"):
            raise ParameterError(f"{who}: scale is 'linear' or 'log', but got '{self.scale}'.")
        if not (np.isfinite(self.lower) and np.isfinite(self.upper) and self.lower < self.upper):
            raise ParameterError(
                f"{who}: bounds are finite with lower < upper, but got {self.lower} and {self.upper}"
                f" {self.unit}; swap or widen them."
            )
        if self.scale == "log" and self.lower <= 0.0:
            raise ParameterError(
                f"{who}: a log scale needs lower > 0, but got {self.lower} {self.unit};"
                " raise the bound or use scale 'linear'."
            )
        if not self.lower <= self.prior_mean <= self.upper:
            raise ParameterError(
                f"{who}: prior_mean lies in [{self.lower}, {self.upper}] {self.unit}, but got"
                f" {self.prior_mean} {self.unit}; move it or widen the bounds."
            )
        if self.prior_std is not None and not (np.isfinite(self.prior_std) and self.prior_std > 0.0):
            raise ParameterError(
                f"{who}: prior_std is positive, but got {self.prior_std}; use None for a uniform prior."
            )

    def to_scale(self, value: npt.ArrayLike) -> Array:
        """Value in `unit` (any shape) to the coordinate `x` on the scale."""
        array = np.asarray(value, dtype=np.float64)
        return np.log(array) if self.scale == "log" else array

    def from_scale(self, x: npt.ArrayLike) -> Array:
        """Coordinate `x` on the scale (any shape) to the value in `unit`, kept inside the bounds."""
        array = np.asarray(x, dtype=np.float64)
        return np.clip(np.exp(array) if self.scale == "log" else array, self.lower, self.upper)


@final
@dataclass(frozen=True, kw_only=True)
class ParameterSpace:
    """A box of named parameters; a point in it is `theta` (d,), each entry in its parameter's unit.

    Attributes:
        parameters: At least one, names unique; their order is the order of `theta`.
        correlation: Of the normal priors on their scales, (d, d) as rows, before truncation; 0 between a uniform
            prior and any other. Empty where the priors are independent.

    Raises:
        ParameterError: When empty, when a name occurs twice, or when the correlation is none.
    """

    parameters: tuple[Parameter, ...]
    correlation: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", tuple(self.parameters))
        object.__setattr__(self, "correlation", tuple(tuple(float(v) for v in row) for row in self.correlation))
        if not self.parameters:
            raise ParameterError("parameter space: at least one parameter is needed, but got none.")
        for name in self.names:
            if self.names.count(name) > 1:
                raise ParameterError(
                    f"parameter '{name}': names are unique in a space, but it occurs"
                    f" {self.names.count(name)} times; rename or drop one."
                )
        if self.correlation:
            self._check_correlation()

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter names in the order of `theta`."""
        return tuple(p.name for p in self.parameters)

    @property
    def dimension(self) -> int:
        """Number of parameters d."""
        return len(self.parameters)

    @cached_property
    def nominal(self) -> Array:
        """The prior means (d,), each in its unit."""
        return read_only([p.prior_mean for p in self.parameters])

    @cached_property
    def lower(self) -> Array:
        """Lower bounds (d,), each in its unit."""
        return read_only([p.lower for p in self.parameters])

    @cached_property
    def upper(self) -> Array:
        """Upper bounds (d,), each in its unit."""
        return read_only([p.upper for p in self.parameters])

    @cached_property
    def _scale_lower(self) -> Array:
        return read_only([p.to_scale(p.lower) for p in self.parameters])

    @cached_property
    def _scale_width(self) -> Array:
        return read_only([p.to_scale(p.upper) - p.to_scale(p.lower) for p in self.parameters])

    @cached_property
    def prior_std_unit(self) -> Array:
        """Prior standard deviations (d,) in the unit cube, each parameter's own; a uniform one's is 1/sqrt(12)."""
        stds = [math.inf if p.prior_std is None else p.prior_std for p in self.parameters]
        return read_only(np.where(np.isinf(stds), 1.0 / math.sqrt(12.0), stds / self._scale_width))

    def index(self, name: str) -> int:
        """Position of parameter `name` in `theta`.

        Raises:
            ParameterError: When no parameter has this name.
        """
        if name not in self.names:
            raise ParameterError(f"parameter '{name}' is unknown; this space has {', '.join(self.names)}.")
        return self.names.index(name)

    def check(self, theta: npt.ArrayLike) -> None:
        """Accepts a point (d,) or points (..., d) inside the bounds.

        Raises:
            ParameterError: When the last axis is not d long, or a value is outside its bounds or not finite.
        """
        thetas = self._shaped(theta)
        inside = (thetas >= self.lower) & (thetas <= self.upper)
        if inside.all():
            return
        first = tuple(np.argwhere(~inside)[0])
        p = self.parameters[first[-1]]
        where = f" of point {first[0]}" if thetas.ndim > 1 else ""
        raise ParameterError(
            f"parameter '{p.name}'{where}: must lie in [{p.lower:g}, {p.upper:g}] {p.unit}, but is"
            f" {thetas[first]:.10g} {p.unit}; move the point inside or widen the bounds."
        )

    def to_unit(self, thetas: npt.ArrayLike) -> Array:
        """Points (..., d) to the unit cube (..., d), linear on each parameter's scale.

        Raises:
            ParameterError: As `check`.
        """
        self.check(thetas)
        u = (self._to_scale(self._shaped(thetas)) - self._scale_lower) / self._scale_width
        return np.clip(u, 0.0, 1.0)

    def from_unit(self, u: npt.ArrayLike) -> Array:
        """Points of the unit cube (..., d) to thetas (..., d), each entry in its unit.

        Raises:
            ParameterError: When the last axis is not d long or an entry is outside [0, 1] beyond round-off.
        """
        unit = self._shaped(u)
        if not np.all((unit >= -_ROUND_OFF) & (unit <= 1.0 + _ROUND_OFF)):
            raise ParameterError(
                f"unit cube: entries lie in [0, 1], but got {unit.min():g} to {unit.max():g}; clip first."
            )
        return self._from_scale(self._scale_lower + np.clip(unit, 0.0, 1.0) * self._scale_width)

    def sample(self, rng: np.random.Generator, n: int, *, from_prior: bool) -> Array:
        """Draws `n` space-filling points: scrambled Sobol, mapped through the inverse prior cdf if asked.

        Args:
            rng: Scrambles the sequence; the same state gives the same points.
            n: Number of points, at least 1.
            from_prior: True follows the prior, False is uniform on each parameter's scale.

        Returns:
            Thetas (n, d), each entry in its unit.

        Raises:
            ParameterError: When `n` < 1.
        """
        if n < 1:
            raise ParameterError(f"sample: n is at least 1, but got {n}.")
        sobol = qmc.Sobol(self.dimension, scramble=True, seed=rng)
        u: Array = sobol.random_base2(int(np.ceil(np.log2(n))))[:n]
        return self._from_scale(self._inverse_prior_cdf(u)) if from_prior else self.from_unit(u)

    def as_dict(self, theta: npt.ArrayLike) -> dict[str, float]:
        """Point (d,) as a mapping from name to value in its unit.

        Raises:
            ParameterError: As `check`, or when `theta` is not one point.
        """
        self.check(theta)
        point = self._shaped(theta)
        if point.ndim != 1:
            raise ParameterError(f"as_dict: takes one point ({self.dimension},), but got {point.shape}.")
        return {name: float(value) for name, value in zip(self.names, point, strict=True)}

    def _shaped(self, values: npt.ArrayLike) -> Array:
        array = np.asarray(values, dtype=np.float64)
        if array.ndim == 0 or array.shape[-1] != self.dimension:
            raise ParameterError(
                f"point: the last axis has {self.dimension} entries ({', '.join(self.names)}), but the shape"
                f" is {array.shape}; give one value per parameter."
            )
        return array

    def _to_scale(self, thetas: Array) -> Array:
        return np.stack([p.to_scale(thetas[..., i]) for i, p in enumerate(self.parameters)], axis=-1)

    def _from_scale(self, xs: Array) -> Array:
        return np.stack([p.from_scale(xs[..., i]) for i, p in enumerate(self.parameters)], axis=-1)

    @cached_property
    def _factor(self) -> Array:
        """Lower Cholesky factor (d, d) of the priors' correlation."""
        return np.asarray(np.linalg.cholesky(np.array(self.correlation)))

    def _check_correlation(self) -> None:
        matrix = np.array(self.correlation, dtype=object)
        if matrix.shape != (self.dimension, self.dimension):
            raise ParameterError(
                f"correlation: needs {self.dimension} rows of {self.dimension} numbers, but its shape is"
                f" {matrix.shape}."
            )
        values = matrix.astype(np.float64)
        symmetric = np.array_equal(values, values.T) and np.array_equal(np.diag(values), np.ones(self.dimension))
        if not symmetric or np.linalg.eigvalsh(values)[0] <= 0.0:
            raise ParameterError("correlation: must be symmetric, 1 on its diagonal and positive definite.")
        uniform = [p.prior_std is None for p in self.parameters]
        if np.any(values[uniform] != np.eye(self.dimension)[uniform]):
            raise ParameterError("correlation: a uniform prior is correlated with nothing; give it a prior_std.")

    def _truncated(self, i: int) -> Any:
        p = self.parameters[i]
        mean, std = float(p.to_scale(p.prior_mean)), p.prior_std or 1.0
        low = (self._scale_lower[i] - mean) / std
        return truncnorm(low, low + self._scale_width[i] / std, loc=mean, scale=std)

    def _inverse_prior_cdf(self, u: Array) -> Array:
        if self.correlation:
            return self._tied_inverse_cdf(u)
        xs = self._scale_lower + u * self._scale_width
        for i, p in enumerate(self.parameters):
            if p.prior_std is not None:
                xs[:, i] = self._truncated(i).ppf(u[:, i])
        return np.asarray(xs)

    def _tied_inverse_cdf(self, u: Array) -> Array:
        """Points (n, d) on the scale from u (n, d): each parameter's normal given those before it, cut to its bounds.

        That is the truncated normal itself but for the chance that later bounds leave an earlier value, which is
        neglected.

        Source: the sequential sampler of Geweke, Hajivassiliou and Keane, as in Genz, JCGS 1, 1992.
        """
        xs = self._scale_lower + u * self._scale_width
        scores = np.zeros_like(xs)
        for i, p in enumerate(self.parameters):
            if p.prior_std is None:
                continue
            mean = p.to_scale(p.prior_mean) + p.prior_std * (scores[:, :i] @ self._factor[i, :i])
            std = p.prior_std * self._factor[i, i]
            low = (self._scale_lower[i] - mean) / std
            scores[:, i] = truncnorm.ppf(u[:, i], low, low + self._scale_width[i] / std)
            xs[:, i] = mean + std * scores[:, i]
        return np.asarray(xs)
