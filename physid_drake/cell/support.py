"""Where the object stands on the table: quadrature points under it, their weights and their friction cells.

Points at the middle of equal cells underestimate the second moment of the underside by 1/n^2, which is a
systematic yaw error; Gauss-Legendre points with weights do not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.outline import Disc, Outline, Polygon

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class FrictionGrid:
    """A regular grid of ``nx`` by ``ny`` cells over the outline's bounding box; 1 by 1 is plain friction."""

    nx: int = 1
    ny: int = 1

    @property
    def size(self) -> int:
        """Number of cells."""
        return self.nx * self.ny

    def cell_of(self, points: Array, outline: Outline) -> NDArray[np.intp]:
        """Index (n,) of the cell of each point (n, 2); x is the slow index."""
        x0, y0, x1, y1 = outline.extent()
        ix = np.clip(((points[:, 0] - x0) / (x1 - x0) * self.nx).astype(np.intp), 0, self.nx - 1)
        iy = np.clip(((points[:, 1] - y0) / (y1 - y0) * self.ny).astype(np.intp), 0, self.ny - 1)
        return ix * self.ny + iy


@dataclass(frozen=True, kw_only=True)
class Support:
    """Quadrature of the pressure under the object.

    Attributes:
        points: (n, 2) in B [m].
        weights: (n,) shares of the area, summing to 1.
        cells: (n,) index of the friction cell of each point.
    """

    points: Array
    weights: Array
    cells: NDArray[np.intp]


def support_of(outline: Outline, grid: FrictionGrid, points_per_side: int) -> Support:
    """Quadrature points over an outline, fine enough that every friction cell holds some.

    Args:
        outline: the underside, convex, in B.
        grid: the friction cells.
        points_per_side: Gauss points along the longer side; the shorter has one less when it can (5 by 4
            equals 8 by 8 and costs a third).
    """
    match outline:
        case Disc(radius=radius):
            points, weights = _disc_points(radius, grid, points_per_side)
        case Polygon() as polygon if _is_rectangle(polygon):
            points, weights = _rectangle_points(polygon, grid, points_per_side)
        case Polygon() as polygon if len(polygon.vertices) <= 6:
            points, weights = _polygon_points(polygon, grid, points_per_side)
        case Polygon() as polygon:
            points, weights = _chord_points(polygon, grid, points_per_side)
        case _:
            raise TypeError(f"no quadrature for an outline of type {type(outline).__name__}")
    cells = grid.cell_of(points, outline)
    return Support(points=points, weights=weights / weights.sum(), cells=cells)


def _is_rectangle(polygon: Polygon) -> bool:
    x0, y0, x1, y1 = polygon.extent()
    return {(x, y) for x, y in polygon.vertices} == {(x0, y0), (x1, y0), (x1, y1), (x0, y1)}


def _composite_gauss(lower: float, upper: float, pieces: int, order: int) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights, ``order`` in each of ``pieces`` equal parts."""
    node, weight = np.polynomial.legendre.leggauss(order)
    edges = np.linspace(lower, upper, pieces + 1)
    half = 0.5 * np.diff(edges)[:, None]
    middle = 0.5 * (edges[1:] + edges[:-1])[:, None]
    return (middle + half * node).ravel(), (half * weight).ravel()


def _rectangle_points(polygon: Polygon, grid: FrictionGrid, per_side: int) -> tuple[Array, Array]:
    x0, y0, x1, y1 = polygon.extent()
    along_x = per_side if x1 - x0 >= y1 - y0 else per_side - 1
    along_y = per_side - 1 if x1 - x0 >= y1 - y0 else per_side
    x, wx = _composite_gauss(x0, x1, grid.nx, math.ceil(along_x / grid.nx))
    y, wy = _composite_gauss(y0, y1, grid.ny, math.ceil(along_y / grid.ny))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    return points, np.outer(wx, wy).ravel()


def _disc_points(radius: float, grid: FrictionGrid, per_side: int) -> tuple[Array, Array]:
    """Gauss in r^2 (the weight r dr) times equal angles.

    Source: A. H. Stroud, Approximate Calculation of Multiple Integrals, 1971, formulas S2.
    """
    radii = max(2, math.ceil(per_side * max(grid.nx, grid.ny) / 8))
    angles = 8 * max(1, math.ceil(max(grid.nx, grid.ny) / 3))
    s, ws = _composite_gauss(0.0, 1.0, 1, radii)
    rings = []
    for k, (ring, weight) in enumerate(zip(np.sqrt(s), ws, strict=True)):
        phi = 2.0 * math.pi * (np.arange(angles) + 0.5 * (k % 2)) / angles
        rings.append(np.column_stack([ring * np.cos(phi), ring * np.sin(phi), np.full(angles, weight)]))
    table = np.concatenate(rings)
    return radius * table[:, :2], table[:, 2]


def _polygon_points(polygon: Polygon, grid: FrictionGrid, per_side: int) -> tuple[Array, Array]:
    """A Gauss rule on each triangle of the fan about the centroid, by collapsing the square (Duffy).

    Source: M. G. Duffy, Quadrature over a pyramid or cube of integrands with a singularity at a vertex, 1982.
    """
    vertices = np.array(polygon.vertices)
    order = max(2, math.ceil(per_side * max(grid.nx, grid.ny) / max(3, len(vertices))))
    u, wu = _composite_gauss(0.0, 1.0, 1, order)
    # The integrand u du of the collapsed square is absorbed by Gauss in u^2.
    u = np.sqrt(u)
    v, wv = _composite_gauss(0.0, 1.0, 1, order)
    centre = _centroid(vertices)
    points, weights = [], []
    for a, b in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
        area = 0.5 * abs((a - centre)[0] * (b - centre)[1] - (a - centre)[1] * (b - centre)[0])
        edge = a + v[:, None] * (b - a)
        grid_points = centre + u[:, None, None] * (edge - centre)[None]
        points.append(grid_points.reshape(-1, 2))
        weights.append(area * np.outer(wu, wv).ravel())
    return np.concatenate(points), np.concatenate(weights)


def _chord_points(polygon: Polygon, grid: FrictionGrid, per_side: int) -> tuple[Array, Array]:
    """Gauss in x, and Gauss along the chord at each x: for outlines of many short edges (an ellipse)."""
    vertices = np.array(polygon.vertices)
    x0, _, x1, _ = polygon.extent()
    x, wx = _composite_gauss(x0, x1, grid.nx, math.ceil((per_side + 1) / grid.nx))
    points, weights = [], []
    for xi, wi in zip(x, wx, strict=True):
        low, high = _chord(vertices, float(xi))
        y, wy = _composite_gauss(low, high, grid.ny, math.ceil(per_side / grid.ny))
        points.append(np.column_stack([np.full_like(y, xi), y]))
        weights.append(wi * wy)
    return np.concatenate(points), np.concatenate(weights)


def _chord(vertices: Array, x: float) -> tuple[float, float]:
    """Lowest and highest y of a convex polygon at x."""
    ys = []
    for a, b in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
        if min(a[0], b[0]) <= x <= max(a[0], b[0]) and a[0] != b[0]:
            ys.append(a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1]))
    return min(ys), max(ys)


def _centroid(vertices: Array) -> Array:
    """Centroid (2,) of a polygon's area, vertices (n, 2) counter-clockwise."""
    following = np.roll(vertices, -1, axis=0)
    cross = vertices[:, 0] * following[:, 1] - vertices[:, 1] * following[:, 0]
    centre: Array = ((vertices + following) * cross[:, None]).sum(axis=0) / (3.0 * cross.sum())
    return centre


def rest_depths(support: Support, p_BBcm: Array, mean_depth: float) -> tuple[Array, Array]:
    """How an object at rest sinks into a foundation of springs, stiffness in proportion to the weights.

    Args:
        support: the quadrature.
        p_BBcm: (2,) centre of mass in B [m].
        mean_depth: depth under an evenly loaded underside [m].

    Returns:
        ``plane`` (3,): depth at (x, y) is ``plane @ [1, x, y]`` [m], and the points' ``loads`` (n,), shares of
        the weight. Points that would pull are let go; a centre of mass outside the base tips over and raises.

    Raises:
        ValueError: if the centre of mass is not above the base.
    """
    basis = np.column_stack([np.ones(len(support.weights)), support.points])
    target = np.array([1.0, p_BBcm[0], p_BBcm[1]]) * mean_depth
    active = np.ones(len(support.weights), dtype=bool)
    for _ in range(20):
        weighted = basis * (support.weights * active)[:, None]
        if np.count_nonzero(active) < 3 or np.linalg.cond(basis.T @ weighted) > 1e14:
            break
        plane: Array = np.linalg.solve(basis.T @ weighted, target).astype(np.float64)
        loaded = basis @ plane > 0.0
        if np.array_equal(loaded, active):
            return plane, support.weights * active * (basis @ plane) / mean_depth
        active = loaded
    raise ValueError(f"the centre of mass at {p_BBcm} m in B is not above the base: the object tips over")
