"""Shapes of objects that stand on the table: extent, outline, moments of the underside. SI units."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from physid_drake.recording import Box, Cylinder, Prism, outline_distance

Array: TypeAlias = npt.NDArray[np.float64]
Solid: TypeAlias = Box | Cylinder | Prism


def plan_size(shape: Solid) -> tuple[float, float]:
    """Extent of the outline along x and y of B [m]."""
    if isinstance(shape, Box):
        return shape.size[0], shape.size[1]
    if isinstance(shape, Cylinder):
        return 2.0 * shape.radius, 2.0 * shape.radius
    spans = np.ptp(np.array(shape.polygon), axis=0)
    return float(spans[0]), float(spans[1])


def height_of(shape: Solid) -> float:
    """Along z [m]."""
    if isinstance(shape, Box):
        return shape.size[2]
    return shape.length if isinstance(shape, Cylinder) else shape.height


def outline_of(shape: Box | Prism) -> Array:
    """Corners (n, 2) in B, counter-clockwise [m]."""
    if isinstance(shape, Prism):
        return np.array(shape.polygon)
    x, y = shape.size[0] / 2.0, shape.size[1] / 2.0
    return np.array([[-x, -y], [x, -y], [x, y], [-x, y]])


def stretched(shape: Solid, ratio: float) -> Solid:
    """The shape with its plan ``ratio`` times as large, at the same height."""
    if isinstance(shape, Box):
        return Box(size=(shape.size[0] * ratio, shape.size[1] * ratio, shape.size[2]))
    if isinstance(shape, Cylinder):
        return Cylinder(radius=shape.radius * ratio, length=shape.length, axis="z")
    polygon = tuple((x * ratio, y * ratio) for x, y in shape.polygon)
    return Prism(polygon=polygon, height=shape.height)


def plan_moments(shape: Solid) -> Array:
    """Mean of x x, y y and x y over the underside (3,) [m^2]."""
    if isinstance(shape, Cylinder):
        return np.array([1.0, 1.0, 0.0]) * shape.radius**2 / 4.0
    corners = outline_of(shape)
    following = np.roll(corners, -1, axis=0)
    areas = (corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0]) / 2.0
    # Over a triangle with one corner at 0: the mean of u v is (sum u_i v_i + sum u sum v) / 12.
    total = corners + following
    squares = corners**2 + following**2 + total**2
    cross = corners.prod(axis=1) + following.prod(axis=1) + total.prod(axis=1)
    means = np.column_stack([squares, cross]) / 12.0
    moments: Array = areas @ means / areas.sum()
    return moments


def gyration_squared(shape: Solid) -> float:
    """Of a uniform density about z [m^2]."""
    return float(plan_moments(shape)[:2].sum())


def distance_outside(shape: Solid, points: Array) -> Array:
    """Distance (n,) of points (n, 2) in B from the outline, negative inside [m]."""
    if isinstance(shape, Cylinder):
        distances: Array = np.hypot(*points.T) - shape.radius
        return distances
    return outline_distance(outline_of(shape), points)


def nearest_face(shape: Prism, x: float, y: float) -> tuple[float, float, float]:
    """Distance of a point in B from the outline of a prism with notches [m], and the outward normal of that face."""
    best, normal = math.inf, (1.0, 0.0)
    corners = shape.polygon
    for (ax, ay), (bx, by) in zip(corners, (*corners[1:], corners[0]), strict=True):
        length = math.hypot(bx - ax, by - ay)
        tx, ty = (bx - ax) / length, (by - ay) / length
        along = min(max((x - ax) * tx + (y - ay) * ty, 0.0), length)
        distance = math.hypot(x - ax - along * tx, y - ay - along * ty)
        if distance < best:
            best, normal = distance, (ty, -tx)
    return best, *normal


def half_planes(shape: Solid) -> tuple[list[tuple[float, float, float]], float]:
    """Outward normals and offsets of a polygon's faces (none of a disc), and the greatest radius [m]."""
    if isinstance(shape, Cylinder):
        return [], shape.radius
    corners = outline_of(shape)
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([edges[:, 1], -edges[:, 0]]) / np.hypot(*edges.T)[:, None]
    offsets = (normals * corners).sum(axis=1)
    rows = np.column_stack([normals, offsets]).tolist()
    return [(nx, ny, offset) for nx, ny, offset in rows], float(np.hypot(*corners.T).max())
