"""The coordinates of a hypothesis: what they mean, where they end, how they are stepped."""

import numpy as np
import pytest

from physid_drake.diagnose.proposals import with_part
from physid_drake.effects import Surroundings
from physid_drake.effects.drag import ViscousDrag
from physid_drake.effects.friction import FrictionPatch
from physid_drake.inference.hypothesis import Hypothesis
from physid_drake.space import Parameter, ParameterSpace

SPACE = ParameterSpace(parameters=(
    Parameter(name="mass", unit="kg", lower=0.1, upper=1.0, prior_mean=0.3, prior_std=0.01, scale="log"),
    Parameter(name="support_friction", unit="-", lower=0.02, upper=1.2, prior_mean=0.3, scale="log"),
))  # fmt: skip
AROUND = Surroundings(
    mass=0.3, friction=0.3, size=np.array([0.1, 0.08]), height=0.03, region=np.array([[-0.2, -0.2], [0.2, 0.2]]),
    top_speed=0.4, pushes=12, has_hand=True, rolls=False,
)  # fmt: skip
PLAIN = Hypothesis(space=SPACE, around=AROUND)


@pytest.fixture
def both():
    dragged = with_part(PLAIN, ViscousDrag, np.array([0.2]))
    return with_part(dragged, FrictionPatch, np.array([0.3, 0.05, -0.02, np.log(0.04)]))


def test_z_holds_theta_then_the_effects(both):
    z = both.mean.copy()
    assert both.dimension == 2 + 1 + 4
    assert both.theta(z) == pytest.approx([0.3, 0.3])
    drag, patch = both.effects(z)
    assert drag == ViscousDrag(coefficient=0.2)
    assert (patch.ratio, patch.x, patch.y, patch.radius) == pytest.approx((np.exp(0.3), 0.05, -0.02, 0.04))


def test_tolerances_come_last_and_are_not_simulated(both):
    tolerant = Hypothesis(space=SPACE, around=AROUND, parts=both.parts, tolerances=3)
    assert tolerant.dimension == both.dimension + 3
    assert tolerant.simulated == both.dimension == len(tolerant.steps(tolerant.mean))
    assert tolerant.std[-3:] == pytest.approx(1.0)
    moved = tolerant.mean + np.append(np.zeros(both.dimension), [1.0, 2.0, 3.0])
    assert tolerant.effects(moved) == tolerant.effects(tolerant.mean)


def test_steps_lead_away_from_bounds(both):
    least, most = both.bounds
    for z in (least, most, both.mean):
        finite = np.where(np.isfinite(z), z, both.mean)
        stepped = finite + both.steps(finite)
        assert np.all(stepped <= most)
        assert np.all((stepped >= least) | (finite > least))


def test_the_name_does_not_depend_on_the_order(both):
    other = with_part(with_part(PLAIN, FrictionPatch, np.zeros(4)), ViscousDrag, np.zeros(1))
    assert both.name == other.name == "friction_patch + viscous_drag"
    assert PLAIN.name == "baseline"
