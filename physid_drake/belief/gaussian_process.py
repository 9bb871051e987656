"""A Gaussian process on the unit cube: Matern-3/2, one length per dimension, and fast joint samples."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property, wraps
from typing import Any, ParamSpec, TypeVar, final

import numpy as np
import numpy.typing as npt
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import Bounds, minimize
from scipy.special import ndtr
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]  # ships no types

from physid_drake.errors import ParameterError
from physid_drake.space import Array, read_only

AMPLITUDE_BOUNDS = (0.05, 20.0)
LENGTH_BOUNDS = (0.05, 20.0)
NOISE_BOUNDS = (1e-6, 1e-1)
_FEWEST_TO_FIT = 4
_JITTER = 1e-10
_LARGEST = 1e150  # of a target: its square is a number
_LOG_LENGTH_VARIANCE = 3.0

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


@cache
def _threadpools() -> Any:
    return ThreadpoolController()


def _on_one_core(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Keeps BLAS on one core: many small solves lose time in threads, and rounding depends on them."""

    @wraps(function)
    def limited(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
        with _threadpools().limit(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return limited


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class Hyperparameters:
    """Hyperparameters of the kernel, for targets with mean 0 and variance 1 on the unit cube.

    Attributes:
        amplitude: Variance of the function, dimensionless.
        lengths: Lengths (d,) in widths of the unit cube.
        noise: Variance of what the kernel cannot follow, dimensionless.
    """

    amplitude: float
    lengths: Array
    noise: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "lengths", read_only(self.lengths))

    @classmethod
    def default(cls, dimension: int) -> "Hyperparameters":
        """Where nothing is known: lengths at the mode of the prior of `fit`, little noise."""
        length = np.clip(np.exp(_log_length_mode(dimension)), *LENGTH_BOUNDS)
        return cls(amplitude=1.0, lengths=np.full(dimension, length), noise=1e-4)


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class GaussianProcess:
    """A Gaussian process conditioned on trials.

    Attributes:
        u: Where it was tried (m, d), in the unit cube; m may be 0, which is the prior.
        targets: Finite values there (m,), any unit; standardised inside.
        hyperparameters: Kernel hyperparameters for the standardised targets.
        n_at_fit: Number of trials when the hyperparameters were last fitted; 0 for never.

    Raises:
        ParameterError: When shapes disagree or a target is not finite.

    Source: Rasmussen and Williams, "Gaussian Processes for Machine Learning", 2006, algorithm 2.1 and
        equation 4.17 with nu = 3/2.
    """

    u: Array
    targets: Array
    hyperparameters: Hyperparameters
    n_at_fit: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "u", read_only(self.u))
        object.__setattr__(self, "targets", read_only(self.targets))
        d = len(self.hyperparameters.lengths)
        if self.u.ndim != 2 or self.u.shape != (len(self.targets), d):
            raise ParameterError(
                f"gaussian process: u is (m, {d}) for m targets, but got {self.u.shape} for {self.targets.shape}."
            )
        if not (np.abs(self.targets) < _LARGEST).all():
            raise ParameterError(
                "gaussian process: targets are finite, and so are their squares; give failed trials a high value."
            )

    @property
    def offset(self) -> float:
        """Mean of the targets, in their unit."""
        return float(self.targets.mean()) if len(self.targets) else 0.0

    @property
    def scale(self) -> float:
        """Standard deviation of the targets in their unit; 1 where they are all equal."""
        spread = float(self.targets.std()) if len(self.targets) else 0.0
        return spread if spread > 1e-12 * max(1.0, abs(self.offset)) else 1.0

    @property
    def noise_variance(self) -> float:
        """Variance of one target about the function, in the targets' unit squared."""
        return float(self.scale**2 * (self.hyperparameters.noise + _JITTER))

    @cached_property
    def _residuals(self) -> Array:
        return np.asarray((self.targets - self.offset) / self.scale)

    @cached_property
    def _factor(self) -> Array:
        gram = matern32(self.u, self.u, self.hyperparameters)
        gram[np.diag_indices_from(gram)] += self.hyperparameters.noise + _JITTER
        return np.asarray(cholesky(gram, lower=True)) if len(gram) else np.zeros((0, 0))

    def _solve(self, rhs: Array) -> Array:
        return np.asarray(
            solve_triangular(self._factor.T, solve_triangular(self._factor, rhs, lower=True), lower=False)
        )

    @_on_one_core
    def predict(self, u: Array) -> tuple[Array, Array]:
        """Posterior mean (n,) and standard deviation (n,) at u (n, d), noise-free, in the targets' unit."""
        variance = np.full(len(u), self.hyperparameters.amplitude)
        if not len(self.targets):
            return np.full(len(u), self.offset), self.scale * np.sqrt(variance)
        cross = matern32(u, self.u, self.hyperparameters)
        half = solve_triangular(self._factor, cross.T, lower=True)
        variance = variance - np.einsum("ij,ij->j", half, half)
        mean = cross @ self._solve(self._residuals)
        return self.offset + self.scale * mean, self.scale * np.sqrt(np.maximum(variance, 0.0))

    @_on_one_core
    def covariance(self, u: Array, other: Array) -> Array:
        """Posterior covariance (n, k) between u (n, d) and other (k, d), in the targets' unit squared."""
        prior = matern32(u, other, self.hyperparameters)
        if len(self.targets):
            left = solve_triangular(self._factor, matern32(self.u, u, self.hyperparameters), lower=True)
            right = solve_triangular(self._factor, matern32(self.u, other, self.hyperparameters), lower=True)
            prior = prior - left.T @ right
        return np.asarray(self.scale**2 * prior)

    @_on_one_core
    def sample_exact(self, u: Array, n_samples: int, rng: np.random.Generator) -> Array:
        """Joint posterior samples (s, n) at u (n, d) by Cholesky, in the targets' unit; cost O(n^3 + s n^2).

        Jitter starts at 1e-10 of the prior variance and grows tenfold until the factorisation succeeds.
        """
        covariance = self.covariance(u, u) / self.scale**2
        factor = _cholesky_with_jitter(covariance, self.hyperparameters.amplitude)
        mean, _ = self.predict(u)
        return np.asarray(mean + self.scale * (rng.standard_normal((n_samples, len(u))) @ factor.T))

    @_on_one_core
    def sample_pathwise(
        self, u: Array, n_samples: int, rng: np.random.Generator, n_features: int = 512
    ) -> npt.NDArray[np.float32]:
        """Joint posterior samples (s, n) at u (n, d), in the targets' unit; cost O(s n (features + m)).

        Matern paths are drawn from the prior as random Fourier features and corrected by Matheron's rule,
        f + K_*X (K + noise)^-1 (y - f(X) - eps), so that the correction is exact and only the prior is
        approximate: its covariance is off by about n_features^-1/2 of the amplitude, afresh in every call.
        Single precision for the paths, double for the correction.

        Args:
            u: Points (n, d) in the unit cube.
            n_samples: Number of functions s.
            rng: Draws frequencies, weights and noise.
            n_features: Number of random features, even; half are cosines, half are sines.

        Source: Wilson et al., "Efficiently Sampling Functions from Gaussian Process Posteriors", ICML 2020,
            equations 12 and 13; Rahimi and Recht 2007 for the features. The spectral density of Matern-3/2
            is a multivariate t with 3 degrees of freedom.
        """
        hyper, d = self.hyperparameters, u.shape[1]
        n_pairs = n_features // 2
        frequencies = rng.standard_normal((n_pairs, d)) / hyper.lengths
        frequencies /= np.sqrt(rng.chisquare(3.0, size=(n_pairs, 1)) / 3.0)
        weights = rng.standard_normal((n_samples, 2 * n_pairs)) * np.sqrt(hyper.amplitude / n_pairs)
        paths = weights.astype(np.float32) @ _features(u.astype(np.float32), frequencies.astype(np.float32))
        if len(self.targets):
            noise = rng.standard_normal((n_samples, len(self.targets))) * np.sqrt(hyper.noise + _JITTER)
            prior_at_trials = weights @ _features(self.u, frequencies)
            update = self._solve((self._residuals - prior_at_trials - noise).T)
            paths += update.T @ matern32(self.u, u, hyper)
        paths *= np.float32(self.scale)
        paths += np.float32(self.offset)
        return np.asarray(paths, dtype=np.float32)

    def sample(
        self, u: Array, n_samples: int, rng: np.random.Generator, *, exact_limit: int = 1000
    ) -> npt.NDArray[np.floating[Any]]:
        """Joint posterior samples (s, n) at u (n, d): exact up to `exact_limit` points, else pathwise."""
        if len(u) <= exact_limit:
            return self.sample_exact(u, n_samples, rng)
        return self.sample_pathwise(u, n_samples, rng)

    def possible_minima(self, u: Array, tolerance: float, limit: int | None = None) -> npt.NDArray[np.intp]:
        """Indices, ascending, of the points of u (n, d) that may be the minimiser.

        The others are each below the point of least mean with so little probability that their sum, which
        bounds the probability that the minimiser is among them, is at most `tolerance`. With a `limit` no more
        points than that are left, the likeliest, and the bound no longer holds.
        """
        below = self.probability_below_best(u)
        order = np.argsort(below, kind="stable")
        n_dropped = int(np.searchsorted(np.cumsum(below[order]), tolerance, side="right"))
        n_dropped = max(n_dropped, 0 if limit is None else len(u) - limit)
        return np.sort(order[n_dropped:])

    def probability_below_best(self, u: Array) -> Array:
        """Probability (n,) that f at each point of u (n, d) is below f at the point of least mean.

        That point itself, and any other that cannot be told from it, gets 1/2.
        """
        mean, std = self.predict(u)
        best = int(np.argmin(mean))
        shared = self.covariance(u, u[best : best + 1])[:, 0]
        variance = np.maximum(std**2 + std[best] ** 2 - 2.0 * shared, 0.0)
        gap = mean - mean[best]
        floor = 1e-12 * self.scale
        z = gap / np.maximum(np.sqrt(variance), floor)
        return np.asarray(ndtr(-z))


def matern32(a: Array, b: Array, hyperparameters: Hyperparameters) -> Array:
    """Matern-3/2 covariance (n, k) between a (n, d) and b (k, d), one length per dimension, without noise.

    Source: Rasmussen and Williams 2006, equation 4.17.
    """
    scaled_a, scaled_b = a / hyperparameters.lengths, b / hyperparameters.lengths
    squares = np.add.outer(np.sum(scaled_a**2, axis=1), np.sum(scaled_b**2, axis=1))
    squares -= 2.0 * (scaled_a @ scaled_b.T)
    r = np.sqrt(3.0 * np.maximum(squares, 0.0))
    return np.asarray(hyperparameters.amplitude * (1.0 + r) * np.exp(-r))


@_on_one_core
def fit(
    u: Array, targets: Array, rng: np.random.Generator, *, n_restarts: int = 2, length_prior: bool = True
) -> GaussianProcess:
    """Fits the hyperparameters to trials by type-II maximum likelihood within bounds.

    With fewer trials than parameters the likelihood alone switches most dimensions off or makes them
    needles; `length_prior` adds a log-normal prior on the lengths that grows with the square root of the
    dimension, which makes it a maximum a posteriori fit. Fewer than four trials: the default
    hyperparameters, not fitted.

    Args:
        u: Where it was tried (m, d), in the unit cube.
        targets: Finite values there (m,), any unit.
        rng: Draws the starting points of the restarts.
        n_restarts: Optimiser runs beside the one from the default.
        length_prior: False is type-II maximum likelihood alone.

    Raises:
        ParameterError: When shapes disagree or a target is not finite.

    Source: Rasmussen and Williams 2006, section 5.4.1; Hvarfner, Hellsten, Nardi, "Vanilla Bayesian
        Optimization Performs Great in High Dimensions", ICML 2024, section 5, for the prior.
    """
    start = Hyperparameters.default(u.shape[1])
    unfitted = GaussianProcess(u=u, targets=targets, hyperparameters=start)
    if len(targets) < _FEWEST_TO_FIT:
        return unfitted
    kernel = ConstantKernel(start.amplitude, AMPLITUDE_BOUNDS)
    kernel *= Matern(start.lengths, LENGTH_BOUNDS, nu=1.5)
    kernel += WhiteKernel(start.noise, NOISE_BOUNDS)
    regressor = GaussianProcessRegressor(
        kernel,
        alpha=_JITTER,
        optimizer=_penalised_optimizer(u.shape[1]) if length_prior else _penalised_optimizer(0),
        n_restarts_optimizer=n_restarts,
        random_state=int(rng.integers(2**31)),
    )
    with warnings.catch_warnings():
        # A length at its upper bound is an answer (the parameter does not matter), not a failure.
        warnings.simplefilter("ignore", ConvergenceWarning)
        regressor.fit(u, (unfitted.targets - unfitted.offset) / unfitted.scale)
    found = regressor.kernel_
    hyperparameters = Hyperparameters(
        amplitude=float(found.k1.k1.constant_value),
        lengths=np.atleast_1d(found.k1.k2.length_scale),
        noise=float(found.k2.noise_level),
    )
    return GaussianProcess(u=u, targets=targets, hyperparameters=hyperparameters, n_at_fit=len(targets))


def _log_length_mode(dimension: int) -> float:
    """Log of the mode of Hvarfner's log-normal, mu = sqrt(2) + log(d)/2 and sigma^2 = 3: mu - sigma^2."""
    return float(np.sqrt(2.0) + 0.5 * np.log(dimension) - _LOG_LENGTH_VARIANCE)


def _penalised_optimizer(n_lengths: int) -> Callable[..., tuple[Array, float]]:
    """An optimiser for scikit-learn that adds the prior of the logs of the lengths; none for 0 lengths."""
    lengths = slice(1, 1 + n_lengths)
    mode = _log_length_mode(max(n_lengths, 1))

    def optimise(objective: Callable[[Array], Any], initial: Array, bounds: Array) -> tuple[Array, float]:
        def penalised(log_theta: Array) -> tuple[float, Array]:
            value, gradient = objective(log_theta)
            away = log_theta[lengths] - mode
            gradient = np.array(gradient, dtype=np.float64)
            gradient[lengths] += away / _LOG_LENGTH_VARIANCE
            return float(value) + 0.5 * float(away @ away) / _LOG_LENGTH_VARIANCE, gradient

        result = minimize(
            penalised, initial, jac=True, bounds=Bounds(*np.transpose(bounds)), options={"maxiter": 100}
        )
        return np.asarray(result.x), float(result.fun)

    return optimise


def _features(u: Any, frequencies: Any) -> Any:
    """Cosines and sines (2k, n) at u (n, d) of frequencies (k, d)."""
    phases = frequencies @ u.T
    return np.concatenate([np.cos(phases), np.sin(phases)])


def _cholesky_with_jitter(covariance: Array, amplitude: float) -> Array:
    if not np.isfinite(covariance).all():
        raise ParameterError("gaussian process: the posterior covariance is not finite; are u and targets?")
    jitter = _JITTER * amplitude
    diagonal = np.diag_indices_from(covariance)
    for _ in range(8):
        covariance[diagonal] += jitter
        try:
            return np.asarray(cholesky(covariance, lower=True))
        except np.linalg.LinAlgError:
            jitter *= 10.0
    raise ParameterError("gaussian process: the posterior covariance cannot be factorised; are u finite?")
