"""Theta: from the configuration to a parameter space, and from a point in it to a body."""

import numpy as np
import pytest

from physid_drake.cell.solid import solid_of
from physid_drake.errors import ConfigError, ParameterError
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.theta import cell_error, friction_names, theta_map
from physid_drake.recording import Box, Cylinder, ObjectModel, Prism

SHAPE = Box(size=(0.12, 0.05, 0.03))
WEIGHED = ObjectModel(shape=SHAPE, mass=0.054, mass_std=0.001)
SOLID = solid_of(SHAPE)


def thetas(*parameters, model=None, cells=(1, 1), bounds=None, nominal=None, density=500.0):
    config = ThetaConfig(parameters=list(parameters), bounds=bounds or {}, nominal=nominal or {})
    return theta_map(model or ObjectModel(shape=SHAPE), SOLID, cells, config, density)


ALL = ("mass", "hand_friction", "support_friction", "com_x", "com_y", "inertia_ratio", "static_ratio", "restitution")


def test_theta_is_what_the_configuration_asks_for_in_its_order():
    assert thetas("support_friction", "mass").space.names == ("support_friction", "mass")
    assert thetas(*ALL).space.names == ALL
    assert thetas("mass", "mass").space.names == ("mass",)


def test_every_entry_of_theta_reaches_the_body():
    space = thetas(*ALL).space
    middle = space.from_unit(0.5 * np.ones(8))
    base = thetas(*ALL).body(middle)
    attributes = {"com_x": "p_BBcm", "com_y": "p_BBcm"}
    for k, name in enumerate(ALL):
        theta = middle.copy()
        theta[k] = space.from_unit(np.where(np.arange(8) == k, 0.75, 0.5))[k]
        body = thetas(*ALL).body(theta)
        changed = {
            field for field in base.__dataclass_fields__
            if not np.array_equal(getattr(base, field), getattr(body, field))
        }  # fmt: skip
        assert changed == {attributes.get(name, name)}
    body = thetas("mass", "com_y").body(np.array([0.7, 0.01]))
    assert body.mass == 0.7
    np.testing.assert_array_equal(body.p_BBcm, [0.0, 0.01])


def test_what_is_not_in_theta_has_its_nominal_value():
    body = thetas("mass", nominal={"hand_friction": 0.4, "com_x": 0.01}).body(np.array([0.2]))
    assert (body.hand_friction, body.p_BBcm[0], body.inertia_ratio, body.static_ratio) == (0.4, 0.01, 1.0, 1.0)
    np.testing.assert_array_equal(body.support_friction, [0.3])


def test_a_pushs_own_friction_and_restitution_come_on_top():
    body = thetas("support_friction", nominal={"restitution": 0.3}).body(
        np.array([0.2]), friction_scale=1.1, restitution=0.05
    )
    np.testing.assert_allclose(body.support_friction, [0.22])
    assert body.restitution == pytest.approx(0.35)
    assert thetas("mass").body(np.array([0.2]), restitution=-0.1).restitution == 0.0


def test_a_grid_of_frictions_is_named_by_its_cells():
    assert friction_names((1, 1)) == ["support_friction"]
    assert friction_names((2, 2)) == [f"support_friction_{i}_{j}" for i in (0, 1) for j in (0, 1)]
    grid = thetas("support_friction", "mass", cells=(2, 1), bounds={"support_friction_1_0": [0.1, 0.9]})
    assert grid.space.names == ("support_friction_0_0", "support_friction_1_0", "mass")
    np.testing.assert_array_equal(grid.body(np.array([0.2, 0.4, 0.3])).support_friction, [0.2, 0.4])
    assert grid.space.lower[1] == 0.1
    assert grid.space.lower[0] == 0.02


@pytest.mark.parametrize(
    ("shape", "cells", "empty"),
    [
        (
            Prism(polygon=((-0.1, -0.02), (0.1, -0.02), (0.0, 0.04)), height=0.03),
            (4, 4),
            {(0, 2), (0, 3), (3, 2), (3, 3)},
        ),
        (Cylinder(radius=0.04, length=0.03, axis="z"), (8, 8), {(0, 0), (0, 7), (7, 0), (7, 7)}),
        (Cylinder(radius=0.04, length=0.03, axis="z"), (1, 1), set()),
        (SHAPE, (3, 2), set()),
        (Cylinder(radius=0.04, length=0.1, axis="y"), (3, 2), {(0, 0), (0, 1), (2, 0), (2, 1)}),  # lies on a line
    ],
)
def test_a_cell_in_which_there_is_nothing_of_the_object_is_no_unknown(shape, cells, empty):
    made = theta_map(ObjectModel(shape=shape), solid_of(shape), cells, ThetaConfig(), 500.0)
    without = {f"support_friction_{i}_{j}" for i, j in empty}
    assert set(friction_names(cells)) - set(made.space.names) == without
    assert len(made.body(made.space.nominal).support_friction) == cells[0] * cells[1]


def test_a_single_cell_can_be_the_unknown():
    one = thetas("support_friction_1_0", cells=(2, 1), nominal={"support_friction": 0.25})
    np.testing.assert_array_equal(one.body(np.array([0.5])).support_friction, [0.25, 0.5])


def test_the_family_sets_bounds_and_nominal_of_all_cells():
    grid = thetas("support_friction", cells=(2, 2), bounds={"support_friction": [0.1, 0.5]},
                  nominal={"support_friction": 0.2})  # fmt: skip
    np.testing.assert_array_equal(grid.space.lower, 0.1)
    np.testing.assert_array_equal(grid.space.nominal, 0.2)


def test_a_weighed_mass_is_known_to_the_scale():
    mass = thetas("mass", model=WEIGHED).space.parameters[0]
    assert mass.prior_mean == 0.054
    assert mass.prior_std == pytest.approx(0.001 / 0.054)
    assert mass.lower < 0.054 - 4 * 0.001
    assert mass.upper > 0.054 + 4 * 0.001


def test_an_unweighed_mass_is_known_to_its_order_and_lies_between_foam_and_steel():
    mass = thetas("mass").space.parameters[0]
    volume = 0.12 * 0.05 * 0.03
    assert (mass.lower, mass.upper) == pytest.approx((20.0 * volume, 8000.0 * volume))
    assert (mass.prior_mean, mass.prior_std) == (pytest.approx(500.0 * volume), 0.8)
    assert thetas("mass", density=20.0).space.parameters[0].prior_mean == pytest.approx(20.0 * volume)


def test_bounds_that_are_asked_for_are_all_that_is_known_of_an_unweighed_mass():
    mass = thetas("mass", bounds={"mass": [0.1, 0.9]}).space.parameters[0]
    assert (mass.lower, mass.upper, mass.prior_mean, mass.prior_std) == (0.1, 0.9, 0.1, None)


def test_the_centre_of_mass_stays_inside_the_outline():
    space = thetas("com_x", "com_y").space
    np.testing.assert_allclose(space.upper, [0.036, 0.015])
    np.testing.assert_allclose(space.lower, [-0.036, -0.015])


def test_the_cells_own_error_is_something_at_a_bound_and_at_nothing():
    """A percent of a friction, of a place as much of what is known of it."""
    space = thetas("support_friction", "com_x", bounds={"support_friction": [0.02, 1.0]}).space
    inside, at_bound = (cell_error(space, np.array([mu, 0.0]), 0) for mu in (0.3, 0.02))
    assert at_bound == pytest.approx(inside, rel=0.02)
    com = space.parameters[1]
    assert cell_error(space, np.array([0.3, 0.0]), 1) == pytest.approx(
        0.01 * com.prior_std / (com.upper - com.lower), rel=1e-6
    )


@pytest.mark.parametrize(
    ("name", "bounds", "rule"),
    [
        ("static_ratio", [0.5, 2.0], "of at least 1"),
        ("restitution", [0.0, 1.2], "of at most 1"),
    ],
)
def test_bounds_beyond_what_physics_allows_are_refused(name, bounds, rule):
    with pytest.raises(ConfigError, match=rf"theta\.bounds\.{name}: needs numbers .*{rule}"):
        thetas(name, bounds={name: bounds})


def test_bounds_move_the_nominal_inside():
    mass = thetas("mass", bounds={"mass": [0.5, 0.8]}).space.parameters[0]
    assert (mass.lower, mass.upper, mass.prior_mean) == (0.5, 0.8, 0.5)


@pytest.mark.parametrize(
    "asked",
    [
        {"parameters": ("weight",)},
        {"parameters": ("mass",), "bounds": {"weight": [0.0, 1.0]}},
        {"parameters": ("mass",), "nominal": {"weight": 1.0}},
        {"parameters": ("support_friction_0_0",)},
        {"parameters": ("support_friction_2_0",), "cells": (2, 1)},
    ],
)
def test_an_unknown_name_is_answered_with_the_known_ones(asked):
    with pytest.raises(ConfigError, match=r"no parameter '(weight|support_friction_\d_0)'; known are mass, "):
        thetas(*asked.pop("parameters"), **asked)


@pytest.mark.parametrize("bounds", [[0.1], [0.1, 0.2, 0.3], []])
def test_bounds_are_a_pair(bounds):
    with pytest.raises(ConfigError, match=r"theta\.bounds\.mass: needs \[lower, upper\]"):
        thetas("mass", bounds={"mass": bounds})


@pytest.mark.parametrize(
    ("bounds", "nominal"),
    [
        ([0.5, 0.1], None),
        ([0.2, 0.2], None),
        ([-1.0, 1.0], None),
        ([0.0, 1.0], None),
        ([float("nan"), 1.0], None),
        ([0.1, float("inf")], None),
        ([0.1, 0.2], 0.3),
        (None, 2.0),
        (None, float("nan")),
    ],
)
def test_bounds_and_nominal_that_make_no_parameter_are_refused_by_name(bounds, nominal):
    with pytest.raises(ParameterError, match="mass"):
        thetas("mass", bounds=None if bounds is None else {"mass": bounds},
               nominal=None if nominal is None else {"mass": nominal})  # fmt: skip


@pytest.mark.parametrize("theta", [[0.05], [0.95], [float("nan")], [0.3, 0.3]])
def test_a_point_outside_the_bounds_makes_no_body(theta):
    with pytest.raises(ParameterError):
        thetas("mass", bounds={"mass": [0.1, 0.9]}).body(np.array(theta))


def test_no_parameters_are_no_space():
    with pytest.raises(ParameterError, match="at least one"):
        thetas()
