"""When held-out gains confirm an effect, and which regimes a recording spans."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.cell import HandPath, Start
from physid_drake.diagnose.confirm import Candidate, rivals
from physid_drake.diagnose.regimes import _by_heading, _by_speed


def candidate(gains, *, degenerate=False):
    return Candidate(score=None, fitted=None, gains=np.asarray(gains, dtype=float), degenerate=degenerate)


@pytest.mark.parametrize(
    ("gains", "confirmed"),
    [
        ([3.0, 2.5, 4.0, 1.0, 2.0, 3.5, 0.5, 2.2], True),  # a little in every push
        ([0.1, -0.2, 0.3, 0.1, -0.1, 0.2, 0.0, 0.1], False),  # nothing
        (
            [-0.6, 6.4, -2.3, -0.9, -1.8, 8.0, -3.6, 10.5, 10.4],
            False,
        ),  # as a simulator's own error gives
        ([-1.0, -0.5, 120.0, 0.2, -1.5, 260.0, 90.0, -0.3, -0.2], True),  # a patch that three pushes cross
        ([-1.0, -0.5, 500.0, 0.2, -1.5, 0.3, -0.4, -0.3, -0.2], False),  # one odd push is no physics
        # Every push that feels it gains, one far more than the others.
        ([-0.8, -1.1, 12.8, -0.2, 0.5, 2.3, 1.4, 41.2, 9.9, 2.2, -0.4, 0.0, 3.2, 8.7, 0.2], True),
        ([-3.0, -2.0, -4.0, -1.0, -2.0, -3.5], False),
    ],
)
def test_held_out_gains_confirm_an_effect(gains, confirmed):
    assert candidate(gains).accepted is confirmed


def test_an_effect_that_ran_to_nothing_is_not_confirmed():
    assert not candidate([5.0] * 8, degenerate=True).accepted


def test_a_rival_is_one_whose_deficit_is_not_sure():
    rng = np.random.default_rng(0)
    best = candidate(20.0 + rng.standard_normal(10))
    near = candidate(best.gains + 2.0 * rng.standard_normal(10))
    far = candidate(best.gains - 5.0)
    assert rivals(best, (best, near, far)) == (near,)


def pushes(speeds, headings):
    made = []
    for speed, heading in zip(speeds, headings, strict=True):
        ahead = np.array([np.cos(heading), np.sin(heading)])
        path = HandPath(times=np.array([0.0, 1.0]), velocities=np.array([speed * ahead] * 2), start=np.zeros(2))
        end = np.array([[0.1 * ahead[0], 0.1 * ahead[1], 0.0]])
        made.append(SimpleNamespace(path=path, start=Start(pose=(0.0, 0.0, 0.0)), poses=end))
    return SimpleNamespace(problems=made)


def test_slow_and_fast_pushes_are_two_regimes():
    case = pushes([0.05, 0.4, 0.06, 0.5, 0.04, 0.6], [0.0] * 6)
    assert _by_speed(case) == ((4, 0, 2), (1, 3, 5))
    assert _by_heading(case) is None


def test_pushes_to_either_side_are_two_regimes():
    case = pushes([0.2] * 6, [0.1, 3.0, -0.1, 3.2, 0.0, 3.1])
    assert _by_speed(case) is None
    halves = _by_heading(case)
    assert {frozenset(half) for half in halves} == {frozenset({0, 2, 4}), frozenset({1, 3, 5})}


def test_few_pushes_span_no_regimes():
    case = pushes([0.05, 0.5, 0.04, 0.6], [0.0, 3.0, 0.1, 3.1])
    assert _by_speed(case) is None and _by_heading(case) is None
