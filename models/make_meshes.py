"""Writes the three OBJ files of this folder: ``python models/make_meshes.py``. They are prisms; nothing is copied."""

from __future__ import annotations

import math
from pathlib import Path

import yaml

MODELS = Path(__file__).resolve().parent
ARC_STEP = math.radians(2.0)
REACH_SLAB = (0.0005, 0.0015)  # m above the table top: thin, and clear of it so that the faces do not flicker

Point = tuple[float, float]


def prism(polygon: list[Point], bottom: float, top: float) -> str:
    """Wavefront OBJ of an upright prism on a convex, counter-clockwise polygon; lengths in m."""
    n = len(polygon)
    lines = ["# made by models/make_meshes.py"]
    lines += [f"v {x:.6g} {y:.6g} {z:.6g}" for z in (bottom, top) for x, y in polygon]
    lines += [f"f {1} {i + 1} {i}" for i in range(2, n)]
    lines += [f"f {n + 1} {n + i} {n + i + 1}" for i in range(2, n)]
    for i in range(1, n + 1):
        j = i % n + 1
        lines += [f"f {i} {j} {n + j}", f"f {i} {n + j} {n + i}"]
    return "\n".join(lines) + "\n"


def clipped_disc(centre: Point, radius: float, half_x: float, half_y: float) -> list[Point]:
    """The part of a disc that lies on the table top, as a polygon inscribed in it; m."""
    count = round(2.0 * math.pi / ARC_STEP)
    angles = (2.0 * math.pi * i / count for i in range(count))
    polygon = [(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in angles]
    for axis, sign, limit in ((0, 1.0, half_x), (0, -1.0, half_x), (1, 1.0, half_y), (1, -1.0, half_y)):
        polygon = _clip(polygon, axis, sign, limit)
    return polygon


def _clip(polygon: list[Point], axis: int, sign: float, limit: float) -> list[Point]:
    """Sutherland and Hodgman's clipping at one side of the table."""
    kept: list[Point] = []
    for start, end in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        inside, next_inside = sign * start[axis] <= limit, sign * end[axis] <= limit
        if inside:
            kept.append(start)
        if inside != next_inside:
            share = (limit - sign * start[axis]) / (sign * (end[axis] - start[axis]))
            kept.append((start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])))
    return kept


def meshes() -> dict[str, str]:
    """Text of every OBJ file, by its path relative to this folder."""
    leg, height = 0.150, 0.050
    corner = -leg / 3.0
    triangle = [(corner, corner), (corner + leg, corner), (corner, corner + leg)]
    found = {"objects/cmu_triangle.obj": prism(triangle, -0.5 * height, 0.5 * height)}
    reach = yaml.safe_load((MODELS / "robots" / "reach.yaml").read_text(encoding="utf-8"))
    half_x, half_y = (0.5 * side for side in reach["table"]["size_m"])
    for name, robot in reach["robots"].items():
        x, y = robot["base_m"]
        polygon = clipped_disc((x, y), robot["reach_m"], half_x, half_y)
        found[f"robots/{name}_reach.obj"] = prism(polygon, *REACH_SLAB)
    return found


if __name__ == "__main__":
    for path, text in meshes().items():
        (MODELS / path).write_text(text, encoding="utf-8")
        print(path)
