"""The planar reference against closed forms and itself. Measured errors stand beside the tolerances."""

import csv
import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.integrate import dblquad, solve_ivp

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from reference.planar import Hand, HandPath, PlanarObject, box, simulate_planar
from reference.scenes import (
    OBJECTS,
    QUIET,
    Theta,
    draw_push,
    simulate,
    sixty_pushes,
    write_reference_recording,
)
from reference.steps import GRAVITY, routh_impact

pytestmark = pytest.mark.slow  # of what other tests are measured against, not of what users run

LONG_ERASER = box("long eraser", (0.05, 0.12, 0.03), 0.05)
ERASER = OBJECTS["eraser"]
BOX = OBJECTS["box"]


def straight_path(start, speed, *, direction=(1.0, 0.0), ramp=0.05, cruise=0.3, brake=0.04):
    times = np.cumsum([0.0, ramp, cruise, brake])
    return HandPath(times=times, p0=np.array(start, float), velocities=np.outer([0, speed, speed, 0], direction))


def end_pose(body, mu, *, seconds=1.0, **more):
    return simulate_planar(body, mu, np.array([0.0, seconds]), **more).poses[-1]


# ------------------------------------------------------------------------------------------------ free slides


@pytest.mark.parametrize("speed", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("name", ["eraser", "box", "can", "triangle"])
def test_stopping_distance_is_v_squared_over_two_mu_g(name, speed):
    x, y, yaw = end_pose(OBJECTS[name], 0.3, velocity=(speed, 0, 0))
    assert x == pytest.approx(speed**2 / (2 * 0.3 * GRAVITY), abs=1e-7)  # measured 2e-10 m
    assert abs(y) < 1e-8
    assert abs(yaw) < 1e-6


def test_stopping_distance_does_not_depend_on_mass():
    light = end_pose(BOX, 0.3, velocity=(0.5, 0.1, 4.0))
    heavy = end_pose(replace(BOX, mass=10 * BOX.mass), 0.3, velocity=(0.5, 0.1, 4.0))
    np.testing.assert_allclose(light, heavy, atol=1e-9)


def test_spin_down_of_a_box_follows_the_torque_integral():
    mu, spin = 0.3, 15.0
    lx, ly = np.ptp(LONG_ERASER.polygon, axis=0)
    mean_arm, _ = dblquad(lambda y, x: math.hypot(x, y), -lx / 2, lx / 2, -ly / 2, ly / 2, epsabs=1e-12)
    deceleration = mu * GRAVITY * (mean_arm / (lx * ly)) / ((lx**2 + ly**2) / 12)
    yaw = end_pose(LONG_ERASER, mu, velocity=(0, 0, spin))[2]
    assert yaw == pytest.approx(spin**2 / (2 * deceleration), rel=4e-4)  # the 600 cells: measured -1.5e-4


def test_spin_down_of_a_disc_follows_two_thirds_of_its_radius():
    can, spin = OBJECTS["can"], 20.0
    deceleration = 0.3 * GRAVITY * (2 / 3 * can.radius) / (can.radius**2 / 2)
    yaw = end_pose(can, 0.3, velocity=(0, 0, spin))[2]
    assert yaw == pytest.approx(spin**2 / (2 * deceleration), rel=1e-3)  # the 600 cells: measured 6.1e-4


def test_a_sliding_and_spinning_disc_follows_quadrature_of_uniform_pressure():
    """A low disc carries uniform pressure: force and torque by an independent polar quadrature."""
    disc = PlanarObject(name="puck", radius=0.04, height=1e-6, mass=0.2)
    nodes, gauss = np.polynomial.legendre.leggauss(60)
    r = (nodes + 1) / 2 * disc.radius
    angle = 2 * np.pi * (np.arange(120) + 0.5) / 120
    R, A = np.meshgrid(r, angle)
    x, y = R * np.cos(A), R * np.sin(A)
    w = R * gauss / np.sum(R * gauss)

    def slope(_, s):
        ux, uy = s[1] - s[3] * y, s[3] * x
        n = np.sqrt(ux**2 + uy**2) + 1e-12
        f = -0.3 * GRAVITY * np.sum(w * ux / n)
        tau = -0.3 * GRAVITY * np.sum(w * (x * uy - y * ux) / n) / (disc.radius**2 / 2)
        return [s[1], f, s[3], tau]

    seconds = 0.12  # before it stops
    exact = solve_ivp(slope, (0, seconds), [0, 0.5, 0, 10.0], rtol=1e-9, atol=1e-11).y[:, -1]
    got = end_pose(disc, 0.3, velocity=(0.5, 0, 10.0), seconds=seconds)
    assert got[0] == pytest.approx(exact[0], abs=5e-6)
    assert got[2] == pytest.approx(exact[2], abs=5e-4)


def test_half_slippery_underside_turns_to_the_rough_side():
    """Figures of an independent planar code (drake.md, section 5): 49.66 mm, -1.44 mm, -30.1 deg."""
    points, _ = LONG_ERASER.support()
    mu = np.where(points[:, 1] > 0, 0.1, 0.5)
    x, y, yaw = end_pose(LONG_ERASER, mu, velocity=(0.5, 0, 0))
    assert 1e3 * x == pytest.approx(49.66, abs=0.01)  # measured 49.666
    assert 1e3 * y == pytest.approx(-1.44, abs=0.005)  # measured -1.441
    assert math.degrees(yaw) == pytest.approx(-30.1, abs=0.05)  # measured -30.09


def test_a_force_below_the_friction_limit_does_not_move_the_object():
    limit = 0.3 * BOX.mass * GRAVITY
    held = end_pose(BOX, 0.3, force=(0.6 * 0.9 * limit, 0.8 * 0.9 * limit))
    assert np.hypot(*held[:2]) < 3e-6  # the regularisation creeps 2.1e-6 m in 1 s
    x = end_pose(BOX, 0.3, force=(1.1 * limit, 0), seconds=0.5)[0]
    assert x == pytest.approx(0.1 * 0.3 * GRAVITY * 0.5**2 / 2, rel=1e-4)


def test_load_transfer_moves_the_centre_of_pressure_forward():
    """With the front half frictionless, the rear carries less while sliding than it does at rest."""
    body = BOX
    points, weights = body.support()
    mu = np.where(points[:, 0] > 0, 0.0, 0.4)
    slope = weights @ points[:, 0] ** 2
    rear = mu > 0
    # N = w m g (1 + b x); sum(x N) = h F, F = 0.4 sum over the rear of N
    h = body.height_of_com
    share, arm = weights[rear].sum(), weights[rear] @ points[rear, 0]
    b = 0.4 * h * share / (slope - 0.4 * h * arm)
    deceleration = 0.4 * GRAVITY * (share + b * arm)
    seconds = 0.1
    x = end_pose(body, mu, velocity=(0.5, 0, 0), seconds=seconds)[0]
    assert x == pytest.approx(0.5 * seconds - deceleration * seconds**2 / 2, abs=1e-7)


# ----------------------------------------------------------------------------------------------------- pushes


def test_no_push_no_motion():
    path = straight_path((-0.2, 0), 0.2)
    motion = simulate_planar(BOX, 0.3, np.linspace(0, 1, 11), hand=Hand(path=path))
    assert np.all(motion.poses == 0)


def test_energy_never_grows_after_the_push():
    for body, theta, push in sixty_pushes(0)[:5]:
        motion = simulate(body, theta, push)
        v = motion.velocities
        energy = body.mass * (v[:, 0] ** 2 + v[:, 1] ** 2) / 2 + body.inertia * v[:, 2] ** 2 / 2
        free = np.flatnonzero(motion.in_contact | (motion.times < push.path.times[-1]))[-1] + 1
        assert np.all(np.diff(energy[free:]) <= 1e-15)


@pytest.mark.parametrize("name", ["eraser", "bottle", "triangle"])
def test_turning_the_scene_turns_the_motion(name):
    body, angle = OBJECTS[name], 0.7
    theta = Theta(support_friction=0.22, hand_friction=0.3, com_offset=(0.003, -0.002))
    push = draw_push(np.random.default_rng(4), body, speed=0.3)
    c, s = math.cos(angle), math.sin(angle)
    R = np.array([[c, -s], [s, c]])
    path = HandPath(times=push.path.times, p0=R @ push.path.p0, velocities=push.path.velocities @ R.T)
    x, y = R @ np.array(push.pose[:2])
    turned = replace(push, path=path, pose=(x, y, push.pose[2] + angle))
    times = np.linspace(0, 1.5, 16)
    a, b = simulate(body, theta, push, times).poses, simulate(body, theta, turned, times).poses
    np.testing.assert_allclose(b[:, :2], a[:, :2] @ R.T, atol=1e-8)  # rounding, amplified by contact
    np.testing.assert_allclose(b[:, 2], a[:, 2] + angle, atol=1e-7)


def test_a_mirrored_push_gives_a_mirrored_motion():
    mirror = np.array([1.0, -1.0])
    theta = Theta(support_friction=0.3, hand_friction=0.3, com_offset=(0.003, -0.002))
    push = draw_push(np.random.default_rng(5), ERASER, speed=0.3)
    path = HandPath(times=push.path.times, p0=push.path.p0 * mirror, velocities=push.path.velocities * mirror)
    x, y, yaw = push.pose
    other = replace(push, path=path, pose=(x, -y, -yaw))
    times = np.linspace(0, 1.5, 16)
    a = simulate(ERASER, theta, push, times).poses
    b = simulate(ERASER, replace(theta, com_offset=(0.003, 0.002)), other, times).poses
    np.testing.assert_allclose(b, a * [1, -1, -1], atol=1e-7)


@pytest.mark.parametrize("body", [BOX, OBJECTS["can"]], ids=["box", "can"])
def test_a_push_through_the_centre_of_friction_does_not_rotate(body):
    half = body.radius or np.ptp(body.polygon[:, 0]) / 2
    path = straight_path((-half - 0.02, 0.0), 0.3)
    motion = simulate_planar(body, 0.2, np.linspace(0, 1, 101), hand=Hand(path=path))
    assert motion.poses[-1, 0] > 0.05
    assert np.abs(motion.poses[:, 1:]).max() < 1e-8


def test_a_central_push_has_the_force_of_friction_and_slides_on_from_the_brake():
    mu, speed, brake = 0.3, 0.3, 0.04
    path = straight_path((-0.05 - 0.010 - 0.010, 0.0), speed, brake=brake)
    motion = simulate_planar(BOX, mu, np.linspace(0, 1, 1001), hand=Hand(path=path))
    cruising = motion.in_contact & (motion.times > 0.15) & (motion.times < 0.34)
    np.testing.assert_allclose(motion.forces[cruising, 0], mu * BOX.mass * GRAVITY, rtol=1e-6)
    # the hand brakes at 7.5 m/s^2 > mu g: released at the first instant of the brake
    released = path.knots[2, 0] + 0.010 + 0.05
    assert motion.poses[-1, 0] == pytest.approx(released + speed**2 / (2 * mu * GRAVITY), abs=1e-7)


def test_a_slow_push_approaches_the_quasi_static_limit():
    """The path no longer depends on speed; the hand does the work of friction; both to 1 %."""
    ends = []
    for speed in (0.004, 0.002):
        path = straight_path((-0.05 - 0.010, 0.02), speed, ramp=0.05, cruise=0.02 / speed, brake=0.05)
        points = BOX.support(150)
        times = np.array([0.0, path.times[-1] + 0.2])
        motion = simulate_planar(BOX, 0.3, times, hand=Hand(path=path), support=points, time_step=1e-4)
        travel = path.knots[-1, 0] - path.p0[0]
        ends.append(motion.poses[-1] / travel)
    np.testing.assert_allclose(ends[0], ends[1], rtol=2e-3, atol=2e-3)
    # A sticking tip: twist and force are normal to each other on the limit surface; first instant
    motion = simulate_planar(BOX, 0.3, np.array([0.0, 0.3, 0.35]), hand=Hand(path=path, friction=2.0), time_step=2e-5)
    twist, force = motion.velocities[1], motion.forces[1]
    points, weights = BOX.support(9600)
    slip = twist[:2] + twist[2] * np.column_stack([-points[:, 1], points[:, 0]])
    unit = slip / np.hypot(slip[:, 0], slip[:, 1])[:, None]
    load = weights * 0.3 * BOX.mass * GRAVITY
    pulled = load @ unit
    # uniform pressure, while the reference tilts its own: the force agrees, the moment to a few per cent
    np.testing.assert_allclose(force, pulled, rtol=0.02, atol=0.02 * np.hypot(*pulled))


def test_a_sticking_tip_does_not_slip_and_a_pushed_face_stays_on_the_tip():
    path = straight_path((-0.05 - 0.010 - 0.005, 0.015), 0.2)
    times = np.linspace(0, 0.34, 341)
    motion = simulate_planar(BOX, 0.3, times, hand=Hand(path=path, friction=1.0))
    tip = path.position(times) - motion.poses[:, :2]
    c, s = np.cos(motion.poses[:, 2]), np.sin(motion.poses[:, 2])
    x, y = c * tip[:, 0] + s * tip[:, 1], -s * tip[:, 0] + c * tip[:, 1]
    touching = np.flatnonzero(motion.in_contact)[2:]
    assert len(touching) > 200
    assert np.abs(x[touching] + 0.06).max() < 2e-8  # gap, m
    # the tip does not turn: while it sticks, the touched point rolls by the tip's radius times the yaw
    rolled = 0.010 * (motion.poses[touching, 2] - motion.poses[touching[0], 2])
    drift = np.minimum(np.abs(y[touching] - y[touching[0]] - rolled), np.abs(y[touching] - y[touching[0]] + rolled))
    assert drift.max() < 2e-6


def test_halving_the_time_step_changes_a_push_by_less_than_five_micrometres():
    for body, theta, push in [sixty_pushes(0)[k] for k in (0, 1, 2, 3, 4)]:
        motion = simulate(body, theta, push)
        finer = simulate(body, theta, push, motion.times, time_step=1e-5)
        change = np.abs(finer.poses - motion.poses).max(axis=0)
        assert change[:2].max() < 5e-6
        assert change[2] < 1e-4
        assert motion.unconverged == 0
        assert not motion.tipped


# ----------------------------------------------------------------------------------------------------- impact


def impact_in_closed_form(mass, inertia, rn, rt, un, ut, mu, e):
    """Wang and Mason (1992), table 1: impulses of Routh's method with Poisson's e, by the cases."""
    sign = 1.0 if ut > 0 else -1.0
    rt, ut = sign * rt, sign * ut  # mirrored so that the slip is positive
    B1, B2, B3 = 1 / mass + rt**2 / inertia, 1 / mass + rn**2 / inertia, rn * rt / inertia
    C0, S0 = un, ut
    mu_stick = -B3 / B1  # pt = mu_stick pn keeps the slip
    p_stop = S0 / (mu * B1 - B3) if mu * B1 > B3 else math.inf  # normal impulse at which slip ends
    p_turn = -C0 / (B2 - mu * B3) if mu * B3 < B2 else math.inf  # at which compression ends
    after = mu_stick if abs(mu_stick) <= mu else math.copysign(mu, mu_stick)
    if p_stop >= (1 + e) * p_turn:  # sliding
        pn = (1 + e) * p_turn
        pt = -mu * pn
    elif p_stop > p_turn:  # slip ends in restitution: R-sticking, R-reversed
        pn = (1 + e) * p_turn
        pt = -mu * p_stop + after * (pn - p_stop)
    else:  # slip ends in compression: C-sticking, C-reversed
        un_stop = C0 + (B2 - mu * B3) * p_stop
        pn = (1 + e) * (p_stop - un_stop / (B2 + after * B3))
        pt = -mu * p_stop + after * (pn - p_stop)
    return pn, sign * pt


def test_impacts_agree_with_the_closed_form_in_every_case():
    rng = np.random.default_rng(1)
    kinds = {"slip": 0, "stick": 0, "reverse": 0}
    for _ in range(3000):
        mass, inertia = rng.uniform(0.05, 1), rng.uniform(1e-4, 1e-3)
        rn, rt = rng.uniform(-0.06, 0.06, 2)
        un, ut = -rng.uniform(0.01, 1), rng.uniform(-1, 1)
        mu, e = rng.uniform(0.05, 1.0), rng.choice([0.0, 0.5])
        got = routh_impact(mass, inertia, rn, rt, un, ut, mu, e)
        exact = impact_in_closed_form(mass, inertia, rn, rt, un, ut, mu, e)
        np.testing.assert_allclose(got, exact, rtol=1e-9, atol=1e-12)
        slip = ut + (1 / mass + rt**2 / inertia) * got[1] + rn * rt / inertia * got[0]
        kinds["stick" if abs(slip) < 1e-9 else "slip" if slip * ut > 0 else "reverse"] += 1
    assert min(kinds.values()) > 50, kinds


@pytest.mark.parametrize("mu_hand", [0.1, 0.3, 0.9])
@pytest.mark.parametrize("e", [0.0, 0.4])
def test_a_fast_oblique_off_centre_touch_leaves_with_the_velocities_of_the_closed_form(mu_hand, e):
    direction, offset = (math.cos(0.4), math.sin(0.4)), 0.02
    path = straight_path((-0.0635 - 0.010 - 0.02, offset - 0.02 * math.tan(0.4)), 0.6, direction=direction, ramp=0.01)
    motion = simulate_planar(
        ERASER, 0.3, np.linspace(0, 0.06, 60001), hand=Hand(path=path, friction=mu_hand, restitution=e)
    )
    hit = int(np.flatnonzero(np.abs(motion.velocities[:, 0]) > 0)[0])
    y = motion.poses[hit, 1] + path.position(motion.times[hit])[0, 1]
    ux, uy = -0.6 * direction[0], -0.6 * direction[1]
    # n = x, t = y; the touched point is at (-0.0635, y)
    pn, pt = impact_in_closed_form(ERASER.mass, ERASER.inertia, -y, -0.0635, ux, uy, mu_hand, e)
    exact = [pn / ERASER.mass, pt / ERASER.mass, (-y * pn - 0.0635 * pt) / ERASER.inertia]
    # within one sample of 1 us friction takes mu g dt = 3e-6 m/s and 1e-4 rad/s
    np.testing.assert_allclose(motion.velocities[hit, :2], exact[:2], atol=1e-4)
    assert motion.velocities[hit, 2] == pytest.approx(exact[2], abs=5e-3)


# ------------------------------------------------------------------------------------------------- recordings


def test_sixty_pushes_are_the_same_for_the_same_seed():
    for (_, theta_a, push_a), (_, theta_b, push_b) in zip(sixty_pushes(3), sixty_pushes(3), strict=True):
        assert theta_a == theta_b
        assert np.array_equal(push_a.path.knots, push_b.path.knots)


def test_a_written_recording_holds_the_poses_of_the_reference(tmp_path):
    rng = np.random.default_rng(0)
    pushes = [(Theta(), draw_push(rng, OBJECTS["triangle"], tip_radius=0.01, speed=0.3)) for _ in range(2)]
    motions = write_reference_recording(tmp_path, OBJECTS["triangle"], pushes, QUIET, rng, time_step=1e-4)
    header = yaml.safe_load((tmp_path / "recording.yaml").read_text(encoding="utf-8"))
    assert header["format"] == "physid-recording/1"
    assert header["object"]["shape"] == "prism"
    for entry, motion in zip(header["pushes"], motions, strict=True):
        with (tmp_path / entry["file"]).open(encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
        x = np.array([float(row["object_x_m"]) for row in rows])
        np.testing.assert_allclose(x, motion.poses[:, 0], atol=1e-9)
        assert np.ptp(x[:19]) == 0
        assert np.ptp(x[-19:]) < 1e-9
        assert np.ptp(x) > 0.005
