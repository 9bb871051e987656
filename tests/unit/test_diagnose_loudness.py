"""A noise that nobody knows is as loud as most pushes say."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose.linear import LinearPush
from physid_drake.diagnose.loudness import _left_over, quieter
from physid_drake.pushes.features import PushFeatures
from physid_drake.pushes.tracker_noise import ForceNoise

PUSHES = 40


def case_of_ends(odd=(), windows=0):
    features = PushFeatures(
        averaging=np.ones((1, 1)), middles=np.zeros(1), sigmas=np.ones(3), recorded=np.zeros(3 + 2 * windows),
        noise=np.eye(3 + 2 * windows), force_std=np.full(windows, 0.1), force_size=2.0,
        force_way=np.linspace(0.0, 0.02, windows),
    )  # fmt: skip
    return SimpleNamespace(features=[features] * PUSHES, odd=odd, noise=SimpleNamespace(forces=ForceNoise()))


def model_that_leaves(residuals, forces=None):
    """A model whose pushes have an end pose each, (n, 3) [standard deviations], and perhaps forces (n, 2k)."""
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
    factor, forces, odd = _left_over(case_of_ends(), model_that_leaves(errors))
    assert factor == pytest.approx(3.0, rel=0.15)  # the median of 40 has a standard error of 9 %
    assert forces == ForceNoise()
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


@pytest.mark.parametrize(("scatter", "offset"), [(0.12, 0.0), (0.03, 0.16), (0.12, 0.32)])
def test_forces_wander_and_are_off_as_much_as_they_do(errors, scatter, offset):
    case = case_of_ends(windows=40)
    lower = np.linalg.cholesky(case.features[0].force_noise(ForceNoise(scatter=scatter, offset=offset)))
    white = np.random.default_rng(1).normal(size=(PUSHES, 2, 40))
    _, forces, _ = _left_over(case, model_that_leaves(errors, (white @ lower.T).reshape(PUSHES, -1)))
    # The grids' steps are a factor of 1.41 and 2.
    assert forces.scatter == pytest.approx(scatter, rel=0.5)
    assert forces.offset == pytest.approx(offset, rel=0.6, abs=0.03)


def test_half_the_deviation_is_a_quarter_of_the_variance():
    one, half = (SimpleNamespace(noise=SimpleNamespace(position=p)) for p in (1e-3, 5e-4))
    assert quieter(one, half) == pytest.approx(0.25)
