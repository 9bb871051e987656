"""Friction cells: the prior that ties neighbours, and which of their combinations pushes tell."""

import dataclasses as dc

import numpy as np
import pytest

from physid_drake.belief import Belief
from physid_drake.cell.outline import rectangle
from physid_drake.cell.solid import solid_of
from physid_drake.errors import ConfigError, ParameterError
from physid_drake.identify.cells import identifiable_cells
from physid_drake.inference.hypothesis import Hypothesis
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.theta import theta_map
from physid_drake.pushes.tied_cells import LEVEL_STD, tied_cells
from physid_drake.recording import Box, ObjectModel
from physid_drake.report.cells import cells_verdict
from physid_drake.space import Parameter, ParameterSpace

OUTLINE = rectangle(0.12, 0.06)


def tied(cells, *parameters, **config):
    given = ThetaConfig(parameters=list(parameters or ("support_friction",)), **config)
    shape = Box(size=(0.12, 0.06, 0.03))
    return tied_cells(theta_map(ObjectModel(shape=shape), solid_of(shape), cells, given, 500.0), OUTLINE, given)


# The prior.


def test_neighbours_are_tied_by_the_exponential_of_their_distance():
    space = tied((4, 1), cell_spread=0.4, cell_length=0.5).space
    matrix = np.array(space.correlation)
    total = LEVEL_STD**2 + 0.4**2
    assert space.parameters[0].prior_std == pytest.approx(np.sqrt(total))
    # Centres are 30 mm apart, and the length is 60 mm.
    for apart in (1, 2, 3):
        wanted = (LEVEL_STD**2 + 0.4**2 * np.exp(-0.5 * apart)) / total
        np.testing.assert_allclose(np.diag(matrix, apart), wanted)


def test_without_a_grid_nothing_is_tied_and_others_stay_as_they_are():
    assert tied((1, 1)).space.correlation == ()
    space = tied((2, 1), "mass", "support_friction", "com_x").space
    matrix = np.array(space.correlation)
    np.testing.assert_array_equal(matrix[[0, 3]], np.eye(4)[[0, 3]])
    assert space.parameters[0] == tied((1, 1), "mass").space.parameters[0]


def test_drawn_frictions_have_the_correlation_asked_for_and_stay_inside():
    space = tied((3, 1), bounds={"support_friction": [1e-4, 900.0]}).space
    drawn = space.sample(np.random.default_rng(0), 4096, from_prior=True)
    found = np.corrcoef(np.log(drawn).T)
    np.testing.assert_allclose(found, np.array(space.correlation), atol=0.01)
    np.testing.assert_allclose(np.log(drawn).std(axis=0), space.parameters[0].prior_std, rtol=0.02)
    narrow = tied((3, 1)).space
    narrow.check(narrow.sample(np.random.default_rng(0), 512, from_prior=True))


def test_the_fits_prior_is_that_of_the_covariance():
    space = tied((2, 2), "mass", "support_friction").space
    h = Hypothesis(space=space, around=None)
    stds = space.prior_std_unit
    np.testing.assert_allclose(np.linalg.inv(h.precision), np.outer(stds, stds) * space.correlation, rtol=1e-9)


def test_a_saved_belief_keeps_the_ties(tmp_path):
    space = tied((2, 2), "mass", "support_friction").space
    Belief.start(space, space.sample(np.random.default_rng(0), 8, from_prior=True), np.random.default_rng(0)).to_npz(
        tmp_path / "belief.npz"
    )
    assert Belief.from_npz(tmp_path / "belief.npz").space == space


@pytest.mark.parametrize(
    "rows", [[[1.0]], [[1.0, 0.5], [0.4, 1.0]], [[1.0, 1.0], [1.0, 1.0]], [[2.0, 0.0], [0.0, 1.0]]]
)
def test_a_correlation_that_is_none_is_refused(rows):
    pair = tuple(
        Parameter(name=name, unit="-", lower=0.0, upper=1.0, prior_mean=0.5, prior_std=0.1) for name in ("a", "b")
    )
    with pytest.raises(ParameterError, match="correlation"):
        ParameterSpace(parameters=pair, correlation=rows)
    uniform = dc.replace(pair[0], prior_std=None)
    with pytest.raises(ParameterError, match="uniform"):
        ParameterSpace(parameters=(uniform, pair[1]), correlation=[[1.0, 0.5], [0.5, 1.0]])


def test_a_length_of_nothing_is_refused():
    with pytest.raises(ConfigError, match="cell_length"):
        tied((2, 1), cell_length=0.0)


# What pushes tell, from a Jacobian made by hand.


def told_by(thetas, rows):
    """What whitened residuals that change by ``rows`` (m, d) with ln theta tell."""
    prior, posterior = covariances(thetas, rows)
    return identifiable_cells(thetas, thetas.space.nominal, prior, posterior)


def covariances(thetas, rows):
    """Of theta in the unit cube, before and after."""
    h = Hypothesis(space=thetas.space, around=None)
    slopes = np.atleast_2d(rows) * np.log(thetas.space.upper / thetas.space.lower)
    return np.linalg.inv(h.precision), np.linalg.inv(h.precision + slopes.T @ slopes)


def test_pushes_that_feel_only_the_sum_tell_one_combination_with_its_singular_value():
    thetas = tied((2, 2))
    told = told_by(thetas, 10.0 * np.ones(4))
    first, *others = told.combinations
    np.testing.assert_allclose(first.weights, 0.25, atol=1e-6)
    covariance = thetas.space.parameters[0].prior_std ** 2 * np.array(thetas.space.correlation)
    strength = 10.0 * np.sqrt(covariance.sum())
    assert first.strength == pytest.approx(strength, rel=1e-3)
    assert first.left == pytest.approx(1.0 / np.sqrt(1.0 + strength**2), rel=1e-3)
    assert told.identifiable == 1
    assert all(c.left == pytest.approx(1.0, abs=1e-4) for c in others)
    assert told.apart == ()
    assert len(told.not_apart) == 4


def test_mass_and_friction_of_which_a_force_tells_the_product_vary_against_one_another():
    thetas = tied((1, 1), "mass", "support_friction", bounds={"mass": [0.1, 0.9]})
    strength = 30.0
    a, b = strength * np.log(thetas.space.upper / thetas.space.lower)  # of ln m + ln mu, in the unit cube
    flat = 12.0  # information of a uniform prior there
    _, covariance = covariances(thetas, [strength, strength])
    rho = -a * b / np.sqrt((a**2 + flat) * (b**2 + flat))
    stds = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(covariance / np.outer(stds, stds), [[1.0, rho], [rho, 1.0]], rtol=1e-6)
    std = np.sqrt((b**2 + flat) / ((a**2 + flat) * (b**2 + flat) - (a * b) ** 2))
    assert stds[0] == pytest.approx(std) and rho < -0.95


def test_what_is_told_does_not_depend_on_the_order_of_what_else_is_unknown():
    """An unknown that the pushes cannot tell from a combination of cells takes that combination away."""
    thetas = tied((2, 1), "mass", "support_friction")
    told = told_by(thetas, [[0.0, 50.0, 50.0], [50.0, 50.0, -50.0]])
    # The difference is mixed with the mass, whose prior leaves ln(0.9 / 0.1) / sqrt(12) open.
    assert [c.identifiable for c in told.combinations] == [True, False]
    alone = told_by(tied((2, 1)), [[50.0, 50.0], [50.0, -50.0]])
    assert alone.identifiable == 2
    assert alone.apart == (("support_friction_0_0", "support_friction_1_0"),)
    assert cells_verdict(alone).endswith("All neighbouring cells are distinguishable.")
