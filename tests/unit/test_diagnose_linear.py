"""The linear algebra of a diagnosis, against brute force."""

import dataclasses as dc

import numpy as np
import pytest
from scipy import stats

from physid_drake.diagnose.linear import LinearPush, Whitened, best_scatter, left_out_scores, own_unknowns, solve
from physid_drake.diagnose.model import Fitted, State
from physid_drake.diagnose.screen import log_probability

FRICTION = 1  # column of the pushes' own unknowns


def made(rng, pushes=10, m=12, shared=3, own=4, beta=None, scatter=1.0):
    beta = np.zeros(shared) if beta is None else beta
    result = []
    for _ in range(pushes):
        x, j = rng.standard_normal((m, shared)), rng.standard_normal((m, own))
        noise = np.diag(rng.uniform(0.5, 2.0, m))
        unknowns = rng.standard_normal(own)
        unknowns[FRICTION] *= scatter
        residual = x @ beta + j @ unknowns + np.sqrt(np.diag(noise)) * rng.standard_normal(m)
        result.append(LinearPush(residual=residual, shared=x, own=j, noise=noise, friction=FRICTION))
    return result


def test_whitened_residuals_are_white():
    rng = np.random.default_rng(0)
    pushes = made(rng, pushes=400)
    white = Whitened.of(pushes, 1.0)
    assert np.var(white.y) == pytest.approx(1.0, abs=0.05)
    assert np.abs(np.cov(np.array(white.residuals).T) - np.eye(12)).max() < 0.25


def test_the_marginal_likelihood_is_that_of_the_full_covariance():
    pushes = made(np.random.default_rng(1))
    solution = solve(Whitened.of(pushes, 1.3), np.zeros(3), np.full(3, np.inf))
    expected = sum(
        stats.multivariate_normal(p.shared @ solution.beta, p.covariance(1.3)).logpdf(p.residual) for p in pushes
    )
    assert solution.log_likelihood - 60.0 * np.log(2.0 * np.pi) == pytest.approx(expected, rel=1e-9)


def test_leaving_a_push_out_is_the_same_as_fitting_without_it():
    pushes = made(np.random.default_rng(2), beta=np.array([0.3, -0.2, 0.5]))
    mean, std = np.array([0.1, 0.0, 0.0]), np.array([1.0, np.inf, np.inf])
    scores, betas = left_out_scores(pushes, 1.0, mean, std)
    for k, push in enumerate(pushes):
        others = solve(Whitened.of(pushes[:k] + pushes[k + 1 :], 1.0), mean, std)
        spread = push.covariance(1.0) + push.shared @ np.linalg.inv(others.precision) @ push.shared.T
        expected = stats.multivariate_normal(push.shared @ others.beta, spread).logpdf(push.residual)
        assert scores[k] == pytest.approx(expected, rel=1e-6)
        np.testing.assert_allclose(betas[k], others.beta, atol=1e-7)


def test_leaving_a_half_out_is_the_same_as_fitting_to_the_other_half():
    pushes = made(np.random.default_rng(12), beta=np.array([0.3, -0.2, 0.5]))
    mean, std = np.zeros(3), np.array([1.0, np.inf, np.inf])
    halves = ((0, 2, 4, 6, 8), (1, 3, 5, 7, 9))
    scores, _ = left_out_scores(pushes, 1.0, mean, std, halves)
    for own, other in (halves, halves[::-1]):
        fitted = solve(Whitened.of([pushes[k] for k in other], 1.0), mean, std)
        for k in own:
            spread = (
                pushes[k].covariance(1.0) + pushes[k].shared @ np.linalg.inv(fitted.precision) @ pushes[k].shared.T
            )
            expected = stats.multivariate_normal(pushes[k].shared @ fitted.beta, spread).logpdf(pushes[k].residual)
            assert scores[k] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("scatter", [0.6, 1.0, 3.0])
def test_the_scatter_of_friction_is_learnt(scatter):
    pushes = made(np.random.default_rng(3), pushes=80, scatter=scatter)
    found, _ = best_scatter(pushes, np.zeros(3), np.full(3, np.inf))
    assert found == pytest.approx(scatter, rel=0.35)


def test_a_pushs_own_unknowns_are_the_posterior_mean():
    (push,) = made(np.random.default_rng(4), pushes=1)
    joint = np.linalg.solve(
        push.own.T @ np.linalg.solve(push.noise, push.own) + np.eye(4),
        push.own.T @ np.linalg.solve(push.noise, push.residual),
    )
    np.testing.assert_allclose(own_unknowns(push, 1.0, np.zeros(3)), joint, atol=1e-10)


def test_a_push_that_is_not_there_tells_nothing():
    pushes = made(np.random.default_rng(5))
    blind = [dc.replace(p, shared=np.zeros_like(p.shared)) for p in pushes]
    solution = solve(Whitened.of(blind, 1.0), np.array([0.2, 0.0, 0.0]), np.ones(3))
    np.testing.assert_allclose(solution.beta, [0.2, 0.0, 0.0], atol=1e-9)


def test_gains_of_pushes_without_an_effect_are_uniform_in_p():
    """Friction that scatters, an effect that acts like friction: the push is the unit, not the sample."""
    rng, p_values = np.random.default_rng(6), []
    for _ in range(400):
        n, d = 10, 2
        x, y = rng.standard_normal((n, d + 1)), rng.standard_normal(n)
        left = [_left(a, y) for a in (x[:, :d], x)]
        gain = n * np.log(left[0] / left[1])
        p_values.append(np.exp(log_probability(gain, 1, n, d)))
    assert stats.kstest(p_values, "uniform").pvalue > 0.01


def _left(design, y):
    fit = design @ np.linalg.lstsq(design, y, rcond=None)[0]
    return float((y - fit) @ (y - fit))


def test_more_gain_is_less_probable_and_more_directions_need_more_of_it():
    assert log_probability(30.0, 1, 10, 3) < log_probability(10.0, 1, 10, 3) < 0.0
    assert log_probability(30.0, 3, 10, 3) > log_probability(30.0, 1, 10, 3)


def test_what_would_leave_its_bounds_is_held_there_and_the_others_make_up_for_it():
    rng = np.random.default_rng(12)
    pushes = made(rng, beta=np.array([2.0, -1.0, 0.5]))
    for push in pushes:
        push.shared[:, 1] += 0.7 * push.shared[:, 0]  # what one may not do, the other does in part
    white, std = Whitened.of(pushes, 1.0), np.full(3, 10.0)
    bounds = np.array([-5.0, -5.0]), np.array([0.8, 5.0])  # of the first two; the third has none
    free, held = solve(white, np.zeros(3), std), solve(white, np.zeros(3), std, bounds)
    assert free.beta[0] > 1.0 and held.beta[0] == pytest.approx(0.8)
    assert held.beta[1] > free.beta[1] + 0.3
    y, x = white.y - 0.8 * white.x[:, 0], white.x[:, 1:]
    rest = np.linalg.solve(x.T @ x + np.eye(2) / 100.0, x.T @ y)
    assert held.beta[1:] == pytest.approx(rest, rel=1e-6)
    left = white.y - white.x @ held.beta
    assert held.chi2 == pytest.approx(left @ left + np.sum(held.beta**2) / 100.0) and held.chi2 > free.chi2 + 10.0
    np.testing.assert_array_equal(held.precision, free.precision)
    wide = solve(white, np.zeros(3), std, (np.full(3, -9.0), np.full(3, 9.0)))
    np.testing.assert_array_equal(wide.beta, free.beta)
    _, betas = left_out_scores(pushes, 1.0, np.zeros(3), std, bounds=bounds)
    assert betas[:, 0].max() <= 0.8 + 1e-12


@pytest.mark.parametrize("scatter", [0.3, 1.0, 4.0])
def test_what_steps_compare_is_the_posterior_from_which_the_scatter_is_learnt(scatter):
    """Where nothing is left to move, so that both are of one place."""
    pushes = [dc.replace(push, shared=0.0 * push.shared) for push in made(np.random.default_rng(4))]
    mean, std = np.zeros(3), np.ones(3)
    fitted = Fitted(
        state=State(u=np.full(3, 0.5), effects=(), own=(), scatter=scatter), pushes=tuple(pushes), prior_mean=mean,
        prior_std=std, solution=solve(Whitened.of(pushes, scatter), mean, std), predicted=(), score=0.0,
    )  # fmt: skip
    assert fitted.cost_here == pytest.approx(-2.0 * best_scatter(pushes, mean, std, among=[scatter])[1], rel=1e-9)
