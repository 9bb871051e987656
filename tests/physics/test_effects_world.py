"""Effects of the world around against closed forms. Measured errors stand beside the tolerances."""

import numpy as np
import pytest
from motions import MASS, MU, G, distance, end, make, slide, velocities

from physid_drake.effects import Surroundings
from physid_drake.effects.drag import QuadraticDrag


@pytest.mark.parametrize(("c", "most"), [(0.3, 1e-3), (3.0, 8e-3), (30.0, 0.05)])
def test_quadratic_drag_stops_the_object_where_the_equation_says(c, most):
    want = distance(lambda v: MU * G + c * v * v / MASS)
    # Measured: 5e-4, 4.7e-3 and 2.9e-2 (of 12 mm), for the same reason.
    assert end(slide(make("quadratic_drag", coefficient=c)))[0] == pytest.approx(want, rel=most)


@pytest.mark.parametrize("top_speed", [0.02, 0.6])
def test_however_slow_the_pushes_a_quadratic_drag_is_one_that_a_fluid_may_have(top_speed):
    around = Surroundings(
        mass=1.0, friction=0.3, size=np.array([0.09, 0.11]), height=0.05, region=np.zeros((2, 2)),
        top_speed=top_speed, pushes=20, has_hand=True, rolls=False,
    )  # fmt: skip
    (most,) = (coordinate.upper for coordinate in QuadraticDrag.chart(around))
    under_water = 0.5 * 1000.0 * 2.0 * 0.11 * 0.05  # a plate across the stream
    assert 10.0 * under_water < most
    assert most * 0.01**2 < 0.2 * around.friction * around.weight


@pytest.mark.parametrize("rest_length", [0.0, 0.06])
def test_a_tether_pulls_with_its_stretch(rest_length):
    tether = make("tether", stiffness=2.0, x=0.06, y=0.08, rest_length=rest_length)
    motion = slide(tether, velocity=(0.0, 0.0, 0.0), friction=1e-6, seconds=0.1)
    pull = 2.0 * (0.1 - rest_length) / MASS
    # Half a t^2, less the little by which the pull has fallen.
    want = 0.5 * pull * 0.1**2 * np.array([0.6, 0.8])
    np.testing.assert_allclose(end(motion)[:2], want, rtol=0.01)  # measured 4.6e-3


@pytest.mark.parametrize("stiffness", [20.0, 1000.0, 10000.0])
def test_a_spring_gives_back_no_more_than_it_took(stiffness):
    """At 2 ms; a force taken where the time step begins makes 1.1 to 29 % of speed in these swings."""
    swings = 4.0 * np.sqrt(MASS / stiffness) * np.pi
    motion = slide(make("tether", stiffness=stiffness), friction=1e-4, seconds=swings)
    speeds = np.hypot(*velocities(motion)[:, :2].T)
    assert speeds.max() <= 0.5 and speeds[-len(speeds) // 2 :].max() > 0.49  # measured 0.499, 0.499, 0.496


@pytest.mark.parametrize(("rest_length", "most"), [(0.0, 5e-5), (0.02, 3e-4)])
def test_a_tether_does_not_depend_on_the_tick(rest_length, most):
    stiffness = 30.0 if rest_length == 0.0 else 300.0
    tether = make("tether", stiffness=stiffness, rest_length=rest_length)
    fine, *coarse = (
        end(slide(tether, friction=0.1, seconds=1.5, time_step=time_step))[0]
        for time_step in (5e-4, 2e-3, 4e-3, 8e-3)
    )
    # Measured: 0.002 to 0.014 mm and 0.004 to 0.13 mm; 0.5 to 14 mm where the time step begins.
    np.testing.assert_allclose(coarse, fine, atol=most)


def test_a_slack_cable_does_not_pull():
    tether = make("tether", stiffness=2.0, x=0.06, y=0.08, rest_length=0.2)
    assert np.array_equal(slide(tether).poses[-1], slide().poses[-1])


def test_a_magnet_attracts_with_its_strength_over_the_square():
    magnet = make("magnet", strength=1e-3, x=0.06, y=-0.08, core=0.03)
    motion = slide(magnet, velocity=(0.0, 0.0, 0.0), friction=1e-6, seconds=0.1)
    want = 0.5 * 1e-3 / (0.1**2 + 0.03**2) / MASS * 0.1**2 * np.array([0.6, -0.8])
    np.testing.assert_allclose(end(motion)[:2], want, rtol=0.01)  # measured 3.9e-3
