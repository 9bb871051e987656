"""Whatever the unknowns, their unit cube, bounds and priors fit together; and what a belief makes of trials in it."""

import numpy as np
import pytest
from drawn import generators, numbers
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.stats import norm

from physid_drake.belief.gaussian_process import GaussianProcess, Hyperparameters, matern32
from physid_drake.belief.p_min import entropy, estimate_p_min, weigh_p_min
from physid_drake.errors import ParameterError
from physid_drake.ranges import SHORT_OF, Range
from physid_drake.space import Parameter, ParameterSpace


@st.composite
def parameters(draw, name, normal=None):
    """One unknown; bounds over six decades, which logarithms span, too."""
    log = draw(st.booleans())
    lower = draw(numbers(1e-6, 10.0)) if log else draw(numbers(-10.0, 10.0))
    upper = lower * draw(numbers(1.01, 1e6)) if log else lower + draw(numbers(1e-3, 100.0))
    share = draw(numbers(0.0, 1.0))
    mean = lower * (upper / lower) ** share if log else lower + share * (upper - lower)
    width = np.log(upper / lower) if log else upper - lower
    std = draw(numbers(0.1, 2.0).map(lambda s: float(s * width)))
    return Parameter(
        name=name, unit="-", lower=lower, upper=upper, prior_mean=min(max(mean, lower), upper),
        prior_std=std if normal or (normal is None and draw(st.booleans())) else None,
        scale="log" if log else "linear",
    )  # fmt: skip


@st.composite
def spaces(draw, most=4, normal=None):
    count = draw(st.integers(1, most))
    return ParameterSpace(parameters=tuple(draw(parameters(f"p{k}", normal)) for k in range(count)))


def correlation(rng, d):
    """A correlation of d numbers that is far from singular."""
    root = np.vstack([rng.normal(size=(2 * d, d)), np.eye(d)])
    covariance = root.T @ root
    made = covariance / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    made = 0.5 * (made + made.T)
    np.fill_diagonal(made, 1.0)
    return made


def one_in_each(shares):
    """Whether of n numbers (n,) one lies in each n-th of [0, 1], but for rounding at its edges."""
    n = len(shares)
    off = np.sort(shares) * n - np.arange(n)
    return bool((off > -1e-5).all() and (off < 1.0 + 1e-5).all())


# ----------------------------------------------------------------------------------------------------- the unit cube


@given(spaces(), generators())
def test_the_unit_cube_there_and_back_is_the_same_point_and_its_corners_are_the_bounds(space, rng):
    u = np.vstack([rng.uniform(size=(8, space.dimension)), np.zeros(space.dimension), np.ones(space.dimension)])
    thetas = space.from_unit(u)
    space.check(thetas)
    there = space.to_unit(thetas)
    # Bounds 1e-3 apart and 10 away hold 1e-12 of their width.
    assert np.abs(there - u).max() < 1e-11
    assert space.from_unit(there) == pytest.approx(thetas, rel=1e-11, abs=1e-13)
    assert thetas[-2] == pytest.approx(space.lower, rel=1e-14) and thetas[-1] == pytest.approx(space.upper, rel=1e-14)


@given(spaces(most=1), st.lists(numbers(0.0, 1.0), min_size=2, max_size=2))
def test_what_is_further_in_the_unit_cube_is_further_in_the_space(space, u):
    low, high = sorted(u)
    less, more = space.from_unit([[low], [high]])[:, 0]
    assert less <= more
    # Even where all else is rounded away, a step of the cube's width is one of the scale's.
    (p,) = space.parameters
    step = (p.to_scale(more) - p.to_scale(less)) / (p.to_scale(p.upper) - p.to_scale(p.lower))
    assert step == pytest.approx(high - low, abs=1e-11)


@given(spaces(), generators(), numbers(1e-6, 10.0), st.booleans(), st.data())
def test_a_point_beyond_a_bound_is_refused_by_the_name_of_its_parameter(space, rng, beyond, above, data):
    theta = space.from_unit(rng.uniform(size=space.dimension))
    k = data.draw(st.integers(0, space.dimension - 1))
    theta[k] = space.upper[k] + beyond if above else space.lower[k] - beyond
    for refuses in (space.check, space.to_unit, space.as_dict):
        with pytest.raises(ParameterError, match=f"'p{k}'"):
            refuses(theta)


# ---------------------------------------------------------------------------------------------------------- priors


@given(spaces(), generators(), st.integers(0, 6))
def test_of_so_many_samples_of_a_prior_one_lies_in_each_such_part_of_its_probability(space, rng, log_count):
    """By the closed form of a truncated normal's distribution; Sobol points share out each dimension evenly."""
    thetas = space.sample(rng, 2**log_count, from_prior=True)
    space.check(thetas)
    for p, column in zip(space.parameters, thetas.T, strict=True):
        x, low, high = p.to_scale(column), p.to_scale(p.lower), p.to_scale(p.upper)
        if p.prior_std is None:
            assert one_in_each((x - low) / (high - low))
            continue
        at, least, most = (norm.cdf(v, p.to_scale(p.prior_mean), p.prior_std) for v in (x, low, high))
        assert one_in_each((at - least) / (most - least))


@given(generators(), st.integers(2, 4), st.integers(1, 6))
def test_correlated_samples_are_independent_normals_once_their_correlation_is_undone(rng, d, log_count):
    """Where no bound is near: x = mean + std L s with L L^T the correlation, and each s is shared out evenly."""
    matrix, means, stds = correlation(rng, d), rng.uniform(-10.0, 10.0, d), rng.uniform(0.1, 50.0, d)
    some = tuple(
        Parameter(name=f"p{k}", unit="-", lower=-1e3, upper=1e3, prior_mean=mean, prior_std=std)
        for k, (mean, std) in enumerate(zip(means, stds, strict=True))
    )
    drawn = ParameterSpace(parameters=some, correlation=matrix).sample(rng, 2**log_count, from_prior=True)
    scores = np.linalg.solve(np.linalg.cholesky(matrix), ((drawn - means) / stds).T)
    assert all(one_in_each(norm.cdf(row)) for row in scores)


@given(spaces(normal=True), generators())
def test_samples_of_correlated_priors_keep_within_bounds_and_without_correlation_are_those_of_each(space, rng):
    d = space.dimension
    seed = int(rng.integers(2**32))
    some = ParameterSpace(parameters=space.parameters, correlation=correlation(rng, d))
    some.check(some.sample(np.random.default_rng(seed), 32, from_prior=True))
    none = ParameterSpace(parameters=space.parameters, correlation=np.eye(d))
    found, alone = (one.sample(np.random.default_rng(seed), 32, from_prior=True) for one in (none, space))
    assert np.abs(none.to_unit(found) - space.to_unit(alone)).max() < 1e-9


@given(generators(), st.integers(2, 4))
def test_a_correlation_is_taken_if_and_only_if_it_is_positive_definite(rng, d):
    values = np.triu(rng.uniform(-1.0, 1.0, (d, d)), 1)
    matrix = values + values.T + np.eye(d)
    least = np.linalg.eigvalsh(matrix)[0]
    assume(abs(least) > 1e-6)
    some = tuple(
        Parameter(name=f"p{k}", unit="-", lower=0.0, upper=1.0, prior_mean=0.5, prior_std=0.1) for k in range(d)
    )
    if least > 0.0:
        ParameterSpace(parameters=some, correlation=matrix)
    else:
        with pytest.raises(ParameterError, match="positive definite"):
            ParameterSpace(parameters=some, correlation=matrix)


# ----------------------------------------------------------------------------------------------------------- ranges

ends = numbers(-5.0, 5.0)


@st.composite
def ranges(draw):
    """Intervals that are longer than what is kept from an end that does not belong to them."""
    low, width = draw(ends), draw(numbers(0.01, 5.0))
    low_of, high_of = draw(st.sampled_from(("above", "least", None))), draw(st.sampled_from(("most", "below", None)))
    return Range(**{name: end for name, end in ((low_of, low), (high_of, low + width)) if name is not None})


@given(ranges(), numbers(-20.0, 20.0), numbers(-20.0, 20.0))
def test_the_nearest_value_of_a_range_is_in_it_and_no_other_is_nearer(range_, value, other):
    nearest = range_.nearest(value)
    assert range_.holds(nearest) and range_.nearest(nearest) == nearest
    assert not range_.holds(value) or nearest == value
    assert not range_.holds(other) or abs(nearest - value) <= abs(other - value) + SHORT_OF + 1e-12
    assert not range_.holds(float("nan"))


# ----------------------------------------------------------------------------------------------------------- beliefs


@st.composite
def processes(draw):
    """A Gaussian process after some trials."""
    rng, d, m = draw(generators()), draw(st.integers(1, 3)), draw(st.integers(2, 8))
    hyper = Hyperparameters(
        amplitude=draw(numbers(0.05, 20.0)), lengths=rng.uniform(0.1, 5.0, d), noise=draw(numbers(1e-4, 0.1))
    )
    return GaussianProcess(u=rng.uniform(size=(m, d)), targets=rng.normal(size=m), hyperparameters=hyper), rng


@given(processes())
def test_a_belief_is_what_dense_linear_algebra_says_in_whatever_order_trials_came(made):
    process, rng = made
    hyper, u = process.hyperparameters, rng.uniform(size=(5, process.u.shape[1]))
    gram = matern32(process.u, process.u, hyper) + (hyper.noise + 1e-10) * np.eye(len(process.u))
    cross = matern32(u, process.u, hyper)
    offset, scale = process.targets.mean(), process.targets.std()
    mean = offset + cross @ np.linalg.solve(gram, process.targets - offset)
    variance = hyper.amplitude - np.einsum("ij,ji->i", cross, np.linalg.solve(gram, cross.T))
    order = rng.permutation(len(process.u))
    shuffled = GaussianProcess(u=process.u[order], targets=process.targets[order], hyperparameters=hyper)
    for one in (process, shuffled):
        found, std = one.predict(u)
        assert np.abs(found - mean).max() < 1e-8
        assert np.abs(std**2 - scale**2 * variance).max() < 1e-8
        assert np.abs(np.diag(one.covariance(u, u)) - std**2).max() < 1e-8


@given(processes(), numbers(-1e3, 1e3), numbers(1e-3, 1e3), st.booleans())
def test_errors_in_another_unit_make_the_same_belief_in_that_unit(made, shift, size, turned):
    process, rng = made
    factor = -size if turned else size
    u = rng.uniform(size=(5, process.u.shape[1]))
    other = GaussianProcess(
        u=process.u, targets=shift + factor * process.targets, hyperparameters=process.hyperparameters
    )
    (mean, std), (moved, wider) = process.predict(u), other.predict(u)
    unit = size * process.scale
    assert np.abs(moved - (shift + factor * mean)).max() < 1e-7 * (unit + abs(shift))
    assert np.abs(wider - size * std).max() < 1e-7 * unit + 1e-9 * abs(shift)


@given(processes())
def test_one_more_trial_never_makes_a_function_less_certain(made):
    """In units of the spread of the errors, which a trial changes."""
    process, rng = made
    u, more = rng.uniform(size=(6, process.u.shape[1])), rng.uniform(size=(1, process.u.shape[1]))
    after = GaussianProcess(
        u=np.vstack([process.u, more]), targets=np.append(process.targets, rng.normal()),
        hyperparameters=process.hyperparameters,
    )  # fmt: skip
    before, then = (one.predict(u)[1] / one.scale for one in (process, after))
    assert (then <= before + 1e-7).all()


@given(generators(), st.integers(1, 40), st.integers(1, 12))
def test_p_min_is_a_probability_that_follows_its_candidates_and_knows_no_unit(rng, n_samples, n):
    samples = rng.normal(size=(n_samples, n))
    p, order = estimate_p_min(samples), rng.permutation(n)
    assert p.sum() == pytest.approx(1.0) and (p >= 0.0).all()
    assert np.array_equal(estimate_p_min(samples[:, order]), p[order])
    assert np.array_equal(estimate_p_min(4.0 * samples + rng.normal(size=(n_samples, 1))), p)
    assert -1e-12 <= entropy(p) <= np.log(min(n, n_samples)) + 1e-12


@given(generators(), st.integers(2, 12), numbers(0.0, 30.0))
def test_prior_weights_follow_their_candidates_and_only_ratios_of_them_count(rng, n, spread):
    p = estimate_p_min(rng.normal(size=(50, n)))
    same, whole = weigh_p_min(p, np.full(n, spread))
    assert np.array_equal(same, p) and whole == 1.0
    weights, order = spread * rng.normal(size=n), rng.permutation(n)
    found, power = weigh_p_min(p, weights)
    assert found.sum() == pytest.approx(1.0) and 0.0 <= power <= 1.0 and not found[p == 0.0].any()
    moved, same = weigh_p_min(p[order], weights[order] + 8.0)
    assert moved == pytest.approx(found[order], abs=1e-9) and same == pytest.approx(power, abs=1e-9)
    if power == 1.0 and not np.array_equal(found, p):  # Bayes: in proportion to prior times likelihood
        held = p > 0.0
        ratio = np.log(found[held] / p[held]) - weights[held]
        assert np.ptp(ratio) < 1e-9
