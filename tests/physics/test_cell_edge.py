"""The table's edge: an object beyond it falls, one before it does not know of it."""

import numpy as np
import pytest

from physid_drake.cell import Body, Cell, Outcome, Start
from physid_drake.recording import Box

TABLE = np.array([[-0.6, -0.4], [0.6, 0.4]])
MU, G = 0.3, 9.81


@pytest.fixture(scope="module")
def cell():
    return Cell(Box(size=(0.1, 0.08, 0.04)), hand_radius=None, table=TABLE)


def slide(cell, x, speed, seconds=1.0):
    body = Body(mass=0.3, p_BBcm=np.zeros(2), inertia_ratio=1.0, hand_friction=0.3, support_friction=np.array([MU]))
    start = Start(pose=(x, 0.0, 0.0), velocity=(speed, 0.0, 0.0))
    return cell.rollout(body, start=start, path=None, begin=0.0, end=seconds)


def test_an_object_whose_centre_stops_beyond_the_edge_falls(cell):
    reach = 0.6 - 0.45
    motion = slide(cell, 0.45, 1.3 * np.sqrt(2 * MU * G * reach))
    assert motion.outcome is Outcome.FELL
    assert motion.poses[-1, 6] < -0.05


def test_an_object_that_stops_with_its_centre_on_the_table_stays(cell):
    # Half of it may hang over: its centre stops 20 mm before the edge.
    reach = 0.58 - 0.45
    motion = slide(cell, 0.45, np.sqrt(2 * MU * G * reach))
    assert motion.outcome is Outcome.COMPLETED
    # Measured: 0.3 mm beyond the closed form.
    assert motion.planar_at(np.array([1.0]))[0, 0] == pytest.approx(0.58, abs=1.5e-3)


def test_far_from_the_edge_the_table_is_endless(cell):
    endless = Cell(Box(size=(0.1, 0.08, 0.04)), hand_radius=None)
    assert np.array_equal(slide(cell, 0.0, 0.5).poses, slide(endless, 0.0, 0.5).poses)


def test_the_table_with_an_edge_slides_like_the_endless_one():
    edged = Cell(Box(size=(0.1, 0.08, 0.04)), hand_radius=None, table=TABLE, with_edge=True)
    stop = slide(edged, 0.0, 0.5).planar_at(np.array([1.0]))[0, 0]
    # Measured: within 1e-3 of the closed form, as on the half space.
    assert stop == pytest.approx(0.5**2 / (2 * MU * G), rel=5e-3)
