"""The friction of depths beyond the loads: what is given back over a time step."""

import numpy as np
import pytest

from physid_drake.cell.lift import Lift
from physid_drake.cell.object_state import Underside, lifts_of
from physid_drake.cell.outline import rectangle
from physid_drake.cell.support import FrictionGrid, support_of

STIFFNESS, SPAN, DEPTH = 1e5, 2e-3, 3e-5
SLOPE = (DEPTH * 6.0, -DEPTH * 4.0)  # depth grows by a third towards the edges


@pytest.fixture(scope="module")
def underside():
    support = support_of(rectangle(0.10, 0.08), FrictionGrid(nx=1, ny=1), 36)
    points = support.points[:, 0] + 1j * support.points[:, 1]
    friction = np.where(points.real > 0.0, 0.5, 0.3)
    return Underside(points=points, weights=support.weights, friction=friction, radii=support.radii)


def of_all(underside, lean, velocity, spin):
    """Force and moment about Bo, point by point."""
    slips = velocity + 1j * spin * underside.points
    lifts = lifts_of(underside.points, slips, SPAN, lean)
    pushes = STIFFNESS * underside.weights * underside.friction * lifts * slips / np.abs(slips)
    return pushes.sum(), float((underside.points.conj() * pushes).sum().imag)


@pytest.mark.parametrize("velocity", [0.5 + 0j, 0.5j, 0.2 - 0.3j])
def test_a_face_that_slides_along_its_lean_has_v_n_dt_too_much(underside, velocity):
    force, moment = Lift(underside, STIFFNESS).excess(SPAN, (DEPTH, *SLOPE), velocity, 0.0)
    rough = underside.weights * underside.friction
    lift = SPAN * (velocity.real * SLOPE[0] + velocity.imag * SLOPE[1])
    assert force == pytest.approx(STIFFNESS * lift * rough.sum() * velocity / abs(velocity))
    # It acts where the face is rough.
    place = complex(rough @ underside.points) / rough.sum()
    assert place.real > 0.005
    assert moment == pytest.approx((place.conjugate() * force).imag, abs=1e-12)


@pytest.mark.parametrize("spin", [0.0, 1.0, 5.0, -15.0])
@pytest.mark.parametrize("velocity", [0.5 + 0.1j, 0.2j, 0.02 + 0j])
def test_four_points_tell_it_as_all_do(underside, velocity, spin):
    lean = (DEPTH, *SLOPE)
    force, moment = Lift(underside, STIFFNESS).excess(SPAN, lean, velocity, spin)
    want, torque = of_all(underside, lean, velocity, spin)
    # Of the friction and of its torque in a spin: measured 4e-4 and 8e-4 at most.
    friction = STIFFNESS * DEPTH * 0.4
    assert abs(force - want) < 1e-3 * friction
    assert abs(moment - torque) < 1.5e-3 * friction * 0.035


def test_what_is_not_in_the_table_gives_nothing_back(underside):
    steep = (DEPTH, 2.0 * DEPTH / 0.05, 0.0)  # a quarter of the face is off the table
    assert Lift(underside, STIFFNESS).excess(SPAN, steep, 1.0 + 0.3j, 2.0) == pytest.approx(
        of_all(underside, steep, 1.0 + 0.3j, 2.0)
    )
    lifts = lifts_of(underside.points, np.ones(len(underside.points)) + 0j, SPAN, steep)
    depths = DEPTH + steep[1] * underside.points.real
    assert (lifts[depths <= 0.0] == 0.0).all()
    assert (lifts <= np.maximum(depths, 0.0)).all()


def test_nothing_is_given_back_at_rest(underside):
    assert Lift(underside, STIFFNESS).excess(SPAN, (DEPTH, *SLOPE), 0j, 0.0) == (0j, 0.0)
