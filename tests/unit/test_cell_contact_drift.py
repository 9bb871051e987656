"""What a tip drifts and creeps is made up for in the next step, unless it slides."""

import math

import pytest

from physid_drake.cell.contact_drift import SPARE, ContactDrift, spare_friction
from physid_drake.cell.touch import HandMove, Touch

SPAN = 0.01
HAND = (0.02, 0.0)  # m/s, straight at the face
TOUCH = Touch(pose=(0.0, 0.0, 0.0), twist=(0.0, 0.0, 0.0), gap=0.0, nx=1.0, ny=0.0, rx=-0.05, ry=0.01, rate=0.0)


class Flat:
    """A tip that always touches."""

    def gap(self, *pose_and_hand):
        return 0.0, 1.0, 0.0


def steps(spare, creep, count=5):
    """Velocities along the face that are asked for, and those of the object, which slips by a constant creep."""
    drift, asked = ContactDrift(Flat()), []
    for _ in range(count):
        asked.append(drift.command(TOUCH, HAND, SPAN)[1])
        move = HandMove([0.0, 0.0], [SPAN * HAND[0], 0.0], HAND)
        drift.learn(TOUCH, (0.0, 0.0, 0.0), (HAND[0], asked[-1] + creep, 0.0), move, SPAN, spare)
    return asked


def test_what_crept_in_one_step_is_made_up_for_in_the_next():
    assert steps(spare=0.6, creep=1e-4) == pytest.approx([0.0, -1e-4, -1e-4, -1e-4, -1e-4])


def test_what_slides_is_left_alone():
    assert steps(spare=0.0, creep=5e-3) == pytest.approx([0.0] * 5)
    assert max(map(abs, steps(spare=0.05, creep=1e-4))) == pytest.approx(0.05 / SPARE * 1e-4)


def test_a_new_contact_knows_nothing_of_the_old():
    drift = ContactDrift(Flat())
    move = HandMove([0.0, 0.0], [SPAN * HAND[0], 0.0], HAND)
    drift.learn(TOUCH, (0.0, 0.0, 0.0), (0.03, 1e-3, 0.0), move, SPAN, 1.0)
    drift.forget()
    assert drift.command(TOUCH, HAND, SPAN) == HAND


@pytest.mark.parametrize(
    ("force", "friction", "spare"),
    [((2.0, 0.3, 0.0), 0.3, 0.5), ((2.0, 0.36, -0.48), 0.5, 0.4), ((2.0, 0.9, 0.0), 0.3, 0.0),
     ((2.0, 0.0, 0.0), 0.0, 0.0), ((0.0, 0.0, 0.0), 0.3, 0.0), ((-1.0, 0.0, 0.0), 0.3, 0.0)],
)  # fmt: skip
def test_friction_is_to_spare_of_what_the_normal_force_bears(force, friction, spare):
    """In any direction of the face; a contact that bears nothing has nothing to spare."""
    assert math.isclose(spare_friction(TOUCH, force, friction), spare, abs_tol=1e-12)
