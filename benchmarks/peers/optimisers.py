"""Other people's optimisers behind one call: ``optimise(errors, residuals, space, budget, seed)``.

Each asks ``errors`` for the error at points (k, d) of the space's own units until ``Spent`` ends it.
"""

# ruff: noqa: PLC0415  a peer is imported when it is asked for
from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np

from physid_drake.space import ParameterSpace

Array = np.ndarray
Errors = Callable[[Array], Array]
Optimise = Callable[[Errors, Errors, ParameterSpace, int, int], None]


class Spent(Exception):  # noqa: N818  not an error: it ends a run
    """The budget of rollouts is spent."""


def _start(errors: Errors, space: ParameterSpace, budget: int, seed: int) -> tuple[Array, Array]:
    """As many first points as the project's own search takes, the nominal one first; unit cube and errors."""
    count = min(max(4, space.dimension + 1), max(1, budget // 3))
    drawn = space.sample(np.random.default_rng(seed), max(1, count - 1), from_prior=False)
    thetas = np.concatenate([space.nominal[None], drawn])[:count]
    return np.asarray(space.to_unit(thetas)), errors(thetas)


def _botorch(kind: str) -> Optimise:
    def optimise(errors: Errors, residuals: Errors, space: ParameterSpace, budget: int, seed: int) -> None:
        import torch
        from botorch.acquisition.logei import qLogNoisyExpectedImprovement
        from botorch.acquisition.max_value_entropy_search import qMaxValueEntropy
        from botorch.fit import fit_gpytorch_mll
        from botorch.models import SingleTaskGP
        from botorch.models.transforms import Standardize
        from botorch.optim import optimize_acqf
        from gpytorch.mlls import ExactMarginalLogLikelihood

        torch.set_num_threads(1)
        torch.manual_seed(seed)
        warnings.simplefilter("ignore")
        d = space.dimension
        u, values = _start(errors, space, budget, seed)
        bounds = torch.tensor([[0.0] * d, [1.0] * d], dtype=torch.float64)
        while True:
            x, y = torch.tensor(u), -torch.tensor(_finite(values))[:, None]
            model = SingleTaskGP(x, y, outcome_transform=Standardize(m=1))
            fit_gpytorch_mll(ExactMarginalLogLikelihood(model.likelihood, model))
            if kind == "qLogNEI":
                chooser = qLogNoisyExpectedImprovement(model, X_baseline=x)
            else:
                chooser = qMaxValueEntropy(model, torch.rand(1000, d, dtype=torch.float64))
            point, _ = optimize_acqf(chooser, bounds, q=1, num_restarts=4, raw_samples=128)
            u = np.concatenate([u, np.clip(point.numpy(), 0.0, 1.0)])
            values = np.concatenate([values, errors(np.asarray(space.from_unit(u[-1:])))])

    return optimise


def _skopt(errors: Errors, residuals: Errors, space: ParameterSpace, budget: int, seed: int) -> None:
    from skopt import Optimizer

    warnings.simplefilter("ignore")
    optimizer = Optimizer([(0.0, 1.0)] * space.dimension, "GP", n_initial_points=1, random_state=seed)
    u, values = _start(errors, space, budget, seed)
    optimizer.tell(u.tolist(), _finite(values).tolist())
    worst = float(_finite(values).max())
    while True:
        point = optimizer.ask()
        value = float(errors(np.asarray(space.from_unit(np.array([point]))))[0])
        optimizer.tell(point, value if np.isfinite(value) else worst)


def _cma(errors: Errors, residuals: Errors, space: ParameterSpace, budget: int, seed: int) -> None:
    import cma

    u, values = _start(errors, space, budget, seed)
    best = u[int(np.argmin(_finite(values)))]
    while True:
        strategy = cma.CMAEvolutionStrategy(best, 0.2, {"bounds": [0, 1], "seed": seed + 1, "verbose": -9})
        while not strategy.stop():
            asked = strategy.ask()
            strategy.tell(asked, _finite(errors(np.asarray(space.from_unit(np.array(asked))))).tolist())


def _least_squares(errors: Errors, residuals: Errors, space: ParameterSpace, budget: int, seed: int) -> None:
    from scipy.optimize import least_squares

    rng = np.random.default_rng(seed)
    starts = np.concatenate([space.nominal[None], space.sample(rng, 15, from_prior=False)])
    for start in np.asarray(space.to_unit(starts)):
        least_squares(
            lambda u: residuals(np.asarray(space.from_unit(u))), np.clip(start, 1e-3, 1.0 - 1e-3), bounds=(0.0, 1.0),
            diff_step=0.004, x_scale=0.1, xtol=1e-4, ftol=1e-4,
        )  # fmt: skip


def _emukit(errors: Errors, residuals: Errors, space: ParameterSpace, budget: int, seed: int) -> None:
    import GPy
    from emukit.bayesian_optimization.acquisitions import EntropySearch
    from emukit.core import ContinuousParameter
    from emukit.core import ParameterSpace as Box
    from emukit.core.optimization import GradientAcquisitionOptimizer
    from emukit.model_wrappers import GPyModelWrapper
    from emukit.samplers import AffineInvariantEnsembleSampler

    np.random.seed(seed)  # noqa: NPY002  the peer draws from the global generator
    box = Box([ContinuousParameter(f"u{k}", 0.0, 1.0) for k in range(space.dimension)])
    u, values = _start(errors, space, budget, seed)
    while True:
        kernel = GPy.kern.Matern32(space.dimension, ARD=True)
        shown = _finite(values)
        model = GPy.models.GPRegression(u, (shown[:, None] - shown.mean()) / max(1e-9, shown.std()), kernel)
        model.optimize()
        chooser = EntropySearch(GPyModelWrapper(model), box, AffineInvariantEnsembleSampler(box))
        point, _ = GradientAcquisitionOptimizer(box).optimize(chooser)
        u = np.concatenate([u, point])
        values = np.concatenate([values, errors(np.asarray(space.from_unit(point)))])


def _finite(values: Array) -> Array:
    """The worst finite value in place of those that failed."""
    fine = np.isfinite(values)
    return np.where(fine, values, values[fine].max() if fine.any() else 0.0)


PEERS: dict[str, tuple[str, Optimise]] = {
    "BoTorch qLogNEI": ("botorch", _botorch("qLogNEI")),
    "BoTorch qMaxValueEntropy": ("botorch", _botorch("qMaxValueEntropy")),
    "Emukit EntropySearch": ("emukit", _emukit),
    "scikit-optimize GP": ("skopt", _skopt),
    "pycma": ("cma", _cma),
    "scipy least_squares, starts": ("scipy", _least_squares),
}
