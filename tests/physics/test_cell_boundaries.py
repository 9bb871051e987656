"""The cell at the ends of what it takes: no friction, odd time steps, hands that touch, steps that failed."""

import numpy as np
import pytest
from twin import MODELS

from physid_drake.cell import Body, Cell, CellConfig, HandPath, Start
from physid_drake.cell.config import ContactConfig, SolverConfig
from physid_drake.cell.forces import Wrench
from physid_drake.cell.motion import Outcome
from physid_drake.recording import Box, Cylinder

BOX = Box(size=(0.1, 0.06, 0.04))
TIP, GRAVITY = 0.01, 9.81
AT_ORIGIN = Start(pose=(0.0, 0.0, 0.0))

both_models = pytest.mark.parametrize("model", MODELS)


def body(friction=0.3, com=(0.0, 0.0)):
    return Body(mass=0.5, support_friction=np.atleast_1d(friction), hand_friction=0.2, inertia_ratio=1.0,
                p_BBcm=np.array(com))  # fmt: skip


def cell_of(model, *, hand=TIP, shape=BOX, **solver):
    config = CellConfig(contact=ContactConfig(model=model), solver=SolverConfig(**solver))
    return Cell(shape, hand_radius=hand, config=config)


def steady(begin, gap=0.0, reach=0.05):
    """A hand at 50 mm/s whose tip is a gap [m] behind an object as far [m] about the origin."""
    velocities = np.array([[0.05, 0.0], [0.05, 0.0]])
    return HandPath(times=np.array([0.0, begin]), velocities=velocities, start=np.array([-reach - TIP - gap, 0.0]))


class Pull:
    """A constant force along x [N]."""

    def __init__(self, force):
        self.force = force

    def wrench(self, state):
        return Wrench(fx=self.force, fy=0.0, torque=0.0)


@both_models
def test_without_friction_nothing_stops(model):
    motion = cell_of(model, hand=None).rollout(
        body(0.0), start=Start(pose=(0.0, 0.0, 0.0), velocity=(0.5, 0.0, 0.0)), path=None, begin=0.0, end=0.3
    )
    assert motion.planar_at(np.array([0.3]))[0] == pytest.approx((0.15, 0.0, 0.0), abs=1e-6)


@both_models
def test_a_push_without_friction_is_nearly_that_of_next_to_none(model):
    cell, ends = cell_of(model), []
    for friction in (0.0, 1e-6):
        motion = cell.rollout(body(friction), start=AT_ORIGIN, path=steady(0.2), begin=0.0, end=0.3)
        assert motion.outcome is Outcome.COMPLETED
        ends.append(motion.planar_at(np.array([0.3]))[0])
    assert ends[0] == pytest.approx(ends[1], abs=1e-5)


@pytest.mark.parametrize(
    ("time_step", "slide", "most"),
    [(1e-3, 1.5e-3, 5e-5), (1.3e-3, 2e-3, 5e-5), (2e-3, 3.33e-3, 8e-5), (4e-3, 6e-3, 2e-4)],
)
def test_ticks_of_a_slide_that_are_no_multiple_stop_where_they_should(time_step, slide, most):
    """Measured: 0.02 to 0.13 mm; 1.1 to 5.6 mm where a slide took more steps than Drake's integrator one."""
    cell = cell_of("point", hand=None, time_step_s=time_step, slide_time_step_s=slide)
    start = Start(pose=(0.0, 0.0, 0.0), velocity=(1.0, 0.0, 0.0))
    motion = cell.rollout(body(), start=start, path=None, begin=0.0, end=0.6)
    assert motion.planar_at(np.array([0.6]))[0, 0] == pytest.approx(1.0 / (2.0 * 0.3 * GRAVITY), abs=most)


@both_models
def test_an_object_off_centre_that_starts_touching_is_not_flung(model):
    """It goes as from 2 mm further back. Measured: below 0.02 mm; 0.75 and 20 mm where B was made to touch, not the
    side that leans into the tip."""
    bottle, off = Cylinder(radius=0.033, length=0.2, axis="z"), body(com=(0.02, 0.0))
    cell, ways = cell_of(model, shape=bottle), []
    for gap in (0.0, 2e-3):
        path = steady(0.2 + gap / 0.05, gap, reach=0.033)
        motion = cell.rollout(off, start=AT_ORIGIN, path=path, begin=0.0, end=0.7, hand_height=0.05)
        ways.append(motion.planar_at(np.array([0.1, 0.15]) + gap / 0.05)[:, 0])
    np.testing.assert_allclose(ways[0], ways[1], atol=5e-5)


@both_models
def test_a_step_that_failed_spoils_no_later_rollout(model):
    def pushed(cell, **laws):
        return cell.rollout(body(), start=AT_ORIGIN, path=steady(0.2), begin=0.0, end=0.3, **laws)

    cell = cell_of(model)
    before = pushed(cell)
    assert pushed(cell, laws=[Pull(float("nan"))]).outcome is Outcome.DIVERGED
    np.testing.assert_array_equal(pushed(cell).poses, before.poses)


def test_an_integrator_that_lost_its_parameters_is_replaced(monkeypatch):
    """Drake raises before it has built the step, as for a hand of no mass, and never steps again."""
    cell = cell_of("point")
    rollout = lambda: cell.rollout(body(), start=AT_ORIGIN, path=steady(0.2), begin=0.0, end=0.3)  # noqa: E731
    before = rollout()
    with monkeypatch.context() as weightless:
        weightless.setattr(type(cell._stepper), "_mass_of_hand", lambda *_: 0.0)
        assert rollout().outcome is Outcome.DIVERGED
    np.testing.assert_array_equal(rollout().poses, before.poses)
