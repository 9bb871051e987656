"""The compiled twin against closed forms, invariants, and the fine planar integrator."""

import dataclasses as dc
import math

import numpy as np
import pytest
from reference.scenes import simulate, sixty_pushes
from twin import SIGMA, body_of, path_of, rms, shape_of, twin_body

from physid_drake.cell import HandPath, Outcome, Start
from physid_drake.cell.laws import Attraction, Ellipse, Falling, Gradient, Patch, Quadratic, Spring, Tilt, Viscous
from physid_drake.cell.soft_tip import Mount
from physid_drake.cell.solid import solid_of
from physid_drake.effects.liquid import Swing
from physid_drake.recording import Box, Cylinder
from physid_drake.twin.twin import STEADY, Twin, TwinPush, Wander

G = 9.81
MU, SPEED = 0.3, 0.5
BOX = Twin(solid=solid_of(Box(size=(0.10, 0.08, 0.02))), hand_radius=0.01)
DISC = Twin(solid=solid_of(Cylinder(radius=0.04, length=0.02, axis="z")), hand_radius=0.01)


def slide(
    *laws, twin=BOX, mu=MU, mass=0.4, velocity=(SPEED, 0.0, 0.0), end=2.0, pose=(0.0, 0.0, 0.0), times=None,
    wander=STEADY,
):  # fmt: skip
    """A free slide."""
    times = np.linspace(0.0, end, 201) if times is None else times
    push = TwinPush(
        body=body_of(mass, mu), start=Start(pose=pose, velocity=velocity), path=None, begin=0.0, end=end, times=times,
        laws=laws, wander=wander,
    )  # fmt: skip
    (trace,) = twin.rollouts([push])
    assert trace.outcome is Outcome.COMPLETED
    return trace


def pushed(pose=(0.0, 0.0, 0.0), start=(-0.07, 0.012), heading=0.1, body=None, times=None, **more):
    along = np.array([math.cos(heading), math.sin(heading)])
    path = HandPath(
        times=np.array([0.0, 0.05, 0.30, 0.34]), velocities=np.outer([0, 0.3, 0.3, 0], along), start=np.array(start)
    )
    times = np.linspace(0.0, 0.8, 81) if times is None else times
    return TwinPush(
        body=body or body_of(0.35, MU), start=Start(pose=pose), path=path, begin=0.0, end=0.8, times=times, **more
    )


def turned(points, angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.asarray(points) @ np.array([[c, s], [-s, c]])


# Measured .067, worst push .22 (36 points); .032 and .13 with 100.
@pytest.mark.parametrize(("points", "furthest", "worst"), [(36, 0.10, 0.30), (100, 0.05, 0.16)])
def test_pushes_go_where_the_fine_integrator_has_them(points, furthest, worst):
    squares = []
    for body, theta, push in sixty_pushes(0)[::3]:
        reference = simulate(body, theta, push)
        twin = Twin(solid=solid_of(shape_of(body)), hand_radius=push.tip_radius, points=points)
        asked = TwinPush(
            body=twin_body(body, theta), start=Start(pose=push.pose), path=path_of(push), begin=0.0,
            end=float(reference.times[-1]), times=reference.times, hand_height=push.tip_height,
        )  # fmt: skip
        (trace,) = twin.rollouts([asked])
        away = trace.poses - reference.poses
        away[:, 2] = (away[:, 2] + math.pi) % (2 * math.pi) - math.pi
        squares.append(rms(away / SIGMA))
    assert rms(np.array(squares)) < furthest and max(squares) < worst


@pytest.mark.parametrize("mu", [0.1, 0.5])
@pytest.mark.parametrize("twin", [BOX, DISC], ids=["box", "disc"])
def test_a_slide_ends_after_v_squared_over_two_mu_g(twin, mu):
    way = slide(twin=twin, mu=mu).poses[-1]
    assert way == pytest.approx([SPEED**2 / (2 * mu * G), 0.0, 0.0], abs=3e-7)


@pytest.mark.parametrize("share", [-0.2, 0.3])
def test_a_friction_that_differs_for_a_while_changes_the_speed_by_the_area_of_its_hat(share):
    """While the object slides on, v(t) = v0 - mu g (t + share A(t)), with A the area of a hat up to t."""
    middle, width, mu = 0.1, 0.06, 0.2
    plain, other = (
        slide(mu=mu, wander=w).poses[-1, 0] for w in (STEADY, Wander(middle=middle, width=width, support=share))
    )
    lost, late = mu * G * share * width, SPEED - mu * G * (middle + width)  # m/s: within the hat, and left after it
    apart = width * lost + (late**2 - (late - lost) ** 2) / (2 * mu * G)
    assert plain - other == pytest.approx(apart, rel=1e-3)


def test_a_wrench_that_comes_and_goes_gives_the_momentum_of_its_hat_about_its_middle():
    """Hardly any friction: x(T) = v T + F width (T - middle) / m, and the same of the turn."""
    middle, width, mass, end = 0.3, 0.2, 0.4, 1.0
    wander = Wander(middle=middle, width=width, force=(0.05, -0.08), torque=2e-4)
    x, y, yaw = slide(mu=1e-6, mass=mass, velocity=(0.2, 0.1, 0.5), end=end, wander=wander).poses[-1]
    gained = width * (end - middle)
    assert (x, y) == pytest.approx((0.2 + 0.05 * gained / mass, 0.1 - 0.08 * gained / mass), rel=1e-3)
    inertia = mass * BOX.solid.gyration[2]
    assert yaw == pytest.approx(0.5 + 2e-4 * gained / inertia, rel=1e-3)


def test_mass_cancels_in_a_free_slide():
    poses = [slide(mass=mass, velocity=(SPEED, 0.1, 3.0)).poses for mass in (0.05, 0.4, 5.0)]
    assert np.abs(np.array(poses) - poses[0]).max() < 1e-9


def test_a_disc_spins_down_as_coulomb_friction_says():
    """dw/dt = -(2/3) mu g R m / I = -(4/3) mu g / R of a uniform disc that turns in place."""
    spin = 20.0
    turn = slide(twin=dc.replace(DISC, points=400), velocity=(0.0, 0.0, spin)).poses[-1, 2]
    assert turn == pytest.approx(spin**2 / (2 * 4 / 3 * MU * G / 0.04), rel=2e-3)  # measured 7e-4


def test_nothing_moves_without_a_push():
    trace = slide(velocity=(0.0, 0.0, 0.0), pose=(0.1, 0.2, 0.3))
    assert np.array_equal(trace.poses, np.tile([0.1, 0.2, 0.3], (201, 1)))


def test_a_push_that_is_turned_and_moved_turns_and_moves_with_it():
    angle, shift = 1.1, np.array([0.3, -0.2])
    (plain,) = BOX.rollouts([pushed(pose=(0.0, 0.0, 0.1))])
    moved = pushed(pose=(*shift, 0.1 + angle), start=turned([-0.07, 0.012], angle) + shift, heading=0.1 + angle)
    (other,) = BOX.rollouts([moved])
    assert turned(plain.poses[:, :2], angle) + shift == pytest.approx(other.poses[:, :2], abs=1e-9)
    assert plain.poses[:, 2] + angle == pytest.approx(other.poses[:, 2], abs=1e-7)
    assert turned(plain.forces, angle) == pytest.approx(other.forces, abs=1e-6)


def test_a_push_that_is_mirrored_moves_as_in_a_mirror():
    plain, mirrored = BOX.rollouts([
        pushed(pose=(0.0, 0.0, 0.1)), pushed(pose=(0.0, 0.0, -0.1), start=(-0.07, -0.012), heading=-0.1)
    ])  # fmt: skip
    assert plain.poses * [1.0, -1.0, -1.0] == pytest.approx(mirrored.poses, abs=1e-8)


def test_a_push_through_the_centre_does_not_turn():
    (trace,) = BOX.rollouts([pushed(start=(-0.07, 0.0), heading=0.0)])
    assert np.abs(trace.poses[:, 1:]).max() < 1e-9 and trace.poses[-1, 0] > 0.03
    pushing = trace.forces[(trace.forces[:, 0] > 0.0)]
    assert np.median(pushing[:, 0]) == pytest.approx(MU * 0.35 * G, rel=1e-3)


def test_energy_never_grows_in_a_slide():
    times = np.linspace(0.0, 0.6, 1201)
    trace = slide(velocity=(0.3, 0.2, 8.0), end=0.6, times=times)
    velocities = np.gradient(trace.poses, times, axis=0)
    inertia = (0.10**2 + 0.08**2) / 12.0
    energy = (velocities**2) @ [1.0, 1.0, inertia]
    assert (np.diff(energy[1:-1]) < 1e-5).all()


def test_what_is_simulated_together_is_simulated_as_alone():
    pushes = [
        pushed(), pushed(heading=0.2, laws=(Tilt(0.02, 0.0),)), pushed(laws=(Patch(1.5, 0.05, 0.0, 0.03),)),
        pushed(body=body_of(0.3, 0.5)),
    ]  # fmt: skip
    together = BOX.rollouts([*pushes, *reversed(pushes)])
    for push, first, last in zip(pushes, together[:4], reversed(together[4:]), strict=True):
        (alone,) = BOX.rollouts([push])
        assert np.array_equal(alone.poses, first.poses) and np.array_equal(alone.poses, last.poses)
        assert np.array_equal(alone.forces, first.forces)


def test_poses_do_not_depend_on_when_they_are_asked_for():
    few, many = np.array([0.3, 0.8]), np.linspace(0.0, 0.8, 161)
    short, long = BOX.rollouts([pushed(times=few), pushed(times=many)])
    assert np.array_equal(short.poses, long.poses[[60, 160]])


def test_a_tall_object_that_a_push_tips_is_said():
    tall = Twin(solid=solid_of(Box(size=(0.04, 0.04, 0.30))), hand_radius=0.01)
    (trace,) = tall.rollouts([pushed(start=(-0.04, 0.0), heading=0.0, body=body_of(0.4, 0.6), hand_height=0.28)])
    assert trace.tips > 0


# The vocabulary, law by law, in slides along a line.


def test_a_tilt_brakes_less():
    way = slide(Tilt(0.1, 0.0)).poses[-1, 0]
    assert way == pytest.approx(SPEED**2 / (2 * (MU - 0.1) * G), abs=1e-6)


def test_a_tilt_that_friction_holds_moves_nothing():
    trace = slide(Tilt(0.8 * MU, 0.0), velocity=(0.0, 0.0, 0.0))
    assert np.abs(trace.poses).max() == 0.0


def test_a_viscous_drag_makes_a_speed_decay():
    """x = v T (1 - e) - mu g T (t - T (1 - e)) with T = m / c, up to the stop."""
    mass, c = 0.4, 1.6
    T = mass / c
    stop = T * math.log1p(SPEED / (MU * G * T))
    gone = -math.expm1(-stop / T)
    way = slide(Viscous(c, 0.0), mass=mass).poses[-1, 0]
    assert way == pytest.approx(SPEED * T * gone - MU * G * T * (stop - T * gone), abs=1e-6)


def test_a_quadratic_drag():
    """v dv/dx = -mu g - k v^2: x = ln(1 + k v^2 / (mu g)) / (2 k)."""
    mass, c = 0.4, 4.0
    k = c / mass
    way = slide(Quadratic(c), mass=mass).poses[-1, 0]
    assert way == pytest.approx(math.log1p(k * SPEED**2 / (MU * G)) / (2 * k), abs=1e-6)


def test_a_spring_stops_a_slide_where_its_energy_says():
    """m v^2 / 2 = mu m g x + k x^2 / 2 of a spring that is slack at first, and holds less than friction at last."""
    mass, k = 0.4, 2.0
    b = MU * mass * G / k
    way = slide(Spring(k, -0.2, 0.0, 0.2), mass=mass).poses[-1, 0]
    assert way == pytest.approx(-b + math.sqrt(b * b + mass * SPEED**2 / k), abs=1e-6)


def test_an_attraction_stops_a_slide_where_its_energy_says():
    mass, strength, core = 0.4, 8e-4, 0.03  # weaker than friction, so that it stays where it stops
    law = Attraction(strength, 0.0, 0.0, core)
    way = slide(law, mass=mass).poses[-1, 0]
    lost = MU * mass * G * way + strength / core * math.atan(way / core)
    assert lost == pytest.approx(0.5 * mass * SPEED**2, rel=5e-5)  # measured 1.9e-5


def test_friction_that_falls_with_speed():
    """x is the integral of v dv / (mu g (1 + a exp(-(v / s)^2)))."""
    excess, scale = 0.5, 0.2
    v = np.linspace(0.0, SPEED, 200_001)
    want = np.trapezoid(v / (MU * G * (1.0 + excess * np.exp(-((v / scale) ** 2)))), v)
    assert slide(Falling(excess, scale)).poses[-1, 0] == pytest.approx(want, abs=3e-6)


@pytest.mark.parametrize("angle", [0.0, 0.5 * math.pi])
def test_friction_along_the_axes_of_an_ellipse(angle):
    ratio = 1.4
    mu = MU / math.sqrt(ratio) if angle == 0.0 else MU * math.sqrt(ratio)
    assert slide(Ellipse(ratio, angle, False)).poses[-1, 0] == pytest.approx(SPEED**2 / (2 * mu * G), abs=1e-6)


def test_an_ellipse_that_is_fixed_in_the_object_turns_with_it():
    in_table, in_object = (slide(Ellipse(1.4, 0.3 + yaw, fixed), pose=(0.0, 0.0, yaw), velocity=(0.3, 0.1, 0.0))
                           for fixed, yaw in ((False, 0.0), (True, 0.0)))  # fmt: skip
    assert in_table.poses[-1, :2] == pytest.approx(in_object.poses[-1, :2], abs=2e-4)  # it hardly turns


def test_friction_that_changes_across_the_table():
    """v dv/dx = -mu g (1 + s x) at the middle: s x^2 / 2 + x = v^2 / (2 mu g)."""
    s, free = 4.0, SPEED**2 / (2 * MU * G)
    way = slide(Gradient(s, 0.0, 10.0)).poses[-1, 0]
    # Friction tips the pressure forward, to where it is larger: that is not in the formula.
    assert way == pytest.approx((-1.0 + math.sqrt(1.0 + 2.0 * s * free)) / s, abs=1e-3)


def test_a_patch_that_holds_all_of_the_slide_is_another_friction():
    assert slide(Patch(2.0, 0.0, 0.0, 1.0)).poses == pytest.approx(slide(mu=2.0 * MU).poses, abs=1e-9)


# What moves by itself: a tip that gives way, a mass that swings inside.


def test_a_tip_that_gives_way_pushes_as_its_spring_says():
    """The object holds; after the hand has stopped, the force is stiffness times what the spring is pressed by."""
    mount = Mount(stiffness=50.0, damping=2.0, mass=0.01)
    (trace,) = BOX.rollouts([
        pushed(start=(-0.08, 0.0), heading=0.0, body=body_of(2.0, 0.9), mount=mount, times=np.array([0.7, 0.8]))
    ])  # fmt: skip
    way = 0.3 * (0.25 + 0.045)  # of the hand
    assert trace.poses[-1] == pytest.approx([0.0, 0.0, 0.0], abs=3e-6)  # friction that is regularised creeps
    assert trace.forces[-1, 0] == pytest.approx(50.0 * (way - (0.08 - 0.05 - 0.01)), rel=1e-4)


def test_a_stiff_tip_that_is_damped_pushes_as_a_rigid_one():
    """One whose spring swings with the object's mass throws it ahead instead, as a rebound does."""
    mount = Mount(stiffness=1e6, damping=2.0 * math.sqrt(1e6 * 0.35), mass=1e-3)
    rigid, stiff = BOX.rollouts([pushed(), pushed(mount=mount)])
    assert rms((rigid.poses - stiff.poses) / SIGMA) < 0.3


@pytest.mark.parametrize("damping", [0.0, 0.2, 1.5])
def test_a_mass_that_swings_inside_keeps_the_momentum_of_both(damping):
    """Without friction their centre goes on as it came: the object is off it by m_s d / (m + m_s).

    A tilt pulls at the object alone here, so that d swings about, and comes to, F / (m w^2 (1 + m_s / m)).
    """
    mass, swinging, own, tilt = 0.3, 0.1, 2 * math.pi * 3.0, 1e-3
    push = TwinPush(
        body=body_of(mass, 1e-12), start=Start(pose=(0.0, 0.0, 0.0), velocity=(0.2, 0.0, 0.0)), path=None, begin=0.0,
        end=1.0, times=np.linspace(0.0, 1.0, 501), swing=Swing(swinging, own, damping, 0.0), laws=(Tilt(tilt, 0.0),),
    )  # fmt: skip
    (trace,) = BOX.rollouts([push])
    centre = 0.2 * push.times + 0.5 * mass * G * tilt / (mass + swinging) * push.times**2
    away, comes_to = (
        trace.poses[:, 0] - centre,
        swinging * G * tilt / (own**2 * (1.0 + swinging / mass) * (mass + swinging)),
    )
    if damping == 0.0:
        assert away.max() == pytest.approx(2.0 * comes_to, rel=0.02) and away.min() > -1e-8
    else:
        assert away[-1] == pytest.approx(comes_to, rel=0.05)


def test_a_mass_that_swings_has_the_frequency_of_two_bodies_on_a_spring():
    """w sqrt(1 + m_s / m) in an object that is free."""
    mass, swinging, own = 0.3, 0.1, 2 * math.pi * 3.0
    times = np.linspace(0.0, 2.0, 4001)
    push = TwinPush(
        body=body_of(mass, 1e-12), start=Start(pose=(0.0, 0.0, 0.0)), path=None, begin=0.0, end=2.0, times=times,
        swing=Swing(swinging, own, 0.0, 0.0), laws=(Tilt(0.02, 0.0),),
    )  # fmt: skip
    (trace,) = BOX.rollouts([push])
    left = trace.poses[:, 0] - 0.5 * mass * G * 0.02 / (mass + swinging) * times**2  # (1 - cos) of an amplitude
    crossings = times[:-1][np.diff(np.sign(left - left.mean())) != 0]
    period = 2.0 * float(np.mean(np.diff(crossings)))
    assert 2 * math.pi / period == pytest.approx(own * math.sqrt(1.0 + swinging / mass), rel=2e-3)
