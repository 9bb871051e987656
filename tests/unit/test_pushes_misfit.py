"""The misfit: residuals in standard deviations, whitened, with a push's own unknowns marginalised."""

from dataclasses import replace

import numpy as np
import pytest
from runs import shipped_pushes

from physid_drake.pushes.misfit import Whitener, model_error_columns, whitened_residual
from physid_drake.pushes.noise import Noise, noise_of
from physid_drake.pushes.nuisance import MODEL_ERROR
from physid_drake.pushes.prediction import Prediction
from physid_drake.pushes.problem import PushProblem, problems_of


@pytest.fixture(scope="module")
def problem() -> PushProblem:
    recording = shipped_pushes(1)
    return problems_of(recording, noise_of(recording), 0.03)[0]


def noise(place=0.0, turn=None) -> Noise:
    return Noise(
        position=3e-4, rotation=3e-3, hand=5e-5, force=0.02, position_correlation=place,
        rotation_correlation=place if turn is None else turn, source={},
    )  # fmt: skip


def long_problem(problem, times, forces=0):
    return replace(
        problem, times=times, poses=np.zeros((len(times), 3)), force_times=np.arange(forces, dtype=float),
        forces=np.zeros((forces, 2)), force_std=np.full(forces, 0.1),
    )  # fmt: skip


def ar1(rng, n, rho, gaps=None):
    """(n, 3) of unit variance; ``gaps`` (n - 1,) in samples."""
    gaps = np.ones(n - 1) if gaps is None else gaps
    e = rng.standard_normal((n, 3))
    for k in range(1, n):
        r = rho ** gaps[k - 1]
        e[k] = r * e[k - 1] + np.sqrt(1 - r * r) * e[k]
    return e


@pytest.mark.parametrize("rho", [(0.0, 0.0), (0.5, 0.5), (0.95, 0.95), (0.0, 0.9), (0.9, 0.3)])
def test_the_whitened_residual_of_correlated_noise_is_white(problem, rho):
    """A filter of place and one of rotation are two."""
    n, (place, turn) = 20_000, rho
    one = long_problem(problem, 0.01 * np.arange(n))
    errors = ar1(np.random.default_rng(0), n, np.array([place, place, turn])) * noise().sigmas
    white = whitened_residual(one, noise(*rho), Prediction(poses=errors, forces=np.zeros((0, 2)))).reshape(3, n)
    # Four standard errors of n samples.
    assert np.abs(white.var(axis=1) - 1.0).max() < 4.0 * np.sqrt(2.0 / n)
    for lag in (1, 2, 10):
        assert np.abs((white[:, lag:] * white[:, :-lag]).mean(axis=1)).max() < 4.0 / np.sqrt(n)


def test_a_gap_in_the_stream_loosens_the_correlation(problem):
    n, rho, rng = 20_000, 0.8, np.random.default_rng(1)
    gaps = rng.choice([1.0, 1.0, 1.0, 5.0], n - 1)
    one = long_problem(problem, 0.01 * np.concatenate([[0.0], np.cumsum(gaps)]))
    errors = ar1(rng, n, rho, gaps) * noise().sigmas
    white = whitened_residual(one, noise(rho), Prediction(poses=errors, forces=np.zeros((0, 2)))).reshape(3, n)
    assert np.abs(white.var(axis=1) - 1.0).max() < 4.0 * np.sqrt(2.0 / n)
    assert np.abs((white[:, 1:] * white[:, :-1]).mean(axis=1)).max() < 4.0 / np.sqrt(n)


def test_whitening_is_the_inverse_of_the_covariance(problem):
    n, rho = 40, 0.7
    one = long_problem(problem, 0.01 * np.arange(n))
    errors = np.zeros((n, 3))
    errors[:, 0] = np.random.default_rng(2).standard_normal(n)
    white = whitened_residual(one, noise(rho), Prediction(poses=errors * noise().sigmas, forces=np.zeros((0, 2))))
    covariance = rho ** np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    assert white @ white == pytest.approx(errors[:, 0] @ np.linalg.solve(covariance, errors[:, 0]), rel=1e-10)


def test_the_residual_holds_poses_by_axis_and_then_forces_by_axis(problem):
    one = long_problem(problem, 0.01 * np.arange(4), forces=2)
    poses = np.outer(np.ones(4), [1.0, 2.0, 3.0]) * noise().sigmas
    residual = whitened_residual(one, noise(), Prediction(poses=poses, forces=np.array([[0.1, 0.2], [0.3, 0.4]])))
    np.testing.assert_allclose(residual, [1] * 4 + [2] * 4 + [3] * 4 + [1, 3, 2, 4])


def test_a_perfect_prediction_has_no_residual(problem):
    prediction = Prediction(poses=problem.poses, forces=problem.forces)
    assert not whitened_residual(problem, noise(0.5), prediction).any()


def test_the_marginal_cost_is_exact():
    rng = np.random.default_rng(3)
    for m, k in ((1, 1), (30, 4), (5, 9)):
        jacobian, residual = rng.standard_normal((m, k)) * 10.0 ** rng.uniform(-3, 3, k), rng.standard_normal(m)
        whitener = Whitener.of(jacobian)
        left = whitener.apply(residual)
        assert left.shape == (m + k,)
        want = residual @ np.linalg.solve(np.eye(m) + jacobian @ jacobian.T, residual)
        assert left @ left == pytest.approx(want, rel=1e-6)


def test_unknowns_without_influence_change_nothing():
    residual = np.random.default_rng(4).standard_normal(12)
    whitener = Whitener.of(np.zeros((12, 3)))
    np.testing.assert_array_equal(whitener.apply(residual), [*residual, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(whitener.variances(), 1.0)


def test_an_injected_unknown_is_found():
    """A residual J x + noise, prior one: x within its own standard deviation, which shrinks with the evidence."""
    rng = np.random.default_rng(5)
    jacobian = 3.0 * rng.standard_normal((400, 4))
    errors, found = [], Whitener.of(-jacobian)
    for _ in range(200):
        x = rng.standard_normal(4)
        errors.append(found.unknowns(jacobian @ x + rng.standard_normal(400)) - x)
    std = np.sqrt(found.variances())
    assert (std < 0.02).all()
    np.testing.assert_allclose(np.std(errors, axis=0), std, rtol=0.2)
    assert np.abs(np.mean(errors, axis=0)).max() < 4.0 * std.max() / np.sqrt(200)


def test_variances_are_those_of_the_posterior():
    jacobian = np.random.default_rng(6).standard_normal((20, 5))
    want = np.diag(np.linalg.inv(np.eye(5) + jacobian.T @ jacobian))
    np.testing.assert_allclose(Whitener.of(jacobian).variances(), want, rtol=1e-12)


def test_the_models_own_error_begins_with_the_motion(problem):
    columns = model_error_columns(problem, noise(), moved=float(problem.times[30]))
    n = len(problem.times)
    assert columns.shape == (3 * n, 3)
    for dof in range(3):
        column = columns[:, dof].reshape(3, n)
        assert not np.delete(column, dof, axis=0).any()
        assert not column[dof, :31].any()
        np.testing.assert_allclose(column[dof, 31:], MODEL_ERROR[dof] / noise().sigmas[dof])
