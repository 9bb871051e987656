"""What the cell needs to know of an object's shape: outline, underside, height, inertia, Drake geometry."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydrake.common import MemoryFile
from pydrake.geometry import Box as DrakeBox
from pydrake.geometry import Convex, InMemoryMesh, Mesh, Shape
from pydrake.geometry import Cylinder as DrakeCylinder
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.tree import CalcSpatialInertia, SpatialInertia
from scipy.spatial import ConvexHull, QhullError

from physid_drake.cell.outline import Disc, Outline, Polygon, rectangle
from physid_drake.cell.support import second_moments
from physid_drake.errors import CellError, RecordingError
from physid_drake.recording import Box, Cylinder, MeshShape, Prism, convex_pieces
from physid_drake.recording import Shape as RecordedShape
from physid_drake.recording.mesh_outline import prism_outline
from physid_drake.recording.obj import ObjMesh, check_solid, read_obj
from physid_drake.wording import named

Array = NDArray[np.float64]
FACE_THICKNESS = 2e-4  # m: how far a prism's colliding faces reach inward; at acute corners they end so early


@dataclass(frozen=True, kw_only=True)
class Solid:
    """An object of uniform density, seen by the cell.

    Attributes:
        outline: what the hand touches, from above, in B.
        underside: what stands on the table, in B; the axis' rectangle for a lying cylinder.
        height: m; the underside is at z = -height / 2 in B.
        gyration: (3,) squared radii of gyration about Bo's axes x, y, z [m^2].
        rolling_radius: m for a lying cylinder (axis along y of B), else None.
        faces: Drake shapes and poses ``X_BG`` that collide with the hand.
        visual: Drake shapes and poses that are only seen.
    """

    outline: Outline
    underside: Outline
    height: float
    gyration: tuple[float, float, float]
    rolling_radius: float | None
    faces: tuple[tuple[Shape, RigidTransform], ...]
    visual: tuple[tuple[Shape, RigidTransform], ...]


def solid_of(shape: RecordedShape) -> Solid:
    """The solid for a recorded shape.

    Raises:
        CellError: if a mesh cannot be read or has no volume.
    """
    match shape:
        case Box():
            return _box(shape)
        case Cylinder(axis="z"):
            return _standing_cylinder(shape)
        case Cylinder():
            return _lying_cylinder(shape)
        case Prism():
            return _prism(shape)
        case MeshShape():
            return _mesh(shape)
    raise CellError(f"no solid for a shape of type {type(shape).__name__}")


def _box(shape: Box) -> Solid:
    x, y, z = shape.size
    body = ((DrakeBox(x, y, z), RigidTransform()),)
    outline = rectangle(x, y)
    squares = ((y * y + z * z) / 12.0, (x * x + z * z) / 12.0, (x * x + y * y) / 12.0)
    return Solid(outline=outline, underside=outline, height=z, gyration=squares, rolling_radius=None,
                 faces=body, visual=body)  # fmt: skip


def _standing_cylinder(shape: Cylinder) -> Solid:
    r, length = shape.radius, shape.length
    body = ((DrakeCylinder(r, length), RigidTransform()),)
    outline = Disc(radius=r)
    across = (3.0 * r * r + length * length) / 12.0
    return Solid(outline=outline, underside=outline, height=length, gyration=(across, across, 0.5 * r * r),
                 rolling_radius=None, faces=body, visual=body)  # fmt: skip


def _lying_cylinder(shape: Cylinder) -> Solid:
    r, length = shape.radius, shape.length
    body = ((DrakeCylinder(r, length), RigidTransform(RollPitchYaw(0.5 * math.pi, 0.0, 0.0), np.zeros(3))),)
    outline = rectangle(2.0 * r, length)
    across = (3.0 * r * r + length * length) / 12.0
    return Solid(outline=outline, underside=outline, height=2.0 * r, gyration=(across, 0.5 * r * r, across),
                 rolling_radius=r, faces=body, visual=body)  # fmt: skip


def _prism(shape: Prism) -> Solid:
    polygon = Polygon(shape.polygon)
    iyy, _, ixx = second_moments(np.array(shape.polygon))
    z2 = shape.height**2 / 12.0
    pieces = [Polygon([(x, y) for x, y in piece.tolist()]) for piece in convex_pieces(shape.polygon)]
    look = tuple((_convex_prism(piece, shape.height), RigidTransform()) for piece in pieces)
    return Solid(outline=polygon, underside=polygon, height=shape.height, gyration=(ixx + z2, iyy + z2, ixx + iyy),
                 rolling_radius=None, faces=_polygon_faces(polygon, shape.height), visual=look)  # fmt: skip


def _polygon_faces(polygon: Polygon, height: float) -> tuple[tuple[Shape, RigidTransform], ...]:
    """Thin boxes along the edges: Drake's sphere against a box is exact, against a Convex it is iterative."""
    faces = []
    count = len(polygon.vertices)
    for i in range(count):
        (ax, ay), (bx, by) = polygon.vertices[i], polygon.vertices[(i + 1) % count]
        length = math.hypot(bx - ax, by - ay)
        tx, ty = (bx - ax) / length, (by - ay) / length
        thickness = min(FACE_THICKNESS, 0.2 * _inradius(polygon))
        # At an acute corner the box would stick out through the next face, so it ends earlier there.
        start = thickness * _overhang(polygon, i)
        end = thickness * _overhang(polygon, (i + 1) % count)
        middle = 0.5 * (start + length - end)
        centre = np.array([ax + tx * middle - ty * 0.5 * thickness, ay + ty * middle + tx * 0.5 * thickness, 0.0])
        box = DrakeBox(length - start - end, thickness, height)
        faces.append((box, RigidTransform(RollPitchYaw(0.0, 0.0, math.atan2(ty, tx)), centre)))
    return tuple(faces)


def _overhang(polygon: Polygon, corner: int) -> float:
    """By how much of its thickness a face must end before this corner: the cotangent of an acute angle."""
    vertices = np.array(polygon.vertices)
    to_previous = vertices[corner - 1] - vertices[corner]
    to_next = vertices[(corner + 1) % len(vertices)] - vertices[corner]
    cosine = float(to_previous @ to_next)
    sine = abs(float(to_previous[0] * to_next[1] - to_previous[1] * to_next[0]))
    return max(0.0, cosine / sine)


def _inradius(polygon: Polygon) -> float:
    """Of the largest circle about Bo inside; of an outline with notches, in which Bo may be outside, its thinnest."""
    if polygon.convex:
        return -polygon.nearest(0.0, 0.0)[0]
    edges = np.roll(np.array(polygon.vertices), -1, axis=0) - np.array(polygon.vertices)
    return 0.5 * float(np.linalg.norm(edges, axis=1).min())


def _convex_prism(polygon: Polygon, height: float) -> Convex:
    points = [(x, y, z) for z in (-0.5 * height, 0.5 * height) for x, y in polygon.vertices]
    return Convex(np.array(points).T, label="prism")


def _mesh(shape: MeshShape) -> Solid:
    """From what was parsed, and never from the path: Drake and Meshcat would follow what the file names."""
    try:
        parsed = read_obj(shape.file)
        check_solid(parsed, shape.scale, shape.file)
    except RecordingError as error:
        raise CellError(str(error)) from error
    vertices = shape.scale * parsed.vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    height = float(high[2] - low[2])
    surface = _surface(parsed, shape.scale)
    centroid, gyration = _volume(shape, vertices, surface)
    middle = np.array([centroid[0], centroid[1], 0.5 * (low[2] + high[2])])
    centred = vertices - middle
    prism = prism_outline(parsed, shape.scale)
    if prism is not None:
        outline = underside = Polygon([(x, y) for x, y in (prism - middle[:2]).tolist()])
    else:
        outline = _hull(centred[:, :2], shape.file)
        standing = centred[centred[:, 2] < -0.5 * height + max(1e-4, 0.01 * height)]
        underside = _hull(standing[:, :2], shape.file)
    look = surface or Convex(vertices.T, label=shape.file.stem)
    visual = ((look, RigidTransform(-middle)),)
    return Solid(outline=outline, underside=underside, height=height, gyration=gyration,
                 rolling_radius=None, faces=_polygon_faces(outline, height), visual=visual)  # fmt: skip


def _surface(parsed: ObjMesh, scale: float) -> Mesh | None:
    """The mesh in Drake, in memory; None where it has no faces."""
    if not len(parsed.triangles):
        return None
    return Mesh(mesh_data=InMemoryMesh(mesh_file=MemoryFile(parsed.text(), ".obj", "object")), scale=scale)


def _volume(shape: MeshShape, vertices: Array, surface: Mesh | None) -> tuple[Array, tuple[float, float, float]]:
    """Centroid (3,) [m] of a mesh's volume, and the squared radii of gyration about it [m^2].

    Of its convex hull where its surface does not enclose a volume.
    """
    hull = _inertia(Convex(vertices.T, label=shape.file.stem))
    mesh = None if surface is None else _inertia(surface)
    if hull is None:
        raise CellError(f"mesh '{named(shape.file)}' has no volume: its vertices lie in a plane.")
    # A solid fills some of its hull; a surface with holes, or wound both ways, has a meaningless volume.
    found = mesh if mesh is not None and _is_within(mesh, hull.get_mass(), vertices) else hull
    x, y, z = found.Shift(found.get_com()).get_unit_inertia().get_moments().tolist()
    return np.asarray(found.get_com(), dtype=np.float64), (x, y, z)


def _is_within(mesh: SpatialInertia, most: float, vertices: Array) -> bool:
    """Whether a mesh's volume, for which its mass stands, and its centroid can be those of its vertices' solid."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    inside = np.all((mesh.get_com() > low) & (mesh.get_com() < high))
    return bool(inside and 0.02 * most < mesh.get_mass() < 1.001 * most)


def _inertia(shape: Shape) -> SpatialInertia | None:
    """Of a solid of density 1 [kg/m^3], about its origin; None where Drake finds none."""
    try:
        return CalcSpatialInertia(shape, 1.0)
    except (RuntimeError, ValueError):
        return None


def _hull(points: Array, file: Path) -> Polygon:
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError) as error:
        raise CellError(
            f"mesh '{named(file)}' has no area where it stands or is touched: its vertices lie on a line."
        ) from error
    return Polygon([(float(x), float(y)) for x, y in points[hull.vertices]])
