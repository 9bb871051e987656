"""An object's outline as it is drawn, and in words."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.outline import Disc
from physid_drake.cell.outline import Polygon as OutlinePolygon
from physid_drake.cell.solid import solid_of
from physid_drake.errors import CellError
from physid_drake.recording import Box, Cylinder, MeshShape, Shape
from physid_drake.wording import named

Array = NDArray[np.float64]


def outline_of(shape: Shape) -> Array | None:
    """Corners (n, 2) of the object seen from above [m]; None where its mesh cannot be read."""
    try:
        outline = solid_of(shape).outline
    except CellError:
        return None
    if isinstance(outline, Disc):
        angles = np.linspace(0.0, 2.0 * math.pi, 40, endpoint=False)
        return np.asarray(outline.radius * np.column_stack([np.cos(angles), np.sin(angles)]))
    return np.array(outline.vertices) if isinstance(outline, OutlinePolygon) else None


def shape_in_words(shape: Shape) -> str:
    """What the cell takes the object for: its kind, the sizes that the hand can touch, and its height."""
    try:
        solid = solid_of(shape)
    except CellError:
        return "a mesh that cannot be read"
    left, front, right, back = solid.outline.extent()
    sizes = f"{1e3 * (right - left):.1f} by {1e3 * (back - front):.1f} mm, {1e3 * solid.height:.1f} mm high"
    if isinstance(shape, Box):
        return f"a box, {sizes}"
    if isinstance(shape, Cylinder):
        return f"a {'standing' if shape.axis == 'z' else 'lying'} cylinder, {sizes}"
    what = f"mesh '{named(shape.file.name)}' as a prism" if isinstance(shape, MeshShape) else "a prism"
    corners = len(solid.outline.vertices) if isinstance(solid.outline, OutlinePolygon) else 0
    return f"{what} of {corners} corners, {sizes}"
