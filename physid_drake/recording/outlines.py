"""Planar geometry of an object's outline: area centroid, distance of a point, convex pieces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from physid_drake.errors import RecordingError
from physid_drake.recording.limits import check_lengths

CENTROID_TOLERANCE: Final = 1e-4
"""A prism's centroid may be this far from the origin of B, in m."""

MOST_CORNERS: Final = 200
"""Of an outline: a circle is one to a hair with as many."""

FLAT: Final = 1e-9
"""Of the largest turn: a vertex with less is on a straight line, but for rounding."""

Array = npt.NDArray[np.float64]


def polygon_centroid(polygon: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Area centroid (2,) in m of a simple polygon (n, 2) in m."""
    vertices = np.asarray(polygon, dtype=np.float64)
    following = np.roll(vertices, -1, axis=0)
    cross = vertices[:, 0] * following[:, 1] - vertices[:, 1] * following[:, 0]
    centroid: npt.NDArray[np.float64] = ((vertices + following) * cross[:, None]).sum(axis=0) / (3.0 * cross.sum())
    return centroid


def is_convex(polygon: npt.ArrayLike, *, straight: bool = False) -> bool:
    """Whether a counter-clockwise polygon (n, 2) turns left at every vertex, and goes round once.

    Args:
        polygon: vertices.
        straight: whether it may go straight on at some.
    """
    turns, headings = _turns(np.asarray(polygon, dtype=np.float64))
    least = -FLAT * float(np.abs(turns).max()) if straight else 0.0
    # A star also turns left at every vertex, but goes round more than once.
    return bool((turns >= least if straight else turns > least).all() and headings.sum() < 3.0 * np.pi)


def _turns(vertices: Array) -> tuple[Array, Array]:
    """Cross product of the edges that meet after each vertex (n,) [m^2], and the angle between them [rad]."""
    edges = np.roll(vertices, -1, axis=0) - vertices
    following = np.roll(edges, -1, axis=0)
    turns = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    return turns, np.arctan2(turns, (edges * following).sum(axis=1))


def check_polygon(polygon: Sequence[Sequence[float]]) -> None:
    """Refuses a polygon that is not simple and counter-clockwise about its centroid; it may have notches.

    Args:
        polygon: vertices (n, 2) in m.

    Raises:
        RecordingError: naming the rule, what was got and what to do.
    """
    vertices = np.asarray(polygon, dtype=np.float64)
    if vertices.ndim != 2 or vertices.shape[1] != 2 or len(vertices) < 3 or not np.isfinite(vertices).all():
        raise RecordingError(f"polygon_m must be at least three finite [x, y] pairs, but got {len(polygon)} rows.")
    if len(vertices) > MOST_CORNERS:
        raise RecordingError(
            f"polygon_m must have at most {MOST_CORNERS} vertices, but got {len(vertices)}; thin them."
        )
    for name, across in zip("xy", np.ptp(np.clip(vertices, -1e9, 1e9), axis=0).tolist(), strict=True):
        check_lengths(f"polygon_m's extent along {name}", across)
    turns, headings = _turns(vertices)
    if (turns == 0.0).any():
        corner = (int(np.argmin(np.abs(turns))) + 1) % len(vertices)
        raise RecordingError(
            f"polygon_m must have no repeated or collinear vertices, but it has one at vertex {corner}"
            f" {vertices[corner].tolist()} m; leave that out."
        )
    crossing = _crossing(vertices)
    if crossing is not None or not abs(abs(headings.sum()) - 2.0 * np.pi) < 1e-6:
        where = "" if crossing is None else f": the edges from vertices {crossing[0]} and {crossing[1]} cross"
        raise RecordingError(
            f"polygon_m must not cross or touch itself, but it does{where}; list its outline once round."
        )
    if headings.sum() < 0.0:
        raise RecordingError("polygon_m must be counter-clockwise, but it is clockwise; reverse its vertices.")
    centroid = polygon_centroid(vertices)
    if float(np.hypot(*centroid)) > CENTROID_TOLERANCE:
        raise RecordingError(
            f"polygon_m must have its centroid at the origin of B within {CENTROID_TOLERANCE} m, but it is "
            f"at [{centroid[0]:.6f}, {centroid[1]:.6f}] m; subtract that from every vertex, "
            "and move the recorded poses there: add it, turned by each pose, to each position."
        )


def _crossing(vertices: Array) -> tuple[int, int] | None:
    """Two edges, by their first vertices, that cross or touch though they are no neighbours; None if none do."""
    n = len(vertices)
    for i in range(n):
        for j in range(i + 2, n - (i == 0)):
            a, b, c, d = vertices[[i, (i + 1) % n, j, (j + 1) % n]]
            across = _side(a, b, c) * _side(a, b, d), _side(c, d, a) * _side(c, d, b)
            if max(across) <= 0.0 and _overlap(a, b, c, d):
                return i, j
    return None


def _overlap(a: Array, b: Array, c: Array, d: Array) -> bool:
    """Whether the boxes about two edges overlap: of edges on one line, the other test says nothing."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    return bool(np.all(np.minimum(c, d) <= high) and np.all(np.maximum(c, d) >= low))


def _side(a: Array, b: Array, p: Array) -> float:
    """Twice the area of the triangle a, b, p: positive where p is to the left of the way from a to b."""
    return float((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]))


def convex_pieces(polygon: npt.ArrayLike) -> list[Array]:
    """Convex polygons, counter-clockwise, that together are a simple polygon (n, 2); itself if it is convex.

    Its ears are cut off one by one, and what is convex together is joined again (Hertel and Mehlhorn, Fast
    triangulation of simple polygons, 1983): at most four times as many pieces as there can be at least.
    """
    vertices = np.asarray(polygon, dtype=np.float64)
    if is_convex(vertices):
        return [vertices]
    pieces = _triangles(vertices)
    joined = True
    while joined:
        joined = False
        for i in range(len(pieces)):
            for j in range(i + 1, len(pieces)):
                both = _joined(pieces[i], pieces[j])
                if both is not None and is_convex(vertices[both], straight=True):
                    pieces = [both, *(p for k, p in enumerate(pieces) if k not in (i, j))]
                    joined = True
                    break
            if joined:
                break
    return [without_straight(vertices[piece]) for piece in pieces]


def without_straight(vertices: Array) -> Array:
    """A polygon (n, 2) without vertices at which it goes straight on."""
    turns = np.abs(_turns(vertices)[0])
    return vertices[np.roll(turns, 1) > FLAT * float(turns.max())]


def _triangles(vertices: Array) -> list[list[int]]:
    """Indices of triangles, by cutting off ears."""
    left = list(range(len(vertices)))
    found: list[list[int]] = []
    while len(left) > 3:
        ears = [(k, left[k - 1], left[k], left[(k + 1) % len(left)]) for k in range(len(left))]
        ears = [ear for ear in ears if _is_ear(vertices, left, *ear[1:])]
        if not ears:
            break  # of a simple polygon, there always is one
        # The shortest cut leaves the fewest slivers.
        k, a, b, c = min(ears, key=lambda ear: float(np.linalg.norm(vertices[ear[3]] - vertices[ear[1]])))
        found.append([a, b, c])
        left.pop(k)
    return [*found, left]


def _is_ear(vertices: Array, left: list[int], a: int, b: int, c: int) -> bool:
    """Whether a corner turns left, and the triangle that it is cut off with holds no other vertex."""
    others = [v for v in left if v not in (a, b, c)]
    return _side(*vertices[[a, b, c]]) > 0.0 and not any(_holds(vertices, a, b, c, v) for v in others)


def _holds(vertices: Array, a: int, b: int, c: int, v: int) -> bool:
    p = vertices[v]
    return all(_side(vertices[i], vertices[j], p) >= 0.0 for i, j in ((a, b), (b, c), (c, a)))


def _joined(one: list[int], other: list[int]) -> list[int] | None:
    """Two polygons that share an edge, as one without it; None where they do not."""
    for k, a in enumerate(one):
        b = one[(k + 1) % len(one)]
        if a in other and b in other and other[(other.index(b) + 1) % len(other)] == a:
            start = other.index(a)
            between = [other[(start + m) % len(other)] for m in range(1, len(other) - 1)]
            return [*one[: k + 1], *between, *one[k + 1 :]]
    return None


def outline_distance(polygon: npt.ArrayLike, points: npt.ArrayLike) -> Array:
    """Signed distances (n,) in m of points (n, 2) from a simple polygon (m, 2), negative inside."""
    vertices = np.asarray(polygon, dtype=np.float64)
    queries = np.asarray(points, dtype=np.float64)[:, None, :]
    edges = np.roll(vertices, -1, axis=0) - vertices
    offsets = queries - vertices
    share = np.clip((offsets * edges).sum(-1) / (edges * edges).sum(-1), 0.0, 1.0)
    nearest = np.linalg.norm(offsets - share[..., None] * edges, axis=-1).min(axis=1)
    if is_convex(vertices):
        inside = (edges[:, 0] * offsets[..., 1] - edges[:, 1] * offsets[..., 0] >= 0.0).all(axis=1)
    else:
        inside = _inside(vertices, edges, offsets)
    distances: Array = np.where(inside, -nearest, nearest)
    return distances


def _inside(vertices: Array, edges: Array, offsets: Array) -> npt.NDArray[np.bool_]:
    """Whether points are inside, by how often a ray along x from each crosses the outline; offsets (n, m, 2)."""
    above = offsets[..., 1] < 0.0
    crosses = above != np.roll(above, -1, axis=1)
    rise = np.where(edges[:, 1] == 0.0, 1.0, edges[:, 1])
    ahead = vertices[:, 0] + edges[:, 0] * (offsets[..., 1] / rise)
    at = offsets[..., 0] + vertices[:, 0]
    return np.asarray((crosses & (at < ahead)).sum(axis=1) % 2 == 1)
