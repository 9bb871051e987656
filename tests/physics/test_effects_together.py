"""Two effects at once: each leaves the other what it does alone."""

from dataclasses import replace

import numpy as np
import pytest
from motions import BOX, MASS, MU, SIZE, TIP, G, end, make, slide
from twin import body_of, config_of

from physid_drake.cell import Cell, HandPath, Start
from physid_drake.effects.rollout import Geometry, Rollout, roll
from physid_drake.recording import Cylinder

SOFT = make("hand_compliance", compliance=2e-3)
LYING = Geometry(shape=Cylinder(radius=0.033, length=0.12, axis="y"))


def pushed(*effects, geometry=BOX, first, side, speed, way, time_step=1e-3, height=None):
    """Where an object ends that is pushed along x by so much."""
    times = np.array([0.0, 0.2, 0.2 + way / speed, 0.4 + way / speed])
    path = HandPath(
        times=times, velocities=np.outer([0.0, speed, speed, 0.0], [1.0, 0.0]), start=np.array([-first, side])
    )
    config = config_of("point")
    config.solver.time_step_s, config.solver.slide_time_step_s = time_step, max(time_step, 2e-3)
    push = Rollout(
        start=Start(pose=(0.0, 0.0, 0.0)), path=path, begin=0.0, end=float(times[-1]) + 0.1, hand_height=height
    )
    body = body_of(MASS, MU, hand_friction=0.3)
    return end(roll(lambda g: Cell(g.shape, hand_radius=TIP, config=config), geometry, body, push, effects))


@pytest.mark.parametrize(
    "effect",
    [
        make("anisotropic_table", ratio=2.0, angle=0.6),
        make("friction_patch", ratio=2.0, x=0.06, y=0.02, radius=0.04),
        make("viscous_drag", coefficient=20.0),
    ],
    ids=lambda effect: effect.name,
)
def test_a_tip_that_gives_way_leaves_laws_as_they_are_in_long_ticks(effect):
    """The laws saw the tip's impulse before the table's friction had answered it: up to 39 mrad off."""
    slow = {"first": 0.5 * SIZE[0] + TIP + 0.003, "side": 0.015, "speed": 0.01, "way": 0.04}
    short, long = (pushed(SOFT, effect, **slow, time_step=time_step) for time_step in (1e-3, 1e-2))
    np.testing.assert_allclose(long[:2], short[:2], atol=1e-4)
    assert long[2] == pytest.approx(short[2], abs=2e-3)


def test_a_larger_lying_cylinder_is_touched_at_its_axis():
    aside = {"first": 0.033 * 1.05 + TIP + 0.003, "side": 0.02, "speed": 0.1, "way": 0.05}
    larger = Geometry(shape=Cylinder(radius=0.033 * 1.05, length=0.12 * 1.05, axis="y"))
    got = pushed(make("size_error", ratio=1.05), geometry=LYING, **aside, height=0.033)
    np.testing.assert_allclose(got, pushed(geometry=larger, **aside, height=0.033 * 1.05), atol=1e-9)


def test_a_spring_that_launches_an_object_carries_it_onto_a_patch():
    tether, patch = make("tether", stiffness=8.0, x=0.45), make("friction_patch", ratio=4.0, x=0.3, radius=0.06)
    with_patch = end(slide(tether, patch, velocity=(0.0, 0.0, 0.0)))[0]
    without = end(slide(tether, velocity=(0.0, 0.0, 0.0)))[0]
    assert without - with_patch > 0.03
    # The patch's work is what the spring has less to give: at most its friction over all of it.
    assert without - with_patch < 3.0 * MU * MASS * G * (2 * 0.06 + SIZE[0]) / (8.0 * 0.2)


def test_friction_that_has_drifted_away_leads_further():
    slippery, patch = make("friction_drift", per_push=-0.06), make("friction_patch", ratio=5.0, x=0.5, radius=0.06)
    toss = {"velocity": (0.6, 0.0, 0.0), "order": 15, "seconds": 2.0}
    assert end(slide(slippery, **toss))[0] > 0.5
    assert end(slide(slippery, patch, **toss))[0] < 0.5
    near = replace(patch, x=-0.8)
    np.testing.assert_allclose(end(slide(slippery, near, **toss)), end(slide(slippery, **toss)), atol=1e-6)
