"""The polish: slopes of what it makes small, and rollouts that diverge on the way."""

import numpy as np
import pytest
from runs import shipped_pushes

from physid_drake.cell import CellConfig
from physid_drake.identify import Identifier, SearchConfig, ThetaConfig
from physid_drake.identify.misfit import FAILED, diverged, whitened_residual
from physid_drake.identify.polish import THETA_STEP, Polisher


@pytest.fixture(scope="module")
def identifier():
    config = CellConfig()
    config.contact.model = "point"
    config.solver.time_step_s = config.solver.slide_time_step_s = 4e-3
    return Identifier(
        shipped_pushes(2), cell=config, theta=ThetaConfig(), search=SearchConfig(jobs=1), held_out_share=0.0, seed=0
    )


@pytest.fixture
def polisher(identifier):
    return Polisher(identifier.pool, identifier.problems, identifier.noise, 0.03)


def slope_and_whiteners(polisher, identifier):
    u = np.full(identifier.thetas.space.dimension, 0.5)
    whiteners = polisher._linearise(identifier.thetas.space.from_unit(u))
    return u, whiteners, polisher._jacobian(u, whiteners)


def test_the_slope_is_that_of_what_is_made_small(polisher, identifier):
    u, whiteners, slope = slope_and_whiteners(polisher, identifier)
    for j in range(len(u)):
        sides = []
        for sign in (-1.0, 1.0):
            theta = identifier.thetas.space.from_unit(u + sign * THETA_STEP * np.eye(len(u))[j])
            sides.append(polisher._stacked(whiteners, polisher._residuals(polisher._tasks(theta)), theta))
        np.testing.assert_allclose(slope[:, j], (sides[1] - sides[0]) / (2.0 * THETA_STEP), rtol=1e-6, atol=1e-6)


def test_a_rollout_that_diverged_is_no_slope(polisher, identifier, monkeypatch):
    _, whiteners, whole = slope_and_whiteners(polisher, identifier)
    count, simulate = len(identifier.problems), identifier.pool.run

    def every_other_theta_diverges(tasks):
        return [None if (k // count) % 2 else p for k, p in enumerate(simulate(tasks))]

    monkeypatch.setattr(identifier.pool, "run", every_other_theta_diverges)
    slope = polisher._jacobian(np.full(whole.shape[1], 0.5), whiteners)
    priors = identifier.thetas.space.dimension
    np.testing.assert_array_equal(slope[:-priors], 0.0)
    np.testing.assert_array_equal(slope[-priors:], whole[-priors:])


def test_a_rollout_that_diverged_is_far_from_every_recording(identifier):
    problem = identifier.problems[0]
    residual = whitened_residual(problem, identifier.noise, None)
    assert diverged(residual) and len(residual) == 3 * len(problem.times) + 2 * len(problem.force_times)
    (prediction,) = identifier.pool.run([identifier._task(problem, identifier.thetas.space.nominal)])
    assert np.abs(whitened_residual(problem, identifier.noise, prediction)).max() < 0.1 * FAILED
