"""The object seen from above: its outline, and how near a round hand tip is to it.

Everything here is plain floats, since the rollout asks once per time step and numpy's overhead on
two-vectors would cost more than Drake's own step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from physid_drake.recording import is_convex

Point = tuple[float, float]


class Outline(Protocol):
    """An outline in the object's frame B."""

    def nearest(self, x: float, y: float) -> tuple[float, float, float]:
        """Signed distance from the point (x, y) [m] to the outline, and the outward unit normal there.

        Returns:
            ``(distance, normal_x, normal_y)``; the distance is negative inside.
        """
        ...

    def extent(self) -> tuple[float, float, float, float]:
        """Bounding box ``(x_min, y_min, x_max, y_max)`` [m]."""
        ...


@dataclass(frozen=True, kw_only=True)
class Disc:
    """A circle about Bo."""

    radius: float

    def nearest(self, x: float, y: float) -> tuple[float, float, float]:
        """Signed distance [m] and outward normal."""
        r = math.hypot(x, y)
        if r == 0.0:
            return -self.radius, 1.0, 0.0
        return r - self.radius, x / r, y / r

    def extent(self) -> tuple[float, float, float, float]:
        """Bounding box [m]."""
        r = self.radius
        return -r, -r, r, r


class Polygon:
    """A simple polygon, counter-clockwise; it may have notches."""

    def __init__(self, vertices: Sequence[Point]) -> None:
        self.vertices: tuple[Point, ...] = tuple((float(x), float(y)) for x, y in vertices)
        edges = []
        for (ax, ay), (bx, by) in zip(self.vertices, self.vertices[1:] + self.vertices[:1], strict=True):
            length = math.hypot(bx - ax, by - ay)
            tx, ty = (bx - ax) / length, (by - ay) / length
            edges.append((ax, ay, tx, ty, ty, -tx, length))
        self._edges = tuple(edges)
        self.convex = is_convex(self.vertices)

    def nearest(self, x: float, y: float) -> tuple[float, float, float]:
        """Signed distance [m] and outward normal; at a corner the normal points from the corner."""
        if not self.convex:
            return self._nearest_of_all(x, y)
        best = -math.inf
        for edge in self._edges:
            height = (x - edge[0]) * edge[4] + (y - edge[1]) * edge[5]
            if height > best:
                best, face = height, edge
        ax, ay, tx, ty, nx, ny, length = face
        along = (x - ax) * tx + (y - ay) * ty
        if best <= 0.0 or 0.0 <= along <= length:
            return best, nx, ny
        # Beyond the end of the most separated face a corner is nearest: no face can be nearer than its height.
        return min(self._corner(x, y, vertex) for vertex in self.vertices)

    def _nearest_of_all(self, x: float, y: float) -> tuple[float, float, float]:
        """The same of an outline with notches: every edge is asked, and a ray along x says whether it is inside."""
        best, inside = math.inf, False
        for ax, ay, tx, ty, nx, ny, length in self._edges:
            along = min(max((x - ax) * tx + (y - ay) * ty, 0.0), length)
            dx, dy = x - ax - along * tx, y - ay - along * ty
            r = math.hypot(dx, dy)
            if r < best:
                best, away = r, (dx / r, dy / r) if r > 0.0 else (nx, ny)
            by = ay + ty * length
            if (ay > y) != (by > y) and x < ax + tx * (y - ay) / ty:
                inside = not inside
        return (-best, -away[0], -away[1]) if inside else (best, *away)

    def reach(self, angle: float) -> float:
        """Distance [m] from Bo, which must lie inside, to a convex outline in a direction [rad]."""
        x, y = math.cos(angle), math.sin(angle)
        ahead = [(edge, x * edge[4] + y * edge[5]) for edge in self._edges]
        return min((edge[0] * edge[4] + edge[1] * edge[5]) / speed for edge, speed in ahead if speed > 1e-12)

    @staticmethod
    def _corner(x: float, y: float, vertex: Point) -> tuple[float, float, float]:
        dx, dy = x - vertex[0], y - vertex[1]
        r = math.hypot(dx, dy)
        return (r, dx / r, dy / r) if r > 0.0 else (0.0, 1.0, 0.0)

    def extent(self) -> tuple[float, float, float, float]:
        """Bounding box [m]."""
        xs = [x for x, _ in self.vertices]
        ys = [y for _, y in self.vertices]
        return min(xs), min(ys), max(xs), max(ys)


def rectangle(length_x: float, length_y: float) -> Polygon:
    """The outline of a box, centred on Bo; lengths in m."""
    x, y = 0.5 * length_x, 0.5 * length_y
    return Polygon([(-x, -y), (x, -y), (x, y), (-x, y)])
