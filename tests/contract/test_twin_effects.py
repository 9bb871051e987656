"""Every effect in both integrators: what it does in the compiled twin is what it does in the cell."""

import dataclasses as dc
from functools import cache

import numpy as np
import pytest
from test_effects import MASS, MU, PUSHES, SHAPES, TIMES, around, directions, rolls_for
from twin import SIGMA, body_of, rms

from physid_drake.cell import Cell, CellConfig, ContactConfig, SolverConfig
from physid_drake.cell.solid import solid_of
from physid_drake.effects import SHIPPED
from physid_drake.effects.pulse import Pulse
from physid_drake.effects.rollout import geometry_with, roll, tracked
from physid_drake.errors import CellError
from physid_drake.twin.twin import Twin, Wander
from physid_drake.twin.with_effects import as_reported, push_with

# As stiff as the cell can be stepped: what is left of its own compliance is about a tenth of a deviation.
STIFF = CellConfig(
    contact=ContactConfig(
        model="point", hand_frequency_rad_s=3000.0, rest_depth_m=3e-7, stiction_tolerance_mps=1e-5
    ),
    solver=SolverConfig(time_step_s=5e-4, slide_time_step_s=5e-4),
)  # fmt: skip
# Deviations; measured: a spring .15, a rebound .13, a lagging hand .11, a tip that gives way .09, a patch .07, all
# others below .05.
FURTHEST = {
    "tether": 0.2, "restitution": 0.2, "actuator_lag": 0.2, "hand_compliance": 0.15, "friction_patch": 0.15,
}  # fmt: skip

planar = [kind for kind in SHIPPED if not rolls_for(kind)]


@cache
def stiff(geometry):
    return Cell(geometry.shape, hand_radius=0.01, config=STIFF, pressure=geometry.pressure, gravity=geometry.gravity)


@cache
def twin_of(geometry):
    # On as many points as the cell has, so that laws are compared and not quadratures.
    return Twin(
        solid=solid_of(geometry.shape), hand_radius=0.01, pressure=geometry.pressure, gravity=geometry.gravity,
        points=STIFF.contact.support_points,
    )  # fmt: skip


def in_cell(*effects):
    return np.array([
        tracked(roll(stiff, SHAPES[False], body_of(MASS, MU), push, effects), TIMES, effects)
        for push in PUSHES[False]
    ])  # fmt: skip


def in_twin(*effects):
    """The same of the twin; None where it does not know the effect."""
    twin = twin_of(geometry_with(effects, SHAPES[False]))
    pushes = [push_with(twin, SHAPES[False], body_of(MASS, MU), p, effects, TIMES) for p in PUSHES[False]]
    if None in pushes:
        return None
    return np.array([as_reported(trace, effects).poses for trace in twin.rollouts(pushes)])


@cache
def plain():
    return in_cell(), in_twin()


def a_large_one(kind):
    """The effect along its first direction, so large that it moves the object by some deviations."""
    family, k, coordinate = directions(kind)[0]
    point = np.array(family.point)
    point[k] += (2.0 if family.size > 1.0 else 8.0) * family.size * coordinate.step
    return kind.at(point, around(False))


def test_without_effects_both_say_the_same():
    cell, twin = plain()
    assert rms((twin - cell) / SIGMA) < 0.12  # measured .080


@pytest.mark.parametrize("kind", planar, ids=lambda kind: kind.name)
def test_an_effect_does_in_the_twin_what_it_does_in_the_cell(kind):
    effect = a_large_one(kind)
    twin = in_twin(effect)
    moved = twin - plain()[1] - (in_cell(effect) - plain()[0])
    assert rms(moved / SIGMA) < FURTHEST.get(kind.name, 0.08)


@pytest.mark.parametrize("kind", planar, ids=lambda kind: kind.name)
def test_an_effect_at_its_null_changes_not_a_bit(kind):
    assert np.array_equal(in_twin(kind()), plain()[1])


def test_what_rolls_is_the_cells():
    with pytest.raises(CellError, match="does not roll"):
        twin_of(SHAPES[True])


def test_a_wrench_that_comes_and_goes_does_in_the_twin_what_it_does_in_the_cell():
    """The question that localisation asks; measured .03 deviations."""
    wrench = {"fx": 0.06, "fy": -0.04, "torque": 1e-3, "middle": 0.3, "width": 0.15}
    wander = Wander(middle=0.3, width=0.15, force=(0.06, -0.04), torque=1e-3)
    cell = in_cell(Pulse(**wrench)) - plain()[0]
    twin = twin_of(SHAPES[False])
    pushes = [push_with(twin, SHAPES[False], body_of(MASS, MU), p, (), TIMES) for p in PUSHES[False]]
    moved = np.array([t.poses for t in twin.rollouts([dc.replace(p, wander=wander) for p in pushes])]) - plain()[1]
    assert rms(cell / SIGMA) > 1.0
    assert rms((moved - cell) / SIGMA) < 0.08
