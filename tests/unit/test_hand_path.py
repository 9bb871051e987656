"""The hand's path: piecewise-linear velocity, exactly integrated."""

import numpy as np
import pytest
from hand_paths import fit_hand_path, fit_hand_paths
from reference.planar import HandPath as ReferencePath
from scipy.integrate import quad

from physid_drake.cell import HandPath
from physid_drake.cell.hand_fit import stream_std
from physid_drake.cell.hand_path import straight_path, subdivided


def some_path(seed=0, knots=6):
    rng = np.random.default_rng(seed)
    velocities = rng.uniform(-0.5, 0.5, (knots, 2))
    velocities[[0, -1]] = 0.0
    times = np.cumsum(rng.uniform(0.03, 0.3, knots))
    return HandPath(times=times, velocities=velocities, start=rng.uniform(-0.1, 0.1, 2))


@pytest.mark.parametrize("seed", range(5))
def test_positions_are_the_references(seed):
    path = some_path(seed)
    want = ReferencePath(times=path.times, p0=path.start, velocities=path.velocities)
    times = np.linspace(path.times[0] - 0.2, path.times[-1] + 0.2, 501)
    np.testing.assert_allclose(path.positions(times), want.position(times), atol=1e-15)


def test_positions_are_the_integral_of_the_velocity():
    path = some_path(7)
    for time in np.linspace(path.times[0], path.times[-1], 13)[1:]:
        for axis in range(2):
            moved, _ = quad(
                lambda t, a=axis: np.interp(t, path.times, path.velocities[:, a]), path.times[0], time,
                points=path.times[1:-1], limit=200,
            )  # fmt: skip
            assert path.positions(np.array([time]))[0, axis] - path.start[axis] == pytest.approx(moved, abs=1e-9)


def test_position_and_velocity_have_no_jump_at_a_knot():
    path, step = some_path(3), 1e-7
    for time in path.times:
        before, at, after = path.positions(np.array([time - step, time, time + step]))
        np.testing.assert_allclose(before, after, atol=2e-7)
        np.testing.assert_allclose((at - before) / step, (after - at) / step, atol=1e-5)


def test_the_hand_rests_before_and_after():
    path = some_path()
    early, late = path.positions(np.array([path.times[0] - 5.0, path.times[-1] + 5.0]))
    assert np.array_equal(early, path.start)
    np.testing.assert_allclose(late, path.knot_positions()[-1], atol=1e-16)


def test_a_straight_path_ends_where_it_should():
    path = straight_path(np.array([0.1, 0.2]), np.array([0.4, -0.1]), 1.0, 0.5)
    np.testing.assert_allclose(path.positions(np.array([1.0, 1.25, 1.5])), [[0.1, 0.2], [0.25, 0.05], [0.4, -0.1]])


def test_a_faster_path_keeps_its_middle_and_its_times():
    path = some_path(2)
    faster = path.faster(0.01)
    np.testing.assert_allclose(faster.velocities, 1.01 * path.velocities)
    ends, ends_faster = path.knot_positions()[[0, -1]], faster.knot_positions()[[0, -1]]
    np.testing.assert_allclose(ends.mean(axis=0), ends_faster.mean(axis=0), atol=1e-15)


def trapezoid(brake=0.04):
    times = np.cumsum([0.2, 0.05, 0.3, brake])
    return HandPath(times=times, velocities=np.outer([0, 0.3, 0.3, 0], [0.8, 0.6]), start=np.zeros(2))


@pytest.mark.parametrize("share", [-0.5, 0.3, 1.0])
def test_a_longer_brake_stops_at_the_same_place(share):
    path = trapezoid()
    changed = path.braking(share, path.last_brake())
    assert changed.times[3] - changed.times[2] == pytest.approx(0.04 * (1 + share))
    np.testing.assert_allclose(changed.knot_positions()[-1], path.knot_positions()[-1], atol=1e-15)


def test_the_smooth_brake_of_a_path_in_pieces_is_stretched_as_a_whole():
    x = np.arange(5) / 4
    speeds = np.concatenate([x**2 * (3 - 2 * x), np.ones(3), 1.0 - x**2 * (3 - 2 * x)])
    ends = np.array([0.1, 0.2, 0.5, 0.6])
    path = HandPath(times=subdivided(ends, 4), velocities=np.outer(speeds, [0.2, 0.1]), start=np.zeros(2), pieces=4)
    longer = path.braking(0.5, path.last_brake())
    assert path.last_brake() == longer.last_brake() == (8, 12)
    np.testing.assert_allclose(longer.times, subdivided(np.array([0.1, 0.2, 0.475, 0.625]), 4))
    np.testing.assert_allclose(longer.knot_positions()[-1], path.knot_positions()[-1], atol=1e-15)


def test_no_change_of_speed_or_brake_changes_no_bit():
    path, times = some_path(4), np.linspace(0.0, 2.0, 200)
    assert np.array_equal(path.faster(0.0).positions(times), path.positions(times))
    path = trapezoid()
    assert path.braking(0.0, path.last_brake()) is path


@pytest.mark.parametrize("pieces", [1, 4])
def test_a_hand_that_is_seen_late_came_as_fast(pieces):
    knots, ramp = np.array([1.0, 1.5, 1.6]), np.linspace(0.2, 0.0, pieces + 1)
    speeds = np.concatenate([np.full(pieces, 0.2), ramp])
    path = HandPath(
        times=subdivided(knots, pieces), velocities=np.outer(speeds, [1.0, 0.0]), start=np.zeros(2), pieces=pieces
    )
    longer = path.with_run_up(0.0)
    times = np.linspace(0.9, 1.6, 71)
    np.testing.assert_allclose(longer.positions(times[10:]), path.positions(times[10:]), atol=1e-15)
    assert longer.positions(np.array([0.0, 0.97]))[:, 0] == pytest.approx([-0.01, -0.006])
    assert longer.last_brake() == tuple(knot + pieces for knot in path.last_brake())
    assert path.with_run_up(1.0) is path and path.with_run_up(0.98).times[0] == pytest.approx(0.98)
    still = HandPath(times=np.array([0.5, 1.0]), velocities=np.zeros((2, 2)), start=np.zeros(2))
    assert still.with_run_up(0.0) is still


def test_the_last_brake_is_found():
    assert trapezoid().last_brake() == (2, 3)
    still = HandPath(times=np.array([0.0, 1.0]), velocities=np.zeros((2, 2)), start=np.zeros(2))
    assert still.last_brake() is None
    assert still.braking(0.5, still.last_brake()) is still


@pytest.mark.parametrize("noise", [0.0, 5e-5])
def test_the_fit_of_a_sampled_stream_finds_the_path(noise):
    path = trapezoid()
    times = np.arange(0.0, 0.9, 0.01)
    stream = path.positions(times) + noise * np.random.default_rng(1).standard_normal((len(times), 2))
    fit = fit_hand_path(times, stream, noise or None)
    dense = np.arange(0.0, 0.89, 0.001)
    error = np.linalg.norm(fit.positions(dense) - path.positions(dense), axis=1)
    assert len(fit.times) <= 10
    assert error.max() < (1e-9 if noise == 0.0 else 3e-5)  # measured 3e-15 and 1.3e-5 m
    np.testing.assert_allclose(fit.velocities[[0, -1]], 0.0, atol=1e-3)


def least_jerk_brake(seed, *, share, noise=5e-5):
    """Samples (n,) [s] and (n, 2) [m] of a hand that speeds up and brakes as smoothly as an arm; and its way (n,).

    The stream ends after a share of the brake.
    """
    times = np.arange(0.0, 1.0 + 0.2 * share, 0.01)
    fine = np.arange(0.0, times[-1] + 1e-3, 1e-3)
    rise, fall = (np.clip((fine - begin) / 0.2, 0.0, 1.0) for begin in (0.2, 1.0))
    speed = 0.3 * (rise**3 * (10 - 15 * rise + 6 * rise**2) - fall**3 * (10 - 15 * fall + 6 * fall**2))
    way = np.interp(times, fine, np.concatenate([[0.0], np.cumsum(0.5e-3 * (speed[1:] + speed[:-1]))]))
    clean = np.column_stack([way, np.zeros_like(way)])
    return times, clean + noise * np.random.default_rng(seed).standard_normal(clean.shape), clean


@pytest.mark.parametrize("share", [0.5, 0.8])
def test_a_stream_that_ends_in_a_smooth_brake_has_a_path(share):
    """The last piece of some had no length, and they were nowhere. Measured: off by 0.1 to 0.22 mm."""
    streams = [least_jerk_brake(seed, share=share) for seed in range(3)]
    paths = fit_hand_paths([(times, samples) for times, samples, _ in streams], 5e-5)
    for path, (times, _, clean) in zip(paths, streams, strict=True):
        assert (np.diff(path.times) > 0.0).all()
        np.testing.assert_allclose(path.positions(times), clean, atol=2.5e-4)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_hand_that_moves_by_next_to_nothing_is_one_that_stands():
    times = np.arange(60) * 0.02
    still = np.column_stack([1e-200 * times**2, np.zeros(60)])
    paths = fit_hand_paths([(times, still)] * 3, 1e-4)
    assert all(np.abs(path.velocities).max() < 1e-6 for path in paths)


def test_a_hand_that_is_held_says_nothing_of_its_noise() -> None:
    """Robots repeat the last sample while they stand: most differences are 0, and the noise is what motion shows."""
    rng = np.random.default_rng(1)
    times = np.arange(400) / 120.0
    moving = np.column_stack([0.1 * times[:120], 0.02 * times[:120]]) + 1e-4 * rng.normal(size=(120, 2))
    positions = np.vstack([np.repeat(moving[:1], 140, axis=0), moving, np.repeat(moving[-1:], 140, axis=0)])
    assert 0.6e-4 < stream_std(times, positions) < 1.5e-4
    assert stream_std(times, np.repeat(moving[:1], 400, axis=0)) == 0.0
