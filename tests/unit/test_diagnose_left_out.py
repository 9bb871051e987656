"""What counts as nearer to pushes that were left out, and how far an effect must move them for that."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose.left_out import comes_nearer, errors_of, least_motion

RNG = np.random.default_rng(4)
SIGMAS = np.array([3e-4, 3e-4, 3e-3])


def features():
    """Four windows of a push's poses, followed by two force components that are no part of its error."""
    return SimpleNamespace(sigmas=SIGMAS, poses=lambda vector: vector[:12].reshape(3, 4).T * SIGMAS)


CASE = SimpleNamespace(features=[features() for _ in range(10)])


def errors(size, odd=1.0):
    """Of ten pushes, each with this root mean square; the last is ``odd`` times as far off."""
    made = []
    for k in range(10):
        vector = RNG.standard_normal(14)
        vector *= size * (odd if k == 9 else 1.0) / np.sqrt(np.mean(vector[:12] ** 2))
        made.append(vector)
    return made


@pytest.mark.parametrize("odd", [1.0, 40.0])
def test_an_effect_shows_if_it_moves_the_pushes_far_enough(odd):
    """One push that is far off with the effect and without it hides nothing."""
    left = errors(1.3, odd)
    least = least_motion(CASE, left)
    assert least == pytest.approx(np.sqrt(0.44) * 1.3)
    for moves, shows in ((1.02, True), (0.98, False)):
        # Across what is left, as independent errors are in the mean.
        squares = [np.sqrt(1.3**2 + (moves * least) ** 2) / 1.3] * 9 + [1.0]
        before = [factor * vector for factor, vector in zip(squares, left, strict=True)]
        assert comes_nearer(CASE, before, left) == shows


def test_errors_are_in_deviations_and_in_metres():
    whole = errors_of(CASE, errors(2.0))
    assert whole.rms == pytest.approx(2.0) and whole.per_push == pytest.approx([2.0] * 10)
    assert errors_of(CASE, [np.r_[np.ones(8), np.zeros(6)]] * 10).position == pytest.approx(3e-4 * np.sqrt(2.0))
