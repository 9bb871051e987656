"""Which pushes are too far off to be noise."""

from types import SimpleNamespace

import numpy as np

from physid_drake.diagnose.conclude import ODD, odd_pushes
from physid_drake.inference.push import TAIL

M, PUSHES = 45, 12


def fit_of(squares, noise_scale=1.0):
    return SimpleNamespace(
        pushes=[SimpleNamespace(residual=np.zeros(M))] * len(squares),
        weighed=[SimpleNamespace(square=square) for square in squares], noise_scale=noise_scale,
    )  # fmt: skip


def drawn(rng, count):
    """Squares of errors that are t distributed push by push."""
    return rng.chisquare(M, count) / (rng.chisquare(TAIL, count) / TAIL)


def test_noise_with_its_heavy_tail_makes_no_push_odd_more_often_than_is_said():
    rng, rounds = np.random.default_rng(0), 20_000
    often = sum(bool(odd_pushes(fit_of(drawn(rng, PUSHES)))) for _ in range(rounds)) / rounds
    assert 0.5 * ODD < often < 1.5 * ODD  # measured: 0.00090


def test_a_push_that_nothing_explains_is_named_whatever_the_scale():
    squares = drawn(np.random.default_rng(1), PUSHES)
    squares[[2, 7]] = 200.0 * M, 30.0 * M
    assert odd_pushes(fit_of(squares)) == (2, 7)
    assert odd_pushes(fit_of(9.0 * squares, noise_scale=3.0)) == (2, 7)
