"""When a model explains the pushes: how often frictions that only scatter are called something else."""

import numpy as np
import pytest

from physid_drake.diagnose.case import UNIT_SCATTER
from physid_drake.diagnose.evidence import MOST_SCATTER, scatter_p_value
from physid_drake.diagnose.linear import LinearPush, Whitened, best_scatter, solve
from physid_drake.diagnose.model import Fitted, State

NOTHING = np.zeros(0)


def fitted_to(frictions):
    """A model of pushes whose only unknown is their own friction, which each tells to 1 %."""
    pushes = tuple(
        LinearPush(
            residual=np.array([friction / 0.01]), shared=np.zeros((1, 0)), own=np.array([[UNIT_SCATTER / 0.01]]),
            noise=np.eye(1), friction=0,
        )
        for friction in frictions
    )  # fmt: skip
    scatter, score = best_scatter(pushes, NOTHING, NOTHING)
    state = State(u=NOTHING, effects=(), own=(), scatter=scatter)
    solution = solve(Whitened.of(pushes, scatter), NOTHING, NOTHING)
    return Fitted(
        state=state,
        pushes=pushes,
        prior_mean=NOTHING,
        prior_std=NOTHING,
        solution=solution,
        predicted=(),
        score=score,
    )


@pytest.mark.parametrize(("scatter", "most"), [(0.02, 0.0), (0.05, 0.001), (MOST_SCATTER, 0.015)])
def test_frictions_that_scatter_are_hardly_ever_called_too_scattered(scatter, most):
    rng = np.random.default_rng(3)
    called = [scatter_p_value(fitted_to(scatter * rng.standard_normal(10))) < 0.01 for _ in range(2000)]
    assert np.mean(called) <= most


def test_frictions_that_follow_something_else_are():
    of_a_slide = 0.25 * np.linspace(-1.0, 1.0, 10)  # say, of an object that sticks at first
    assert scatter_p_value(fitted_to(of_a_slide)) < 0.001
    assert scatter_p_value(fitted_to(0.2 * of_a_slide)) == 1.0
