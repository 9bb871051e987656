"""Routh's impact: the cell's closed form against the reference's march through the phases."""

import numpy as np
import pytest
from reference.steps import routh_impact

from physid_drake.cell.impact import routh_impulse


def touches(seed, count):
    """Mass, inertia, lever along n and t, approach, slip, friction, restitution."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        mass = 10 ** rng.uniform(-2, 1)
        inertia = mass * 10 ** rng.uniform(-5, -1)
        levers = rng.uniform(-0.2, 0.2, 2)
        slip = rng.uniform(-1, 1) * (rng.random() > 0.1)  # some without slip
        yield mass, inertia, *levers, -(10 ** rng.uniform(-3, 0)), slip, rng.uniform(0, 1.5), rng.uniform(0, 1)


def impulse(touch, **more):
    mass, inertia, lever_n, lever_t, approach, slip, friction, restitution = touch
    given = {
        "mass": mass, "inertia": inertia, "lever_n": lever_n, "lever_t": lever_t, "approach": approach,
        "slip": slip, "friction": friction, "restitution": restitution,
    }  # fmt: skip
    return routh_impulse(**(given | more))


def after(touch, normal, tangent):
    """Normal and tangential relative velocity after the impulse, from rigid-body mechanics alone."""
    mass, inertia, lever_n, lever_t, approach, slip, *_ = touch
    turn = (lever_n * tangent - lever_t * normal) / inertia
    return approach + normal / mass - lever_t * turn, slip + tangent / mass + lever_n * turn


def test_the_impulse_is_the_references():
    for touch in touches(0, 4000):
        mass, inertia, lever_n, lever_t, approach, slip, friction, restitution = touch
        # The reference's arms are r x n = -lever_t and r x t = lever_n.
        normal, tangent = routh_impact(mass, inertia, -lever_t, lever_n, approach, slip, friction, restitution)
        got = impulse(touch)
        assert got.normal == pytest.approx(normal, rel=1e-9)
        assert got.tangent == pytest.approx(tangent, rel=1e-9, abs=1e-12 * normal)


def test_energy_is_never_made():
    for touch in touches(1, 4000):
        mass, _, _, _, approach, slip, *_ = touch
        got = impulse(touch)
        # Work of an impulse on a body against an unmoving wall: J . (u + u') / 2.
        normal_rate, slip_after = after(touch, got.normal, got.tangent)
        work = got.normal * (approach + normal_rate) / 2 + got.tangent * (slip + slip_after) / 2
        assert work <= 1e-12 * mass * (approach**2 + slip**2)


def test_an_inelastic_touch_leaves_no_approach():
    for touch in touches(2, 4000):
        got = impulse(touch, restitution=0.0)
        assert abs(after(touch, got.normal, got.tangent)[0]) < 1e-9 * (abs(touch[4]) + abs(touch[5]))


def test_an_elastic_touch_separates():
    for touch in touches(3, 2000):
        got = impulse(touch, restitution=1.0)
        assert after(touch, got.normal, got.tangent)[0] >= -1e-9


def test_friction_never_exceeds_coulombs_bound():
    for touch in touches(4, 4000):
        got = impulse(touch)
        assert got.normal > 0.0
        assert abs(got.tangent) <= touch[6] * got.normal * (1 + 1e-12)


def test_slip_that_goes_on_is_opposed_by_all_friction_there_is():
    sliding = 0
    for touch in touches(5, 4000):
        got = impulse(touch, restitution=0.0)
        slip, slip_after = touch[5], after(touch, got.normal, got.tangent)[1]
        if slip * slip_after > 1e-9:
            sliding += 1
            assert got.tangent == pytest.approx(-np.sign(slip) * touch[6] * got.normal, rel=1e-9, abs=1e-15)
    assert sliding > 500


def test_a_central_frictionless_touch_is_the_textbooks():
    got = routh_impulse(
        lever_n=-0.05, lever_t=0.0, approach=-0.4, slip=0.0, mass=0.3, inertia=1e-3, friction=0.5, restitution=0.25
    )
    assert got.normal == pytest.approx(1.25 * 0.3 * 0.4)
    assert got.tangent == 0.0


@pytest.mark.parametrize("approach", [0.0, 0.2])
def test_a_point_that_does_not_approach_gets_nothing(approach):
    got = routh_impulse(
        lever_n=-0.05, lever_t=0.01, approach=approach, slip=0.1, mass=0.3, inertia=1e-3, friction=0.5,
        restitution=0.5,
    )  # fmt: skip
    assert (got.normal, got.tangent) == (0.0, 0.0)


def test_mirroring_the_touch_mirrors_the_impulse():
    for touch in touches(6, 500):
        one = impulse(touch)
        other = impulse(touch, lever_t=-touch[3], slip=-touch[5])
        assert other.normal == pytest.approx(one.normal, rel=1e-12)
        assert other.tangent == pytest.approx(-one.tangent, rel=1e-12, abs=1e-18)
