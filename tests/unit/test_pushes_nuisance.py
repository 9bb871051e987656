"""A push's nuisance parameters: what each of them changes, and what it leaves alone."""

from dataclasses import replace

import numpy as np
import pytest
from runs import shipped_pushes

from physid_drake.cell import HandPath
from physid_drake.pushes.noise import noise_of
from physid_drake.pushes.nuisance import apply_nuisance, nuisance_of
from physid_drake.pushes.problem import problems_of


@pytest.fixture(scope="module")
def problem():
    recording = shipped_pushes(1)
    return problems_of(recording, noise_of(recording), 0.03)[0]


def free(problem):
    return replace(problem, path=None, start_std=np.array([1e-4, 1e-4, 1e-3, 1e-2, 1e-2, 0.1]))


def setting(problem, **values):
    nuisance = nuisance_of(problem, 0.02)
    given = np.zeros(len(nuisance.names))
    for name, value in values.items():
        given[nuisance.index(name)] = value
    return apply_nuisance(problem, nuisance, given)


def test_a_push_has_start_brake_speed_restitution_and_friction(problem):
    nuisance = nuisance_of(problem, 0.02)
    assert nuisance.names == ("start_x", "start_y", "start_yaw", "brake", "speed", "restitution", "friction")
    assert nuisance.stds[-1] == 0.02
    np.testing.assert_array_equal(nuisance.stds[:3], problem.start_std)
    assert (nuisance.stds > 0.0).all()


def test_a_free_motion_has_a_start_velocity_and_no_hand(problem):
    nuisance = nuisance_of(free(problem), 0.02)
    assert nuisance.names == (
        "start_x", "start_y", "start_yaw", "start_vx", "start_vy", "start_wz", "friction",
    )  # fmt: skip
    np.testing.assert_array_equal(nuisance.stds[:6], free(problem).start_std)


def test_a_hand_that_never_brakes_has_no_brake(problem):
    steady = HandPath(times=np.array([0.0, 1.0]), velocities=np.ones((2, 2)), start=np.zeros(2))
    assert "brake" not in nuisance_of(replace(problem, path=steady), 0.02).names


def test_unknowns_that_are_zero_change_nothing(problem):
    same = setting(problem)
    times = np.linspace(problem.begin, problem.end, 200)
    assert same.start == problem.start
    np.testing.assert_allclose(same.path.positions(times), problem.path.positions(times), atol=1e-16)
    assert (same.friction_scale, same.restitution) == (1.0, 0.0)


def test_each_unknown_changes_its_own_thing(problem):
    moved = setting(problem, start_x=1e-3, start_yaw=-2e-3)
    np.testing.assert_allclose(np.subtract(moved.start.pose, problem.start.pose), [1e-3, 0.0, -2e-3], atol=1e-15)
    assert setting(problem, friction=0.03).friction_scale == pytest.approx(1.03)
    assert setting(problem, restitution=0.05).restitution == 0.05
    thrown = setting(free(problem), start_vy=0.2, start_wz=-1.0).start
    np.testing.assert_allclose(np.subtract(thrown.velocity, problem.start.velocity), [0.0, 0.2, -1.0])


def test_a_hand_that_was_faster_keeps_the_middle_of_its_way(problem):
    path = setting(problem, speed=0.01).path
    np.testing.assert_allclose(path.velocities, 1.01 * problem.path.velocities)
    np.testing.assert_array_equal(path.times, problem.path.times)
    middle = [p.knot_positions()[[0, -1]].mean(axis=0) for p in (path, problem.path)]
    np.testing.assert_allclose(*middle, atol=1e-15)


@pytest.mark.parametrize("share", [-0.9, -0.3, 0.3, 1.0])
def test_a_longer_brake_ends_where_the_hand_ended(problem, share):
    path = setting(problem, brake=share).path
    np.testing.assert_allclose(path.knot_positions()[-1], problem.path.knot_positions()[-1], atol=1e-12)
    assert (np.diff(path.times) > 0.0).all()
    first, last = problem.path.last_brake()
    before, after = (p.times[last] - p.times[first] for p in (problem.path, path))
    assert (after - before) * share > 0.0


def test_a_brake_keeps_knots_in_order_on_any_path():
    rng = np.random.default_rng(0)
    for _ in range(300):
        k = int(rng.integers(2, 9))
        path = HandPath(
            times=np.cumsum(rng.uniform(2e-3, 0.3, k)), velocities=rng.uniform(-0.5, 0.5, (k, 2)), start=np.zeros(2)
        )
        for share in (-0.9, 0.9, 3.0):
            changed = path.braking(share, path.last_brake())
            assert (np.diff(changed.times) > 0.0).all()
            np.testing.assert_allclose(changed.knot_positions()[-1], path.knot_positions()[-1], atol=1e-12)
