"""The Drake cell against closed forms and symmetries. Measured errors stand beside the tolerances."""

import math
from dataclasses import replace

import numpy as np
import pytest
from reference.planar import box, simulate_planar
from reference.scenes import OBJECTS, Theta, draw_push
from reference.steps import GRAVITY
from scipy.integrate import dblquad
from twin import MODELS, SIGMA, body_of, cell_of, config_of, rms, shape_of, twin

from physid_drake.cell import Cell, Start
from physid_drake.recording import Cylinder

NAMES = ("box", "can")
STEPS_HALVED = (("time_step_s", 5e-4), ("slide_time_step_s", 1e-3))

both_models = pytest.mark.parametrize("model", MODELS)
box_and_can = pytest.mark.parametrize("name", NAMES)


def slide(cell, body, velocity=(0.0, 0.0, 0.0), *, pose=(0.0, 0.0, 0.0), end=1.0):
    return cell.rollout(body, start=Start(pose=pose, velocity=velocity), path=None, begin=0.0, end=end)


def final(motion):
    return motion.planar_at(motion.times[-1:])[0]


def tilt(motion):
    """Lean (n,) of the object's axis from the vertical, rad."""
    return 2.0 * np.hypot(motion.poses[:, 1], motion.poses[:, 2])


def let_drake_run(cell, body, seconds, *, force=(0.0, 0.0)):
    """Plain Drake from rest, without the rollout's own stepping: start state and end state."""
    cell.set_body(body)
    root, plant = cell.simulator.get_mutable_context(), cell.scene.plant
    context = plant.GetMyMutableContextFromRoot(root)
    state = np.zeros(plant.num_multibody_states())
    state[:7] = cell.rest_pose(body)
    root.SetTime(0.0)
    plant.SetPositionsAndVelocities(context, state)
    push = np.zeros(plant.num_velocities())
    push[3:5] = force
    plant.get_applied_generalized_force_input_port().FixValue(context, push)
    cell.simulator.Initialize()
    cell.simulator.AdvanceTo(seconds)
    return state, np.array(plant.GetPositionsAndVelocities(context))


# ------------------------------------------------------------------------------------------------ free slides


@pytest.mark.parametrize("speed", [0.1, 0.3, 0.6, 1.0])
@pytest.mark.parametrize("name", ["box", "can", "eraser", "book", "triangle"])
@both_models
def test_stopping_distance_is_v_squared_over_two_mu_g(model, name, speed):
    motion = slide(cell_of(name, model), body_of(OBJECTS[name].mass, 0.3), (speed, 0.0, 0.0))
    x, y, yaw = final(motion)
    # Measured: at most 0.21 % (can at 0.1 m/s, point), 0.04 % for the others.
    assert x == pytest.approx(speed**2 / (2 * 0.3 * GRAVITY), rel=0.01)
    if name != "triangle":  # whose load transfer is not symmetrical: 2 um and 2.4 urad
        assert abs(y) < 1e-9
        assert abs(yaw) < 1e-9


@pytest.mark.parametrize("speed", [0.3, 0.6, 1.0])
@both_models
def test_stopping_distance_of_a_tall_bottle(model, speed):
    motion = slide(cell_of("bottle", model), body_of(0.5, 0.2), (speed, 0.0, 0.0), end=1.2)
    # Measured: -0.35 to -0.06 % (point), +0.58 to +0.94 % (hydroelastic).
    assert final(motion)[0] == pytest.approx(speed**2 / (2 * 0.2 * GRAVITY), rel=0.01)


@both_models
def test_stopping_distance_of_a_slow_tall_bottle_is_short_by_its_lean(model):
    # Measured: 0.052 mm (point) and 0.060 mm (hydroelastic) short of 2.548 mm, which is 2 %: the bottle leans by
    # 0.5 mrad, and B is 100 mm above the table. 0.2 sigma of a tracker, so it is stated in millimetres.
    motion = slide(cell_of("bottle", model), body_of(0.5, 0.2), (0.1, 0.0, 0.0))
    assert abs(final(motion)[0] - 0.01 / (2 * 0.2 * GRAVITY)) < 1e-4


@box_and_can
@both_models
def test_mass_cancels_in_a_free_slide(model, name):
    # The stiffness follows the weight, so even the resting depth is the same.
    cell, mass = cell_of(name, model), OBJECTS[name].mass
    ends = [final(slide(cell, body_of(share * mass), (0.5, 0.1, 4.0))) for share in (0.1, 1.0, 10.0)]
    np.testing.assert_allclose(ends[0], ends[1], atol=2e-6)  # measured 1.1e-6 m and rad (the can)
    np.testing.assert_allclose(ends[2], ends[1], atol=1e-6)  # measured 1e-8


def mean_radius(name):
    """Mean distance of the base's points from its middle [m], by adaptive quadrature."""
    body = OBJECTS[name]
    if body.polygon is None:
        return dblquad(lambda r, _: r * r, 0, 2 * math.pi, 0, body.radius)[0] / (math.pi * body.radius**2)
    x, y = np.ptp(body.polygon, axis=0) / 2
    return dblquad(lambda v, u: math.hypot(u, v), -x, x, -y, y)[0] / (4 * x * y)


@pytest.mark.parametrize("name", ["box", "can", "eraser", "book"])
@both_models
def test_a_spinning_object_turns_as_far_as_torsional_friction_lets_it(model, name):
    body, spin, mu = OBJECTS[name], 10.0, 0.3
    motion = slide(cell_of(name, model), body_of(body.mass, mu), (0.0, 0.0, spin))
    expected = body.inertia / body.mass * spin**2 / (2 * mu * GRAVITY * mean_radius(name))
    # Measured: box -0.17 %, can 0.00 %, eraser -0.07 %, book -0.18 %; both models alike (the quadrature's error).
    assert final(motion)[2] == pytest.approx(expected, rel=0.004)
    assert np.abs(final(motion)[:2]).max() < 1e-9


@pytest.mark.slow
@both_models
def test_a_spinning_triangle_turns_as_the_reference_does(model, request):
    body = OBJECTS["triangle"]
    want = simulate_planar(body, 0.3, np.array([0.0, 1.0]), velocity=(0, 0, 10.0)).poses[-1]
    motion = slide(cell_of("triangle", model), body_of(body.mass, 0.3), (0.0, 0.0, 10.0))
    assert final(motion)[2] == pytest.approx(want[2], rel=0.02)


# ------------------------------------------------------------------------------------------- friction cells


def half_slippery(model, body, cells, mu=(0.5, 0.1), speed=0.5):
    """End poses of the cell and of the reference: rough for y < 0 and slippery for y > 0, moving along x."""
    points, weights = body.support(4000)
    friction = np.where(points[:, 1] > 0, mu[1], mu[0])
    want = simulate_planar(
        body, friction, np.array([0.0, 1.0]), velocity=(speed, 0, 0), support=(points, weights), time_step=1e-4
    ).poses[-1]
    cell = Cell(shape_of(body), hand_radius=None, config=config_of(model, cells=cells))
    rows = np.where(np.arange(cells[1]) >= cells[1] / 2, mu[1], mu[0])
    motion = slide(cell, body_of(body.mass, np.tile(rows, cells[0])), (speed, 0.0, 0.0))
    return final(motion), want


@pytest.mark.slow
@pytest.mark.parametrize("cells", [(1, 2), (2, 2), (4, 4)])
@both_models
def test_a_half_slippery_box_turns_to_its_rough_side(model, cells):
    got, want = half_slippery(model, box("half", (0.05, 0.12, 0.03), 0.05), cells)
    assert want[2] < math.radians(-25)  # the rough side is at y < 0: clockwise
    # Measured: 0.10 and 0.07 deg (1 x 2), 0.03 and 0.06 (2 x 2), 0.30 and 0.27 (4 x 4); at most 0.15 mm.
    assert abs(got[2] - want[2]) < math.radians(2)
    assert np.abs(got[:2] - want[:2]).max() < 3e-4


@pytest.mark.parametrize("cells", [(1, 2), (2, 2), (4, 4)])
@both_models
def test_a_half_slippery_disc_turns_to_its_rough_side(model, cells, request):
    got, want = half_slippery(model, OBJECTS["can"], cells)
    assert want[2] < math.radians(-25)
    assert abs(got[2] - want[2]) < math.radians(2)


@box_and_can
@both_models
def test_equal_friction_in_every_cell_is_plain_friction(model, name):
    body = OBJECTS[name]
    cell = Cell(shape_of(body), hand_radius=None, config=config_of(model, cells=(2, 2)))
    many = final(slide(cell, body_of(body.mass, np.full(4, 0.3)), (0.4, 0.2, 2.0)))
    one = final(slide(cell_of(name, model), body_of(body.mass, 0.3), (0.4, 0.2, 2.0)))
    # A box has the same points either way: measured 0.007 sigma. A disc cut by cells has other points than
    # whole: 0.58 sigma of yaw, 0.7 % of the turn.
    np.testing.assert_allclose(many / SIGMA, one / SIGMA, atol=0.02 if name == "box" else 0.8)


# --------------------------------------------------------------------------------------------- static friction


@box_and_can
@both_models
def test_static_friction_above_kinetic_holds(model, name):
    mass, mu, ratio, seconds = OBJECTS[name].mass, 0.2, 2.0, 0.6
    cell = Cell(shape_of(OBJECTS[name]), hand_radius=None, config=config_of(model))
    body = body_of(mass, mu, static_ratio=ratio)
    for share in (0.25, 0.35):  # of the weight: between kinetic 0.2 and static 0.4
        start, end = let_drake_run(cell, body, seconds, force=(share * mass * GRAVITY, 0.0))
        # Measured creep 0.049 to 0.056 mm at 0.25 and 0.110 to 0.127 mm at 0.35; sliding would be 88 and 265 mm.
        assert abs(end[4] - start[4]) < 2e-4
    start, end = let_drake_run(cell, body, seconds, force=(0.45 * mass * GRAVITY, 0.0))
    ideal = 0.5 * (0.45 - mu) * GRAVITY * seconds**2
    # Beyond static friction it slides on the kinetic one. Measured 0.5 to 4.1 % short: the plain Drake step here
    # has neither the rollout's correction of tilt nor of the trapezoid, and the object accelerates to 1.5 m/s.
    assert end[4] - start[4] == pytest.approx(ideal, rel=0.06)


@box_and_can
@both_models
def test_without_static_friction_the_same_force_moves_it(model, name):
    mass = OBJECTS[name].mass
    cell = Cell(shape_of(OBJECTS[name]), hand_radius=None, config=config_of(model))
    start, end = let_drake_run(cell, body_of(mass, 0.2), 0.3, force=(0.35 * mass * GRAVITY, 0.0))
    assert end[4] - start[4] > 0.05


# ------------------------------------------------------------------------------------------------------- rest


@pytest.mark.parametrize("name", list(OBJECTS))
@both_models
def test_without_a_push_nothing_moves_at_all(model, name):
    motion = slide(cell_of(name, model), body_of(OBJECTS[name].mass), pose=(0.1, -0.2, 0.7), end=2.0)
    assert np.array_equal(motion.poses, np.broadcast_to(motion.poses[0], motion.poses.shape))
    np.testing.assert_allclose(final(motion), [0.1, -0.2, 0.7], atol=1e-15)


@pytest.mark.parametrize(
    ("name", "com"),
    [("box", (0.02, -0.01)), ("can", (0.01, 0.005)), ("triangle", (0.01, 0.01)), ("bottle", (0.015, 0.0))],
)
@both_models
def test_an_object_with_an_offset_centre_of_mass_rests_without_creeping(model, name, com):
    cell, body = cell_of(name, model), body_of(OBJECTS[name].mass, com=com)
    start, end = let_drake_run(cell, body, 1.0)
    # It sinks in deeper on the heavy side: by 0.20 mrad at most (bottle).
    assert 2 * math.hypot(start[1], start[2]) < 3e-4
    # Measured: at most 0.11 um, 0.43 urad and 7e-8 m/s after a second of plain Drake.
    assert np.abs(end[4:7] - start[4:7]).max() < 5e-7
    assert np.abs(end[1:4] - start[1:4]).max() < 1e-6
    assert np.abs(end[7:]).max() < 1e-6


# ----------------------------------------------------------------------------------------- pushes and symmetry


def oblique(name, seed=3, *, offset=0.4, heading=0.2, speed=0.3):
    return draw_push(
        np.random.default_rng(seed), OBJECTS[name], pose=(0.0, 0.0, 0.0), speed=speed, offset=offset,
        heading=heading, push_time=0.3,
    )  # fmt: skip


THETA = Theta(support_friction=0.25, hand_friction=0.3)


def pushed(name, push, model, solver=(), theta=THETA):
    motion = twin(OBJECTS[name], theta, push, push.path.times[-1] + 0.6, model, solver)
    return motion.times, motion.planar_at(motion.times)


def seen_through(push, matrix, yaw=0.0):
    """The same push with every point mapped by ``matrix``."""
    path = replace(push.path, p0=matrix @ push.path.p0, velocities=push.path.velocities @ matrix.T)
    return replace(push, path=path, pose=(0.0, 0.0, yaw))


@box_and_can
@both_models
def test_turning_the_scene_turns_the_result(model, name):
    angle = 0.7
    R = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    push = oblique(name)
    _, poses = pushed(name, push, model)
    _, turned = pushed(name, seen_through(push, R, angle), model)
    assert abs(poses[-1, 2]) > 0.5  # something happened
    np.testing.assert_allclose(turned[:, :2] @ R, poses[:, :2], atol=1e-6)  # measured 3.1e-7 m
    np.testing.assert_allclose(turned[:, 2] - angle, poses[:, 2], atol=3e-5)  # measured 1.0e-5 rad


@box_and_can
@both_models
def test_a_mirrored_push_gives_a_mirrored_motion(model, name):
    push = oblique(name)
    _, poses = pushed(name, push, model)
    _, mirrored = pushed(name, seen_through(push, np.diag([1.0, -1.0])), model)
    np.testing.assert_allclose(mirrored * [1, -1, -1], poses, atol=1e-10)  # measured 7e-14


@box_and_can
@both_models
def test_a_push_through_the_centre_of_friction_does_not_rotate(model, name):
    push = oblique(name, offset=0.0, heading=0.0)
    _, poses = pushed(name, push, model)
    assert np.hypot(*poses[-1, :2]) > 0.1
    # A can is unstable against its tip, so rounding grows. Measured: box 2e-14, can 7e-6 (point) and 2.7e-4 rad.
    assert np.abs(poses[:, 2]).max() < (1e-9 if name == "box" else 1e-3)


@pytest.mark.parametrize("name", ["box", "can", "eraser", "book"])
@both_models
def test_energy_never_grows_after_the_push(model, name):
    push = oblique(name, speed=0.6)
    motion = twin(OBJECTS[name], THETA, push, push.path.times[-1] + 0.6, model)
    poses = motion.planar_at(motion.times)
    velocities = np.diff(poses, axis=0) / np.diff(motion.times)[:, None]
    inertia = OBJECTS[name].inertia / OBJECTS[name].mass
    energy = 0.5 * (velocities[:, 0] ** 2 + velocities[:, 1] ** 2 + inertia * velocities[:, 2] ** 2)
    released = np.flatnonzero(np.abs(motion.forces).max(axis=1) > 0.0)[-1] + 1
    after = energy[released:]
    assert after[0] > 1e-3  # J/kg: it still slides
    assert after[-1] == 0.0
    # Measured: at most 1.6e-6 of it, in the last step of the can, which then rights itself from its lean.
    assert np.diff(after).max() < 1e-5 * after[0]


@box_and_can
@both_models
def test_halving_the_time_step_changes_the_end_by_less_than_a_fifth_of_the_noise(model, name):
    push = oblique(name)
    _, coarse = pushed(name, push, model)
    _, fine = pushed(name, push, model, STEPS_HALVED)
    # Measured: box 0.17 and 0.15 sigma (yaw), can 0.10 and 0.13 sigma (x).
    assert np.abs((coarse[-1] - fine[-1]) / SIGMA).max() < 0.2


def test_hydroelastic_and_point_contact_agree():
    differences = []
    for name in ("eraser", "box", "book", "can"):
        for seed, offset, speed in ((3, 0.4, 0.3), (4, -0.3, 0.1), (5, 0.1, 0.5)):
            push = oblique(name, seed, offset=offset, speed=speed)
            times, point = pushed(name, push, "point")
            motion = twin(OBJECTS[name], THETA, push, push.path.times[-1] + 0.6, "hydroelastic")
            differences.append((motion.planar_at(times) - point) / SIGMA)
    # Measured: 0.002 to 0.06 sigma, the can at 0.5 m/s 0.30; all together 0.079.
    assert rms(np.concatenate(differences)) < 0.2
    assert max(rms(d) for d in differences) < 0.5


# ---------------------------------------------------------------------------------------------------- bottles


@both_models
def test_a_standing_bottle_does_not_lean(model):
    push = oblique("bottle", offset=0.0, heading=0.0)
    motion = twin(OBJECTS["bottle"], Theta(support_friction=0.2), push, push.path.times[-1] + 0.6, model)
    # Measured, pushed at 30 mm of its 200: 1.01 and 1.11 mrad; sliding freely at 0.5 m/s: 1.01 and 1.35 mrad;
    # at rest again 0.12 and 0.05 mrad. A tracker's noise is 3 mrad.
    assert tilt(motion).max() < 2e-3
    assert tilt(motion)[-1] < 3e-4
    free = slide(cell_of("bottle", model), body_of(0.5, 0.2), (0.5, 0.0, 0.0))
    assert tilt(free).max() < 2e-3
    assert tilt(free)[-1] < 3e-4


@pytest.mark.parametrize(("radius", "length"), [(0.033, 0.2), (0.03, 0.1)])
@pytest.mark.parametrize("yaw", [0.0, 0.6])
@both_models
def test_a_lying_bottle_rolls_as_far_as_it_should(model, radius, length, yaw):
    cell = Cell(Cylinder(radius=radius, length=length, axis="y"), hand_radius=None, config=config_of(model))
    along = np.array([math.cos(yaw), math.sin(yaw)])
    motion = slide(cell, body_of(0.5, 0.3), (*(0.3 * along), 0.0), pose=(0.0, 0.0, yaw))
    x, y, turned = final(motion)
    assert (x, y) == pytest.approx(0.3 * along, rel=0.01)  # measured 0.003 % short
    assert turned == pytest.approx(yaw, abs=1e-9)


@both_models
def test_a_lying_bottle_slides_along_its_axis(model):
    cell = Cell(Cylinder(radius=0.033, length=0.2, axis="y"), hand_radius=None, config=config_of(model))
    assert final(slide(cell, body_of(0.5, 0.3), (0.0, 0.3, 0.0)))[1] == pytest.approx(0.09 / 0.6 / GRAVITY, rel=0.01)
