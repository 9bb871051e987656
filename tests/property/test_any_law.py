"""Whatever is pushed, however and with whichever effect: what the twin's laws of motion leave unchanged."""

import dataclasses as dc

import numpy as np
import pytest
from drawn import costly, generators, numbers
from hypothesis import given
from hypothesis import strategies as st
from pushed import (
    AROUND,
    BY_NAME,
    END,
    HEIGHT,
    PLANAR,
    TIMES,
    TIP,
    bodies,
    effects,
    mirror_of,
    mirrored,
    point_of,
    rolled,
    rollouts,
    rotation,
    shapes,
    slides,
    turned,
    twin_of,
)
from twin import SIGMA

from physid_drake.cell import Start
from physid_drake.cell.diagram import GRAVITY
from physid_drake.effects.rollout import Geometry
from physid_drake.recording import Cylinder
from physid_drake.twin.with_effects import push_with

pushes = rollouts() | slides()
# Deviations. Rounding lets a touch come a step sooner or later: measured 1e-3 in 4000 pushes, 8e-6 in 2000 slides.
ROUNDING = 0.01
# A strong magnet may catch an object that swings about it a swing sooner or later: measured .036.
ROUGHLY = {"magnet": 0.3}
# The points of a pressure's grid under a disc are not their own image in a mirror: measured .06.
IN_A_MIRROR = {"uneven_support": 0.2, **ROUGHLY}


def apart(one, other):
    """The largest difference of poses in the tracker's deviations."""
    return float(np.abs((one - other) / SIGMA).max())


def of_each(*names):
    """A test of each effect, of some names or of all: hypothesis would draw some of them often and others never."""

    def marked(test):
        kinds = [BY_NAME[name] for name in names] if names else PLANAR
        return pytest.mark.parametrize("kind", kinds, ids=lambda kind: kind.name)(costly(test))

    return marked


def drawn_of(kind, rng):
    return kind.at(point_of(kind, rng), AROUND)


# ----------------------------------------------------------------------------------------------------- nothing there


@of_each()
@given(shape=shapes, body=bodies(), push=pushes, rng=generators(), other=effects())
def test_an_effect_at_its_null_leaves_any_rollout_as_it_is_to_the_last_bit(kind, shape, body, push, rng, other):
    """Whatever its other parameters, alone and beside another effect."""
    nulls = {name: null for name, null in kind.nulls().items() if null is not None}
    effect = dc.replace(drawn_of(kind, rng), **nulls)
    for beside in ([], [other]):
        one, plain = rolled(shape, body, push, [effect, *beside]), rolled(shape, body, push, beside)
        assert np.array_equal(one.poses, plain.poses) and np.array_equal(one.forces, plain.forces)


# An elastic tip bounces, however stiff it is. A bounce, a lag and a swing change the twin's steps, a pressure its
# points: these show how exact it is in fast, oblique pushes (measured 2.0, 2.0, .21 and .16 in 6000).
OWN_STEPS = {"restitution": 5.0, "actuator_lag": 5.0, "sloshing": 1.0, "uneven_support": 1.0}


@of_each(*(name for name in BY_NAME if name != "hand_compliance"))
@given(shape=shapes, body=bodies(), push=pushes)
def test_an_effect_that_vanishes_changes_any_rollout_by_nothing(kind, shape, body, push):
    family, chart = kind.families(AROUND)[0], kind.chart(AROUND)
    point = np.array(family.point)
    for k in family.free:
        point[k] += 1e-7 * chart[k].step
    effect = kind.at(point, AROUND)
    assert not effect.is_null
    limit = OWN_STEPS.get(kind.name, ROUNDING)
    assert apart(rolled(shape, body, push, [effect]).poses, rolled(shape, body, push).poses) < limit


# -------------------------------------------------------------------------------------------------------- symmetries


@of_each()
@given(shape=shapes, body=bodies(), push=pushes, rng=generators(), angle=numbers(-3.0, 3.0), x=numbers(-1.0, 1.0))
def test_turning_and_moving_the_whole_scene_turns_and_moves_the_result(kind, shape, body, push, rng, angle, x):
    effect = drawn_of(kind, rng)
    # These are about the world's origin, which is turned and stays.
    about_origin = effect.name in ("friction_gradient", "tracker_scale")
    shift = np.zeros(2) if about_origin else np.array([x, 0.3])
    there, along = turned(push, [effect], angle, shift)
    one, other = rolled(shape, body, push, [effect]), rolled(shape, body, there, along)
    places = one.poses[:, :2] @ rotation(angle).T + shift
    want = np.column_stack([places, one.poses[:, 2] + angle])
    assert apart(other.poses, want) < ROUGHLY.get(effect.name, ROUNDING)


@of_each()
@given(shape=shapes, body=bodies(), push=pushes, rng=generators())
def test_a_push_in_a_mirror_moves_its_object_as_in_the_mirror(kind, shape, body, push, rng):
    effect = drawn_of(kind, rng)
    there, along = mirrored(push, [effect])
    one, other = rolled(shape, body, push, [effect]), rolled(mirror_of(shape), body, there, along)
    assert apart(other.poses, one.poses * [1.0, -1.0, -1.0]) < IN_A_MIRROR.get(effect.name, ROUNDING)


@of_each()
@given(shape=shapes, body=bodies(), push=pushes, rng=generators(), late=numbers(-1e3, 1e3))
def test_the_same_push_at_another_time_is_the_same_motion(kind, shape, body, push, rng, late):
    effect = drawn_of(kind, rng)
    path = push.path
    later = dc.replace(
        push, begin=push.begin + late, end=push.end + late,
        path=None if path is None else dc.replace(path, times=path.times + late),
    )  # fmt: skip
    one, other = rolled(shape, body, push, [effect]), rolled(shape, body, later, [effect], TIMES + late)
    assert apart(one.poses, other.poses) < ROUGHLY.get(effect.name, ROUNDING)


NOT_IN_OBJECT = [kind.name for kind in PLANAR if kind.element != "object" and kind.name != "tracker_bias"]


@given(bodies(), pushes, effects(*NOT_IN_OBJECT), numbers(-3.0, 3.0), numbers(0.03, 0.06))
def test_a_disc_moves_the_same_whichever_way_its_frame_points(body, push, effect, angle, radius):
    """But for the points under it, which turn with the frame."""
    disc = Cylinder(radius=radius, length=HEIGHT, axis="z")
    x, y, yaw = push.start.pose
    other = dc.replace(push, start=dc.replace(push.start, pose=(x, y, yaw + angle)))
    one, same = (rolled(disc, body, p, [effect]).poses for p in (push, other))
    assert apart(one + np.array([0.0, 0.0, angle]), same) < 0.5


# ------------------------------------------------------------------------------------------------------- similarity


def larger(shape, times):
    """A shape with all lengths so many times as large."""
    return BY_NAME["size_error"](ratio=times).reshaped(shape)


@given(shapes, bodies(), pushes, numbers(0.3, 3.0))
def test_a_scene_that_is_larger_moves_alike_and_slower_by_the_root(shape, body, push, size):
    """Froude: dry friction knows gravity alone, so that lengths go with the square of times."""
    slower = size**0.5
    (x, y, yaw), (vx, vy, spin) = push.start.pose, push.start.velocity
    start = Start(pose=(size * x, size * y, yaw), velocity=(slower * vx, slower * vy, spin / slower))
    path = push.path
    if path is not None:
        path = dc.replace(
            path, times=slower * path.times, velocities=slower * path.velocities, start=size * path.start
        )
    height = None if push.hand_height is None else size * push.hand_height
    large = dc.replace(push, start=start, path=path, end=slower * END, hand_height=height)
    plain = Geometry(shape=larger(shape, size))
    twin = dc.replace(twin_of(plain), hand_radius=size * TIP)
    asked = push_with(twin, plain, body, large, (), slower * TIMES)
    (trace,) = twin.rollouts([asked])
    # The slip at which friction sets in and the accuracy of steps have sizes of their own: measured 1.7 and .012.
    limit = 0.05 if path is None else 5.0
    assert apart(trace.poses / [size, size, 1.0], rolled(shape, body, push).poses) < limit


# Of whose forces all are in proportion to the mass.
BY_WEIGHT = (
    "stribeck_friction", "anisotropic_table", "anisotropic_object", "friction_patch", "friction_gradient",
    "friction_drift", "uneven_support", "com_offset", "rotational_inertia", "size_error", "table_tilt", "sloshing",
)  # fmt: skip
# And which parameters, in proportion to it, make the others so.
BY_FORCE = {
    "viscous_drag": "coefficient",
    "quadratic_drag": "coefficient",
    "tether": "stiffness",
    "magnet": "strength",
}


@of_each(*BY_WEIGHT, *BY_FORCE)
@given(shape=shapes, body=bodies(), push=slides(), rng=generators(), ratio=numbers(0.1, 10.0))
def test_mass_cancels_in_a_free_slide_where_forces_are_in_proportion_to_it(kind, shape, body, push, rng, ratio):
    effect = drawn_of(kind, rng)
    name = BY_FORCE.get(effect.name)
    scaled = effect if name is None else dc.replace(effect, **{name: ratio * getattr(effect, name)})
    heavier = dc.replace(body, mass=ratio * body.mass)
    one, other = rolled(shape, body, push, [effect]), rolled(shape, heavier, push, [scaled])
    assert apart(one.poses, other.poses) < ROUGHLY.get(effect.name, ROUNDING)


@of_each(*BY_WEIGHT)
@given(shape=shapes, body=bodies(), push=pushes, rng=generators(), doublings=st.integers(-3, 3))
def test_twice_the_mass_takes_twice_the_force_and_moves_alike_to_the_last_bit(
    kind, shape, body, push, rng, doublings
):
    """A hand goes its way whatever it pushes; and what is doubled is not rounded."""
    effect = drawn_of(kind, rng)
    ratio = 2.0**doublings
    one = rolled(shape, body, push, [effect])
    other = rolled(shape, dc.replace(body, mass=ratio * body.mass), push, [effect])
    assert np.array_equal(one.poses, other.poses) and np.array_equal(ratio * one.forces, other.forces)


# ------------------------------------------------------------------------------------------------------------ energy

FINE = np.linspace(0.0, END, 7001)
DISSIPATING = tuple(name for name in (*BY_WEIGHT, *BY_FORCE) if name != "sloshing")  # whose own energy is not seen


def energies(shape, body, push, effect):
    """Energy of motion in each short span, with that of what pulls [J]."""
    poses = rolled(shape, body, push, [effect], FINE).poses
    shape = effect.reshaped(shape)
    com = np.array([effect.x, effect.y]) if effect.name == "com_offset" else np.zeros(2)
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x, y = poses[:, 0] + c * com[0] - s * com[1], poses[:, 1] + s * com[0] + c * com[1]
    vx, vy, spin = (np.diff(one) / np.diff(FINE) for one in (x, y, poses[:, 2]))
    ratio = effect.ratio if effect.name == "rotational_inertia" else 1.0
    inertia = ratio * twin_of(Geometry(shape=shape)).solid.gyration[2]
    motion = 0.5 * body.mass * (vx**2 + vy**2 + inertia * spin**2)
    return motion + potential(effect, body.mass, 0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1]))


def potential(effect, mass, x, y):
    """Of what pulls at an object at places (n,): closed forms [J]."""
    if effect.name == "table_tilt":
        return -mass * GRAVITY * (np.sin(effect.x) * x + np.sin(effect.y) * y)
    if effect.name not in ("tether", "magnet"):
        return 0.0
    far = np.hypot(x - effect.x, y - effect.y)
    if effect.name == "tether":
        return 0.5 * effect.stiffness * np.maximum(0.0, far - effect.rest_length) ** 2
    return effect.strength / effect.core * np.arctan(far / effect.core)


@of_each(*DISSIPATING)
@given(shape=shapes, body=bodies(least_friction=1e-3), push=slides(), rng=generators())
def test_energy_never_grows_once_no_hand_is_there(kind, shape, body, push, rng):
    """Of motion and of what pulls, together: a spring and a magnet give back no more than they took.

    Where hardly any friction is left, nothing else hides what a law gives.
    """
    effect = drawn_of(kind, rng)
    whole = energies(shape, body, push, effect)
    # Measured, of all that is lost, 4e-6; and 3e-3 where the core of a strong magnet is passed in a step or two.
    share = 2e-2 if effect.name == "magnet" else 1e-4
    assert np.diff(whole).max() < share * np.ptp(whole) + 1e-6 * body.mass
    assert whole[-1] < whole[0]


HOLDING = [name for name in DISSIPATING if name not in ("table_tilt", "tether", "magnet")]


@given(shapes, bodies(), slides(), effects(*HOLDING))
def test_what_rests_stays_where_it_is_to_the_last_bit(shape, body, push, effect):
    at_rest = dc.replace(push, start=Start(pose=push.start.pose))
    poses = rolled(shape, body, at_rest, [effect]).poses
    assert np.array_equal(poses, np.tile(poses[0], (len(poses), 1)))


# ------------------------------------------------------------------------------------------------------------ limits


def tilted(share, heading):
    return BY_NAME["table_tilt"](x=float(np.arcsin(share * np.cos(heading))),
                                 y=float(np.arcsin(share * np.sin(heading))))  # fmt: skip


def far_away(kind, force, heading, distance):
    """What pulls with a force [N] from far away."""
    x, y = distance * np.cos(heading), distance * np.sin(heading)
    if kind == "tether":
        return BY_NAME[kind](stiffness=force / distance, x=x, y=y)
    return BY_NAME[kind](strength=force * (distance**2 + 0.03**2), x=x, y=y)


def test_all_effects_that_are_another_one_in_a_limit_are_looked_at_here():
    limits = {kind.name: kind.limits for kind in PLANAR if kind.limits}
    assert limits == {"tether": ("table_tilt",), "magnet": ("table_tilt",)}


@pytest.mark.parametrize("kind", ["tether", "magnet"])
@given(shape=shapes, body=bodies(), push=pushes, heading=numbers(-3.0, 3.0), share=numbers(0.0, 0.2))
def test_what_pulls_from_far_away_is_a_tilt_the_more_so_the_further(kind, shape, body, push, heading, share):
    """It differs by as much as the object's way is of the distance: measured 480 deviations over the metres."""
    tilt = rolled(shape, body, push, [tilted(share, heading)]).poses
    for distance in (1e4, 1e6):
        pull = far_away(kind, share * body.mass * GRAVITY, heading, distance)
        assert apart(rolled(shape, body, push, [pull]).poses, tilt) < 2e3 / distance
