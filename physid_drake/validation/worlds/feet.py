"""Feet under an object: points that carry it, with the moments of its underside and the pressure asked for."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Final

import numpy as np

from physid_drake.recording import Box, Cylinder, Prism, is_convex, outline_distance
from physid_drake.validation.worlds.shapes import Array, Solid, gyration_squared, height_of, outline_of
from physid_drake.validation.worlds.world_plan import Plan

RINGS: Final = 4
_FOOT_APART: Final = 0.0075
"""m between feet under an outline with notches, about: as many feet as under others. Of fewer, the world's own torque
is off by percents as it turns about a place beside one, which a diagnosis sees."""


def weighted_feet(plan: Plan) -> tuple[Array, Array]:
    """Places (n, 2) in B [m] and stiffness shares (n,) of the feet; those without weight are left out."""
    feet, weights = feet_of(plan.shape)
    if plan.pressure is None:
        return feet, weights
    grid = np.array(plan.pressure)
    if isinstance(plan.shape, Cylinder):
        low, high = np.outer([-1.0, 1.0], [plan.shape.radius] * 2)
    else:
        corners = outline_of(plan.shape)
        low, high = corners.min(axis=0), corners.max(axis=0)
    cells = np.clip(((feet - low) / (high - low) * grid.shape).astype(int), 0, np.array(grid.shape) - 1)
    weights = weights * grid[cells[:, 0], cells[:, 1]]
    keep = weights > 1e-6 * weights.max()
    return feet[keep], weights[keep] / weights[keep].sum()


def feet_of(shape: Solid) -> tuple[Array, Array]:
    """Places (n, 2) in B [m] and shares (n,) of a uniform pressure; their second moments are the underside's."""
    if isinstance(shape, Box):
        return _grid_feet(shape)
    if isinstance(shape, Cylinder):
        return _ring_feet(shape.radius)
    return _triangle_feet(shape)


def friction_that_lifts(shape: Solid) -> float:
    """Least friction that lifts an edge of a uniform object pushed at half its height, or sliding."""
    feet, weights = feet_of(shape)
    spread = np.linalg.inv((feet * weights[:, None]).T @ feet)
    return 1.0 / (height_of(shape) / 2.0 * float(np.linalg.norm(feet @ spread, axis=1).max()))


def stays_loaded(plan: Plan) -> bool:
    """Whether every foot carries weight, at rest and sliding any way."""
    feet, weights = weighted_feet(plan)
    columns = np.column_stack([np.ones(len(feet)), feet])
    moments = (columns * weights[:, None]).T @ columns
    if np.linalg.cond(moments) > 1e12:
        return False
    shift = 1.05 * plan.support_friction * height_of(plan.shape) / 2.0
    ways = [(math.cos(a), math.sin(a)) for a in np.linspace(0.0, 2.0 * math.pi, 12, endpoint=False).tolist()]
    centres = np.array([[1.0, plan.com[0] + shift * c, plan.com[1] + shift * s] for c, s in ways])
    return bool((columns @ np.linalg.solve(moments, centres.T)).min() > 0.0)


def _grid_feet(shape: Box) -> tuple[Array, Array]:
    long_side = shape.size[0] / shape.size[1]
    nx = min(15, max(5, round(math.sqrt(80.0 * long_side))))
    ny = max(5, math.ceil(72 / nx))
    # Middles of cells have 1 - 1/n^2 of the second moment; spreading them out restores it.
    x, y = (
        ((np.arange(n) + 0.5) / n - 0.5) * side / math.sqrt(1.0 - 1.0 / n**2)
        for n, side in ((nx, shape.size[0]), (ny, shape.size[1]))
    )
    grid = np.meshgrid(x, y, indexing="ij")
    return np.column_stack([axis.ravel() for axis in grid]), np.full(nx * ny, 1.0 / (nx * ny))


def _ring_feet(radius: float) -> tuple[Array, Array]:
    counts = 6 * np.arange(1, RINGS + 1)
    edges = np.sqrt(np.concatenate([[0], np.cumsum(counts)]) / counts.sum()) * radius
    places = []
    for ring, count in enumerate(counts.tolist()):
        middle = math.sqrt((edges[ring] ** 2 + edges[ring + 1] ** 2) / 2.0)
        angles = 2.0 * math.pi * (np.arange(count) + 0.5 * (ring % 2)) / count
        places.append(middle * np.column_stack([np.cos(angles), np.sin(angles)]))
    return np.concatenate(places), np.full(counts.sum(), 1.0 / counts.sum())


def _triangle_feet(shape: Prism) -> tuple[Array, Array]:
    corners = outline_of(shape)
    if not is_convex(corners):
        return _pieced_feet(shape)
    parts = math.ceil(math.sqrt(72 / len(corners)))
    places, shares = [], []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        area = (a[0] * b[1] - a[1] * b[0]) / 2.0
        for i in range(parts):
            for j in range(parts - i):
                # The upright and the inverted small triangle of one cell of the subdivision.
                thirds = [1.0 / 3.0, 2.0 / 3.0][: 2 if i + j < parts - 1 else 1]
                places += [((i + t) * a + (j + t) * b) / parts for t in thirds]
                shares += [area / parts**2] * len(thirds)
    feet, weights = np.array(places), np.array(shares) / np.sum(shares)
    lacking = gyration_squared(shape) / float(weights @ (feet**2).sum(axis=1))
    return feet * math.sqrt(lacking), weights


def _pieced_feet(shape: Prism) -> tuple[Array, Array]:
    """A grid in each rectangle that the lines through the corners cut out of an outline with right angles."""
    corners = outline_of(shape)
    xs, ys = np.unique(corners[:, 0]), np.unique(corners[:, 1])
    places, shares = [], []
    for x0, x1 in pairwise(xs.tolist()):
        for y0, y1 in pairwise(ys.tolist()):
            middle = np.array([[0.5 * (x0 + x1), 0.5 * (y0 + y1)]])
            if outline_distance(corners, middle)[0] < 0.0:
                feet = middle + _spread_grid(x1 - x0, y1 - y0, _FOOT_APART)
                places.append(feet)
                shares.append(np.full(len(feet), (x1 - x0) * (y1 - y0) / len(feet)))
    weights = np.concatenate(shares)
    return np.concatenate(places), weights / weights.sum()


def _spread_grid(length_x: float, length_y: float, apart: float) -> Array:
    """Middles of cells of a rectangle, spread so that their second moments are its own."""
    axes = []
    for side in (length_x, length_y):
        n = max(2, round(side / apart))
        axes.append(((np.arange(n) + 0.5) / n - 0.5) * side / math.sqrt(1.0 - 1.0 / n**2))
    return np.column_stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")])
