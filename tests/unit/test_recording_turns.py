"""Whole turns of a heading, over gaps too."""

import numpy as np
import pytest

from physid_drake.recording.turns import unwrapped


def wrapped(angles):
    return np.arctan2(np.sin(angles), np.cos(angles))


@pytest.mark.parametrize("spin", [-40.0, -8.0, 0.0, 20.0, 40.0])
@pytest.mark.parametrize("gap", [(60, 82), (60, 140), (1, 20)])
def test_a_spin_keeps_its_turns_over_a_gap(spin, gap):
    """A spin that is braked by 30 rad/s^2, seen at 200 Hz with 3 mrad of noise, and not at all for 0.1 to 0.4 s."""
    times = 0.005 * np.arange(200)
    slowing = np.minimum(times, abs(spin) / 30.0)
    angles = spin * slowing - 15.0 * np.sign(spin) * slowing**2
    angles += 3e-3 * np.random.default_rng(0).standard_normal(len(times))
    seen = np.ones(len(times), dtype=bool)
    seen[slice(*gap)] = False
    assert unwrapped(times[seen], wrapped(angles[seen])) == pytest.approx(
        angles[seen] - angles[0] + wrapped(angles)[0]
    )


@pytest.mark.parametrize("spin", [-20.0, 20.0, 25.0])
@pytest.mark.parametrize("hit", [False, True])
def test_a_spin_that_begins_or_ends_in_a_gap_gets_no_turns_that_nobody_saw(spin, hit):
    """It rests, or spins, but for 20 ms of a gap of 0.4 s."""
    times = 0.005 * np.arange(200)
    angles = spin * (np.maximum(times - 0.58, 0.0) if hit else np.minimum(times, 0.22))
    seen = (times < 0.2) | (times > 0.6)
    assert unwrapped(times[seen], wrapped(angles[seen])) == pytest.approx(angles[seen])


def test_a_rest_that_was_not_seen_for_long_makes_no_turns():
    """Its rate is noise, and the nearest angle is the best guess."""
    times = np.concatenate([0.01 * np.arange(20), 60.0 + 0.01 * np.arange(20)])
    angles = 0.05 * np.random.default_rng(0).standard_normal(40)
    assert unwrapped(times, angles) == pytest.approx(angles)


def test_angles_at_one_rate_are_those_of_numpy():
    angles = wrapped(np.linspace(0.0, 30.0, 100))
    assert np.array_equal(unwrapped(np.linspace(0.0, 1.0, 100), angles), np.unwrap(angles))
