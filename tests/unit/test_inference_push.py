"""A push with its unknowns integrated out, beside closed forms."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import stats

from physid_drake.inference.push import (
    NO_TAIL,
    TAIL,
    LinearPush,
    held_out,
    noise_scale_of,
    weighed,
    without,
)

RNG = np.random.default_rng(0)
PRIOR = np.array([1.0, 0.5])


def a_push(rng, count=12):
    """Residual, shared and own columns."""
    return rng.normal(size=count), rng.normal(size=(count, 3)), rng.normal(size=(count, 2))


def covariance(nuisance, noise_scale):
    return noise_scale**2 * np.eye(len(nuisance)) + (nuisance * PRIOR**2) @ nuisance.T


@pytest.mark.parametrize("noise_scale", [1.0, 2.5])
def test_normal_errors_have_the_density_and_the_equations_of_linear_algebra(noise_scale):
    residual, shared, nuisance = a_push(RNG)
    one = weighed(residual, shared, nuisance, PRIOR, noise_scale, NO_TAIL)
    inverse = np.linalg.inv(covariance(nuisance, noise_scale))
    density = stats.multivariate_normal(cov=covariance(nuisance, noise_scale)).logpdf(residual)
    assert one.log_density == pytest.approx(density, rel=1e-4)
    np.testing.assert_allclose(one.precision, shared.T @ inverse @ shared, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(one.right, shared.T @ inverse @ residual, rtol=1e-4, atol=1e-6)


def test_unknowns_follow_what_all_pushes_share():
    residual, shared, nuisance = a_push(RNG)
    one = weighed(residual, shared, nuisance, PRIOR, 1.0, NO_TAIL)
    dz = np.array([0.3, -0.2, 0.1])
    moved = weighed(residual - shared @ dz, shared, nuisance, PRIOR, 1.0, NO_TAIL)
    np.testing.assert_allclose(one.nuisance + one.to_nuisance @ dz, moved.nuisance, atol=1e-6)


@pytest.mark.parametrize("noise_scale", [1.0, 3.0])
def test_without_unknowns_a_push_has_the_density_of_a_t_distribution(noise_scale):
    residual, shared, _ = a_push(RNG)
    one = weighed(residual, shared, np.zeros((12, 0)), np.zeros(0), noise_scale)
    heavy = stats.multivariate_t(shape=noise_scale**2 * np.eye(12), df=TAIL)
    assert one.log_density == pytest.approx(heavy.logpdf(residual))


def test_an_odd_push_counts_less_the_further_it_is_off():
    residual, shared, nuisance = a_push(np.random.default_rng(4))
    off = np.linalg.qr(np.column_stack([nuisance, RNG.normal(size=12)]))[0][:, -1]  # what no unknown explains
    weights = [weighed(residual + far * off, shared, nuisance, PRIOR, 1.0).weight for far in (0.0, 10.0, 30.0, 100.0)]
    assert weights[0] == pytest.approx(1.0, abs=0.5)
    assert all(later < 0.5 * earlier for earlier, later in pairwise(weights))


def test_far_from_an_explanation_unknowns_stay_at_zero():
    _, shared, nuisance = a_push(RNG)
    residual = 40.0 * RNG.normal(size=12)
    near, far = (
        weighed(residual, shared, nuisance, PRIOR, noise_scale, NO_TAIL).nuisance for noise_scale in (1.0, 40.0)
    )
    assert np.abs(near / PRIOR).max() > 5.0
    assert np.abs(far / PRIOR).max() < 1.0


@pytest.mark.parametrize("scale", [0.2, 1.0, 7.0])
def test_loudness_is_found_and_is_no_less_than_it_may_be(scale):
    rng, count = np.random.default_rng(1), 40
    chances = np.sqrt(TAIL / rng.chisquare(TAIL, size=(400, 1)))  # of a t distribution
    errors = scale * chances * rng.normal(size=(400, count))
    squares = [float(e @ e) for e in errors]
    assert noise_scale_of(squares, [count] * 400, 1e-3, TAIL) == pytest.approx(scale, rel=0.05)
    assert noise_scale_of(squares, [count] * 400, 1.0, TAIL) >= 1.0


def test_coordinates_that_act_alike_leave_what_is_known_beforehand():
    """Two that cannot be told apart, in units that are far from each other's: rounding must not make one certain."""
    rng, prior = np.random.default_rng(3), np.diag([1e-6, 1e6])
    shared = rng.normal(size=(12, 1)) @ np.array([[1.0, 1e6]])
    found = [weighed(rng.normal(size=12), shared, np.zeros((12, 0)), np.zeros(0), 1.0, NO_TAIL) for _ in range(3)]
    _, root = without([0], np.zeros(2), prior, found)
    np.testing.assert_allclose(root @ root.T, np.linalg.inv(prior + 2.0 * shared.T @ shared), rtol=0.05)


def test_a_coordinate_that_no_other_push_tells_is_as_good_as_free():
    shared = np.column_stack([RNG.normal(size=12), np.zeros(12)])
    one = weighed(RNG.normal(size=12), shared, np.zeros((12, 0)), np.zeros(0), 1.0, NO_TAIL)
    dz, root = without([0], np.zeros(2), np.diag([1.0, 0.0]), [one, one])
    assert np.all(np.isfinite(root)) and dz[1] == 0.0
    assert (root @ root.T)[1, 1] > 1e6


def test_held_out_density_is_the_ratio_of_two_marginal_ones():
    rng = np.random.default_rng(2)
    mean, std = np.zeros(3), np.array([1.0, 2.0, 0.7])
    pushes = [LinearPush(residual=r, shared=x, nuisance=j) for r, x, j in (a_push(rng) for _ in range(4))]
    found = [weighed(p.residual, p.shared, p.nuisance, PRIOR, 1.0, NO_TAIL) for p in pushes]

    def marginal(some):
        shared = np.vstack([p.shared for p in some])
        blocks = np.zeros((12 * len(some),) * 2)
        for k, p in enumerate(some):
            blocks[12 * k : 12 * (k + 1), 12 * k : 12 * (k + 1)] = covariance(p.nuisance, 1.0)
        spread = blocks + (shared * std**2) @ shared.T
        return stats.multivariate_normal(cov=spread).logpdf(np.concatenate([p.residual for p in some]))

    scores = held_out(pushes, [PRIOR] * 4, mean, np.diag(std**-2.0), 1.0, found, NO_TAIL)
    for i, score in enumerate(scores):
        others = [p for k, p in enumerate(pushes) if k != i]
        assert score == pytest.approx(marginal(pushes) - marginal(others), rel=1e-4)
