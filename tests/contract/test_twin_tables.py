"""Tables of friction and force in both integrators: what they do in the compiled twin they do in the cell."""

import math

import numpy as np
import pytest
from bare_laws import GRID, BareLaws, over_grid
from test_effects import MASS
from test_twin_effects import in_cell, in_twin, plain
from twin import SIGMA, rms

from physid_drake.cell.laws import ForceTable, HeadingTable, MotionTable, PlaceTable, SpeedTable
from physid_drake.cell.tables import Speeds

WEIGHT = MASS * 9.81
SPEEDS = Speeds(1e-3, 0.5)
HEADINGS = 2.0 * math.pi / 12 * np.arange(12)


def waving(times):
    """Factors that wave so many times around."""
    return HeadingTable(tuple((1.0 + 0.2 * np.cos(times * HEADINGS)).tolist()))


def moving(along, across):
    """Shares of the weight."""
    return MotionTable(tuple(WEIGHT * a for a in along), tuple(WEIGHT * a for a in across), SPEEDS)


NONE = (0.0,) * 6
SOFT_PLACES = PlaceTable(over_grid(lambda x, y: 1.0 + 0.3 * math.sin(15.0 * x + 10.0 * y)), GRID)
FALLING = SpeedTable((1.3, 1.2, 1.1, 1.0, 0.9, 0.8), SPEEDS)
FIELD = ForceTable(
    over_grid(lambda x, y: 0.1 * WEIGHT * math.sin(15.0 * x)),
    over_grid(lambda x, y: 0.1 * WEIGHT * math.cos(12.0 * y)),
    GRID,
)
# They move the object by 4 to 64 deviations. Measured apart: .19 of all of them, which half the cell's time step
# halves, .08 of a force across, and .06 and less of all others.
FURTHEST = {"all of them": 0.25, "across": 0.12}
CASES = {
    "places": (SOFT_PLACES,),
    "falling with speed": (FALLING,),
    "rising with speed": (SpeedTable((0.7, 0.8, 0.9, 1.0, 1.1, 1.2), SPEEDS),),
    "one way": (waving(1),),
    "two ways": (waving(2),),
    "three ways": (waving(3),),
    "field": (FIELD,),
    "brake": (moving((-0.1,) * 6, NONE),),
    "drive": (moving((0.1,) * 6, NONE),),
    "across": (moving(NONE, (0.1,) * 6),),
    "all of them": (
        SOFT_PLACES, FALLING, waving(2), FIELD,
        moving((0.0, -0.02, -0.05, -0.1, -0.05, 0.05), (0.1, 0.1, 0.0, 0.0, -0.1, -0.1)),
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_tables_do_in_the_twin_what_they_do_in_the_cell(case):
    effect = BareLaws(all=CASES[case])
    by_twin, by_cell = in_twin(effect) - plain()[1], in_cell(effect) - plain()[0]
    assert rms(by_twin / SIGMA) > 3.0
    assert rms((by_twin - by_cell) / SIGMA) < FURTHEST.get(case, 0.08)


@pytest.mark.parametrize(
    "law",
    [
        PlaceTable(over_grid(lambda x, y: 1.0), GRID), SpeedTable((1.0,) * 6, SPEEDS), HeadingTable((1.0,) * 12),
        ForceTable(over_grid(lambda x, y: 0.0), over_grid(lambda x, y: 0.0), GRID), moving(NONE, NONE),
    ],
    ids=lambda law: type(law).__name__,
)  # fmt: skip
def test_null_tables_change_not_a_bit(law):
    effect = BareLaws(all=(law,))
    assert np.array_equal(in_twin(effect), plain()[1])
    assert np.array_equal(in_cell(effect), plain()[0])
