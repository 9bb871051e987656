"""Effects of the object against closed forms. Measured errors stand beside the tolerances."""

import math

import numpy as np
import pytest
from motions import BOX, MASS, MU, POLAR, SIZE, G, at, built, end, make, push_along_x, slide, velocities
from twin import body_of

from physid_drake.cell import Start
from physid_drake.cell.forces import Wrench
from physid_drake.cell.support import PressureGrid
from physid_drake.effects.rollout import Geometry
from physid_drake.recording import Box, Cylinder, Prism

LYING = Geometry(shape=Cylinder(radius=0.033, length=0.1, axis="y"))


def test_a_grain_of_the_object_turns_with_the_object():
    angle = 0.7
    R = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    grain = make("anisotropic_object", ratio=2.0, angle=0.3)
    plain = slide(grain, velocity=(0.4, 0.2, 3.0))
    turned = slide(grain, velocity=(*(R @ [0.4, 0.2]), 3.0), pose=(0.0, 0.0, angle))
    np.testing.assert_allclose(end(turned)[:2], R @ end(plain)[:2], atol=1e-6)  # measured 5e-16
    assert end(turned)[2] - angle == pytest.approx(end(plain)[2], abs=1e-5)


def test_a_grain_of_the_object_and_the_same_of_the_table_are_one_while_it_does_not_turn():
    table = slide(make("anisotropic_table", ratio=2.0, angle=0.9), pose=(0, 0, 0.5))
    on_object = slide(make("anisotropic_object", ratio=2.0, angle=0.4), pose=(0, 0, 0.5))
    # Until it turns: the box turns by little.
    times = np.linspace(0.0, 0.05, 6)
    np.testing.assert_allclose(at(table, times), at(on_object, times), atol=1e-6)


def test_rolling_resistance_slows_a_rolling_cylinder_by_two_thirds_g_b_over_r():
    b, r = 1e-3, 0.033
    motion = slide(make("rolling_resistance", coefficient=b), velocity=(0.2, 0.0, 0.0), geometry=LYING)
    want = 2.0 / 3.0 * G * b / r
    rate = np.polyfit(motion.times[5:200], np.gradient(at(motion, motion.times)[5:200, 0], 2e-3), 1)[0]
    assert -rate == pytest.approx(want, rel=1e-3)  # measured 2.4e-4


@pytest.mark.parametrize("yaw", [0.8, 2.5])
def test_a_cylinder_rolls_alike_whichever_way_it_lies(yaw):
    c, s = math.cos(yaw), math.sin(yaw)
    effects = (make("rolling_resistance", coefficient=1e-3), make("viscous_drag", coefficient=0.1))
    straight = end(slide(*effects, velocity=(0.2, 0.05, 0.0), geometry=LYING))
    turned = end(
        slide(*effects, velocity=(0.2 * c - 0.05 * s, 0.2 * s + 0.05 * c, 0.0), pose=(0, 0, yaw), geometry=LYING)
    )
    R = np.array([[c, -s], [s, c]])
    np.testing.assert_allclose(turned[:2], R @ straight[:2], atol=1e-6)
    assert turned[2] - yaw == pytest.approx(straight[2], abs=1e-6)


def test_a_rolling_cylinder_stops_and_stays():
    motion = slide(make("rolling_resistance", coefficient=0.004), velocity=(0.1, 0.0, 0.0), geometry=LYING)
    want = 0.1**2 / (2 * (2.0 / 3.0 * G * 0.004 / 0.033))
    assert end(motion)[0] == pytest.approx(want, abs=5e-5)  # measured 1.4e-5 m
    assert np.abs(velocities(motion)[-20:, 0]).max() < 1e-3


@pytest.mark.parametrize("tilt", [0.03, 0.05])
def test_rolling_resistance_holds_a_cylinder_on_a_tilt_below_b_over_r(tilt):
    effects = (make("rolling_resistance", coefficient=0.002), make("table_tilt", x=tilt))  # b / R is 0.061
    assert np.abs(end(slide(*effects, velocity=(0.0, 0.0, 0.0), geometry=LYING, seconds=4.0))).max() < 1e-6
    motion = slide(*effects, velocity=(0.15, 0.0, 0.0), geometry=LYING, seconds=8.0)
    want = 0.15**2 / 2 / (2.0 / 3.0 * G * (0.002 / 0.033 - math.sin(tilt)))
    assert end(motion)[0] == pytest.approx(want, rel=2e-3)
    assert np.abs(velocities(motion)[-20:, 0]).max() < 1e-6


@pytest.mark.parametrize("tilt", [0.07, 0.1])
def test_rolling_resistance_lets_a_cylinder_go_on_a_tilt_beyond(tilt):
    effects = (make("rolling_resistance", coefficient=0.002), make("table_tilt", x=tilt))
    down = end(slide(*effects, velocity=(0.0, 0.0, 0.0), geometry=LYING))[0]
    assert down == pytest.approx(0.5 * 2.0 / 3.0 * G * (math.sin(tilt) - 0.002 / 0.033), rel=0.01)


def test_rolling_resistance_leaves_a_slide_along_the_axis():
    effect = make("rolling_resistance", coefficient=0.004)
    assert end(slide(effect, velocity=(0.0, 0.3, 0.0), geometry=LYING))[1] == pytest.approx(
        0.09 / 2 / MU / G, rel=0.01
    )


def spun(*effects, rate=10.0, **more):
    return slide(*effects, velocity=(0.0, 0.0, rate), **more)


@pytest.mark.parametrize(
    "weights", [((3.0, 1.0, 3.0),) * 3, ((1.0,) * 3, (9.0,) * 3, (1.0,) * 3), ((5, 1, 5), (1, 1, 1), (5, 1, 5))]
)
def test_weights_at_the_rim_shorten_a_spin_by_their_mean_arm(weights):
    grid = tuple(tuple(float(w) for w in row) for row in weights)
    motion = spun(make("uneven_support", weights=grid), points=100)
    support = built(Geometry(shape=BOX.shape, pressure=PressureGrid(weights=grid)), False, "point", 100).scene.support
    arm = float(support.weights @ np.hypot(*support.points.T))
    want = POLAR * 10.0**2 / (2 * MU * G * arm)
    assert end(motion)[2] == pytest.approx(want, rel=1e-3)  # measured 6e-5
    # The weights' own mean arm, by brute force over the cells of the grid.
    x, y = np.meshgrid((np.arange(300) + 0.5) / 300, (np.arange(300) + 0.5) / 300, indexing="ij")
    share = np.array(grid)[(3 * x).astype(int), (3 * y).astype(int)]
    far = np.hypot((x - 0.5) * SIZE[0], (y - 0.5) * SIZE[1])
    assert arm == pytest.approx(float((share * far).sum() / share.sum()), rel=1e-3)  # measured 3e-4


def test_the_pressure_still_balances_an_offset_centre_of_mass():
    grid = ((3.0, 1.0, 1.0), (1.0, 1.0, 1.0), (1.0, 1.0, 2.0))
    effects = (make("uneven_support", weights=grid), make("com_offset", x=0.01, y=-0.005))
    motion = slide(*effects, velocity=(0.0, 0.0, 0.0), seconds=0.5)
    np.testing.assert_allclose(end(motion), 0.0, atol=1e-9)  # no motion without a push
    cell = built(Geometry(shape=BOX.shape, pressure=PressureGrid(weights=grid)), False)
    seen = []

    class Watch:
        def wrench(self, state):
            seen.append(state)
            return Wrench(fx=0.0, fy=0.0, torque=0.0)

    cell.rollout(body_of(MASS, MU, com=(0.01, -0.005)), start=Start(pose=(0, 0, 0)), path=None, begin=0.0, end=0.01,
                 laws=(Watch(),))  # fmt: skip
    loads = seen[0].loads
    assert loads.sum() == pytest.approx(MASS * G, rel=1e-9)
    np.testing.assert_allclose(loads @ (seen[0].p_WQ - seen[0].p_WBcm), 0.0, atol=1e-8)  # measured 4e-11 N m


def test_a_push_beside_the_centre_of_mass_turns_away_from_it():
    plain, _ = push_along_x()
    for y in (0.01, -0.01):
        motion, _ = push_along_x(make("com_offset", y=y))
        # The mass lags behind on its side: at y > 0 the object turns to +, counter-clockwise.
        assert math.copysign(1.0, y) * end(motion)[2] > 0.05
    assert abs(end(plain)[2]) < 1e-6


@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_a_spin_lasts_in_proportion_to_the_inertia(ratio):
    assert end(spun(make("rotational_inertia", ratio=ratio)))[2] == pytest.approx(
        ratio * end(spun())[2], rel=1e-3
    )  # measured 2e-4


def test_a_larger_object_is_touched_earlier_by_half_its_growth():
    plain, path = push_along_x()
    larger, _ = push_along_x(make("size_error", ratio=1.04))
    earlier = path.positions(np.array([plain.impacts[0]])) - path.positions(np.array([larger.impacts[0]]))
    assert earlier[0, 0] == pytest.approx(0.5 * 0.04 * SIZE[0], abs=1e-6)  # measured 3e-7 m


def test_an_object_that_is_lower_than_the_contact_is_touched_at_its_top():
    ends = [end(push_along_x(make("size_error", ratio=0.9), height=share * SIZE[2])[0]) for share in (0.9, 1.0)]
    np.testing.assert_array_equal(ends[0], ends[1])


@pytest.mark.parametrize(
    ("shape", "wanted"),
    [
        (Box(size=(0.1, 0.08, 0.06)), Box(size=(0.11, 0.088, 0.066))),
        (Cylinder(radius=0.03, length=0.1, axis="z"), Cylinder(radius=0.033, length=0.11, axis="z")),
        (
            Prism(polygon=((-0.03, -0.02), (0.06, -0.02), (-0.03, 0.04)), height=0.06),
            Prism(polygon=((-0.033, -0.022), (0.066, -0.022), (-0.033, 0.044)), height=0.066),
        ),
    ],
    ids=lambda shape: type(shape).__name__,
)
def test_an_object_is_larger_in_all_directions(shape, wanted):
    got = make("size_error", ratio=1.1).reshaped(shape)
    assert type(got) is type(wanted)
    for name, value in vars(wanted).items():
        if not isinstance(value, str | None):
            np.testing.assert_allclose(getattr(got, name), value, rtol=1e-12)


@pytest.mark.parametrize(
    "grid", [((5.0, 1.0, 5.0), (1.0, 1.0, 1.0), (5.0, 1.0, 5.0)), ((1, 1, 1), (1, 9, 1), (1, 1, 1))]
)
def test_a_film_is_under_the_whole_base_wherever_it_presses(grid):
    """Without friction, a spin under a drag -c k^2 w decays alike, whatever carries the weight."""
    drag, uneven = make("viscous_drag", coefficient=0.4), make("uneven_support", weights=grid)
    even = spun(drag, friction=1e-6, seconds=0.5)
    np.testing.assert_allclose(
        end(spun(drag, uneven, friction=1e-6, seconds=0.5)), end(even), atol=1e-4
    )  # measured 3e-5
    want = 10.0 * (1.0 - math.exp(-0.4 * 0.5 / MASS)) * MASS / 0.4  # the inertia is m k^2, too
    assert end(even)[2] == pytest.approx(want, rel=2e-3)
