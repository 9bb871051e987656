"""Signed distances from outlines against brute force over points of the boundary."""

import math

import numpy as np
import pytest

from physid_drake.cell.outline import Disc, Polygon, rectangle

ELLIPSE = [(0.06 * math.cos(2 * math.pi * k / 64), 0.04 * math.sin(2 * math.pi * k / 64)) for k in range(64)]
HEXAGON = [(0.05 * math.cos(math.pi * k / 3), 0.05 * math.sin(math.pi * k / 3)) for k in range(6)]
OUTLINES = {
    "rectangle": rectangle(0.1, 0.06),
    "triangle": Polygon([(-0.05, -0.03), (0.07, -0.03), (-0.02, 0.06)]),
    "needle": Polygon([(-0.1, -0.002), (0.1, -0.001), (0.0, 0.004)]),
    "hexagon": Polygon(HEXAGON),
    "ellipse": Polygon(ELLIPSE),
    "disc": Disc(radius=0.033),
}


def boundary(outline, spacing=2e-5):
    """Points along the boundary (n, 2)."""
    if isinstance(outline, Disc):
        angle = np.linspace(0, 2 * math.pi, 20001)
        return outline.radius * np.column_stack([np.cos(angle), np.sin(angle)])
    corners = np.array(outline.vertices)
    pieces = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        n = max(2, math.ceil(np.hypot(*(b - a)) / spacing) + 1)
        pieces.append(a + np.linspace(0, 1, n)[:, None] * (b - a))
    return np.vstack(pieces)


def inside(outline, point):
    if isinstance(outline, Disc):
        return np.hypot(*point) < outline.radius
    corners = np.array(outline.vertices)
    edges = np.roll(corners, -1, axis=0) - corners
    to = point - corners
    return bool((edges[:, 0] * to[:, 1] - edges[:, 1] * to[:, 0] > 0).all())


@pytest.mark.parametrize("name", list(OUTLINES))
def test_distance_is_that_of_the_nearest_boundary_point(name):
    outline, rng = OUTLINES[name], np.random.default_rng(0)
    edge = boundary(outline)
    for point in rng.uniform(-0.15, 0.15, (400, 2)):
        distance, nx, ny = outline.nearest(*point)
        away = np.hypot(*(edge - point).T)
        sign = -1.0 if inside(outline, point) else 1.0
        slack = min(1e-5, 5e-11 / away.min()) + 1e-8  # spacing^2 / (8 distance); a circle's points: 7e-9
        assert distance == pytest.approx(sign * away.min(), abs=slack)
        assert math.hypot(nx, ny) == pytest.approx(1.0)


@pytest.mark.parametrize("name", list(OUTLINES))
def test_the_normal_leads_from_the_boundary_to_the_point(name):
    outline, rng = OUTLINES[name], np.random.default_rng(1)
    for point in rng.uniform(-0.15, 0.15, (400, 2)):
        distance, nx, ny = outline.nearest(*point)
        foot = point - distance * np.array([nx, ny])
        assert abs(outline.nearest(*foot)[0]) < 1e-12


@pytest.mark.parametrize("name", list(OUTLINES))
def test_the_distance_is_continuous_and_no_steeper_than_one(name):
    outline = OUTLINES[name]
    for y in (-0.05, 0.0, 0.013, 0.0399):
        xs = np.linspace(-0.15, 0.15, 3001)
        distances = np.array([outline.nearest(x, y)[0] for x in xs])
        assert np.abs(np.diff(distances)).max() <= np.diff(xs).max() * (1 + 1e-9)


@pytest.mark.parametrize("name", list(OUTLINES))
def test_the_extent_bounds_the_boundary(name):
    outline = OUTLINES[name]
    edge = boundary(outline)
    np.testing.assert_allclose(outline.extent(), [*edge.min(axis=0), *edge.max(axis=0)], atol=1e-8)


def test_the_middle_of_a_disc_has_a_distance_too():
    assert Disc(radius=0.02).nearest(0.0, 0.0)[0] == -0.02
