"""How coarsely a stream was rounded, seen from its values."""

import math

import numpy as np
import pytest

from physid_drake.recording.rounding import rounding_std


def streams(count=5, samples=80, noise=3e-4):
    rng = np.random.default_rng(3)
    ways = np.linspace(0.0, 0.1, samples)[:, None] * rng.uniform(-1.0, 1.0, (count, 1, 2))
    return ways + rng.uniform(-0.2, 0.2, (count, 1, 2)) + noise * rng.standard_normal((count, samples, 2))


@pytest.mark.parametrize("step", [1e-4, 1e-3, math.radians(1.0)])
def test_a_rounded_stream_shows_its_step(step):
    assert rounding_std(np.round(streams() / step) * step) == pytest.approx(step / math.sqrt(12.0), rel=1e-6)


def test_what_is_not_rounded_shows_none():
    assert rounding_std(streams()) < 1e-6
    assert rounding_std(streams(count=1, samples=4)) == 0.0  # so few may be whole multiples of anything


def test_a_stream_that_stands_still_shows_none():
    assert rounding_std([np.zeros((50, 2))]) == 0.0


def test_one_rounded_coordinate_is_enough():
    every = streams()
    every[:, :, 1] = np.round(every[:, :, 1], 3)
    assert rounding_std(every) == pytest.approx(1e-3 / math.sqrt(12.0))


@pytest.mark.parametrize(("speed", "noise"), [(0.1, 0.0), (0.4, 5e-5)])
def test_even_samples_of_a_steady_speed_are_not_rounded(speed, noise):
    rng, times = np.random.default_rng(0), np.linspace(0.0, 1.0, 101)
    for ways in ([[1.0, 0.0]], [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]):
        hands = [speed * times[:, None] * np.array(way) + noise * rng.standard_normal((101, 2)) for way in ways]
        assert rounding_std(hands) < 1e-5
    steady = np.round(speed * times[:, None] * [0.83, 0.56] + 3e-4 * rng.standard_normal((101, 2)), 3)
    assert rounding_std([steady]) == pytest.approx(1e-3 / math.sqrt(12.0))


def test_poses_of_a_slow_tracker_that_are_held_are_not_rounded():
    assert rounding_std(np.repeat(streams(), 4, axis=1)) < 1e-6
