"""What an object's mesh comes to: a prism with its own outline, and where that lies in the frame that was tracked.

STL, OBJ, glTF and whatever else trimesh reads. Only the bytes of the file are read: nothing that it names elsewhere.
"""

from __future__ import annotations

import importlib
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from physid_drake.convert.mapping import MeshFrame, Offset
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
    """A mesh as a prism.

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
    low, high = upright.min(axis=0), upright.max(axis=0)
    height = float(high[2] - low[2])
    outline, area = _outline(file, upright[:, :2], triangles)
    solid = abs(volume) * scale**3
    if not abs(solid - area * height) < ALIKE * area * height:
        raise RecordingError(
            f"mesh '{named(file)}': its volume, {1e6 * solid:.3g} cm^3, is not what its outline and height make,"
            f" {1e6 * area * height:.3g} cm^3: it is no upright prism, its surface is open, or another axis is up."
            " Give the part that is pushed as a prism, or the whole as a mesh (.obj) in recording.yaml."
        )
    centre = polygon_centroid(outline)
    middle = np.array([*centre, 0.5 * (low[2] + high[2])])
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
        says=f"{file.name}: a prism of {len(corners)} corners, {1e3 * wide[0]:.1f} by {1e3 * wide[1]:.1f} mm, "
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


def _outline(file: Path, points: Array, triangles: NDArray[np.int64]) -> tuple[Array, float]:
    """The outline (n, 2) of triangles seen from above, counter-clockwise, and its area."""
    shapely = _needs("shapely")
    corners = points[triangles]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    seen = corners[areas > 1e-12]  # those that face up cover what all of them do
    if not len(seen):
        raise RecordingError(f"mesh '{named(file)}': no face of it looks up.")
    whole = shapely.union_all(shapely.polygons(seen), grid_size=1e-7)
    if whole.geom_type != "Polygon":
        raise RecordingError(f"mesh '{named(file)}': seen from above, it is in several parts.")
    if whole.interiors:
        raise RecordingError(f"mesh '{named(file)}': seen from above, it has a hole, which no outline has.")
    simple = whole.simplify(COARSEST)
    outline = np.asarray(shapely.geometry.polygon.orient(simple).exterior.coords)[:-1]
    if len(outline) > MOST_CORNERS:
        raise RecordingError(f"mesh '{named(file)}': its outline has more than {MOST_CORNERS} corners; thin it.")
    return outline, float(simple.area)
