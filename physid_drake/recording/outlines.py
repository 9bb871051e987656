"""Planar geometry of an object's outline: convexity, area centroid, distance of a point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from physid_drake.errors import RecordingError
from physid_drake.recording.limits import check_lengths

CENTROID_TOLERANCE: Final = 1e-4
"""A prism's centroid may be this far from the origin of B, in m."""


def polygon_centroid(polygon: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Area centroid (2,) in m of a simple polygon (n, 2) in m."""
    vertices = np.asarray(polygon, dtype=np.float64)
    following = np.roll(vertices, -1, axis=0)
    cross = vertices[:, 0] * following[:, 1] - vertices[:, 1] * following[:, 0]
    centroid: npt.NDArray[np.float64] = ((vertices + following) * cross[:, None]).sum(axis=0) / (3.0 * cross.sum())
    return centroid


def check_polygon(polygon: Sequence[Sequence[float]]) -> None:
    """Refuses a polygon that is not convex and counter-clockwise about its centroid.

    Args:
        polygon: vertices (n, 2) in m.

    Raises:
        RecordingError: naming the rule, what was got and what to do.
    """
    vertices = np.asarray(polygon, dtype=np.float64)
    if vertices.ndim != 2 or vertices.shape[1] != 2 or len(vertices) < 3 or not np.isfinite(vertices).all():
        raise RecordingError(f"polygon_m must be at least three finite [x, y] pairs, but got {len(polygon)} rows.")
    for name, across in zip("xy", np.ptp(np.clip(vertices, -1e9, 1e9), axis=0).tolist(), strict=True):
        check_lengths(f"polygon_m's extent along {name}", across)
    edges = np.roll(vertices, -1, axis=0) - vertices
    following = np.roll(edges, -1, axis=0)
    turns = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    if (turns < 0.0).all():
        raise RecordingError("polygon_m must be counter-clockwise, but it is clockwise; reverse its vertices.")
    headings = np.arctan2(turns, (edges * following).sum(axis=1))
    # A star also turns left at every vertex, but goes round more than once.
    if (turns <= 0.0).any() or headings.sum() > 3.0 * np.pi:
        corner = (int(np.argmin(turns)) + 1) % len(vertices)
        raise RecordingError(
            f"polygon_m must be convex with no repeated or collinear vertices, but it is not at vertex "
            f"{corner} {vertices[corner].tolist()} m; use its convex hull or a mesh."
        )
    centroid = polygon_centroid(vertices)
    if float(np.hypot(*centroid)) > CENTROID_TOLERANCE:
        raise RecordingError(
            f"polygon_m must have its centroid at the origin of B within {CENTROID_TOLERANCE} m, but it is "
            f"at [{centroid[0]:.6f}, {centroid[1]:.6f}] m; subtract that from every vertex, "
            "and move the recorded poses there: add it, turned by each pose, to each position."
        )


def outline_distance(polygon: npt.ArrayLike, points: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Signed distances (n,) in m of points (n, 2) from a convex polygon (m, 2), negative inside."""
    vertices = np.asarray(polygon, dtype=np.float64)
    queries = np.asarray(points, dtype=np.float64)[:, None, :]
    edges = np.roll(vertices, -1, axis=0) - vertices
    offsets = queries - vertices
    share = np.clip((offsets * edges).sum(-1) / (edges * edges).sum(-1), 0.0, 1.0)
    nearest = np.linalg.norm(offsets - share[..., None] * edges, axis=-1).min(axis=1)
    inside = (edges[:, 0] * offsets[..., 1] - edges[:, 1] * offsets[..., 0] >= 0.0).all(axis=1)
    distances: npt.NDArray[np.float64] = np.where(inside, -nearest, nearest)
    return distances
