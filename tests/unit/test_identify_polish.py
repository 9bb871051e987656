"""The polish: slopes of what it makes small, and rollouts that diverge on the way."""

import numpy as np
import pytest
from runs import shipped_pushes

from physid_drake.cell import CellConfig
from physid_drake.cell.solid import solid_of
from physid_drake.identify import Identifier, SearchConfig
from physid_drake.identify.identify import _may_lie_beyond, estimates_of
from physid_drake.identify.polish import (
    THETA_STEP,
    Polished,
    Polisher,
    degrees_of_freedom,
    new_scatter,
    scatter_of,
)  # fmt: skip
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.misfit import FAILED, Whitener, diverged, whitened_residual
from physid_drake.pushes.theta import theta_map
from physid_drake.recording import Box, ObjectModel

SHAPE = Box(size=(0.12, 0.05, 0.03))


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


def test_what_only_its_prior_holds_takes_no_degree_of_freedom():
    slope = np.zeros((9, 3))
    slope[:, 0] = 1e3  # the residuals tell the first, say nothing of the second, and half of the third
    slope[:, 2] = np.sqrt(1.0 / 9.0) * np.array([1.0, -1.0] * 4 + [0.0]) * np.sqrt(9.0 / 8.0)
    assert degrees_of_freedom(9, np.concatenate([slope, np.eye(3)])) == pytest.approx(9 - 1.5, abs=1e-2)
    assert degrees_of_freedom(1, np.concatenate([slope, np.eye(3)])) == 1.0


@pytest.mark.slow
def test_a_push_that_diverges_says_nothing_and_takes_nothing_from_the_others(identifier, monkeypatch):
    lost, simulate = identifier.problems[0].name, identifier.pool.run

    def run(tasks):
        return [None if t.problem.name == lost else p for t, p in zip(tasks, simulate(tasks), strict=True)]

    start = identifier.thetas.space.nominal
    others = Polisher(identifier.pool, identifier.problems[1:], identifier.noise, 0.03).run(start)
    monkeypatch.setattr(identifier.pool, "run", run)
    found = Polisher(identifier.pool, identifier.problems, identifier.noise, 0.03).run(start)
    np.testing.assert_allclose(found.theta, others.theta, rtol=1e-6)
    assert found.samples == others.samples and found.chi2 == pytest.approx(others.chi2)
    error = identifier._error([None, *simulate([identifier._task(identifier.problems[1], start)])])
    assert error == float("inf")  # half of them


def test_an_interval_of_what_is_not_told_holds_its_value(identifier):
    """Restitution and static friction begin at their lower bounds."""
    config = ThetaConfig(parameters=["support_friction", "restitution", "static_ratio"])
    thetas = theta_map(ObjectModel(shape=SHAPE, mass=0.054), solid_of(SHAPE), (1, 1), config, 500.0)
    jacobian = np.concatenate([np.zeros((4, 3)), np.sqrt(12.0) * np.eye(3)])
    polished = Polished(
        theta=np.array([0.3, 0.0, 1.0]), jacobian=jacobian, chi2=1.0, inflation=1.0, samples=4, friction_scatter=0.03,
        residuals=(), unknowns=(), rollouts=0,
    )  # fmt: skip
    for estimate in estimates_of(thetas, polished):
        assert estimate.ci90[0] <= estimate.value <= estimate.ci90[1]


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [("static_ratio", False, True), ("restitution", False, True), ("support_friction", True, True)],
)
def test_only_a_bound_that_was_chosen_may_be_too_narrow(name, low, high):
    """Static friction is no less than kinetic, and nothing bounces back faster: no search can go further."""
    model = ObjectModel(shape=SHAPE)
    parameter = theta_map(model, solid_of(SHAPE), (1, 1), ThetaConfig(parameters=[name]), 500.0).space.parameters[0]
    assert _may_lie_beyond(parameter, 0.0) is low and _may_lie_beyond(parameter, 1.0) is high
    assert not _may_lie_beyond(parameter, 0.5)


@pytest.mark.parametrize("inflation", [1.0, 4.0, 9.0])
def test_the_scatter_of_friction_is_told_as_pushes_have_it(inflation):
    """Forty linear pushes, in noise as loud as what a cell cannot explain leaves."""
    rng, truth = np.random.default_rng(3), 0.05
    slopes = [rng.uniform(50.0, 100.0, 60) for _ in range(40)]
    frictions = truth * rng.standard_normal(40)
    wide = np.sqrt(inflation)
    residuals = [f * slope / wide + rng.standard_normal(60) for f, slope in zip(frictions, slopes, strict=True)]
    share = 0.02
    for _ in range(6):  # rounds, as a fit makes them
        whiteners = [Whitener.of(share * slope[:, None]) for slope in slopes]
        share = new_scatter(whiteners, [0] * 40, residuals, old=share, first=0.02 / wide)
    assert scatter_of(share, inflation, 40) == pytest.approx(np.std(frictions), rel=0.1)
    assert scatter_of(share, inflation, 3) == share
