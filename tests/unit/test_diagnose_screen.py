"""Score tests in linear algebra: pairs of effects, and frictions that follow the order of the pushes."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from physid_drake.diagnose.linear import LinearPush, Whitened, best_scatter, solve
from physid_drake.diagnose.model import Fitted, State
from physid_drake.diagnose.pairs import promising
from physid_drake.diagnose.screen import (
    STRIDE,
    Signature,
    _on_the_way,
    by_trend,
    cosine,
    log_probability,
    projected,
    score,
)
from physid_drake.effects import Family

PUSHES, NUMBERS = 12, 20


def fitted_to(residuals, own):
    """A model with one unknown of its own a push, its friction, and one that all share."""
    rng = np.random.default_rng(1)
    pushes = tuple(
        LinearPush(
            residual=r, shared=rng.normal(size=(NUMBERS, 1)), own=column[:, None], noise=np.eye(NUMBERS), friction=0
        )
        for r, column in zip(residuals, own, strict=True)
    )
    mean, std = np.zeros(1), np.ones(1)
    scatter, value = best_scatter(pushes, mean, std)
    return Fitted(
        state=State(u=np.zeros(1), effects=(), own=(np.zeros(1),) * len(pushes), scatter=scatter),
        pushes=pushes, prior_mean=mean, prior_std=std, solution=solve(Whitened.of(pushes, scatter), mean, std),
        predicted=tuple(np.zeros(NUMBERS) for _ in pushes), score=value,
    )  # fmt: skip


def signature_of(name, columns, *, one_sided=False, friction_changes=()):
    return Signature(
        kind=SimpleNamespace(name=name), family=Family(point=(0.0,), free=(0,)),
        columns=tuple(c[:, None] for c in columns), one_sided=(one_sided,), stds=(np.inf,),
        friction_changes=tuple(friction_changes),
    )  # fmt: skip


@pytest.fixture
def columns():
    rng = np.random.default_rng(0)
    return {name: rng.normal(size=(PUSHES, NUMBERS)) for name in ("one", "two", "noise", "own", "third")}


def test_two_effects_outrank_a_third_that_mimics_their_sum(columns):
    both = 3.0 * columns["one"] + 3.0 * columns["two"]
    mimic = both + 2.0 * columns["third"]
    fitted = fitted_to(both + columns["noise"], columns["own"])
    shapes = {"one": columns["one"], "two": columns["two"], "mimic": mimic}
    scores = [score(fitted, signature_of(name, shape)) for name, shape in shapes.items()]
    assert max(scores, key=lambda s: s.gain).kind.name == "mimic"
    best = promising(fitted, scores)[0]
    assert [s.kind.name for s in best] in (["one", "two"], ["two", "one"])
    # Each with its coefficient beside the other's.
    assert [float(s.coefficients[0]) for s in best] == pytest.approx([3.0, 3.0], abs=0.3)


def test_a_pair_of_which_one_acts_the_other_way_round_is_none(columns):
    fitted = fitted_to(3.0 * columns["one"] - 3.0 * columns["two"] + columns["noise"], columns["own"])
    one = score(fitted, signature_of("one", columns["one"]))
    two = score(fitted, signature_of("two", columns["two"]))
    backwards = score(fitted, signature_of("two", -columns["two"], one_sided=True))
    assert len(promising(fitted, [one, two])) == 1
    assert len(promising(fitted, [one, backwards])) == 1
    wrong = signature_of("two", columns["two"], one_sided=True)
    kept = SimpleNamespace(kind=wrong.kind, signature=wrong, kept=(0,), gain=1.0, coefficients=np.zeros(1))
    assert promising(fitted, [one, kept]) == []


def with_tolerance(fitted, columns, std):
    """The model, its pushes sharing an error that looks like ``columns``."""
    pushes = tuple(
        replace(push, shared=np.column_stack([push.shared, c]))
        for push, c in zip(fitted.pushes, columns, strict=True)
    )
    return replace(fitted, pushes=pushes, prior_mean=np.zeros(2), prior_std=np.array([1.0, std]))


@pytest.mark.parametrize(("std", "left"), [(0.01, 1.0), (np.inf, 0.0)])
def test_a_tolerance_imitates_an_effect_no_further_than_it_goes(columns, std, left):
    """A lag was told from a latency, of which 0.2 ms are a tolerance that was taken away whole: cosine 0.04."""
    fitted = with_tolerance(fitted_to(columns["noise"], np.zeros((PUSHES, NUMBERS))), columns["one"], std)
    bare = fitted_to(columns["noise"], np.zeros((PUSHES, NUMBERS)))
    _, (whole,) = projected(bare, [[c[:, None] for c in columns["one"]]])
    _, (rest,) = projected(fitted, [[c[:, None] for c in columns["one"]]])
    assert np.linalg.norm(rest) == pytest.approx(left * np.linalg.norm(whole), rel=0.02, abs=1e-9)
    alike = columns["one"] + 0.2 * columns["two"]
    one, other = (score(bare, signature_of(name, c)) for name, c in (("one", columns["one"]), ("other", alike)))
    assert (cosine(fitted, one, other) > 0.95) == (left > 0.5)


ORDER = np.arange(PUSHES)


def drift_score(frictions, columns):
    """The score of "friction follows the pushes' order", by its signature, which is silent here, and by ranks too."""
    residuals = frictions[:, None] * columns["own"] + columns["noise"]
    fitted = fitted_to(residuals, columns["own"])
    changes = 0.001 * np.arange(len(frictions))
    silent = signature_of("friction_drift", 1e-6 * columns["own"], friction_changes=changes)
    return score(fitted, silent), by_trend(fitted, score(fitted, silent))


def test_frictions_in_order_are_seen_by_their_ranks(columns):
    scattered = -3.0 + 0.5 * ORDER + np.random.default_rng(4).normal(size=PUSHES)
    plain, trend = drift_score(scattered, columns)
    expected = 2.0 * stats.kendalltau(scattered, ORDER).pvalue  # two looks
    assert 1e-8 < expected < 1e-3 < np.exp(plain.log_p)
    assert np.exp(trend.log_p) == pytest.approx(expected, rel=0.3)  # what noise swaps is near
    # 0.5 scatters of 2.5 % a push, in steps of 0.1 % a push.
    assert trend.coefficients[0] == pytest.approx(12.5, rel=0.3)
    assert not trend.in_order and not plain.in_order  # one in ten thousand is asked for
    # Its gain is that of a score test which is as unlikely.
    assert log_probability(trend.gain, 1, PUSHES, 1) == pytest.approx(trend.log_p)


def test_frictions_that_an_effect_does_not_change_have_no_order(columns):
    fitted = fitted_to(ORDER[:, None] * columns["own"], columns["own"])
    one = score(fitted, signature_of("friction_drift", columns["own"], friction_changes=np.ones(PUSHES)))
    assert by_trend(fitted, one) is one


def test_of_a_push_whose_ends_are_known_the_way_between_them_is_a_straight_line():
    ends = np.array([[0.1, 0.0], [0.4, 0.4]])
    found = _on_the_way(ends)
    np.testing.assert_allclose(found[[0, -1]], ends)
    steps = np.diff(found, axis=0)
    np.testing.assert_allclose(steps / STRIDE, np.tile(0.02 * (ends[1] - ends[0]) / STRIDE, (50, 1)), atol=1e-9)
    assert np.linalg.norm(steps, axis=1).max() <= STRIDE * (1.0 + 1e-9)


def test_places_that_are_near_each_other_stay_as_they_are():
    seen = np.cumsum(np.random.default_rng(1).uniform(-0.4, 0.4, (50, 2)) * STRIDE, axis=0)
    np.testing.assert_array_equal(_on_the_way(seen), seen)
    np.testing.assert_array_equal(_on_the_way(seen[:1]), seen[:1])
    np.testing.assert_array_equal(_on_the_way(np.repeat(seen[:1], 3, axis=0)), seen[:1])


def test_a_perfect_order_of_few_pushes_is_no_certainty(columns):
    few = {name: c[:6] for name, c in columns.items()}
    _, trend = drift_score(np.arange(6.0), few)
    assert np.exp(trend.log_p) == pytest.approx(2.0 * 2.0 / 720.0)  # two looks, up or down, of 6! orders


def test_pushes_that_do_not_tell_their_friction_have_no_place_in_the_order(columns):
    frictions = 1.5 * ORDER - 8.0
    frictions[[5, 9]] = frictions[[9, 5]]
    slow = {**columns, "own": columns["own"].copy()}
    slow["own"][:4] *= 1e-3  # no slide to tell it by: a fit leaves them in the middle
    _, trend = drift_score(frictions, slow)
    assert np.exp(trend.log_p) == pytest.approx(2.0 * stats.kendalltau(frictions[4:], ORDER[4:]).pvalue)


def test_frictions_in_no_order_are_not_seen(columns):
    plain, trend = drift_score(np.random.default_rng(3).permutation(-3.0 + 0.5 * ORDER), columns)
    assert trend.gain == plain.gain
    assert trend.log_p == pytest.approx(min(0.0, plain.log_p + np.log(2.0)))


@pytest.mark.parametrize(("frictions", "in_order"), [([3, 0, 5, 1, 4, 2] * 3, False), (range(18), True)])
def test_no_score_test_however_sure_puts_frictions_in_order(columns, frictions, in_order):
    """Far from an explanation a linearised effect may gain much where the pushes' own frictions follow nothing."""
    wide = np.array(frictions, dtype=float)[:PUSHES] - 3.0
    fitted = fitted_to(wide[:, None] * columns["own"] + columns["noise"], columns["own"])
    silent = signature_of("friction_drift", 1e-6 * columns["own"], friction_changes=0.001 * np.arange(PUSHES))
    sure = replace(score(fitted, silent), log_p=-50.0)
    seen = by_trend(fitted, sure)
    assert seen.log_p == pytest.approx(-50.0 + np.log(2.0))
    assert seen.in_order is in_order and not sure.in_order
