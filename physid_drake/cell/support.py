"""Where the object stands on the table: quadrature points under it, their weights and their friction cells.

Points at the middle of equal cells underestimate the second moment of the underside by 1/n^2, which is a
systematic yaw error; Gauss-Legendre points with weights do not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import sqrtm
from scipy.special import roots_jacobi

from physid_drake.cell.outline import Disc, Outline, Polygon
from physid_drake.errors import TippedError
from physid_drake.recording import convex_pieces, polygon_centroid

Array = NDArray[np.float64]

SECTORS = 720  # of a smooth outline, to part equal areas
ABOUT = 0.95  # of the points that are asked for
FEW_CORNERS = 6  # a polygon with more is treated as a round outline


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
class PressureGrid:
    """A pressure that is not even: a regular grid of weights over the outline's bounding box.

    Attributes:
        weights: rows along x of B, columns along y; only their proportions matter.
    """

    weights: tuple[tuple[float, ...], ...]

    @property
    def grid(self) -> FrictionGrid:
        """The cells of the weights."""
        return FrictionGrid(nx=len(self.weights), ny=len(self.weights[0]))

    def factors(self, points: Array, outline: Outline) -> Array:
        """Weight (n,) of the cell of each point (n, 2)."""
        flat = np.array([w for row in self.weights for w in row])
        factors: Array = flat[self.grid.cell_of(points, outline)]
        return factors


@dataclass(frozen=True, kw_only=True)
class Support:
    """Quadrature of the pressure under the object.

    Attributes:
        points: (n, 2) in B [m].
        weights: (n,) shares of the load, summing to 1.
        cells: (n,) index of the friction cell of each point.
        radii: (n,) of a disc as large as the part of the underside that each point stands for [m].
        polar: mean square distance from Bo, of the whole underside, whatever presses where [m^2].
    """

    points: Array
    weights: Array
    cells: NDArray[np.intp]
    radii: Array
    polar: float


def axis_support(support: Support, grid: FrictionGrid, outline: Outline) -> Support:
    """A lying cylinder stands on its lowest line: the quadrature along y only."""
    ys = np.unique(np.round(support.points[:, 1], 12))
    shares = np.array([support.weights[np.isclose(support.points[:, 1], y)].sum() for y in ys])
    points = np.column_stack([np.zeros_like(ys), ys])
    return Support(
        points=points, weights=shares, cells=grid.cell_of(points, outline), radii=np.zeros_like(ys),
        polar=float(shares @ ys**2),
    )  # fmt: skip


def support_of(
    outline: Outline,
    grid: FrictionGrid,
    points: int,
    *,
    pressure: PressureGrid | None = None,
) -> Support:
    """Quadrature points over an outline, fine enough that every friction cell holds some.

    Args:
        outline: the underside, in B.
        grid: the friction cells.
        points: about how many; Gauss points as dense along x as along y.
        pressure: where it is not even; the quadrature is then as fine as its cells need too.
    """
    cut = grid if pressure is None else _common(grid, pressure.grid)
    rings = max(3, math.ceil(math.sqrt(points) / 3))
    match outline:
        case Polygon() if _is_rectangle(outline):
            places, weights = _rectangle_points(outline, cut, points)
        case Polygon(convex=False):
            places, weights = _pieced_points(outline, cut, points)
        case _ if cut.size > 1:
            places, weights = _cell_points(outline, cut, math.ceil(math.sqrt(points) / 2))
        case Disc(radius=radius):
            places, weights = _ring_points(lambda _: radius, rings, points)
        case Polygon(vertices=vertices) if len(vertices) <= FEW_CORNERS:
            places, weights = _fan_points(outline, points)
        case Polygon(vertices=vertices):
            places, weights = _rings_in(np.array(vertices), rings, points)
        case _:
            raise TypeError(f"no quadrature for an outline of type {type(outline).__name__}")
    cells = grid.cell_of(places, outline)
    radii = np.sqrt(weights / weights.sum() * _area(as_polygon(outline)) / math.pi)
    polar = float(weights @ (places**2).sum(axis=1) / weights.sum())
    if pressure is not None:
        weights = weights * pressure.factors(places, outline)
        bears = weights > 0.0  # nothing stands where nothing presses
        places, weights, cells, radii = places[bears], weights[bears], cells[bears], radii[bears]
    return Support(points=places, weights=weights / weights.sum(), cells=cells, radii=radii, polar=polar)


def _common(first: FrictionGrid, second: FrictionGrid) -> FrictionGrid:
    """The coarsest grid whose cells lie within those of both."""
    return FrictionGrid(nx=math.lcm(first.nx, second.nx), ny=math.lcm(first.ny, second.ny))


def _pieced_points(polygon: Polygon, cut: FrictionGrid, points: int) -> tuple[Array, Array]:
    """A rule for each convex piece of an outline with notches, each with its share of the points."""
    pieces = [Polygon([(x, y) for x, y in piece.tolist()]) for piece in convex_pieces(polygon.vertices)]
    areas = [_area(np.array(piece.vertices)) for piece in pieces]
    made = []
    for piece, area in zip(pieces, areas, strict=True):
        share = math.ceil(points * area / sum(areas))
        if cut.size > 1:
            made.append(_cell_points(polygon, cut, math.ceil(math.sqrt(points) / 2), np.array(piece.vertices)))
        else:
            made.append(_fan_points(piece, share))
    return np.concatenate([places for places, _ in made]), np.concatenate([weights for _, weights in made])


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


def _rectangle_points(polygon: Polygon, grid: FrictionGrid, points: int) -> tuple[Array, Array]:
    x0, y0, x1, y1 = polygon.extent()
    slender = (x1 - x0) / (y1 - y0)
    along_x, along_y = round(math.sqrt(points * slender)), round(math.sqrt(points / slender))
    # One point across a cell would be the midpoint rule again.
    x, wx = _composite_gauss(x0, x1, grid.nx, max(2, math.ceil(along_x / grid.nx)))
    y, wy = _composite_gauss(y0, y1, grid.ny, max(2, math.ceil(along_y / grid.ny)))
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    return places, np.outer(wx, wy).ravel()


def _radial_gauss(order: int) -> tuple[Array, Array]:
    """Gauss nodes in [0, 1] for the weight r dr (Gauss-Jacobi), weights summing to 1: exact for torsion.

    Source: A. H. Stroud, Approximate Calculation of Multiple Integrals, 1971, chapter 2.
    """
    x, w = roots_jacobi(order, 0.0, 1.0)
    return np.asarray(0.5 * (x + 1.0)), np.asarray(w / w.sum())


def _ring_points(reach: Callable[[float], float], rings: int, points: int) -> tuple[Array, Array]:
    """Gauss in r with weight r, times angles that part equal areas: points about as dense everywhere.

    Where slip turns about a place in the base, that does better than as many points on each ring. Equal areas make
    the rule of an ellipse that of a disc, stretched, and converge as fast. Even numbers make a disc's rule the same
    mirrored.

    Args:
        reach: distance [m] from Bo to the smooth outline in a direction [rad].
        rings: their number.
        points: about how many on all of them.
    """
    r, wr = _radial_gauss(rings)
    counts = [2 * max(2, round(0.5 * points * share)) for share in (r / r.sum()).tolist()]
    angles = np.linspace(0.0, 2.0 * math.pi, SECTORS + 1)
    squares = np.array([reach(float(angle)) for angle in angles]) ** 2
    swept = np.concatenate([[0.0], np.cumsum(squares[1:] + squares[:-1])])
    places, weights = [], []
    for k, count in enumerate(counts):
        phi = np.interp((np.arange(count) + 0.5 * (k % 2)) / count * swept[-1], swept, angles)
        far = r[k] * np.array([reach(float(angle)) for angle in phi])
        places.append(far[:, None] * np.column_stack([np.cos(phi), np.sin(phi)]))
        weights.append(np.full(count, wr[k] / count))
    return np.concatenate(places), np.concatenate(weights)


def _rings_in(vertices: Array, rings: int, points: int) -> tuple[Array, Array]:
    """Rings about a polygon's centroid, stretched by what its corners take from its second moments."""
    centre = polygon_centroid(vertices)
    about = vertices - centre
    places, weights = _ring_points(Polygon([(x, y) for x, y in about.tolist()]).reach, rings, points)
    middle = weights @ places / weights.sum()
    xx, xy, yy = second_moments(about)
    rule = (weights * (places - middle).T) @ (places - middle) / weights.sum()
    stretch = sqrtm(np.linalg.inv(rule)) @ sqrtm(np.array([[xx, xy], [xy, yy]]))
    return centre + (places - middle) @ stretch, weights


def _fan_points(polygon: Polygon, points: int) -> tuple[Array, Array]:
    """A Gauss rule on each triangle of the fan about the centroid, with more points along the edge the further out.

    As Duffy's, which collapses a square (Quadrature over a pyramid or cube of integrands with a singularity at a
    vertex, 1982), without as many points about the centroid.
    """
    vertices = np.array(polygon.vertices)
    rows = [2, 2, 3]
    while len(vertices) * sum(rows) < ABOUT * points:
        rows.append(rows[-1] + 1)
    u, wu = _radial_gauss(len(rows))
    along = [_composite_gauss(0.0, 1.0, 1, row) for row in rows]
    centre = polygon_centroid(vertices)
    places, weights = [], []
    for a, b in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
        area = 0.5 * abs((a - centre)[0] * (b - centre)[1] - (a - centre)[1] * (b - centre)[0])
        for reach, share, (v, wv) in zip(u.tolist(), wu.tolist(), along, strict=True):
            places.append(centre + reach * (a + v[:, None] * (b - a) - centre))
            weights.append(area * share * wv)
    return np.concatenate(places), np.concatenate(weights)


def _cell_points(outline: Outline, grid: FrictionGrid, fewest: int, part: Array | None = None) -> tuple[Array, Array]:
    """Four points in each piece of the outline that a friction cell cuts out: exact to second moments.

    Args:
        outline: the underside.
        grid: friction cells.
        fewest: pieces along a side; coarser friction cells are cut again.
        part: a convex part of the underside, which alone counts.
    """
    x0, y0, x1, y1 = outline.extent()
    nx, ny = (n * math.ceil(fewest / n) for n in (grid.nx, grid.ny))
    xs, ys = np.linspace(x0, x1, nx + 1), np.linspace(y0, y1, ny + 1)
    whole = as_polygon(outline) if part is None else part
    points, weights = [], []
    for i in range(nx):
        for j in range(ny):
            piece = clipped(whole, (xs[i], ys[j], xs[i + 1], ys[j + 1]))
            if len(piece) >= 3 and _area(piece) > 1e-6 * _area(whole):
                points.append(_moment_points(piece))
                weights.append(np.full(4, 0.25 * _area(piece)))
    return np.concatenate(points), np.concatenate(weights)


def _moment_points(vertices: Array) -> Array:
    """Four points (4, 2) that share a polygon's centroid and second moments, on its principal axes."""
    centre = polygon_centroid(vertices)
    xx, xy, yy = second_moments(vertices - centre)
    values, axes = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
    # A hair inside: in a triangle the points would lie on its edge, where the next friction cell begins.
    arms = (1.0 - 1e-9) * (np.sqrt(2.0 * np.maximum(values, 0.0)) * axes).T
    return np.concatenate([centre + arms, centre - arms])


def second_moments(vertices: Array) -> tuple[float, float, float]:
    """Means of x^2, x y and y^2 over a polygon's area (Green's theorem); vertices (n, 2) counter-clockwise."""
    a, b = vertices, np.roll(vertices, -1, axis=0)
    cross = a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]
    total = 12.0 * 0.5 * cross.sum()
    xx = float((cross * (a[:, 0] ** 2 + a[:, 0] * b[:, 0] + b[:, 0] ** 2)).sum() / total)
    yy = float((cross * (a[:, 1] ** 2 + a[:, 1] * b[:, 1] + b[:, 1] ** 2)).sum() / total)
    mixed = a[:, 0] * b[:, 1] + 2.0 * a[:, 0] * a[:, 1] + 2.0 * b[:, 0] * b[:, 1] + b[:, 0] * a[:, 1]
    return xx, float((cross * mixed).sum() / (2.0 * total)), yy


def as_polygon(outline: Outline) -> Array:
    """Vertices (n, 2); a disc as 64 corners that enclose its area."""
    if isinstance(outline, Polygon):
        return np.array(outline.vertices)
    assert isinstance(outline, Disc)
    phi = 2.0 * math.pi * np.arange(64) / 64
    radius = outline.radius * math.sqrt(2.0 * math.pi / 64 / math.sin(2.0 * math.pi / 64))
    return radius * np.column_stack([np.cos(phi), np.sin(phi)])


def clipped(vertices: Array, window: tuple[float, float, float, float]) -> Array:
    """A convex polygon cut to a window x0, y0, x1, y1 (Sutherland and Hodgman, 1974)."""
    x0, y0, x1, y1 = window
    for axis, limit, sign in ((0, x0, 1.0), (0, x1, -1.0), (1, y0, 1.0), (1, y1, -1.0)):
        inside = sign * (vertices[:, axis] - limit)
        kept = []
        for k in range(len(vertices)):
            a, b, da, db = vertices[k - 1], vertices[k], inside[k - 1], inside[k]
            if da * db < 0.0:
                kept.append(a + da / (da - db) * (b - a))
            if db >= 0.0:
                kept.append(b)
        vertices = np.array(kept).reshape(-1, 2)
        if not len(vertices):
            break
    return vertices


def _area(vertices: Array) -> float:
    following = np.roll(vertices, -1, axis=0)
    return 0.5 * abs(float((vertices[:, 0] * following[:, 1] - vertices[:, 1] * following[:, 0]).sum()))


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
        TippedError: if the centre of mass is not above the base.
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
    raise TippedError(
        f"the centre of mass must lie above the base, not at ({p_BBcm[0]:.4g}, {p_BBcm[1]:.4g}) m in B."
    )
