"""Tables of friction and force against the laws that they are tables of and closed forms, in cell and twin."""

import math
from copy import deepcopy

import numpy as np
import pytest
from bare_laws import GRID, BareLaws, over_grid
from motions import MASS, MU, SIZE, G, at, distance, slide
from twin import body_of

from physid_drake.cell import Start
from physid_drake.cell.laws import (
    Ellipse,
    Falling,
    ForceTable,
    Gradient,
    HeadingTable,
    MotionTable,
    PlaceTable,
    Quadratic,
    SpeedTable,
    Tilt,
)
from physid_drake.cell.solid import solid_of
from physid_drake.cell.tables import Places, Speeds, around, slopes_around
from physid_drake.recording import Box
from physid_drake.twin.twin import Twin, TwinPush

TIMES = np.linspace(0.0, 1.0, 101)
WEIGHT = MASS * G
SPEEDS = Speeds(1e-3, 1.0)
TWIN = Twin(solid=solid_of(Box(size=SIZE)), hand_radius=None)


def in_cell(*laws, velocity=(0.5, 0.1, 2.0), friction=MU):
    return at(slide(BareLaws(all=laws), velocity=velocity, friction=friction, time_step=1e-3), TIMES)


def in_twin(*laws, velocity=(0.5, 0.1, 2.0), friction=MU):
    push = TwinPush(
        body=body_of(MASS, friction), start=Start(pose=(0.0, 0.0, 0.0), velocity=velocity), path=None, begin=0.0,
        end=1.0, times=TIMES, laws=laws,
    )  # fmt: skip
    return TWIN.rollouts([push])[0].poses


both = pytest.mark.parametrize("slid", [in_cell, in_twin], ids=["cell", "twin"])


def furthest(one, other):
    return np.abs(one - other).max()


@both
def test_a_constant_table_of_forces_is_a_tilt(slid):
    table = ForceTable(over_grid(lambda x, y: 0.05 * WEIGHT), over_grid(lambda x, y: -0.03 * WEIGHT), GRID)
    assert furthest(slid(table), slid(Tilt(0.05, -0.03))) < 1e-12


@both
def test_a_table_of_places_that_is_linear_is_a_gradient(slid):
    table = PlaceTable(over_grid(lambda x, y: 1.0 + 1.5 * x - y), GRID)
    assert furthest(slid(table), slid(Gradient(1.5, -1.0, table.largest))) < 1e-8


@both
def test_a_constant_table_of_places_or_headings_is_another_friction(slid):
    other = slid(friction=1.2 * MU)
    assert furthest(slid(PlaceTable(((1.2,),), GRID)), other) < 1e-9
    assert furthest(slid(HeadingTable((1.2,) * 8)), other) < 1e-9


def shrinks(slid, table_of, law, coarse):
    """Differences of tables from their law, of ``coarse`` numbers and of twice as many."""
    exact = slid(law)
    return [furthest(slid(table_of(count))[:, :2], exact[:, :2]) for count in (coarse, 2 * coarse)]


def falling(count):
    speeds = np.geomspace(SPEEDS.slowest, SPEEDS.fastest, count)
    return SpeedTable(tuple((1.0 + 0.5 * np.exp(-((speeds / 0.2) ** 2))).tolist()), SPEEDS)


def elliptic(count):
    away = 2.0 * math.pi / count * np.arange(count) - 0.4
    return HeadingTable(tuple(np.sqrt(np.cos(away) ** 2 / 1.4 + 1.4 * np.sin(away) ** 2).tolist()))


def dragging(count):
    speeds = np.geomspace(SPEEDS.slowest, SPEEDS.fastest, count)
    return MotionTable(tuple((-0.5 * speeds**2).tolist()), (0.0,) * count, SPEEDS)


@both
@pytest.mark.parametrize(
    ("table_of", "law", "most"),
    # Of 41, 51 and 41 mm. Measured, coarse and fine: 87, 21 um; 327, 85 um; 82, 26 um.
    [(falling, Falling(0.5, 0.2), 1.2e-4), (elliptic, Ellipse(1.4, 0.4, False), 4e-4),
     (dragging, Quadratic(0.5), 1.2e-4)],
    ids=["falling", "ellipse", "drag"],
)  # fmt: skip
def test_a_table_approaches_its_law_with_the_square_of_its_steps(slid, table_of, law, most):
    coarse, fine = shrinks(slid, table_of, law, 24)
    assert coarse < most and fine < 0.35 * coarse


@both
@pytest.mark.parametrize("share", [-0.2, 0.1])
def test_a_force_along_the_velocity_brakes_or_drives(slid, share):
    table = MotionTable((share * WEIGHT,) * 2, (0.0, 0.0), SPEEDS)
    want = distance(lambda v: G * (MU - share * min(1.0, v / SPEEDS.slowest)))
    assert slid(table, velocity=(0.5, 0.0, 0.0))[-1] == pytest.approx([want, 0.0, 0.0], rel=1e-3, abs=1e-9)


@both
def test_a_force_across_the_velocity_leads_around_a_circle(slid):
    """Without friction: radius m v^2 / F, and a quarter of it after pi m v / 2 F."""
    speed, force = 0.5, 0.5 * math.pi * MASS * 0.5
    table = MotionTable((0.0, 0.0), (force, force), SPEEDS)
    radius = MASS * speed**2 / force
    poses = slid(table, velocity=(speed, 0.0, 0.0), friction=1e-9)
    assert poses[-1, :2] == pytest.approx([radius, radius], abs=1e-4)


@both
def test_no_force_by_motion_moves_what_rests(slid):
    table = MotionTable((10.0 * WEIGHT,) * 2, (10.0 * WEIGHT,) * 2, Speeds(0.1, 1.0))
    assert furthest(slid(table, velocity=(0.0, 0.0, 0.0)), np.zeros(3)) < 1e-9


@both
def test_a_slippery_heading_lets_go_of_what_others_hold(slid):
    """Half the friction along x, under a force of .6 of it there, and of .6 of it across, where it holds."""
    slippery = HeadingTable(tuple(1.0 - 0.5 * math.cos(math.pi / 6 * k) ** 2 for k in range(12)))
    along, across = Tilt(0.6 * MU, 0.0), Tilt(0.0, 0.6 * MU)
    rest = {"velocity": (0.0, 0.0, 0.0)}
    want = 0.5 * 0.1 * MU * G
    assert slid(slippery, along, **rest)[-1] == pytest.approx([want, 0.0, 0.0], rel=5e-3, abs=1e-6)
    assert furthest(slid(slippery, across, **rest), np.zeros(3)) < 1e-4


def test_tables_are_values():
    for law in (falling(4), elliptic(4), dragging(4), PlaceTable(((1.2,),), GRID)):
        other = deepcopy(law)
        _ = other.numbers
        assert other == law and hash(other) == hash(law)


def test_numbers_are_constant_beyond_a_tables_edge():
    rows = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    found = Places(0.0, 0.0, 1.0, 1.0).between(rows, np.array([0.5 + 0.5j, -1.0 - 1.0j, 2.0 + 1.5j, 0.25 + 9.0j]))
    assert found == pytest.approx([3.0, 1.0, 5.5, 3.75])
    speeds = np.array([0.0, 1e-3, math.sqrt(1e-3), 1.0, 9.0])
    assert Speeds(1e-3, 1.0).between(np.array([1.0, 2.0]), speeds) == pytest.approx([1.0, 1.0, 1.5, 2.0, 2.0])


def test_headings_go_around():
    numbers = np.array([1.0, 2.0, 4.0, 3.0])
    angles = np.array([0.0, 0.25, -0.25, 1.0, 1.75, 2.0]) * math.pi
    assert around(numbers, angles) == pytest.approx([1.0, 1.5, 2.0, 4.0, 2.0, 1.0])
    assert slopes_around(numbers.tolist()) == pytest.approx(np.array([-1.0, 3.0, 1.0, -3.0]) / math.pi)


def test_a_place_that_is_no_number_reads_no_table_beyond_its_end():
    """A velocity beyond all bounds diverges in the twin; tables are asked at what comes of it."""
    laws = (PlaceTable(((1.2, 1.0), (1.0, 1.1)), GRID), elliptic(8), falling(5), dragging(5))
    push = TwinPush(
        body=body_of(MASS, MU), start=Start(pose=(0.0, 0.0, 0.0), velocity=(math.nan, 0.0, 1e200)), path=None,
        begin=0.0, end=1.0, times=TIMES, laws=laws,
    )  # fmt: skip
    assert TWIN.rollouts([push])[0].outcome.name == "DIVERGED"
