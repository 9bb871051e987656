"""Whatever linear pushes are: the objective is the density that it says it is, in whatever units and order."""

import dataclasses as dc
from typing import NamedTuple

import numpy as np
import pytest
from drawn import generators, numbers
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from physid_drake.inference.bounded import bounded
from physid_drake.inference.push import (
    NO_TAIL,
    TAIL,
    LinearPush,
    cost_of,
    held_out,
    noise_scale_of,
    normal_equations,
    weighed,
    weight_of,
    without,
)

tails = st.sampled_from((3.0, TAIL, 100.0, NO_TAIL))
loudnesses = numbers(0.3, 30.0)


class Made(NamedTuple):
    push: LinearPush
    prior: np.ndarray


@st.composite
def pushes(draw, shared=None):
    """One push: of fewer numbers than unknowns, too, and in coordinates whose units are far apart."""
    rng = draw(generators())
    m, k = draw(st.integers(1, 12)), draw(st.integers(0, 5))
    n = draw(st.integers(0, 4)) if shared is None else shared
    size = draw(st.sampled_from((0.1, 1.0, 30.0)))
    units = 10.0 ** rng.uniform(-3.0, 3.0, k)
    return Made(
        LinearPush(
            residual=size * rng.normal(size=m),
            shared=rng.normal(size=(m, n)),
            nuisance=rng.normal(size=(m, k)) * units,
        ),
        rng.uniform(0.1, 2.0, k) / units,
    )


@st.composite
def several(draw, least=2, most=5):
    n = draw(st.integers(1, 4))
    return n, draw(st.lists(pushes(shared=n), min_size=least, max_size=most))


def as_weighed(made, noise_scale=1.0, tail=NO_TAIL):
    push, prior = made
    return weighed(push.residual, push.shared, push.nuisance, prior, noise_scale, tail)


def spread(made, noise_scale):
    """Covariance (m, m) of a push's errors with its unknowns integrated out."""
    push, prior = made
    return noise_scale**2 * np.eye(len(push.residual)) + (push.nuisance * prior**2) @ push.nuisance.T


def assert_same(one, other, to=1e-7):
    """Two pushes, weighed, say the same of what they share."""
    assert one.log_density == pytest.approx(other.log_density, rel=to, abs=to)
    assert one.precision == pytest.approx(other.precision, rel=to, abs=to)
    assert one.right == pytest.approx(other.right, rel=to, abs=to)
    assert one.square == pytest.approx(other.square, rel=to, abs=to)
    assert one.weight == pytest.approx(other.weight, rel=to)


# ------------------------------------------------------------------------------------------------------ one push


@given(pushes(), loudnesses)
def test_a_push_with_normal_errors_has_the_density_of_a_dense_gaussian(made, noise_scale):
    push, _ = made
    one, covariance = as_weighed(made, noise_scale), spread(made, noise_scale)
    far = float(push.residual @ push.residual) / noise_scale**2 + len(push.residual)
    off = 1e-6 + far**2 / NO_TAIL  # what so many degrees of freedom leave of a tail
    density = stats.multivariate_normal(cov=covariance).logpdf(push.residual)
    assert one.log_density == pytest.approx(density, abs=off)
    tells = push.shared.T @ np.linalg.solve(covariance, np.column_stack([push.shared, push.residual]))
    assert one.precision == pytest.approx(tells[:, :-1], rel=off, abs=off)
    assert one.right == pytest.approx(tells[:, -1], rel=off, abs=off)


@given(pushes(), loudnesses, st.sampled_from((3.0, TAIL, 100.0)))
def test_without_unknowns_of_its_own_a_push_has_the_density_of_a_t_distribution(made, noise_scale, tail):
    push, count = made.push, len(made.push.residual)
    alone = Made(dc.replace(push, nuisance=np.zeros((count, 0))), np.zeros(0))
    heavy = stats.multivariate_t(shape=noise_scale**2 * np.eye(count), df=tail)
    assert as_weighed(alone, noise_scale, tail).log_density == pytest.approx(heavy.logpdf(push.residual), rel=1e-9)


@given(pushes(), loudnesses, tails, generators())
def test_unknowns_in_other_units_with_their_priors_change_nothing(made, noise_scale, tail, rng):
    (push, prior), units = made, 10.0 ** rng.uniform(-6.0, 6.0, len(made.prior))
    one, other = as_weighed(made, noise_scale, tail), as_weighed(
        Made(dc.replace(push, nuisance=push.nuisance * units), prior / units), noise_scale, tail
    )  # fmt: skip
    assert_same(one, other)
    assert other.nuisance * units / prior == pytest.approx(one.nuisance / prior, rel=1e-6, abs=1e-6)
    assert other.to_nuisance * (units / prior)[:, None] == pytest.approx(
        one.to_nuisance / prior[:, None], rel=1e-6, abs=1e-6
    )


@given(pushes(), loudnesses, tails, generators())
def test_a_push_may_be_turned_in_the_space_of_its_errors_and_of_its_unknowns(made, noise_scale, tail, rng):
    """Both are round: errors of one noise scale, and unknowns in units of their priors."""
    push, prior = made
    m, k = push.nuisance.shape
    rows, columns = (np.linalg.qr(rng.normal(size=(one, one)))[0] for one in (m, k))
    turned = LinearPush(
        residual=rows @ push.residual, shared=rows @ push.shared, nuisance=rows @ (push.nuisance * prior) @ columns
    )
    assert_same(as_weighed(made, noise_scale, tail), as_weighed(Made(turned, np.ones(k)), noise_scale, tail))


@given(pushes(), loudnesses, generators())
def test_what_is_shared_in_other_coordinates_says_the_same_in_those(made, noise_scale, rng):
    push, n = made.push, made.push.shared.shape[1]
    other = rng.normal(size=(n, n)) + 3.0 * np.eye(n)
    one = as_weighed(made, noise_scale, TAIL)
    same = as_weighed(Made(dc.replace(push, shared=push.shared @ other), made.prior), noise_scale, TAIL)
    assert same.precision == pytest.approx(other.T @ one.precision @ other, rel=1e-7, abs=1e-7)
    assert same.right == pytest.approx(other.T @ one.right, rel=1e-7, abs=1e-7)
    assert same.log_density == one.log_density


@given(pushes(), loudnesses, tails, generators())
def test_no_unknowns_are_likelier_than_those_that_a_push_is_said_to_have(made, noise_scale, tail, rng):
    (push, prior), one = made, as_weighed(made, noise_scale, tail)

    def cost(nuisance):
        errors = push.residual - push.nuisance @ nuisance
        square = float(errors @ errors)
        return cost_of(square, len(errors), noise_scale, tail) + float(np.sum((nuisance / prior) ** 2))

    best = cost(one.nuisance)
    for size in (1e-3, 0.1, 1.0):
        assert best <= cost(one.nuisance + size * prior * rng.normal(size=len(prior))) + 1e-6 * (1.0 + abs(best))


@given(numbers(0.0, 1e4), st.integers(1, 50), loudnesses, tails)
def test_a_pushs_weight_is_how_fast_its_cost_grows_with_its_square(square, count, noise_scale, tail):
    step = 1e-4 * (1.0 + square)
    ends = [cost_of(square + sign * step, count, noise_scale, tail) for sign in (0.0, 1.0, 2.0)]
    slope = (-1.5 * ends[0] + 2.0 * ends[1] - 0.5 * ends[2]) / step
    assert weight_of(square, count, noise_scale, tail) == pytest.approx(slope, rel=1e-4)


# --------------------------------------------------------------------------------------------------------- noise
# scale


@given(generators(), st.integers(1, 8), numbers(1e-2, 1e2))
def test_no_loudness_is_likelier_than_that_which_is_found_and_it_has_the_unit_of_the_errors(rng, n, unit):
    counts, squares = rng.integers(1, 40, n), rng.uniform(0.1, 100.0, n)
    found, order = noise_scale_of(squares, counts, 1e-6, TAIL), rng.permutation(n)

    def cost(noise_scale):
        return sum(cost_of(q, m, noise_scale, TAIL) for q, m in zip(squares, counts, strict=True))

    for ratio in (0.5, 0.9, 0.99, 1.01, 1.1, 2.0):
        assert cost(found) <= cost(ratio * found) + 1e-9
    assert noise_scale_of(squares * unit**2, counts, 1e-6 * unit, TAIL) == pytest.approx(unit * found, rel=1e-9)
    assert noise_scale_of(squares[order], counts[order], 1e-6, TAIL) == pytest.approx(found, rel=1e-12)
    assert noise_scale_of(squares, counts, 2.0 * found, TAIL) == pytest.approx(2.0 * found)


# ------------------------------------------------------------------------------------------------ several pushes


def joint(some, mean, std):
    """Log density of all pushes at once, z and all unknowns integrated out: one dense Gaussian."""
    if not some:
        return 0.0
    shared = np.vstack([push.shared for push, _ in some])
    residual = np.concatenate([push.residual for push, _ in some]) - shared @ mean
    covariance = (shared * std**2) @ shared.T
    at = 0
    for made in some:
        m = len(made.push.residual)
        covariance[at : at + m, at : at + m] += spread(made, 1.0)
        at += m
    return stats.multivariate_normal(cov=covariance).logpdf(residual)


def scores(some, mean, std, noise_scale=1.0, tail=NO_TAIL, folds=None):
    found = [as_weighed(one, noise_scale, tail) for one in some]
    return held_out(
        [push for push, _ in some], [prior for _, prior in some], mean, np.diag(std**-2.0), noise_scale, found, tail,
        folds,
    )  # fmt: skip


def off_by(some):
    """What is left of NO_TAIL in log densities of these pushes."""
    return 1e-6 + sum((float(p.residual @ p.residual) + len(p.residual)) ** 2 for p, _ in some) / NO_TAIL


@given(several(), generators())
def test_what_pushes_add_one_after_the_other_is_what_they_are_together(drawn, rng):
    """The chain rule: log p(y1) + log p(y2 | y1) + ... = log p(y1, y2, ...), in any order."""
    n, some = drawn
    mean, std = rng.normal(size=n), rng.uniform(0.3, 3.0, n)
    some = [some[i] for i in rng.permutation(len(some))]
    added = sum(scores(some[: i + 1], mean, std)[i] for i in range(len(some)))
    assert added == pytest.approx(joint(some, mean, std), abs=10.0 * off_by(some))


@given(several(least=3), generators(), st.data())
def test_a_push_outside_its_fold_is_as_likely_as_the_others_make_it(drawn, rng, data):
    n, some = drawn
    mean, std = rng.normal(size=n), rng.uniform(0.3, 3.0, n)
    fold = sorted(data.draw(st.sets(st.integers(0, len(some) - 1), min_size=1, max_size=len(some) - 1)))
    rest = [i for i in range(len(some)) if i not in fold]
    found = scores(some, mean, std, folds=[fold])
    others = [some[i] for i in rest]
    for i in fold:
        want = joint([*others, some[i]], mean, std) - joint(others, mean, std)
        assert found[i] == pytest.approx(want, abs=10.0 * off_by(some))
    assert not found[rest].any()


@given(several(), generators(), loudnesses, tails)
def test_held_out_densities_follow_their_pushes_in_any_order_and_coordinates(drawn, rng, noise_scale, tail):
    n, some = drawn
    mean, std, units = rng.normal(size=n), rng.uniform(0.3, 3.0, n), 10.0 ** rng.uniform(-8.0, 8.0, n)
    order = rng.permutation(len(some))
    one = scores(some, mean, std, noise_scale, tail)
    shuffled = scores([some[i] for i in order], mean, std, noise_scale, tail)
    assert shuffled == pytest.approx(one[order], rel=1e-8, abs=1e-8)
    other = [Made(dc.replace(push, shared=push.shared * units), prior) for push, prior in some]
    assert scores(other, mean / units, std / units, noise_scale, tail) == pytest.approx(one, rel=1e-6, abs=1e-6)


@given(several(), generators())
def test_what_pushes_share_is_where_their_equations_have_it_and_as_sure(drawn, rng):
    n, some = drawn
    mean, std = rng.normal(size=n), rng.uniform(0.3, 3.0, n)
    found = [as_weighed(one) for one in some]
    precision, right = normal_equations(found, mean, np.diag(std**-2.0))
    dz, root = without([], mean, np.diag(std**-2.0), found)
    assert dz == pytest.approx(np.linalg.solve(precision, right), rel=1e-7, abs=1e-7)
    assert root @ root.T == pytest.approx(np.linalg.inv(precision), rel=1e-7, abs=1e-9)


@given(several(), generators())
def test_what_pushes_share_is_in_other_units_the_same(drawn, rng):
    n, some = drawn
    mean, std, units = rng.normal(size=n), rng.uniform(0.3, 3.0, n), 10.0 ** rng.uniform(-8.0, 8.0, n)
    precision, right = normal_equations([as_weighed(one) for one in some], mean, np.diag(std**-2.0))
    other = [Made(dc.replace(push, shared=push.shared * units), prior) for push, prior in some]
    there, way = normal_equations([as_weighed(one) for one in other], mean / units, np.diag((std / units) ** -2.0))
    assert there == pytest.approx(precision * np.outer(units, units), rel=1e-9)
    assert way == pytest.approx(right * units, rel=1e-7, abs=1e-9 * np.abs(right * units).max())


# ------------------------------------------------------------------------------------------------------------ bounds


@st.composite
def quadratics(draw):
    """Precision, right and bounds of unknowns, in units that are up to `decades` apart; some have no bounds."""
    rng, d, decades = draw(generators()), draw(st.integers(1, 9)), draw(st.sampled_from((0.0, 3.0, 7.0)))
    rows = rng.normal(size=(d + 3, d))
    likeliest = rng.normal(size=d) * draw(st.sampled_from((0.3, 2.0, 20.0)))
    units = 10.0 ** (decades * rng.uniform(size=d))
    count = draw(st.integers(0, d))
    least, most = -rng.exponential(size=count), rng.exponential(size=count)
    least[rng.uniform(size=count) < 0.2], most[rng.uniform(size=count) < 0.2] = -np.inf, np.inf
    return rows.T @ rows, rows.T @ rows @ likeliest, (least, most), units


@given(quadratics())
def test_bounded_unknowns_are_where_no_way_within_bounds_leads_down(drawn):
    """Karush, Kuhn, Tucker: the slope is none in between, and points out of the bounds where one is met."""
    precision, right, (least, most), units = drawn
    count, d = len(least), len(right)
    beta = units * bounded(
        precision * np.outer(units, units), right * units, (least / units[:count], most / units[:count])
    )  # fmt: skip
    low, high = (np.append(one, np.full(d - count, end)) for one, end in ((least, -np.inf), (most, np.inf)))
    assert (beta >= low - 1e-12).all() and (beta <= high + 1e-12).all()
    slope = (precision @ beta - right) / np.abs(precision).max() / (1.0 + np.abs(beta).max())
    at_low, at_high, none = beta <= low + 1e-9, beta >= high - 1e-9, 1e-11  # measured 2e-14
    assert (slope[at_low & ~at_high] > -none).all() and (slope[at_high & ~at_low] < none).all()
    assert np.abs(slope[~at_low & ~at_high]).max(initial=0.0) < none


@given(quadratics())
def test_bounds_that_are_not_met_change_nothing(drawn):
    precision, right, _, _ = drawn
    free = bounded(precision, right, None)
    assert free == pytest.approx(np.linalg.solve(precision, right))
    assert np.array_equal(bounded(precision, right, (free - 1.0, free + 1.0)), free)
