"""The effects of the proof's worlds against closed forms. Measured errors stand beside the tolerances."""

import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco")

from proof_pushes import ERASER, MASS, MU, PLAN, central_push, push, slide, spin_angle, straight_path
from scipy import optimize

from physid_drake.validation.worlds.effects import catalogue as fx
from physid_drake.validation.worlds.feet import feet_of, weighted_feet
from physid_drake.validation.worlds.knobs import draw_knob
from physid_drake.validation.worlds.mujoco_world import PushWorld
from physid_drake.validation.worlds.scene import draw_scene
from physid_drake.validation.worlds.shapes import gyration_squared
from physid_drake.validation.worlds.world_plan import GRAVITY, HandPath

pytestmark = pytest.mark.slow  # of worlds that the proof makes, not of what users run


def moves(plain, poses):
    length = min(len(plain), len(poses))
    return np.abs(poses[:length] - plain[:length]).max() > 1e-5


@pytest.mark.parametrize("name", [*fx.CATALOGUED, *fx.OTHERS])
def test_null_values_change_no_bit_and_strength_does(name):
    effect = (fx.CATALOGUED | fx.OTHERS)[name]
    path = straight_path((0.04, 0.08), (0.3, 0.0), 0.2, lead=0.2)
    run = {"pose": (0.13, 0.08, 0.3), "path": path, "push": 1}
    plain = push(**run).poses
    assert np.array_equal(push(effect(), **run).poses, plain)
    scene = replace(draw_scene(np.random.default_rng(0)), plan=PLAN)
    # A patch, a seam or a cable may lie where this push does not feel it.
    drawn = (draw_knob(name, np.random.default_rng(seed), scene) for seed in (5, 6, 7))
    assert any(moves(plain, push(knob.at(0.8 * knob.limit), **run).poses) for knob in drawn)


def test_tilt_lengthens_the_way_down():
    # Measured -0.10 %.
    angle = 0.05
    deceleration = GRAVITY * (MU * math.cos(angle) - math.sin(angle))
    assert slide(fx.TableTilt(x=angle))[0] == pytest.approx(0.125 / deceleration, rel=0.003)
    assert slide(fx.TableTilt(y=angle))[1] > 0.001


def test_viscous_drag():
    # Measured -0.21 %.
    c, a = 0.8 / MASS, MU * GRAVITY
    expected = (0.5 - a / c * math.log(1 + c * 0.5 / a)) / c
    assert slide(fx.ViscousDrag(coefficient=0.8))[0] == pytest.approx(expected, rel=0.003)


def test_viscous_drag_brakes_a_spin_by_the_underside_s_radius_of_gyration():
    feet, weights = feet_of(ERASER)
    polar, spin = gyration_squared(ERASER), 12.0
    c, a = 0.8 / MASS, MU * GRAVITY * float(weights @ np.hypot(*feet.T)) / polar
    expected = (spin - a / c * math.log(1 + c * spin / a)) / c
    # Measured -0.21 %.
    assert slide(fx.ViscousDrag(coefficient=0.8), velocity=(0, 0, spin))[2] == pytest.approx(expected, rel=0.003)


def test_quadratic_drag():
    # Measured -0.23 %.
    c, a = 2.0 / MASS, MU * GRAVITY
    assert slide(fx.QuadraticDrag(coefficient=2.0))[0] == pytest.approx(math.log(1 + c * 0.25 / a) / 2 / c, rel=0.003)


def test_a_drag_slows_the_centre_of_mass_and_not_the_middle_of_the_shape():
    # What spins about its centre of mass, nearly without friction, goes on doing so in the same place.
    x, y, spin, plan = 0.012, -0.007, 4.0, replace(PLAN, support_friction=1e-4)
    effects = fx.ComOffset(x=x, y=y), fx.QuadraticDrag(coefficient=20.0)
    moved = PushWorld(plan, effects).run(
        (0.0, 0.0, 0.0), None, velocity=(spin * y, -spin * x, spin), duration=0.5
    ).poses[-1]  # fmt: skip
    c, s = math.cos(moved[2]), math.sin(moved[2])
    assert moved[2] == pytest.approx(spin * 0.5, rel=0.01)
    # Measured 1e-5 m; without either part of the velocity 2 mm and more.
    mass = moved[:2] + np.array([c * x - s * y, s * x + c * y])
    np.testing.assert_allclose(mass, [x, y], atol=1e-4)


def test_stribeck_stopping_distance():
    # Measured -0.11 %.
    v = np.linspace(0, 0.5, 20001)
    decelerations = MU * GRAVITY * (1 + 0.5 * np.exp(-((v / 0.1) ** 2)))
    expected = np.trapezoid(v / decelerations, v)
    assert slide(fx.StribeckFriction(excess=0.5, speed=0.1))[0] == pytest.approx(expected, rel=0.003)


@pytest.mark.parametrize("heading", [0.0, 0.4, 1.5])
def test_anisotropic_table_is_slippery_along_its_axis(heading):
    effect = fx.AnisotropicTable(ratio=2.0, angle=heading)
    c, s = math.cos(heading), math.sin(heading)
    along = slide(effect, velocity=(0.5 * c, 0.5 * s, 0.0), pose=(0.1, 0.0, 0.7))
    across = slide(effect, velocity=(-0.5 * s, 0.5 * c, 0.0), pose=(0.0, 0.1, -2.0))
    assert math.hypot(*along[:2]) == pytest.approx(0.125 / MU / GRAVITY * math.sqrt(2), rel=0.003)
    assert math.hypot(*across[:2]) == pytest.approx(0.125 / MU / GRAVITY / math.sqrt(2), rel=0.003)
    assert along[:2] @ [s, -c] == pytest.approx(0, abs=1e-5)


def test_anisotropic_object_turns_with_it():
    effect = fx.AnisotropicObject(ratio=2.0, angle=0.3)
    for yaw in (0.0, 1.0):
        c, s = math.cos(yaw + 0.3), math.sin(yaw + 0.3)
        along = slide(effect, velocity=(0.5 * c, 0.5 * s, 0.0), pose=(0.0, 0.0, yaw))
        across = slide(effect, velocity=(-0.5 * s, 0.5 * c, 0.0), pose=(0.0, 0.0, yaw))
        assert math.hypot(*along[:2]) == pytest.approx(0.125 / MU / GRAVITY * math.sqrt(2), rel=0.003)
        assert math.hypot(*across[:2]) == pytest.approx(0.125 / MU / GRAVITY / math.sqrt(2), rel=0.003)


def test_patch_gradient_and_drift_scale_friction():
    plain = 0.125 / MU / GRAVITY
    everywhere = fx.FrictionPatch(ratio=1.5, radius=5.0)
    assert slide(everywhere)[0] == pytest.approx(plain / 1.5, rel=0.003)
    assert slide(replace(everywhere, x=10.0))[0] == pytest.approx(plain, rel=0.003)
    assert slide(fx.FrictionDrift(per_push=0.1), push=4)[0] == pytest.approx(plain / 1.4, rel=0.003)
    # With mu (1 + s (x + d)) work gives x + s x d + s x^2 / 2 = v^2 / (2 mu g); the load leads by d = mu h / 2.
    slope = 4.0
    linear = 1 + slope * MU * 0.015
    expected = (math.sqrt(linear**2 + 2 * slope * plain) - linear) / slope
    # Measured -0.26 %.
    assert slide(fx.FrictionGradient(slope_x=slope))[0] == pytest.approx(expected, rel=0.004)
    assert slide(fx.FrictionGradient(slope_y=slope))[2] > 0.01


def test_tether_and_magnet_pull_towards_their_point():
    plain = slide()[0]
    for effect in (fx.Tether(stiffness=0.5, x=1.0), fx.Magnet(strength=2e-3, x=0.15, core=0.05)):
        assert slide(effect)[0] > 1.05 * plain
        assert slide(replace(effect, x=-effect.x))[0] < 0.97 * plain
    # A cable that is slack pulls nothing; a taut one does work.
    assert slide(fx.Tether(stiffness=2.0, x=0.2, rest_length=0.3))[0] == pytest.approx(plain, rel=1e-9)
    k, friction = 0.5, MU * MASS * GRAVITY
    x = np.roots([-k / 2, k * 1.0 - friction, MASS * 0.125]).max()
    assert slide(fx.Tether(stiffness=k, x=1.0))[0] == pytest.approx(float(x), rel=0.003)


def test_tether_and_magnet_pull_at_the_centre_of_mass():
    def moved(**place):
        pulls = (fx.Tether(stiffness=40.0, **place), fx.Magnet(strength=1e-2, core=0.05, **place))
        return [np.abs(slide(fx.ComOffset(x=0.01), pull, velocity=(0.0, 0.0, 0.0))).max() for pull in pulls]

    assert max(moved(x=0.01)) < 1e-5  # it is there already
    assert min(moved(x=0.05)) > 1e-3


@pytest.mark.parametrize(("core", "share"), [(0.03, 0.4), (0.05, 0.2)])
def test_a_magnet_does_the_work_of_its_law(core, share):
    # Into it and not past it: half m v^2 + the attraction's work = friction's.
    away, friction = 0.06, MU * MASS * GRAVITY
    strength = share * friction * core**2

    def work(x):
        return strength / core * (math.atan(away / core) - math.atan((away - x) / core))

    want = optimize.brentq(lambda x: MASS * 0.125 + work(x) - friction * x, 0.03, away)
    magnet = fx.Magnet(strength=strength, x=0.07, y=0.02, core=core)
    moved = slide(magnet, pose=(0.07 - away, 0.02, 0.0))
    assert want > 1.1 * slide()[0]
    # Measured -0.2 %.
    assert moved[0] == pytest.approx(want, rel=0.005)


def test_com_offset_turns_a_central_push_about_it():
    turn = {y: push(fx.ComOffset(y=y)).poses[-1, 2] for y in (-0.004, 0.0, 0.004)}
    # The centre of mass lags behind on its own side: left of the push, the object turns left.
    assert turn[0.004] > 0.02
    assert turn[-0.004] == pytest.approx(-turn[0.004], rel=0.02)
    assert abs(turn[0.0]) < 0.002


def test_rotational_inertia_and_weights_set_the_spin_down():
    feet, weights = feet_of(ERASER)
    arm = float(weights @ np.hypot(*feet.T))
    # Measured -0.08 to -0.20 %.
    plain = spin_angle(ERASER, 12.0, arm)
    assert slide(fx.RotationalInertia(ratio=1.6), velocity=(0, 0, 12.0))[2] == pytest.approx(1.6 * plain, rel=0.005)
    assert slide(fx.RotationalInertia(ratio=0.6), velocity=(0, 0, 12.0))[2] == pytest.approx(0.6 * plain, rel=0.005)
    for pressure in (((3.0, 1.0, 3.0), (0.0, 0.0, 0.0), (3.0, 1.0, 3.0)), ((0.0, 1.0, 0.0),)):
        effect = fx.UnevenSupport(weights=pressure)
        places, loads = weighted_feet(effect.build(PLAN))
        expected = spin_angle(ERASER, 12.0, float(loads @ np.hypot(*places.T)))
        assert slide(effect, velocity=(0, 0, 12.0))[2] == pytest.approx(expected, rel=0.005)


def test_sloshing_mass_goes_on_when_the_object_stops():
    # In the end all energy is gone, but the object stops later and elsewhere; no fraction, no difference.
    plain = slide()[0]
    assert abs(slide(fx.Sloshing(fraction=0.3, frequency=3.0, damping=0.1))[0] / plain - 1) > 0.05
    stiff = slide(fx.Sloshing(fraction=0.3, frequency=80.0, damping=0.5))[0]
    assert stiff == pytest.approx(plain, rel=0.02)


def test_restitution_is_small_by_default_and_as_asked():
    # Free of the table nearly: what leaves after a short central touch at constant speed of the hand.
    plan = replace(PLAN, support_friction=0.01)
    for wanted in (0.0, 0.2, 0.5):
        path = straight_path((-0.0635 - 0.008 - 0.003, 0.0), (0.3, 0.0), 0.05, ramp=0.01)
        effect = fx.Restitution(coefficient=wanted)
        motion = PushWorld(plan, [effect]).run((0.0, 0.0, 0.0), path, duration=0.1, sample_time=0.0002)
        speed = np.gradient(motion.poses[:, 0], motion.times)
        after = speed[motion.forces[:, 0].argmax() : motion.forces[:, 0].argmax() + 30].max()
        # Measured 0.006, 0.200, 0.501.
        assert after / 0.3 - 1 == pytest.approx(wanted, abs=0.015)


@pytest.mark.parametrize("arm", [0.0, 0.02, 0.038])
@pytest.mark.parametrize("com", [(0.0, 0.0), (0.01, -0.005)], ids=["centred", "com_offset"])
@pytest.mark.parametrize("inertia", [1.0, 1.8])
def test_a_touch_gives_back_as_much_off_the_middle(arm, com, inertia):
    # Straight onto the long face, with hardly any friction: an impulse along the normal and no other.
    plan = replace(PLAN, support_friction=0.01, hand_friction=1e-3, com=com, inertia_ratio=inertia)
    speed, wanted = 0.3, 0.4
    path = straight_path((arm, -0.0255 - 0.008 - 0.003), (0.0, speed), 0.05, ramp=0.005, lead=0.01)
    motion = PushWorld(plan, [fx.Restitution(coefficient=wanted)]).run(
        (0.0, 0.0, 0.0), path, duration=0.04, sample_time=2e-4
    )
    k = int(np.flatnonzero(motion.forces[:, 1] > 0)[-1]) + 2
    _, vy, spin = (motion.poses[k + 5] - motion.poses[k]) / (5 * 2e-4)
    # Of B's origin; the point that was touched leaves at (1 + e) times the speed. Measured 0.396 to 0.407.
    assert (vy + spin * arm) / speed - 1 == pytest.approx(wanted, abs=0.015)
    lever, turning = arm - com[0], inertia * gyration_squared(ERASER)
    assert spin == pytest.approx((1 + wanted) * speed * lever / (turning + lever**2), rel=0.02, abs=0.03)


def test_hand_compliance_gives_way_by_force_times_compliance():
    # At constant speed the tip lags by mu m g times the compliance; measured -0.1 %.
    compliance = 0.003
    path = central_push(speed=0.1, seconds=0.8)
    soft = push(fx.HandCompliance(compliance=compliance, damping=0.4), path=path)
    hard = push(path=path)
    at = 0.7
    lag = np.interp(at, hard.times, hard.poses[:, 0]) - np.interp(at, soft.times, soft.poses[:, 0])
    assert lag == pytest.approx(compliance * MU * MASS * GRAVITY, rel=0.01)


@pytest.mark.parametrize("share", [0.1, 0.2, 0.5])
def test_a_sprung_tip_has_inertia(share):
    # Accelerated evenly, without friction, the spring carries object and tip.
    plan, rise, compliance = replace(PLAN, support_friction=1e-3), 1.0, 0.004
    path = HandPath(
        times=np.array([0.0, 0.4, 0.45]), start=np.array([-0.0635 - 0.008 - 1e-4, 0.0]),
        velocities=np.outer([0.0, 0.4 * rise, 0.0], [1.0, 0.0]),
    )  # fmt: skip
    run = {"path": path, "plan": plan, "duration": 0.4}
    soft = push(fx.HandCompliance(compliance=compliance, damping=0.6, share=share), **run)
    lag = push(**run).poses[-1, 0] - soft.poses[-1, 0]
    want = compliance * MASS * ((1.0 + share) * rise + 1e-3 * GRAVITY)
    assert lag == pytest.approx(want, rel=0.02)


def test_actuator_lag_and_hand_offset_move_the_tip():
    times = np.arange(0, 0.5, 2e-4)
    ramp = np.column_stack([np.maximum(0, times - 0.1) * 0.4, 0 * times])
    lagged = fx.ActuatorLag(time_constant=0.02).tip(times, ramp)
    since = np.maximum(0, times - 0.1)
    np.testing.assert_allclose(lagged[:, 0], 0.4 * (since - 0.02 * (1 - np.exp(-since / 0.02))), atol=1e-9)
    moved = push(fx.HandOffset(x=0.002)).poses[-1, 0] - push().poses[-1, 0]
    assert moved == pytest.approx(0.002, abs=2e-5)


def test_trackers_are_wrong_exactly_as_they_say():
    plain = push(pose=(0.05, 0.03, 0.0))
    delay = 0.0124
    late = push(fx.TrackerLatency(delay=delay), pose=(0.05, 0.03, 0.0))
    fine = push(pose=(0.05, 0.03, 0.0), sample_time=2e-4)
    expected = np.interp(late.times - delay, fine.times, fine.poses[:, 0])
    np.testing.assert_allclose(late.poses[:, 0], expected, atol=1e-12)
    x, y, yaw = 0.004, -0.002, 0.05
    biased = push(fx.TrackerBias(x=x, y=y, yaw=yaw), pose=(0.05, 0.03, 0.0)).poses
    c, s = np.cos(plain.poses[:, 2]), np.sin(plain.poses[:, 2])
    np.testing.assert_allclose(
        biased - plain.poses, np.column_stack([c * x - s * y, s * x + c * y, yaw + 0 * c]), atol=1e-15
    )
    scaled = push(fx.TrackerScale(ratio=1.03), pose=(0.05, 0.03, 0.0)).poses
    np.testing.assert_allclose(scaled, plain.poses * [1.03, 1.03, 1.0], atol=1e-15)


def test_a_larger_object_is_touched_earlier():
    larger = push(fx.SizeError(ratio=1.04)).poses[-1, 0] - push().poses[-1, 0]
    assert larger == pytest.approx(0.04 * 0.127 / 2, abs=1e-4)
