"""The outline of a mesh that is an upright prism, with its notches."""

from __future__ import annotations

from collections import Counter
from typing import Final

import numpy as np
import numpy.typing as npt

from physid_drake.errors import RecordingError
from physid_drake.recording.obj import THINNEST, ObjMesh
from physid_drake.recording.outlines import MOST_CORNERS, check_polygon, polygon_centroid, without_straight
from physid_drake.recording.values import Array

ALIKE: Final = 0.03
"""Of its volume: a solid that differs by more from outline times height is no prism."""


def prism_outline(mesh: ObjMesh, scale: float) -> Array | None:
    """Outline (n, 2) [m] of a mesh that is an upright prism, counter-clockwise; None where it is none.

    It is the border of the mesh's top, whose edges belong to one triangle of the top only. It may have notches, but
    no hole. A mesh with rounded edges, with a surface that is open, or with an outline of more than ``MOST_CORNERS``
    corners is taken for no prism.

    Args:
        mesh: of which z is up.
        scale: turns its numbers into m.
    """
    if not len(mesh.triangles):
        return None
    welded, index = np.unique(scale * mesh.vertices, axis=0, return_inverse=True)
    triangles = np.ravel(index)[mesh.triangles]
    low, high = float(welded[:, 2].min()), float(welded[:, 2].max())
    border = _border(triangles[(welded[triangles][:, :, 2] > high - THINNEST).all(axis=1)])
    if border is None:
        return None
    outline = without_straight(welded[border, :2])
    if not 3 <= len(outline) <= MOST_CORNERS:
        return None
    volume = float(np.linalg.det(welded[triangles] - welded.mean(axis=0)).sum()) / 6.0
    filled = _area(outline) * (high - low)
    if not abs(volume - filled) < ALIKE * filled:
        return None
    try:
        check_polygon((outline - polygon_centroid(outline)).tolist())
    except RecordingError:
        return None
    return outline


def _border(triangles: npt.NDArray[np.int64]) -> list[int] | None:
    """Vertices round a surface, by its edges that no second triangle has; None where these are not one ring."""
    edges = Counter((int(a), int(b)) for face in triangles for a, b in zip(face, np.roll(face, -1), strict=True))
    single = [(a, b) for a, b in edges if (b, a) not in edges]
    following = dict(single)
    if not single or max(edges.values()) > 1 or len(following) != len(single):
        return None
    ring = [single[0][0]]
    while (ahead := following.get(ring[-1], ring[0])) != ring[0]:
        if len(ring) == len(single):
            return None
        ring.append(ahead)
    return ring if len(ring) == len(single) else None


def _area(ring: Array) -> float:
    """Signed [m^2], positive of a ring that goes round counter-clockwise."""
    following = np.roll(ring, -1, axis=0)
    return 0.5 * float((ring[:, 0] * following[:, 1] - ring[:, 1] * following[:, 0]).sum())
