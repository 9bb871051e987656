"""Outlines with notches: L, T, plus and what is drawn at random; distances, pieces, supports, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physid_drake.cell.outline import Polygon
from physid_drake.cell.solid import solid_of
from physid_drake.cell.support import FrictionGrid, second_moments, support_of
from physid_drake.errors import RecordingError
from physid_drake.recording import Prism, convex_pieces, is_convex, outline_distance, polygon_centroid
from physid_drake.twin.hand import nearest
from physid_drake.twin.twin import _edges


def centred(corners) -> np.ndarray:
    corners = np.asarray(corners, dtype=np.float64)
    return corners - polygon_centroid(corners)


TEE = centred([[-2, 1], [-2, 0], [-0.5, 0], [-0.5, -3], [0.5, -3], [0.5, 0], [2, 0], [2, 1]]) * 0.04
ELL = centred([[0, 0], [3, 0], [3, 1], [1, 1], [1, 4], [0, 4]]) * 0.03
PLUS = centred(
    [[1, -3], [1, -1], [3, -1], [3, 1], [1, 1], [1, 3], [-1, 3], [-1, 1], [-3, 1], [-3, -1], [-1, -1], [-1, -3]]
) * 0.02  # fmt: skip
STAR = centred(
    [[r * math.cos(a), r * math.sin(a)] for k in range(14) for r, a in [(0.08 - 0.04 * (k % 2), k * math.pi / 7)]]
)
SHAPES = {"tee": TEE, "ell": ELL, "plus": PLUS, "star": STAR}


def random_polygon(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0.0, 2.0 * math.pi, 11))
    return centred((rng.uniform(0.02, 0.08, 11) * np.array([np.cos(angles), np.sin(angles)])).T)


def area(corners: np.ndarray) -> float:
    following = np.roll(corners, -1, axis=0)
    return 0.5 * float((corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0]).sum())


@pytest.mark.parametrize("corners", [*SHAPES.values(), *map(random_polygon, range(12))])
def test_pieces_are_convex_and_cover_the_whole(corners: np.ndarray) -> None:
    pieces = convex_pieces(corners)
    assert len(pieces) > 1 and all(is_convex(piece) for piece in pieces)
    assert sum(map(area, pieces)) == pytest.approx(area(corners), rel=1e-12)
    for points in (piece.mean(axis=0)[None] for piece in pieces):
        assert outline_distance(corners, points)[0] < 0.0


def test_a_convex_one_is_its_own_piece() -> None:
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    (piece,) = convex_pieces(square)
    assert np.array_equal(piece, square)
    assert len(convex_pieces(TEE)) == 2 and len(convex_pieces(ELL)) == 2 and len(convex_pieces(PLUS)) == 3


@pytest.mark.parametrize("corners", [*SHAPES.values(), *map(random_polygon, range(6))])
def test_cell_twin_and_recording_measure_one_distance(corners: np.ndarray) -> None:
    outline = Polygon([(x, y) for x, y in corners.tolist()])
    points = np.random.default_rng(0).uniform(-0.15, 0.15, (400, 2))
    expected = outline_distance(corners, points)
    edges = _edges(outline)
    for (x, y), distance in zip(points.tolist(), expected.tolist(), strict=True):
        found = outline.nearest(x, y)
        assert found[0] == pytest.approx(distance, abs=1e-15)
        assert nearest(x, y, edges, 0.0, 1.0) == pytest.approx(found, abs=1e-12)
        # The normal is the distance's gradient: a step along it gains as much.
        step = outline.nearest(x + 1e-7 * found[1], y + 1e-7 * found[2])[0]
        assert step - distance == pytest.approx(1e-7, abs=1e-10) and math.hypot(*found[1:]) == pytest.approx(1.0)


def test_a_tip_in_a_notch_is_near_its_face() -> None:
    outline = Polygon([(x, y) for x, y in TEE.tolist()])
    x, y = (TEE[2] + [-0.01, -0.02]).tolist()  # left of the stem, below the bar
    assert outline.nearest(x, y) == pytest.approx((0.01, -1.0, 0.0), abs=1e-12)
    assert outline.nearest(*(TEE[2] + [-0.02, -0.01]).tolist()) == pytest.approx((0.01, 0.0, -1.0), abs=1e-12)


@pytest.mark.parametrize("corners", SHAPES.values())
@pytest.mark.parametrize("grid", [FrictionGrid(), FrictionGrid(nx=2, ny=3)])
def test_a_support_has_the_shapes_own_moments(corners: np.ndarray, grid: FrictionGrid) -> None:
    outline = Polygon([(x, y) for x, y in corners.tolist()])
    support = support_of(outline, grid, 100)
    assert outline_distance(corners, support.points).max() < 1e-9
    xx, xy, yy = second_moments(corners)
    found = (support.weights * support.points.T) @ support.points
    assert support.weights @ support.points == pytest.approx([0.0, 0.0], abs=1e-9)
    assert found == pytest.approx(np.array([[xx, xy], [xy, yy]]), rel=1e-6, abs=1e-12)
    assert 60 < len(support.points) < 400 and set(support.cells) <= set(range(grid.size))


def test_the_solid_of_a_tee() -> None:
    solid = solid_of(Prism(polygon=tuple((x, y) for x, y in TEE.tolist()), height=0.03))
    wide, thick, long = 0.16, 0.04, 0.12  # bar and stem
    assert len(solid.visual) == 2 and len(solid.faces) == 8
    # Of two rectangles, each about its own middle, by Steiner.
    bar, stem = wide * thick, thick * long
    middle_bar, middle_stem = TEE[0, 1] - 0.5 * thick, TEE[3, 1] + 0.5 * long
    ixx = (bar * (thick**2 / 12 + middle_bar**2) + stem * (long**2 / 12 + middle_stem**2)) / (bar + stem)
    iyy = (bar * wide**2 + stem * thick**2) / 12 / (bar + stem)
    assert solid.gyration == pytest.approx((ixx + 0.03**2 / 12, iyy + 0.03**2 / 12, ixx + iyy), rel=1e-9)


@pytest.mark.parametrize(
    ("corners", "said"),
    [
        ([[0, 0], [1, 1], [1, 0], [0, 1]], "must not cross or touch itself"),
        (TEE[::-1], "must be counter-clockwise, but it is clockwise"),
        ([*TEE[:1], *TEE], "no repeated or collinear vertices"),
        (np.vstack([TEE[:2], [0.5 * (TEE[1] + TEE[2])], TEE[2:]]), "no repeated or collinear vertices"),
        ([[0, 0], [3, 0], [3, 1], [2, 1], [2, 0], [1, 0], [1, 1], [0, 1]], "must not cross or touch itself"),
        (TEE + 0.01, "must have its centroid at the origin"),
        (centred([[0, 0], [4, 0], [4, 4], [2, 0.0], [0, 4]]) * 0.02, "must not cross or touch itself"),
    ],
)
def test_what_is_no_outline(corners, said: str) -> None:
    with pytest.raises(RecordingError, match=said):
        Prism(polygon=tuple((float(x), float(y)) for x, y in np.asarray(corners)), height=0.03)
