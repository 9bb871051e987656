"""The belief about an error function over candidates: Gaussian process, P_min and its entropy."""

import json
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, final

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from physid_drake.belief.gaussian_process import GaussianProcess, Hyperparameters, fit
from physid_drake.belief.npz import check_trials, check_whole, read_npz
from physid_drake.belief.p_min import entropy, estimate_p_min, weigh_p_min
from physid_drake.errors import OutputError, ParameterError
from physid_drake.space import Array, Parameter, ParameterSpace, read_only
from physid_drake.wording import named, one_line

_FORMAT = "physid-belief/1"
_SAME_POINT = 1e-12


@final
@dataclass(frozen=True, kw_only=True)
class BeliefSettings:
    """How P_min is estimated and how often the Gaussian process is fitted anew.

    Attributes:
        n_samples: Functions drawn for P_min; its entropy cannot exceed log(n_samples).
        exact_limit: Candidates up to which joint samples are exact; above they are pathwise.
        sample_limit: Most candidates that are sampled. Where more may be the minimiser, those that are least likely
            to be below the best are left out; hardly any of them would be chosen by one of n_samples functions.
        refit_growth: Hyperparameters are fitted again when the trials grew by this factor since last time;
            1 fits at every update.
        n_restarts: Optimiser runs beside the one from the default hyperparameters.
        length_prior: Whether the lengths have a prior (see `gaussian_process.fit`).
    """

    n_samples: int = 500
    exact_limit: int = 1000
    sample_limit: int = 3000
    refit_growth: float = 1.25
    n_restarts: int = 2
    length_prior: bool = True

    def __post_init__(self) -> None:
        if (
            self.n_samples < 2
            or self.exact_limit < 0
            or self.sample_limit < 1
            or self.refit_growth < 1.0
            or self.n_restarts < 0
        ):
            raise ParameterError(
                "belief settings: n_samples >= 2, exact_limit >= 0, sample_limit >= 1, refit_growth >= 1 and"
                " n_restarts >= 0,"
                f" but got {self}."
            )


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class Belief:
    """What is thought about the error function E given the trials so far.

    Make one with `Belief.start`, get the next with `update`. The prior P_t over candidates enters as
    weights: P_min(theta) is proportional to the fraction of sampled functions with their minimum at theta,
    times P_t(theta); equal weights are exactly the paper. That is, each function sampled from the Gaussian
    process counts as much as its minimiser was believed before, which needs no scale to compare errors
    with probabilities (a prior mean of -log P_t would). `weigh_p_min` says what happens when P_t is much
    narrower than P_min. In many dimensions draw the candidates from P_t instead, with equal weights.

    A failed trial (error infinite or nan: the rollout diverged) is kept and counted; the Gaussian process
    is given the worst finite error so far in its place, so that the search avoids the region without the
    failures stretching the scale of the errors.

    Attributes:
        space: The space the candidates live in.
        settings: Numbers of the estimator.
        candidates: The set Theta (n, d), each entry in its parameter's unit.
        log_weights: Logarithms of the prior weights P_t (n,), up to a constant.
        tried: Whether each candidate was tried (n,).
        thetas: Trials in their order (m, d).
        errors: Errors of the trials (m,), in the unit of the objective; inf for failed ones.
        gaussian_process: The Gaussian process given the trials.
        p_min: Probability (n,) of each candidate to be the minimiser.
        prior_power: Power in [0, 1] of the prior weights that entered `p_min`; 1 for all of it.
        entropies: Entropy of P_min in nats after each update so far, the start first.

    Source: Zhu, Kimmel, Boularias, section III.B; Hennig and Schuler, "Entropy Search for
        Information-Efficient Global Optimization", JMLR 2012, for P_min.
    """

    space: ParameterSpace
    settings: BeliefSettings
    candidates: Array
    log_weights: Array
    tried: npt.NDArray[np.bool_]
    thetas: Array
    errors: Array
    gaussian_process: GaussianProcess
    p_min: Array
    prior_power: float
    entropies: Array
    candidates_u: Array = field(repr=False)

    def __post_init__(self) -> None:
        for name in ("candidates", "log_weights", "thetas", "errors", "p_min", "entropies", "candidates_u"):
            object.__setattr__(self, name, _locked(getattr(self, name)))

    @classmethod
    def start(
        cls,
        space: ParameterSpace,
        candidates: npt.ArrayLike,
        rng: np.random.Generator,
        *,
        prior_weights: npt.ArrayLike | None = None,
        settings: BeliefSettings | None = None,
    ) -> "Belief":
        """The belief before any trial.

        Args:
            space: The space the candidates live in.
            candidates: The set Theta (n, d), each entry in its parameter's unit.
            rng: Draws the functions behind the first P_min.
            prior_weights: P_t over the candidates (n,), positive, up to a factor; None is equal weights. For
                the next recording pass `as_prior()` of the last belief.
            settings: Numbers of the estimator; None takes the defaults.

        Raises:
            ParameterError: When a candidate is outside its bounds, shapes disagree, or a weight is not
                positive.
        """
        thetas = read_only(candidates)
        if thetas.ndim != 2 or not len(thetas):
            raise ParameterError(
                f"candidates: a non-empty matrix (n, {space.dimension}) is needed, but got {thetas.shape}."
            )
        u = space.to_unit(thetas)
        empty = GaussianProcess(
            u=np.zeros((0, space.dimension)),
            targets=np.zeros(0),
            hyperparameters=Hyperparameters.default(space.dimension),
        )
        belief = cls(
            space=space,
            settings=settings or BeliefSettings(),
            candidates=thetas,
            log_weights=_log_weights(prior_weights, len(thetas)),
            tried=np.zeros(len(thetas), dtype=np.bool_),
            thetas=np.zeros((0, space.dimension)),
            errors=np.zeros(0),
            gaussian_process=empty,
            p_min=np.full(len(thetas), 1.0 / len(thetas)),
            prior_power=1.0,
            entropies=np.zeros(0),
            candidates_u=u,
        )
        return belief._with_p_min(rng)

    @property
    def entropy(self) -> float:
        """Entropy of P_min in nats, at most log(n_samples)."""
        return float(self.entropies[-1])

    @property
    def n_trials(self) -> int:
        """Number of trials m, failed ones included."""
        return len(self.errors)

    @property
    def n_failed(self) -> int:
        """Number of failed trials."""
        return int(np.count_nonzero(~np.isfinite(self.errors)))

    @property
    def resolved(self) -> bool:
        """Whether the samples are enough to tell P_min's entropy.

        When most samples have a minimiser of their own, the estimate stands at about log(n_samples)
        whatever the truth is.
        """
        return int(np.count_nonzero(self.p_min)) <= self.settings.n_samples // 2

    @property
    def most_likely(self) -> Array:
        """The candidate (d,) of highest P_min, the paper's theta*."""
        return np.asarray(self.candidates[int(np.argmax(self.p_min))])

    @cached_property
    def best(self) -> tuple[Array, float]:
        """The trial (d,) of lowest finite error and that error; `most_likely` and inf if there is none."""
        if self.n_failed == self.n_trials:
            return self.most_likely, float("inf")
        i = int(np.argmin(self.errors))
        return self.thetas[i], float(self.errors[i])

    def update(self, theta: npt.ArrayLike, error: npt.ArrayLike, rng: np.random.Generator) -> "Belief":
        """The belief after one more trial, or a batch of them.

        Args:
            theta: Tried point (d,) or points (k, d), each entry in its unit; need not be candidates.
            error: Error there, or errors (k,), in the unit of the objective; not finite means failed.
            rng: Draws restarts of the fit and the functions behind P_min.

        Raises:
            ParameterError: When a point is outside its bounds or the numbers of points and errors differ.
        """
        thetas = np.atleast_2d(np.asarray(theta, dtype=np.float64))
        errors = np.atleast_1d(np.asarray(error, dtype=np.float64))
        if errors.shape != (len(thetas),):
            raise ParameterError(f"update: one error per trial, but got {errors.shape} for {len(thetas)} trials.")
        u = self.space.to_unit(thetas)
        errors = np.concatenate([self.errors, np.where(np.isfinite(errors), errors, np.inf)])
        return replace(
            self,
            thetas=np.concatenate([self.thetas, thetas]),
            errors=errors,
            tried=self.tried | _matches(self.candidates_u, u),
            gaussian_process=self._conditioned(np.concatenate([self.gaussian_process.u, u]), errors, rng),
        )._with_p_min(rng)

    def with_candidates(self, candidates: npt.ArrayLike, rng: np.random.Generator) -> "Belief":
        """The same trials over another candidate set; each takes the weight of its nearest old candidate.

        Args:
            candidates: The new set (n', d), each entry in its unit.
            rng: Draws the functions behind P_min.

        Raises:
            ParameterError: When a candidate is outside its bounds.
        """
        thetas = read_only(candidates)
        u = self.space.to_unit(thetas)
        log_weights = np.zeros(len(thetas))
        if np.any(self.log_weights != self.log_weights[0]):
            log_weights = self.log_weights[_nearest(self.candidates_u, u)]
        return replace(
            self,
            candidates=thetas,
            candidates_u=u,
            log_weights=log_weights,
            tried=_matches(u, self.gaussian_process.u),
            entropies=self.entropies[:-1],
        )._with_p_min(rng)

    def as_prior(self) -> Array:
        """P_min as prior weights (n,) for the next recording: the paper's P_{t+1}.

        Mixed with one sample's worth of equal weights, because a candidate that no sample chose is
        unlikely, not impossible.
        """
        floor = 1.0 / (self.settings.n_samples + 1.0)
        return np.asarray((1.0 - floor) * self.p_min + floor / len(self.p_min))

    def to_npz(self, path: str | Path) -> None:
        """Writes the belief as npz of plain arrays and JSON text, no pickles; `from_npz` reads it.

        Raises:
            OutputError: When the file cannot be written.
        """
        header = {
            "format": _FORMAT,
            "parameters": [asdict(p) for p in self.space.parameters],
            "correlation": self.space.correlation,
            "settings": asdict(self.settings),
            "n_at_fit": self.gaussian_process.n_at_fit,
            "prior_power": self.prior_power,
        }
        hyper = self.gaussian_process.hyperparameters
        try:
            with Path(path).open("wb") as file:
                np.savez_compressed(
                    file,
                    header=np.array(json.dumps(header)),
                    lengths=hyper.lengths,
                    variances=np.array([hyper.amplitude, hyper.noise]),
                    **{name: getattr(self, name) for name in _SAVED},
                )
        except OSError as error:
            raise OutputError(f"belief '{path}': cannot be written ({error}); check folder and space.") from error

    @classmethod
    def from_npz(cls, path: str | Path) -> "Belief":
        """Reads what `to_npz` wrote.

        Raises:
            ParameterError: When the file is not a belief of this format.
            FileNotFoundError: When there is no file.
        """
        arrays, header = read_npz(path, _FORMAT)
        try:
            return cls._restored(arrays, header)
        except (LookupError, ValueError, TypeError, AttributeError, ArithmeticError) as error:
            raise ParameterError(
                f"belief '{named(path)}': cannot be read ({one_line(error)}); delete it to begin anew."
            ) from error

    @classmethod
    def _restored(cls, arrays: dict[str, Array], header: dict[str, Any]) -> "Belief":
        """From the arrays and the header of a file."""
        check_trials(arrays, len(header["parameters"]))
        for name in ("n_samples", "exact_limit", "sample_limit", "n_restarts"):
            check_whole(name, header["settings"][name])
        check_whole("n_at_fit", header["n_at_fit"])
        saved: dict[str, Any] = {name: arrays[name] for name in _SAVED}
        amplitude, noise = (float(v) for v in arrays["variances"])
        hyper = Hyperparameters(amplitude=amplitude, lengths=arrays["lengths"], noise=noise)
        space = ParameterSpace(
            parameters=tuple(Parameter(**p) for p in header["parameters"]), correlation=header.get("correlation", ())
        )
        process = GaussianProcess(
            u=space.to_unit(saved["thetas"]),
            targets=_targets(saved["errors"]),
            hyperparameters=hyper,
            n_at_fit=header["n_at_fit"],
        )
        return cls(
            space=space,
            settings=BeliefSettings(**header["settings"]),
            gaussian_process=process,
            prior_power=float(header["prior_power"]),
            candidates_u=space.to_unit(saved["candidates"]),
            **saved,
        )

    def _conditioned(self, u: Array, errors: Array, rng: np.random.Generator) -> GaussianProcess:
        old, targets, s = self.gaussian_process, _targets(errors), self.settings
        if len(targets) < s.refit_growth * old.n_at_fit:
            return replace(old, u=u, targets=targets)
        return fit(u, targets, rng, n_restarts=s.n_restarts, length_prior=s.length_prior)

    def _with_p_min(self, rng: np.random.Generator) -> "Belief":
        s = self.settings.n_samples
        process = self.gaussian_process
        possible = process.possible_minima(self.candidates_u, 0.01 / s, self.settings.sample_limit)
        u = self.candidates_u[possible]
        samples = process.sample(u, s, rng, exact_limit=self.settings.exact_limit)
        p_min = np.zeros(len(self.candidates))
        p_min[possible] = estimate_p_min(samples)
        p_min, power = weigh_p_min(p_min, self.log_weights)
        return replace(
            self,
            p_min=p_min,
            prior_power=power,
            entropies=np.append(self.entropies, entropy(p_min)),
        )


_SAVED = ("candidates", "log_weights", "tried", "thetas", "errors", "p_min", "entropies")


def _locked(array: Array) -> Array:
    """The array itself if nobody can write to it, else a copy nobody can write to."""
    return array if not array.flags.writeable and array.base is None else read_only(array)


def _targets(errors: Array) -> Array:
    """Errors (m,) with the worst finite one in place of failures; 0 everywhere if all failed."""
    finite = np.isfinite(errors)
    worst = float(errors[finite].max()) if finite.any() else 0.0
    return np.where(finite, errors, worst)


def _log_weights(weights: npt.ArrayLike | None, n: int) -> Array:
    if weights is None:
        return np.zeros(n)
    array = np.asarray(weights, dtype=np.float64)
    if array.shape != (n,) or not np.all(np.isfinite(array) & (array > 0.0)):
        raise ParameterError(
            f"prior_weights: one positive finite weight for each of {n} candidates is needed, but got shape"
            f" {array.shape} with least {array.min() if array.size else float('nan'):g}; mix in a floor."
        )
    return np.log(array)


def _matches(u: Array, trials: Array) -> npt.NDArray[np.bool_]:
    """Which of the points u (n, d) are the same as one of the trials (m, d)."""
    same = np.zeros(len(u), dtype=np.bool_)
    for trial in trials:
        same |= np.all(np.abs(u - trial) <= _SAME_POINT, axis=1)
    return same


def _nearest(points: Array, u: Array) -> npt.NDArray[np.intp]:
    """Index (n',) of the nearest of points (n, d) to each of u (n', d)."""
    return np.asarray(cKDTree(points).query(u)[1], dtype=np.intp)
