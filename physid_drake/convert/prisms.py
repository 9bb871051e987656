"""What an object's mesh, or the boxes that it is made of, come to: a prism, and where that lies in the tracked frame.

STL, OBJ, glTF and whatever else trimesh reads. Only the bytes of the file are read: nothing that it names elsewhere.
"""

from __future__ import annotations

import importlib
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from physid_drake.convert.mapping import BoxPart, MeshFrame, Offset
from physid_drake.errors import RecordingError
from physid_drake.files import FileError, read_bytes
from physid_drake.recording import Prism, polygon_centroid
from physid_drake.recording.outlines import MOST_CORNERS
from physid_drake.wording import named, one_line

Array = NDArray[np.float64]

ENDINGS: Final = (".stl", ".obj", ".glb", ".gltf", ".ply", ".off", ".3mf")
MOST_TRIANGLES: Final = 500_000
COARSEST: Final = 1e-4
"""m by which the outline of a mesh may be off: what a tip on a face does not feel."""
ALIKE: Final = 0.03
"""Of its volume: a solid that differs by more from outline times height is no prism."""


@dataclass(frozen=True, kw_only=True)
class Meshed:
    """A mesh, or boxes, as a prism.

    Attributes:
        shape: the prism, about its centroid.
        offset: pose of B, the prism's middle, in the tracked frame.
        says: what was made of it, for people.
    """

    shape: Prism
    offset: Offset
    says: str


def prism_of(file: Path, scale: float, frame: MeshFrame) -> Meshed:
    """The prism that a mesh is.

    Args:
        file: of the mesh.
        scale: of its unit [m].
        frame: which of its axes is up, and where the tracked frame lies in it.

    Raises:
        RecordingError: if it cannot be read, trimesh is not installed, or the solid is no prism.
    """
    vertices, triangles, volume = _read(file)
    upright = scale * vertices @ frame.axes.T
    low, high = float(upright[:, 2].min()), float(upright[:, 2].max())
    height = high - low
    outline, area = _outline(f"mesh '{named(file)}'", _facing_up(file, upright[:, :2], triangles))
    solid = abs(volume) * scale**3
    if not abs(solid - area * height) < ALIKE * area * height:
        raise RecordingError(
            f"mesh '{named(file)}': its volume, {1e6 * solid:.3g} cm^3, is not what its outline and height make,"
            f" {1e6 * area * height:.3g} cm^3: it is no upright prism, its surface is open, or another axis is up."
            " Give the part that is pushed as a prism, or the whole as a mesh (.obj) in recording.yaml."
        )
    return _prism(file.name, outline, (low, high), scale, frame)


def prism_of_boxes(boxes: Sequence[BoxPart], scale: float, frame: MeshFrame) -> Meshed:
    """The prism that boxes make together.

    Args:
        boxes: that lie on one level and are equally high.
        scale: of their unit [m].
        frame: where the tracked frame lies in theirs.

    Raises:
        RecordingError: if they are no prism, or apart, or shapely is not installed.
    """
    levels = [
        (scale * (box.centre[2] - 0.5 * box.size[2]), scale * (box.centre[2] + 0.5 * box.size[2])) for box in boxes
    ]
    if np.ptp(levels, axis=0).max() > COARSEST:
        said = ", ".join(f"{1e3 * low:.1f} to {1e3 * high:.1f}" for low, high in levels[:4])
        raise RecordingError(
            f"object: its boxes must reach from one level to another, but they reach from {said} mm; give those that"
            " are pushed, as high as they are together."
        )
    outline, _ = _outline("object", np.array([_corners(box, scale) for box in boxes]))
    return _prism(f"{len(boxes)} boxes", outline, levels[0], scale, frame)


def _corners(box: BoxPart, scale: float) -> Array:
    """(4, 2) [m], counter-clockwise."""
    signs = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    c, s = np.cos(box.yaw), np.sin(box.yaw)
    turned = signs * box.size[:2] @ np.array([[c, s], [-s, c]])
    return np.asarray(scale * (turned + box.centre[:2]))


def _prism(name: str, outline: Array, level: tuple[float, float], scale: float, frame: MeshFrame) -> Meshed:
    """A prism about its middle, from an outline (n, 2) and its lowest and highest z [m] in axes of which z is up."""
    centre, height = polygon_centroid(outline), level[1] - level[0]
    middle = np.array([*centre, 0.5 * (level[0] + level[1])])
    tracked = Rotation.from_quat(np.roll(frame.rotation, -1))
    place = tracked.inv().apply(middle - scale * frame.axes @ np.asarray(frame.translation))
    turn = np.roll(tracked.inv().as_quat(), 1)
    corners = tuple((float(x), float(y)) for x, y in np.round(outline - centre, 7))
    wide = outline.max(axis=0) - outline.min(axis=0)
    said = ", ".join(f"{1e3 * v:.1f}" for v in place)
    return Meshed(
        shape=Prism(polygon=corners, height=height),
        offset=Offset(
            translation=(float(place[0]), float(place[1]), float(place[2])),
            rotation=(float(turn[0]), float(turn[1]), float(turn[2]), float(turn[3])),
        ),
        says=f"{name}: a prism of {len(corners)} corners, {1e3 * wide[0]:.1f} by {1e3 * wide[1]:.1f} mm, "
        f"{1e3 * height:.1f} mm high; its middle is at ({said}) mm of the tracked frame",
    )


def _needs(module: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise RecordingError(
            f"reading meshes needs {module}, which is not installed; run `pip install physid_drake[meshes]`."
        ) from error


def _read(file: Path) -> tuple[Array, NDArray[np.int64], float]:
    """Vertices (n, 3) and triangles (m, 3) of a mesh in its own unit, and its volume."""
    trimesh = _needs("trimesh")
    if file.suffix.lower() not in ENDINGS:
        raise RecordingError(f"mesh '{named(file)}': must end in {', '.join(ENDINGS)}.")
    try:
        content = read_bytes(file)
        with np.errstate(all="ignore"):
            loaded = _loaded(trimesh, content, file)
            volume = float(loaded.volume)
        vertices, faces = np.asarray(loaded.vertices, dtype=np.float64), np.asarray(loaded.faces, dtype=np.int64)
    except FileError as error:
        raise RecordingError(f"mesh '{named(file)}': {error}.") from error
    except Exception as error:  # what a library makes of damaged bytes is of any kind
        raise RecordingError(f"mesh '{named(file)}': cannot be read ({_why(error)}).") from error
    if len(vertices) < 4 or len(faces) < 4 or not np.isfinite(vertices).all():
        raise RecordingError(
            f"mesh '{named(file)}': is no solid: it has {len(vertices)} vertices and {len(faces)} faces."
        )
    if len(faces) > MOST_TRIANGLES:
        raise RecordingError(f"mesh '{named(file)}': has more than {MOST_TRIANGLES:,} triangles; thin it.")
    return vertices, faces, volume


def _loaded(trimesh: Any, content: bytes, file: Path) -> Any:
    kind = file.suffix[1:].lower()
    return trimesh.load(io.BytesIO(content), file_type=kind, force="mesh", skip_materials=True, resolver=None)


def _why(error: Exception) -> str:
    return "it claims more than it holds" if isinstance(error, MemoryError) else one_line(error)


def _facing_up(file: Path, points: Array, triangles: NDArray[np.int64]) -> Array:
    """The triangles (m, 3, 2) that face up, seen from above; they cover what all of them do."""
    corners = points[triangles]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    seen = corners[areas > 1e-12]
    if not len(seen):
        raise RecordingError(f"mesh '{named(file)}': no face of it looks up.")
    return np.asarray(seen)


def _outline(what: str, polygons: Array) -> tuple[Array, float]:
    """The outline (n, 2) of polygons (m, k, 2) together, counter-clockwise, and its area."""
    shapely = _needs("shapely")
    whole = shapely.union_all(shapely.polygons(polygons), grid_size=1e-7)
    if whole.geom_type != "Polygon":
        raise RecordingError(f"{what}: seen from above, it is in several parts.")
    if whole.interiors:
        raise RecordingError(f"{what}: seen from above, it has a hole, which no outline has.")
    simple = whole.simplify(COARSEST)
    outline = np.asarray(shapely.geometry.polygon.orient(simple).exterior.coords)[:-1]
    if len(outline) > MOST_CORNERS:
        raise RecordingError(f"{what}: its outline has more than {MOST_CORNERS} corners; thin it.")
    return outline, float(simple.area)
