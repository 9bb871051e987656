"""What holds for every effect of the catalogue: nothing at its null value, a chart that fits can walk, its names."""

import dataclasses as dc
import math
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from twin import SIGMA, body_of, config_of

from physid_drake.cell import Cell, HandPath, Outcome, Start
from physid_drake.effects import SHIPPED, Surroundings, applicable, effect_named, known_effects
from physid_drake.effects.rollout import Geometry, Rollout, roll, tracked
from physid_drake.errors import ConfigError
from physid_drake.recording import Box, Cylinder

MASS, MU, END = 0.35, 0.3, 0.55
TIMES = np.linspace(0.0, END, 56)

# Of the catalogue: name, element, and of each parameter its unit and its null value (None: it shapes the effect).
EXPECTED = {
    "stribeck_friction": ("table", {"excess": ("-", 0.0), "speed": ("m/s", None)}),
    "viscous_drag": ("table", {"coefficient": ("N s/m", 0.0)}),
    "quadratic_drag": ("world", {"coefficient": ("N s2/m2", 0.0)}),
    "anisotropic_table": ("table", {"ratio": ("-", 1.0), "angle": ("rad", None)}),
    "anisotropic_object": ("object", {"ratio": ("-", 1.0), "angle": ("rad", None)}),
    "friction_patch": ("table", {"ratio": ("-", 1.0), "x": ("m", None), "y": ("m", None), "radius": ("m", None)}),
    "friction_gradient": ("table", {"slope_x": ("1/m", 0.0), "slope_y": ("1/m", 0.0)}),
    "friction_drift": ("table", {"per_push": ("-", 0.0)}),
    "table_tilt": ("table", {"x": ("rad", 0.0), "y": ("rad", 0.0)}),
    "uneven_support": ("object", {"weights": ("-", ((1.0,),))}),
    "com_offset": ("object", {"x": ("m", 0.0), "y": ("m", 0.0)}),
    "rotational_inertia": ("object", {"ratio": ("-", 1.0)}),
    "sloshing": ("object", {"fraction": ("-", 0.0), "frequency": ("Hz", None), "damping": ("-", None)}),
    "rolling_resistance": ("object", {"coefficient": ("m", 0.0)}),
    "tether": (
        "world", {"stiffness": ("N/m", 0.0), "x": ("m", None), "y": ("m", None), "rest_length": ("m", None)}
    ),
    "magnet": ("world", {"strength": ("N m2", 0.0), "x": ("m", None), "y": ("m", None), "core": ("m", None)}),
    "restitution": ("hand", {"coefficient": ("-", 0.0)}),
    "hand_compliance": ("hand", {"compliance": ("m/N", 0.0), "damping": ("-", None)}),
    "actuator_lag": ("hand", {"time_constant": ("s", 0.0)}),
    "hand_offset": ("hand", {"x": ("m", 0.0), "y": ("m", 0.0)}),
    "tracker_latency": ("sensor", {"delay": ("s", 0.0)}),
    "tracker_bias": ("sensor", {"x": ("m", 0.0), "y": ("m", 0.0), "yaw": ("rad", 0.0)}),
    "tracker_scale": ("sensor", {"ratio": ("-", 1.0)}),
    "size_error": ("object", {"ratio": ("-", 1.0)}),
}  # fmt: skip

# What a parameter can be: lower and upper end.
MEANING = {
    "excess": (0, 10), "speed": (1e-4, 10), "ratio": (0.05, 20), "radius": (1e-3, 10), "core": (1e-4, 1),
    "fraction": (0, 0.95), "frequency": (0.1, 100), "damping": (0, 10), "stiffness": (0, 1e9),
    "rest_length": (0, 10), "strength": (0, 1e9), "compliance": (0, 1), "time_constant": (0, 1), "delay": (0, 1),
    "coefficient": (0, 1e9), "per_push": (-1, 10),
}  # fmt: skip

# A soft tip rings with the root of its compliance, and its re-contacts come and go: its signature is there, but
# straight only over shorter ways.
CURVED = ("hand_compliance",)

CATALOGUE = known_effects()  # with the effects of whatever packages are installed
every_name = pytest.mark.parametrize("kind", CATALOGUE, ids=lambda kind: kind.name)
every_effect = pytest.mark.parametrize("kind", CATALOGUE, ids=lambda kind: kind.name)

# Of the patch, each place is a direction of its own.
every_effect_by_direction = pytest.mark.parametrize(
    "kind",
    [pytest.param(kind, marks=[pytest.mark.slow] * (kind.name == "friction_patch")) for kind in CATALOGUE],
    ids=lambda kind: kind.name,
)


def push(start, heading, speed, pose, order):
    """A push that lets the object go."""
    along = np.array([math.cos(heading), math.sin(heading)])
    path = HandPath(
        times=np.array([0.0, 0.05, 0.25, 0.29]),
        velocities=np.outer([0, speed, speed, 0], along),
        start=np.array(start),
    )
    return Rollout(start=Start(pose=pose), path=path, begin=0.0, end=END, hand_height=0.03, order=order)


SHAPES = {
    False: Geometry(shape=Box(size=(0.10, 0.08, 0.06))),
    True: Geometry(shape=Cylinder(radius=0.033, length=0.1, axis="y")),
}
PUSHES = {
    False: (push((-0.07, 0.01), 0.1, 0.3, (0, 0, 0.1), 1), push((0.06, -0.115), 1.5, 0.4, (0.05, -0.05, -0.3), 2)),
    True: (push((-0.06, 0.01), 0.0, 0.2, (0, 0, 0), 1), push((-0.06, -0.02), 0.3, 0.15, (0, 0, 0.3), 2)),
}


@cache
def built(geometry, hand=True, time_step=2e-3):
    config = config_of("point")
    config.solver.slide_time_step_s = time_step
    return Cell(
        geometry.shape, hand_radius=0.01 if hand else None, config=config, pressure=geometry.pressure,
        gravity=geometry.gravity,
    )  # fmt: skip


def motions(*effects, rolls=False):
    found = [roll(built, SHAPES[rolls], body_of(MASS, MU), p, effects) for p in PUSHES[rolls]]
    assert all(motion.outcome is Outcome.COMPLETED for motion in found)
    return found


def seen(*effects, rolls=False):
    """What the tracker reports (2, n, 3) of the two pushes."""
    return np.array([tracked(motion, TIMES, effects) for motion in motions(*effects, rolls=rolls)])


@cache
def plain(rolls):
    return seen(rolls=rolls)


@cache
def around(rolls):
    places = plain(rolls).reshape(-1, 3)[:, :2]
    return Surroundings(
        mass=MASS, friction=MU, size=np.array([0.066, 0.1] if rolls else [0.1, 0.08]),
        height=0.066 if rolls else 0.06, region=np.array([places.min(axis=0), places.max(axis=0)]), top_speed=0.4,
        pushes=3, has_hand=True, rolls=rolls,
    )  # fmt: skip


def rolls_for(kind):
    """Whether the effect is one of rolling objects."""
    return not kind.applies(around(False))


def directions(kind):
    """Families with each of their free coordinates."""
    scene = around(rolls_for(kind))
    return [(family, k, kind.chart(scene)[k]) for family in kind.families(scene) for k in family.free]


# ------------------------------------------------------------------------------------------------------ the null rule


@every_effect
def test_at_its_null_value_a_rollout_is_bit_for_bit_the_plain_one(kind):
    rolls = rolls_for(kind)
    scene = around(rolls)
    nulls = [kind(), *(kind.at(np.array(family.point), scene) for family in kind.families(scene)[:2])]
    want = motions(rolls=rolls)
    for effect in nulls:
        for got, motion in zip(motions(effect, rolls=rolls), want, strict=True):
            assert np.array_equal(got.times, motion.times)
            assert np.array_equal(got.poses, motion.poses)
            assert np.array_equal(got.forces, motion.forces)
            assert np.array_equal(tracked(got, TIMES, (effect,)), motion.planar_at(TIMES))


@every_effect
def test_every_family_starts_at_a_null_value(kind):
    scene = around(rolls_for(kind))
    assert kind().is_null
    assert all(kind.at(np.array(family.point), scene).is_null for family in kind.families(scene))


@every_effect
def test_a_vanishing_effect_changes_vanishingly_little(kind):
    rolls = rolls_for(kind)
    worst = 0.0
    for family, k, coordinate in directions(kind)[:3]:
        point = np.array(family.point)
        point[k] += 1e-7 * coordinate.step
        worst = max(
            worst,
            float(np.sqrt((((seen(kind.at(point, around(rolls)), rolls=rolls) - plain(rolls)) / SIGMA) ** 2).mean())),
        )
    # Measured: 0.03 sigma where rounding moves the start of a contact by a time step, more for a stiff tip's own
    # contact.
    assert worst < (0.3 if kind.name == "hand_compliance" else 0.05)


# ------------------------------------------------------------------------------------------------- names and charts


def test_the_catalogue_is_complete_and_in_order():
    assert [kind.name for kind in SHIPPED] == list(EXPECTED)


LEFT_OPEN = {
    "sloshing": {"turning": ("-", None)},
    "hand_compliance": {"share": ("-", None)},
}  # by the catalogue, which fixes the other parameters


@pytest.mark.parametrize("kind", SHIPPED, ids=lambda kind: kind.name)
def test_names_elements_parameters_and_units_are_the_catalogues(kind):
    element, parameters = EXPECTED[kind.name]
    parameters = parameters | LEFT_OPEN.get(kind.name, {})
    assert kind.beyond == tuple(LEFT_OPEN.get(kind.name, {}))
    assert kind.element == element
    assert {name: unit.replace("*", " ").replace("^", "") for name, unit in kind.units().items()} == {
        name: unit for name, (unit, _) in parameters.items()
    }
    assert kind.nulls() == {name: null for name, (_, null) in parameters.items()}


@every_name
def test_an_effect_says_what_it_is_and_where_it_is_constant(kind):
    assert len(kind.statement.split()) > 3
    assert kind.frame in {
        "world",
        "object",
        "hand",
        "contact",
        "time",
        "push_order",
        "object_velocity",
        "object_acceleration",
    }
    assert effect_named(kind.name) is kind
    assert kind.__doc__


SUMMED = [kind for kind in CATALOGUE if any(f.shares for f in kind.families(around(rolls_for(kind))))]


@pytest.mark.parametrize("kind", SUMMED, ids=lambda kind: kind.name)
def test_a_family_that_is_a_sum_of_others_moves_an_object_about_as_they_do_together(kind):
    rolls = rolls_for(kind)
    scene = around(rolls)
    families = kind.families(scene)

    def change(family):
        point = np.array(family.point)
        point[family.free[0]] += kind.chart(scene)[family.free[0]].step
        return seen(kind.at(point, scene), rolls=rolls) - plain(rolls)

    simulated = [change(f) for f in families if not f.shares]
    wide = [f for f in families if f.shares]
    assert all(len(f.shares) == len(simulated) for f in wide)
    # In the middle of the grid: at its edge, what lies outside is in no other family.
    family = wide[len(simulated) // 2]
    alone = change(family) / SIGMA
    summed = sum(share * one for share, one in zip(family.shares, simulated, strict=True)) / SIGMA
    sizes = np.linalg.norm(alone), np.linalg.norm(summed)
    assert (alone * summed).sum() > 0.95 * sizes[0] * sizes[1]
    assert sizes[1] == pytest.approx(sizes[0], rel=0.35)


@pytest.mark.parametrize("top_speed", [0.02, 0.4, 2.0])
@every_effect
def test_a_chart_holds_the_points_of_its_families_and_has_positive_steps(kind, top_speed):
    scene = dc.replace(around(rolls_for(kind)), top_speed=top_speed)
    chart, families = kind.chart(scene), kind.families(scene)
    assert all(c.step > 0.0 and c.lower < c.upper and c.std > 0.0 for c in chart)
    assert len({c.name for c in chart}) == len(chart)
    assert families
    for family in families:
        assert family.free
        for value, c in zip(family.point, chart, strict=True):
            assert c.lower <= value <= c.upper
        for k in family.free:
            c = chart[k]
            assert family.point[k] + 2 * c.step < c.upper
            assert not family.central or family.point[k] - c.step > c.lower


@every_effect
def test_parameters_of_any_chart_point_mean_something(kind):
    scene = around(rolls_for(kind))
    chart, rng = kind.chart(scene), np.random.default_rng(0)
    low = np.array([max(c.lower, -100 * c.step) for c in chart])
    high = np.array([min(c.upper, 100 * c.step) for c in chart])
    for u in [np.zeros(len(chart)), np.ones(len(chart)), *rng.random((50, len(chart)))]:
        effect = kind.at(low + u * (high - low), scene)
        assert effect == kind(**dc.asdict(effect))
        for name, value in dc.asdict(effect).items():
            if name == "weights":
                assert np.array(value).min() > 0.0
                assert np.mean(value) == pytest.approx(1.0)
                continue
            lowest, highest = MEANING.get(name, (-math.inf, math.inf))
            assert math.isfinite(value)
            assert isinstance(value, float)
            assert lowest <= value <= highest, name
            assert kind.ranges()[name].holds(value), name


@every_effect_by_direction
def test_each_direction_leaves_a_signature_that_grows_with_the_step(kind):
    rolls = rolls_for(kind)
    scene, reference = around(rolls), plain(rolls)
    for family, k, coordinate in directions(kind):

        def shifted(steps, family=family, k=k, coordinate=coordinate):
            point = np.array(family.point)
            point[k] += steps * coordinate.step
            return seen(kind.at(point, scene), rolls=rolls)

        def signature(steps, family=family, shifted=shifted):
            return 0.5 * (shifted(steps) - shifted(-steps)) if family.central else shifted(steps) - reference

        once, twice = signature(1.0), signature(2.0)
        for one in once:
            assert np.abs(one).max() > 1e-6, (family.point, coordinate.name)
        curve = np.linalg.norm((twice - 2.0 * once) / SIGMA) / np.linalg.norm(2.0 * once / SIGMA)
        # Measured: at most 0.16 (rolling resistance).
        assert kind.name in CURVED or curve < 0.35, (family.point, coordinate.name, curve)


def test_effects_apply_where_they_can():
    flat, round_ = applicable(around(False)), applicable(around(True))
    assert {kind.name for kind in SHIPPED} - {kind.name for kind in flat} == {"rolling_resistance"}
    no_roll = {"com_offset", "uneven_support", "hand_compliance"}
    assert {kind.name for kind in SHIPPED} - {kind.name for kind in round_} == no_roll
    free = dc.replace(around(False), has_hand=False)
    gone = {kind.name for kind in flat} - {kind.name for kind in applicable(free)}
    assert gone == {"restitution", "hand_compliance", "actuator_lag", "hand_offset", "tracker_latency"}
    assert [kind.name for kind in applicable(free, ["table_tilt"])] == ["table_tilt"]
    assert [kind.name for kind in applicable(free, ["table_tilt", "magnet", "table_tilt"])] == [
        "table_tilt",
        "magnet",
    ]
    with pytest.raises(ConfigError, match="'ghost' is unknown"):
        effect_named("ghost")


# ------------------------------------------------------------------------------------------------------- dissipation

BRAKES = [
    effect_named(name)(**parameters)
    for name, many in {
        "viscous_drag": [{"coefficient": 0.2}, {"coefficient": 2e3}],
        "quadratic_drag": [{"coefficient": 0.5}, {"coefficient": 1e4}],
        "stribeck_friction": [{"excess": 0.3, "speed": 0.1}, {"excess": 3.0, "speed": 0.01}],
        "anisotropic_table": [{"ratio": 1.3, "angle": 0.5}, {"ratio": 7.0, "angle": 0.5}],
        "anisotropic_object": [{"ratio": 1.3, "angle": 0.5}, {"ratio": 7.0, "angle": 0.5}],
        "friction_patch": [{"ratio": 1.5, "x": 0.05}, {"ratio": 3.0, "x": 0.05}, {"ratio": 0.14, "x": 0.05}],
        "friction_gradient": [{"slope_x": 0.5, "slope_y": 0.5}, {"slope_x": -6.0, "slope_y": 6.0}],
        "friction_drift": [{"per_push": 0.1}, {"per_push": 3.0}],
        "rolling_resistance": [{"coefficient": 3e-4}, {"coefficient": 1.3e-2}],
    }.items()
    for parameters in many
]


@pytest.mark.parametrize("time_step", [2e-3, 2e-2], ids=["2ms", "20ms"])
@pytest.mark.parametrize("effect", BRAKES, ids=lambda e: f"{e.name}-{max(v for v in dc.astuple(e))}")
def test_what_brakes_never_drives_a_free_slide(effect, time_step):
    rolls = effect.name == "rolling_resistance"
    cell, inertia = built(SHAPES[rolls], False, time_step), MASS * (0.1**2 + 0.08**2) / 12
    velocity = (0.3, 0.0, 0.0) if rolls else (0.4, 0.2, 4.0)
    start = Start(pose=(0.0, 0.0, 0.0), velocity=velocity)
    go = Rollout(start=start, path=None, begin=0.0, end=0.6, hand_height=None, order=1)
    motion = roll(lambda _: cell, SHAPES[rolls], body_of(MASS, MU), go, (effect,))
    v = np.diff(motion.planar_at(motion.times), axis=0) / np.diff(motion.times)[:, None]
    share = 1.5 if rolls else 1.0  # a rolling cylinder turns too
    energy = 0.5 * (share * MASS * (v[:, 0] ** 2 + v[:, 1] ** 2) + inertia * v[:, 2] ** 2)
    for before, after in pairwise(energy):
        # Measured: at most 4e-9 J as the object stops, 2e-9 J without any effect: it rights itself from its lean.
        assert after <= before * (1.0 + 1e-6) + 1e-8
    assert energy[-1] < energy[0]


# -------------------------------------------------------------------------------------------------------------- mass


# Chart coordinates that change with this power of the object's mass: 1 for what is in proportion to a force.
MASS_POWERS = {
    "viscous_drag": {"coefficient": 1}, "quadratic_drag": {"coefficient": 1}, "magnet": {"strength": 1},
    "tether": {"stiffness": 1, "force_x": 1, "force_y": 1}, "hand_compliance": {"compliance": -1},
}  # fmt: skip


@pytest.mark.parametrize("kind", SHIPPED, ids=lambda kind: kind.name)
def test_motion_stays_the_same_where_mass_and_forces_change_together(kind):
    """Friction and inertia are in proportion to the mass, and the hand goes its way whatever it pushes."""
    rolls, ratio = rolls_for(kind), 2.0
    scene, family = around(rolls), kind.families(around(rolls))[0]
    chart, point = kind.chart(scene), np.array(family.point)
    for k in family.free:
        point[k] += 3.0 * family.size * chart[k].step
    of_kind = MASS_POWERS.get(kind.name, {})
    powers = np.array([of_kind.get(coordinate.name, 0) for coordinate in chart])
    assert set(of_kind) <= {coordinate.name for coordinate in chart if not coordinate.log}

    def seen_at(mass, effect):
        motions = [roll(built, SHAPES[rolls], body_of(mass, MU), p, (effect,)) for p in PUSHES[rolls]]
        return np.array([tracked(motion, TIMES, (effect,)) for motion in motions])

    light = seen_at(MASS, kind.at(point, scene))
    heavy = seen_at(ratio * MASS, kind.at(point * ratio**powers, scene))
    # Measured: 4e-3 sigma at most (a magnet); 1.8 sigma and more where such a coordinate does not change.
    assert np.abs((heavy - light) / SIGMA).max() < 0.02
    if powers.any():
        assert np.abs((seen_at(ratio * MASS, kind.at(point, scene)) - light) / SIGMA).max() > 1.0


# ------------------------------------------------------------------------------------------------------- composition


def test_two_effects_in_either_order_give_the_same_bits():
    tilt, late = effect_named("table_tilt")(x=0.02), effect_named("tracker_latency")(delay=0.03)
    one, other = seen(tilt, late), seen(late, tilt)
    assert np.array_equal(one, other)
    alone = np.array([motion.planar_at(TIMES - 0.03) for motion in motions(tilt)])
    assert np.array_equal(one, alone)
    assert not np.array_equal(one, seen(tilt))


def test_friction_laws_together_do_not_depend_on_their_order():
    laws = (
        effect_named("friction_patch")(ratio=2.0, x=0.03, radius=0.05),
        effect_named("stribeck_friction")(excess=0.5),
        effect_named("anisotropic_table")(ratio=1.5, angle=0.4),
    )
    # The same but for rounding, which moves the start of a contact by a time step.
    assert np.abs((seen(*laws) - seen(*laws[::-1])) / SIGMA).max() < 0.1


def test_a_null_effect_among_others_changes_nothing():
    tilt = effect_named("table_tilt")(x=0.02)
    assert np.array_equal(seen(tilt, *(kind() for kind in CATALOGUE)), seen(tilt))
