"""What a fitted path may be off by, against what fits of one path under many noises are off by."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lfilter

from physid_drake.cell import HandPath
from physid_drake.cell.hand_curves import STRAIGHT
from physid_drake.cell.hand_fit import SMOOTH_RAMPS, fit_uncertain_paths
from physid_drake.cell.hand_path import subdivided

STD = 3e-4  # m
TIMES = np.arange(0.0, 1.2, 0.01)
PIECES = 24


def path_of(ramp, speed=0.3):
    """At rest, a ramp, a cruise, a brake, at rest."""
    ends, speeds = np.array([0.2, 0.4, 0.8, 1.0]), [0.0, speed, speed, 0.0]
    parts = ramp(np.arange(PIECES) / PIECES)
    along = np.concatenate([a + (b - a) * parts for a, b in pairwise(speeds)] + [[0.0]])
    velocities = np.outer(along, [0.8, 0.6])
    return HandPath(times=subdivided(ends, PIECES), velocities=velocities, start=np.array([0.1, 0.2]))


def fitted(path, seeds, least=0.0, memory=0.0, told=True):
    """Fits of one robot that goes the same way again and again, its noise slow or white."""
    keeps = np.exp(-0.01 / memory) if memory else 0.0
    noises = (np.random.default_rng(seed).standard_normal((len(TIMES), 2)) for seed in seeds)
    slow = (np.vstack([noise[:1], np.sqrt(1.0 - keeps**2) * noise[1:]]) for noise in noises)
    streams = [(TIMES, path.positions(TIMES) + STD * lfilter([1.0], [1.0, -keeps], s, axis=0)) for s in slow]
    return fit_uncertain_paths(streams, STD if told else None, least=least, memory=memory if told else 0.0)


def changes(path, errors, of):
    """What one standard deviation of each error does to a feature (f,) of a path: (e, f)."""
    return np.array([(of(error.path) - of(path)) / error.stds for error in errors])


RAMPS = {"straight": STRAIGHT, "smooth": SMOOTH_RAMPS[0]}
ENOUGH = 12  # streams: their ramps are seen
LEAST = 6e-5  # m


def features(path):
    """Where the hand is under way and in the end, and its speed: (8,)."""
    places = path.positions(np.array([0.5, 0.7, 1.15]))
    return np.concatenate([places.ravel(), (places[1] - places[0]) / 0.2])


@pytest.mark.parametrize("ramp", RAMPS)
def test_each_error_is_one_standard_deviation_of_the_stream_and_independent_of_the_others(ramp):
    for path, errors in fitted(path_of(RAMPS[ramp]), range(ENOUGH)):
        moved = changes(path, errors, lambda p: p.positions(TIMES).ravel() / STD)
        np.testing.assert_allclose(moved @ moved.T, np.eye(len(errors)), atol=0.02)  # 0.01
        assert len(errors) == 10  # three coefficients each for x and y, and four knots


def off(truth, fits):
    """Root mean squares (8,) of what features are off by, in standard deviations as the errors tell them."""
    ratios = [
        (features(path) - features(truth)) / np.linalg.norm(changes(path, errors, features), axis=0)
        for path, errors in fits
    ]
    return np.sqrt(np.mean(np.square(ratios), axis=0))


@pytest.mark.slow
@pytest.mark.parametrize("memory", [0.0, 0.05])  # s
@pytest.mark.parametrize("ramp", RAMPS)
def test_fits_are_off_by_as_much_as_their_errors_say(ramp, memory):
    truth = path_of(RAMPS[ramp])
    fits = fitted(truth, range(40), memory=memory)
    assert all((path.pieces == 1) is (ramp == "straight") for path, _ in fits)
    assert np.abs(off(truth, fits) - 1.0).max() < 0.3


@pytest.mark.slow
def test_a_slow_noise_that_is_taken_for_white_passes_for_motion():
    truth = path_of(STRAIGHT)
    told, untold = (fitted(truth, range(3), memory=0.05, told=told) for told in (True, False))
    assert max(len(path.times) for path, _ in told) <= 7  # four knots and the ends
    assert np.median([len(path.times) for path, _ in untold]) > 10
    assert off(truth, untold).max() > 2.0


@pytest.mark.parametrize(("speed", "unknowns"), [(0.0, 1), (0.1, 2)])
def test_a_hand_that_stands_or_goes_straight_on_is_off_as_a_straight_line_is(speed, unknowns):
    """By sigma / sqrt(n) in the middle of n samples, and there only while the hand stands; along x and along y."""
    path = HandPath(times=np.array([0.0, 1.2]), velocities=np.full((2, 2), speed), start=np.array([0.1, 0.2]))
    [(found, errors)] = fitted(path, [0])
    assert np.linalg.norm(found.positions(TIMES) - path.positions(TIMES), axis=1).max() < STD
    assert len(errors) == 2 * unknowns

    def places(one):
        return one.positions(np.array([TIMES[0], TIMES.mean()]))

    at_first, in_the_middle = np.linalg.norm(changes(found, errors, places), axis=0)
    mean = STD / np.sqrt(len(TIMES))
    np.testing.assert_allclose(in_the_middle, mean, rtol=0.01)
    np.testing.assert_allclose(at_first, mean * (1.0 if unknowns == 1 else 2.0), rtol=0.01)
    assert fitted(path, [0], least=STD)[0][1] == ()


def test_errors_that_hardly_move_the_hand_are_left_out():
    path = path_of(STRAIGHT)
    [(found, all_of_them)], [(_, large)] = fitted(path, [0]), fitted(path, [0], least=LEAST)
    sizes = [
        np.linalg.norm(error.path.positions(TIMES) - found.positions(TIMES), axis=1).max() / error.stds
        for error in all_of_them
    ]
    assert 0 < len(large) < len(all_of_them)
    assert len(large) == sum(size >= LEAST for size in sizes)


def test_of_a_few_samples_no_error_is_known():
    [(path, errors)] = fit_uncertain_paths([(TIMES[:3], np.zeros((3, 2)))], STD, least=0.0)
    assert errors == ()
    assert len(path.times) == 4


@pytest.mark.parametrize("seed", range(12))
def test_no_error_moves_the_hand_by_more_than_its_noise(seed):
    """Of a hand whose speed hardly changes, so that knots may stand nearly anywhere."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, 2.0, 0.01)
    speeds = 0.02 + 2e-3 * rng.standard_normal(10)
    path = HandPath(times=np.linspace(0.0, 2.0, 10), velocities=np.outer(speeds, [0.8, 0.6]), start=np.zeros(2))
    noise = 3e-5 * rng.standard_normal((len(times), 2))
    [(found, errors)] = fit_uncertain_paths([(times, path.positions(times) + noise)], 3e-5, least=0.0)
    assert errors
    for error in errors:
        moved = np.linalg.norm(error.path.positions(times) - found.positions(times), axis=1).max()
        assert moved <= 1.3 * error.stds * 3e-5
