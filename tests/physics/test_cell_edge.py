"""The table's edge: an object beyond it falls, one before it does not know of it."""

import numpy as np
import pytest
from motions import make
from twin import body_of

from physid_drake.cell import Body, Cell, Outcome, Start
from physid_drake.effects.rollout import Geometry, Rollout, roll
from physid_drake.recording import Box

TABLE = np.array([[-0.6, -0.4], [0.6, 0.4]])
MU, G = 0.3, 9.81
BOX = Box(size=(0.1, 0.08, 0.04))


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


@pytest.mark.parametrize(
    "law",
    [make("friction_patch", ratio=2.0, x=3.0, radius=0.1), make("friction_patch", ratio=0.5, x=3.0, radius=0.1),
     make("anisotropic_table", ratio=2.0, angle=0.5 * np.pi)],
    ids=["rough elsewhere", "slippery elsewhere", "grain"],
)  # fmt: skip
def test_a_friction_law_gives_nothing_back_of_what_hangs_over_the_edge(cell, law):
    """A third of the box is beyond the edge where it stops; what it gave back made it fly off."""
    speed = np.sqrt(2 * MU * G * 0.135)
    push = Rollout(
        start=Start(pose=(0.45, 0.0, 0.0), velocity=(speed, 0.0, 0.0)),
        path=None,
        begin=0.0,
        end=1.0,
        hand_height=None,
    )
    motion = roll(lambda _: cell, Geometry(shape=BOX), body_of(0.3, MU), push, [law])
    assert motion.outcome is Outcome.COMPLETED
    stop = motion.planar_at(np.array([1.0]))[0, 0]
    want = 0.45 + 0.135 / (
        1.0 if law.name == "friction_patch" else np.sqrt(2.0)
    )  # a grain's axes: 1 / root 2, root 2
    assert stop == pytest.approx(want, abs=1.5e-3)  # measured: 0.3 mm and less


@pytest.mark.parametrize("beyond", [5e-3, 0.06])
def test_what_begins_beyond_the_edge_does_not_hover(cell, beyond):
    assert slide(cell, 0.6 + beyond, 0.0).outcome is Outcome.FELL


def test_the_table_with_an_edge_slides_like_the_endless_one():
    edged = Cell(Box(size=(0.1, 0.08, 0.04)), hand_radius=None, table=TABLE, with_edge=True)
    stop = slide(edged, 0.0, 0.5).planar_at(np.array([1.0]))[0, 0]
    # Measured: within 1e-3 of the closed form, as on the half space.
    assert stop == pytest.approx(0.5**2 / (2 * MU * G), rel=5e-3)
