"""Force and friction laws at the rollout's seam, against closed forms; nothing changes without one."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import quad

from physid_drake.cell import Body, Cell, CellConfig, Start
from physid_drake.cell.forces import Wrench
from physid_drake.recording import Box

G, MU, MASS = 9.81, 0.3, 0.05


@dataclass
class Tilt:
    angle: float

    def wrench(self, state):
        return Wrench(fx=state.mass * G * np.sin(self.angle), fy=0.0, torque=0.0)


@dataclass
class Drag:
    coefficient: float

    def wrench(self, state):
        fx, fy = -self.coefficient * state.v_WBcm
        return Wrench(fx=fx, fy=fy, torque=0.0)


@dataclass
class Stribeck:
    excess: float
    speed: float

    @property
    def largest(self):
        return 1.0 + self.excess

    def ratio(self, state):
        slip = np.hypot(*state.v_WQ.T)
        return 1.0 + self.excess * np.exp(-((slip / self.speed) ** 2))


@pytest.fixture(scope="module", params=["point", "hydroelastic"])
def slide(request):
    config = CellConfig()
    config.contact.model = request.param
    cell = Cell(Box(size=(0.05, 0.12, 0.03)), hand_radius=None, config=config)
    body = Body(mass=MASS, p_BBcm=np.zeros(2), inertia_ratio=1.0, hand_friction=0.3, support_friction=np.array([MU]))

    def run(speed, **laws):
        start = Start(pose=(0.0, 0.0, 0.0), velocity=(speed, 0.0, 0.0))
        return cell.rollout(body, start=start, path=None, begin=0.0, end=1.5, **laws)

    return run


def end(motion):
    return motion.planar_at(np.array([1.5]))[0, 0]


def test_a_tilted_table_lengthens_a_slide(slide):
    want = 0.5**2 / (2.0 * (MU * G - G * np.sin(0.05)))
    # Measured: 1e-5 (point), -2.4e-3 (hydroelastic).
    assert end(slide(0.5, laws=(Tilt(0.05),))) == pytest.approx(want, rel=5e-3)


def test_an_object_at_rest_holds_on_a_tilted_table(slide):
    # Two thirds of the friction. Measured: 0.13 mm of creep in 1.5 s; sliding freely it would be 2.2 m.
    assert abs(end(slide(0.0, laws=(Tilt(0.2),)))) < 3e-4


def test_viscous_drag_shortens_a_slide(slide):
    c = 0.2
    k, a = c / MASS, MU * G
    want = 0.5 / k - a / k**2 * np.log(1.0 + k * 0.5 / a)
    # Measured: -3.9e-3 (point), 2e-4 (hydroelastic): the force is that of the time step's start.
    assert end(slide(0.5, laws=(Drag(c),))) == pytest.approx(want, rel=8e-3)


def test_friction_that_falls_with_speed_follows_its_curve(slide):
    law = Stribeck(excess=0.5, speed=0.1)
    want = quad(lambda v: v / (G * MU * (1.0 + 0.5 * np.exp(-((v / 0.1) ** 2)))), 0.0, 0.5)[0]
    # Measured: 9e-4 (point), -5.7e-3 (hydroelastic).
    assert end(slide(0.5, frictions=(law,))) == pytest.approx(want, rel=1e-2)


def test_a_rollout_with_laws_leaves_the_next_one_as_it_was(slide):
    before = slide(0.5)
    slide(0.5, laws=(Drag(0.2),), frictions=(Stribeck(0.5, 0.1),))
    assert np.array_equal(slide(0.5).poses, before.poses)
