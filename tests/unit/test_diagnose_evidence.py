"""When a model explains the pushes: how often frictions that only scatter are called something else."""

import dataclasses as dc
from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose.evidence import MOST_SCATTER, mismatch, scatter_p_value, unexplained
from physid_drake.diagnose.frictions import friction_trend
from physid_drake.diagnose.linear import LinearPush, Whitened, best_scatter, solve
from physid_drake.diagnose.model import Fitted, State
from physid_drake.pushes.case import UNIT_SCATTER

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


@pytest.mark.slow
@pytest.mark.parametrize(("scatter", "most"), [(0.02, 0.0), (0.05, 0.001), (MOST_SCATTER, 0.005)])
def test_frictions_that_scatter_are_hardly_ever_called_too_scattered(scatter, most):
    rng = np.random.default_rng(3)
    called = [scatter_p_value(fitted_to(scatter * rng.standard_normal(10))) < 0.01 for _ in range(600)]
    assert np.mean(called) <= most


def test_frictions_that_follow_something_else_are():
    of_a_slide = 0.25 * np.linspace(-1.0, 1.0, 10)  # say, of an object that sticks at first
    assert scatter_p_value(fitted_to(of_a_slide)) < 0.002
    assert scatter_p_value(fitted_to(0.2 * of_a_slide)) == 1.0


@pytest.mark.parametrize(("doubt", "called"), [(0.0, 1.0), (0.2, 0.0)])
def test_noise_that_rests_hardly_tell_is_no_mismatch(doubt, called):
    # Left by noise whose variance is 1.5 times what rests made of it: two standard deviations, or impossible.
    rng = np.random.default_rng(6)
    worlds = [dc.replace(fitted_to_noise(1.5**0.5 * rng.standard_normal(400)), doubt=doubt) for _ in range(20)]
    assert np.mean([mismatch(world, None) < 0.01 for world in worlds]) == pytest.approx(called, abs=0.2)


@pytest.mark.parametrize("doubt", [0.1, 0.2, 0.4])
def test_noise_that_was_seen_at_rest_is_called_a_mismatch_as_seldom_as_is_said(doubt):
    rng, seen_with = np.random.default_rng(7), int(2.0 / doubt**2)
    stds = np.sqrt(seen_with / rng.chisquare(seen_with, 400))  # true over seen
    worlds = [dc.replace(fitted_to_noise(std * rng.standard_normal(100)), doubt=doubt) for std in stds]
    assert np.mean([mismatch(world, None) < 0.05 for world in worlds]) <= 0.05


def test_pushes_with_no_more_numbers_than_the_model_say_nothing():
    one = fitted_to_noise(np.array([30.0]))
    nothing_left = dc.replace(one, state=dc.replace(one.state, u=np.full(3, 0.5)))
    assert mismatch(one, None) < 1e-9 and mismatch(nothing_left, None) == 1.0
    assert mismatch(dc.replace(nothing_left, doubt=0.3), None) == 1.0


@pytest.mark.parametrize(("doubt", "withheld"), [(0.0, True), (0.29, True), (0.35, False)])
def test_a_model_may_leave_what_noise_that_is_hardly_known_may_be(doubt, withheld):
    plain, final = (SimpleNamespace(reduced_chi2=chi2) for chi2 in (5.0, 1.6))
    final.doubt = doubt
    final.state, final.pushes = SimpleNamespace(scatter=0.5), ()
    assert unexplained(plain, final) is withheld


def fitted_to_noise(left):
    """A model without unknowns that leaves this of one push."""
    push = LinearPush(
        residual=left, shared=np.zeros((len(left), 0)), own=np.zeros((len(left), 1)), noise=np.eye(len(left)),
        friction=0,
    )  # fmt: skip
    state = State(u=NOTHING, effects=(), own=(), scatter=1.0)
    return Fitted(
        state=state, pushes=(push,), prior_mean=NOTHING, prior_std=NOTHING, predicted=(), score=0.0,
        solution=solve(Whitened.of((push,), 1.0), NOTHING, NOTHING),
    )  # fmt: skip


def test_a_single_push_does_not_scatter():
    assert scatter_p_value(fitted_to([0.5])) == 1.0


def test_one_push_whose_friction_takes_up_something_else_is_no_scatter():
    frictions = 0.03 * np.random.default_rng(1).standard_normal(20)
    frictions[8] = 1.4
    assert scatter_p_value(fitted_to(frictions)) > 0.1
    frictions[9] = -0.9
    assert scatter_p_value(fitted_to(frictions)) < 0.01


def pushes_of(ways):
    """Straight slides, so far [m], each pushed as fast as it takes."""
    return SimpleNamespace(
        problems=[
            SimpleNamespace(
                poses=np.array([[way, 0.0, 0.0]]), path=None, order=order,
                start=SimpleNamespace(pose=(0.0, 0.0, 0.0), velocity=(np.sqrt(2.0 * 0.3 * 9.81 * way), 0.0, 0.0)),
            )
            for order, way in enumerate(ways)
        ]
    )  # fmt: skip


def test_what_frictions_follow_is_said():
    rng = np.random.default_rng(5)
    ways = rng.permutation(np.linspace(0.02, 0.3, 10))
    sticks = 0.25 - 1.5 * ways + 0.02 * rng.standard_normal(10)
    assert friction_trend(pushes_of(ways), fitted_to(sticks)).startswith("less the further the object goes (rank")
    worn = fitted_to(0.05 * np.arange(10.0))
    assert friction_trend(pushes_of(ways), worn) == "more the later the push (rank correlation 1.00)"
    assert friction_trend(pushes_of(ways[:5]), fitted_to(sticks[:5])) is None


def test_frictions_that_follow_nothing_are_said_to_follow_something_in_one_of_twenty():
    rng = np.random.default_rng(6)
    said = [
        friction_trend(pushes_of(rng.uniform(0.02, 0.3, 10)), fitted_to(0.2 * rng.standard_normal(10))) is not None
        for _ in range(400)
    ]
    assert np.mean(said) <= 0.06


def test_a_scatter_within_bounds_is_no_look():
    usual, wide = fitted_to(0.03 * np.linspace(-1.0, 1.0, 10)), fitted_to(0.2 * np.linspace(-1.0, 1.0, 10))
    assert mismatch(usual, SimpleNamespace(p_value=1e-3)) == pytest.approx(2e-3, rel=1e-2)
    assert mismatch(wide, SimpleNamespace(p_value=1e-3)) == pytest.approx(3e-3, rel=1e-2)
    assert mismatch(wide, None) == pytest.approx(1.0 - (1.0 - scatter_p_value(wide)) ** 3)
