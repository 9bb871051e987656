"""A noise that nobody knows is as loud as most pushes say."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose.linear import LinearPush
from physid_drake.diagnose.loudness import _left_over, quieter

PUSHES = 40


def case_of_ends(odd=()):
    return SimpleNamespace(features=[SimpleNamespace(middles=np.zeros(1))] * PUSHES, odd=odd)


def model_that_leaves(residuals, forces=None):
    """A model whose pushes have an end pose each, (n, 3) [standard deviations], and perhaps forces (n, k)."""
    vectors = residuals if forces is None else np.hstack([residuals, forces])
    pushes = tuple(
        LinearPush(
            residual=r, shared=np.zeros((len(r), 1)), own=np.zeros((len(r), 1)), noise=np.eye(len(r)), friction=0
        )
        for r in vectors
    )
    return SimpleNamespace(
        pushes=pushes, state=SimpleNamespace(scatter=1.0), solution=SimpleNamespace(beta=np.zeros(1)),
        reduced_chi2=float(np.mean(vectors**2)),
    )  # fmt: skip


@pytest.fixture
def errors():
    return 3.0 * np.random.default_rng(0).normal(size=(PUSHES, 3))


def test_the_noise_is_that_of_most_pushes(errors):
    factor, force_factor, odd = _left_over(case_of_ends(), model_that_leaves(errors))
    assert factor == pytest.approx(3.0, rel=0.15)  # the median of 40 has a standard error of 9 %
    assert force_factor == 1.0
    assert np.mean(np.array(odd) == 1.0) > 0.9


def test_a_push_that_stands_out_is_louder_by_itself(errors):
    usual, _, _ = _left_over(case_of_ends(), model_that_leaves(errors))
    errors[5] = [40.0, -40.0, 40.0]
    factor, _, odd = _left_over(case_of_ends(), model_that_leaves(errors))
    assert factor == pytest.approx(usual, rel=0.1)
    assert odd[5] == pytest.approx(40.0 / (2.0 * factor), rel=1e-9)
    assert max(odd[:5] + odd[6:]) < 1.5


def test_what_a_loud_push_leaves_is_counted_in_everyones_deviations(errors):
    errors[5] = [40.0, -40.0, 40.0]
    first = _left_over(case_of_ends(), model_that_leaves(errors))
    errors[5] /= 4.0
    loud = tuple(4.0 if k == 5 else 1.0 for k in range(PUSHES))
    again = _left_over(case_of_ends(loud), model_that_leaves(errors))
    np.testing.assert_allclose(again[2], first[2], rtol=1e-9)


def test_forces_have_a_factor_of_their_own(errors):
    forces = 2.0 * np.random.default_rng(1).normal(size=(PUSHES, 10))
    _, force_factor, _ = _left_over(case_of_ends(), model_that_leaves(errors, forces))
    assert force_factor == pytest.approx(2.0, rel=0.1)


def test_half_the_deviation_is_a_quarter_of_the_variance():
    one, half = (SimpleNamespace(noise=SimpleNamespace(position=p)) for p in (1e-3, 5e-4))
    assert quieter(one, half) == pytest.approx(0.25)
