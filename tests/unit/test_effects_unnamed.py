"""Forces and frictions without a name: what their tables are."""

import numpy as np
import pytest
from test_diagnose_estimates import AROUND

from physid_drake.cell.laws import ForceTable, HeadingTable, MotionTable, PlaceTable, SpeedTable
from physid_drake.effects import PushFacts
from physid_drake.effects.unnamed import BLOCKS, FORCE, FRICTION, MODES, UnnamedForce

COUNT = sum(MODES.values())
FACTS = PushFacts(order=0, mass=0.2, polar=1e-3)


def laws_of(effect):
    return [*effect.laws(FACTS), *effect.frictions(FACTS)]


def test_none_of_it_is_nothing():
    effect = UnnamedForce.at(np.zeros(COUNT), AROUND)
    assert effect.is_null and laws_of(effect) == []


def test_tables_of_zeros_are_nothing_either():
    assert UnnamedForce(force_x=((0.0, 0.0),), by_speed=(0.0,), friction=((0.0,), (0.0,))).is_null
    assert not UnnamedForce(force_x=((0.0, 0.1),)).is_null and not UnnamedForce(by_speed=(0.1,)).is_null


@pytest.mark.parametrize(
    ("block", "law"), zip(BLOCKS, (ForceTable, PlaceTable, SpeedTable, HeadingTable, MotionTable), strict=True)
)
def test_each_block_is_a_law_of_its_own(block, law):
    point = np.zeros(COUNT)
    point[list(UnnamedForce.free(BLOCKS[block]))] = 0.5
    effect = UnnamedForce.at(point, AROUND)
    assert not effect.is_null and [type(one) for one in laws_of(effect)] == [law]


def test_a_draw_is_as_large_as_its_prior_says():
    """Modes that are left out are a part of the variance: 5 % of a force, 4 % of a friction."""
    draws = np.random.default_rng(0).normal(size=(400, COUNT))
    effects = [UnnamedForce.at(point, AROUND) for point in draws]
    held = AROUND.friction * AROUND.weight
    for name, size in (("force_x", FORCE * held), ("friction", FRICTION), ("along", FORCE * held)):
        values = np.array([getattr(effect, name) for effect in effects])
        assert np.sqrt(np.mean(values**2)) == pytest.approx(size, rel=0.1)


def test_the_tables_stand_where_the_object_was():
    effect = UnnamedForce.at(np.ones(COUNT), AROUND)
    x, y, step_x, step_y = effect.places
    rows, numbers = np.array(effect.force_x).shape
    last = np.array([x + step_x * (rows - 1), y + step_y * (numbers - 1)])
    np.testing.assert_allclose([[x, y], last], AROUND.region)


def test_a_friction_is_never_negative():
    effect = UnnamedForce.at(-40.0 * np.ones(COUNT), AROUND)
    frictions = effect.frictions(FACTS)
    assert min(np.min(law.numbers.real) for law in frictions) >= 0.0
