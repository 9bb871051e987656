"""Reads the Wavefront OBJ file of a mesh: vertices and faces, and nothing that it names elsewhere."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path, PurePosixPath
from typing import Final

import numpy as np
import numpy.typing as npt

from physid_drake.errors import RecordingError
from physid_drake.files import FileError, read_text
from physid_drake.recording.values import Array
from physid_drake.wording import named, shown

MOST_BYTES: Final = 64_000_000
MOST_VERTICES: Final = 500_000
MOST_TRIANGLES: Final = 1_000_000
LONGEST_LINE: Final = 100_000
LARGEST: Final = 1e9
"""A coordinate, in the file's unit."""
THINNEST: Final = 1e-4
"""m that a solid must have across."""
LONGEST: Final = 10.0
"""m that an object may have across: ten metres are a scale that is missing."""
_NAMING: Final = ("mtllib", "maplib", "usemap", "call", "csh", "shadow_obj", "trace_obj")


@dataclass(frozen=True, kw_only=True, eq=False)
class ObjMesh:
    """What an OBJ file says of a solid's surface.

    Attributes:
        vertices: (n, 3) in the file's unit.
        triangles: (m, 3) indices of vertices from 0, counter-clockwise from outside; m may be 0.
    """

    vertices: Array
    triangles: npt.NDArray[np.int64]

    def text(self) -> str:
        """The same as an OBJ file that names nothing."""
        rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in self.vertices.tolist()]
        rows += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in self.triangles.tolist()]
        return "\n".join(rows) + "\n"


def read_obj(file: Path) -> ObjMesh:
    """Reads a mesh. Polygons become fans of triangles; normals, textures and materials are not read.

    Args:
        file: that ends in ``.obj``.

    Raises:
        RecordingError: naming file and line, if it is no OBJ file, a face is of vertices that are not there, a number
            is none, or it names a file that is not in its folder.
    """
    if file.suffix.lower() != ".obj":
        raise RecordingError(f"mesh '{named(file)}': only Wavefront .obj files are read; convert it to .obj.")
    try:
        text = read_text(file, most=MOST_BYTES)
    except FileError as error:
        raise RecordingError(f"mesh '{named(file)}': {error}.") from error
    vertices: list[list[float]] = []
    triangles: list[list[int]] = []
    for line, words in _statements(text):
        try:
            _take(words, vertices, triangles)
        except RecordingError as error:
            raise RecordingError(f"mesh '{named(file)}': line {line}: {error}") from error
    if len(vertices) < 4:
        raise RecordingError(
            f"mesh '{named(file)}': must hold at least 4 vertices 'v x y z', but has {len(vertices)}; is it a solid?"
        )
    wrong = next((k for face in triangles for k in face if k >= len(vertices)), None)
    if wrong is not None:
        raise RecordingError(
            f"mesh '{named(file)}': a face is of vertex {wrong + 1}, but there are {len(vertices)}; correct it."
        )
    return ObjMesh(
        vertices=np.array(vertices, dtype=np.float64),
        triangles=np.array(triangles, dtype=np.int64).reshape(-1, 3),
    )


def check_solid(mesh: ObjMesh, scale: float, file: Path) -> None:
    """Refuse a mesh that is flat, a line or a point, or of no size that a hand can push.

    Args:
        mesh: as it was read.
        scale: turns its numbers into m.
        file: for the message.

    Raises:
        RecordingError: if it is.
    """
    span = float(np.ptp(mesh.vertices, axis=0).max())
    length = scale * span  # may overflow to infinity, which is too long
    if not length <= LONGEST:
        raise RecordingError(
            f"mesh '{named(file)}': must be at most {LONGEST:g} m long, but is {length:.3g} m; is its scale right?"
        )
    if span > 0.0:
        # Of numbers about 1, so that nothing overflows or vanishes; the last axis is the thinnest.
        even = (mesh.vertices - mesh.vertices.mean(axis=0)) / span
        axes = np.linalg.eigh(even.T @ even)[1]
        across = length * float(np.ptp(even @ axes, axis=0).min())
    else:
        across = 0.0
    if not across >= THINNEST:
        raise RecordingError(
            f"mesh '{named(file)}': must be at least {1e3 * THINNEST:g} mm thick in every direction, but is "
            f"{1e3 * across:.3g} mm: it is flat, or its scale is wrong."
        )


def _statements(text: str) -> Iterator[tuple[int, list[str]]]:
    """Number of the first line and words of every statement that is not empty; no words of one that is too long."""
    begun, first = "", 0
    for number, raw in enumerate(io.StringIO(text, newline=None), 1):
        first = first if begun else number
        line = begun + raw.rstrip("\n").partition("#")[0]
        if len(line) > LONGEST_LINE:
            yield first, []
            return
        if line.endswith("\\"):
            begun = line[:-1] + " "
            continue
        begun = ""
        words = line.split()
        if words:
            yield first, words
    if begun.split():
        yield first, begun.split()


def _take(words: list[str], vertices: list[list[float]], triangles: list[list[int]]) -> None:
    """Take up one statement; those that say nothing of the shape are passed over."""
    if not words:
        raise RecordingError(f"a statement must have at most {LONGEST_LINE} characters; make the mesh coarser.")
    match words[0]:
        case "v":
            vertices.append(_point(words[1:]))
            if len(vertices) > MOST_VERTICES:
                raise RecordingError(f"there must be at most {MOST_VERTICES} vertices; make the mesh coarser.")
        case "f" | "fo":
            corners = _corners(words[1:], len(vertices))
            triangles.extend([corners[0], b, c] for b, c in pairwise(corners[1:]))
            if len(triangles) > MOST_TRIANGLES:
                raise RecordingError(f"there must be at most {MOST_TRIANGLES} triangles; make the mesh coarser.")
        case keyword if keyword in _NAMING:
            _refuse_outside(keyword, words[1:])
        case _:
            pass


def _point(words: list[str]) -> list[float]:
    """Place of a vertex; a weight or a colour may follow."""
    if not 3 <= len(words) <= 7:
        raise RecordingError(f"a vertex must be 'v x y z', but has {len(words)} numbers; correct it.")
    place = []
    for word in words[:3]:
        try:
            # Python alone reads 1_000 as a number.
            value = float(word) if "_" not in word and word.isascii() else math.nan
        except ValueError:
            value = math.nan
        if not abs(value) <= LARGEST:
            raise RecordingError(
                f"a coordinate must be a number from -{LARGEST:g} to {LARGEST:g}, but is {shown(word)}; correct it."
            )
        place.append(value)
    return place


def _corners(words: list[str], count: int) -> list[int]:
    """Indices from 0 of a face's vertices, of which ``count`` are there already; later ones may still come."""
    if len(words) < 3:
        raise RecordingError(f"a face must have at least 3 corners, but has {len(words)}; correct it.")
    return [_corner(word, count) for word in words]


def _corner(word: str, count: int) -> int:
    """The vertex of ``v``, ``v/vt``, ``v//vn`` or ``v/vt/vn``; a negative one counts from the last."""
    first, *others = word.split("/")
    if len(others) > 2 or not _is_index(first) or not all(_is_index(other) for other in others if other):
        raise RecordingError(
            f"a face's corner must be whole numbers, as 'v/vt/vn', but is {shown(word)}; correct it."
        )
    index = int(first)
    if index == 0 or index < -count or index > MOST_VERTICES:
        raise RecordingError(
            f"a face's corner must be from 1 to {count}, or from -{count} to -1, but is {shown(index)}; correct it."
        )
    return index - 1 if index > 0 else count + index


def _is_index(word: str) -> bool:
    digits = word[1:] if word[:1] in ("-", "+") else word
    return digits.isascii() and digits.isdigit() and len(digits) <= 18


def _refuse_outside(keyword: str, words: list[str]) -> None:
    """Refuse a name that leads out of the file's folder: whole, since it may have blanks, and word by word."""
    for name in (" ".join(words), *words):
        path = PurePosixPath(name.replace("\\", "/"))
        if path.is_absolute() or ".." in path.parts or name[1:2] == ":" or name.startswith("~"):
            raise RecordingError(
                f"{keyword} must name a file beside the mesh, but names {shown(name)}; remove the line."
            )
