"""What counts as nearer to pushes that were left out, and how far an effect must move them for that."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose.left_out import comes_nearer, errors_of, least_motion, shown_by_several
from physid_drake.pushes.features import PushFeatures

RNG = np.random.default_rng(4)
SIGMAS = np.array([3e-4, 3e-4, 3e-3])


NEWTON = 0.02  # standard deviation of a force


def features(forces=3):
    """Four windows of a push's poses, followed by those of its force."""
    return PushFeatures(
        averaging=np.eye(4), middles=np.arange(4.0), sigmas=SIGMAS, recorded=np.zeros(12 + 2 * forces),
        noise=np.eye(12 + 2 * forces), force_std=np.full(forces, NEWTON), force_way=np.arange(float(forces)),
        force_size=1.0,
    )  # fmt: skip


def case(*, known=True, forces=3):
    return SimpleNamespace(features=[features(forces) for _ in range(10)], noise=SimpleNamespace(known=known))


CASE = case(forces=0)


def errors(size, odd=1.0):
    """Of ten pushes, each with this root mean square; the last is ``odd`` times as far off."""
    made = []
    for k in range(10):
        vector = RNG.standard_normal(12)
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


def test_a_push_that_goes_the_wrong_way_with_either_model_does_not_hide_what_the_others_show():
    """It comes a little nearer itself, and outweighs by far what the others gain."""
    before, after = errors(6.0, odd=7.0), errors(1.5, odd=27.0)
    assert errors_of(CASE, before).rms < 1.2 * errors_of(CASE, after).rms
    assert comes_nearer(CASE, before, after)
    assert shown_by_several(CASE, before, after)
    # Two such pushes are more than a model may leave out.
    before[0], after[0] = before[9], after[9]
    assert not comes_nearer(CASE, before, after)


def test_errors_are_in_deviations_and_in_metres():
    whole = errors_of(CASE, errors(2.0))
    assert whole.rms == pytest.approx(2.0) and whole.per_push == pytest.approx([2.0] * 10)
    assert errors_of(CASE, [np.r_[np.ones(8), np.zeros(4)]] * 10).position == pytest.approx(3e-4 * np.sqrt(2.0))
    assert np.isnan(whole.force)


def with_forces(poses, forces):
    """Errors of ten pushes whose forces are off by so many standard deviations."""
    return [np.r_[vector, np.full(6, forces)] for vector in errors(poses)]


def test_errors_of_forces_are_in_newtons_and_no_part_of_those_of_poses():
    found = errors_of(case(), with_forces(2.0, 3.0))
    assert found.rms == pytest.approx(2.0)
    assert found.force == pytest.approx(3.0 * NEWTON * np.sqrt(2.0))
    assert found.force_per_push == pytest.approx([3.0] * 10)


@pytest.mark.parametrize(
    ("before", "after", "known", "nearer"),
    [
        ((1.0, 4.0), (1.0, 1.5), True, True),  # the object is where the hand is, and only the force tells
        ((1.0, 4.0), (1.0, 3.9), True, False),
        ((1.0, 4.0), (1.5, 1.5), True, False),  # the force at the cost of where the object goes
        ((3.0, 4.0), (3.0, 1.5), True, False),  # poses tell that something else is missing
        ((3.0, 4.0), (1.0, 4.0), True, True),
        ((1.0, 4.0), (0.5, 4.0), True, True),  # windows average, so that poses may tell what is less than a sample's
        ((1.0, 4.0), (1.0, 1.5), False, False),  # poses are as far off as their noise is taken to be
    ],
)
def test_forces_decide_where_poses_leave_nothing_to_come_nearer_to(before, after, known, nearer):
    pushes = case(known=known)
    old, new = with_forces(*before), with_forces(*after)
    assert comes_nearer(pushes, old, new) is nearer
    assert shown_by_several(pushes, old, new) is nearer


def test_the_force_of_one_push_alone_shows_nothing():
    old, new = with_forces(1.0, 1.5), with_forces(1.0, 1.5)
    old[3][12:] = 9.0
    assert comes_nearer(case(), old, new)
    assert not shown_by_several(case(), old, new)


def test_forces_of_one_push_are_none_that_may_come_nearer():
    """One push is left out of what decides: nothing of the others' would be left to speak against an effect."""
    mixed = case()
    mixed.features[1:] = [features(0)] * 9
    old = [with_forces(1.0, 1.5)[0], *errors(1.0)[1:]]
    new = [1.05 * vector for vector in old]
    assert not comes_nearer(mixed, old, new)
    assert not shown_by_several(mixed, old, new)


def test_a_push_without_forces_takes_nothing_from_those_of_others():
    mixed = case()
    mixed.features[0] = features(0)
    old, new = with_forces(1.0, 4.0), with_forces(1.0, 1.5)
    old[0], new[0] = old[0][:12], new[0][:12]
    assert np.isnan(errors_of(mixed, old).force_per_push[0])
    assert comes_nearer(mixed, old, new)
