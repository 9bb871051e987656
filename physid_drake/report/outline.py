"""An object's outline as it is drawn."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.outline import Disc
from physid_drake.cell.outline import Polygon as OutlinePolygon
from physid_drake.cell.solid import solid_of
from physid_drake.errors import CellError
from physid_drake.recording import Shape

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
