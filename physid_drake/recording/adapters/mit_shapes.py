"""The objects of the MIT push dataset (Yu, Bauza, Fazeli, Rodriguez, IROS 2016): outlines, masses, frames.

The triangles' published poses are of a point 45 mm from both legs, with the right angle towards +x, +y
and the longer leg along x. This was found from the published end points: with it the pusher's centre ends
4.75 mm from an edge, as it does for the rectangles, and with the centroid in its place it is off by up to
14 mm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from physid_drake.errors import RecordingError
from physid_drake.recording.object_model import Box, Prism, Shape
from physid_drake.recording.outlines import polygon_centroid
from physid_drake.recording.values import Array
from physid_drake.wording import shown

THICKNESS: Final = 0.013
TIP_RADIUS: Final = 0.00475
ELLIPSE_VERTICES: Final = 64

_CORNER: Final = 0.045


@dataclass(frozen=True, kw_only=True)
class PublishedObject:
    """One object of the dataset.

    Attributes:
        shape: about B at its centroid.
        outline: (n, 2) of the shape in B, in m.
        mass: in kg.
        centroid: of B's origin in the frame whose pose is published, in m.
    """

    shape: Shape
    outline: tuple[tuple[float, float], ...]
    mass: float
    centroid: tuple[float, float] = (0.0, 0.0)


def _rectangle(mass: float, x: float, y: float) -> PublishedObject:
    outline = ((-x / 2, -y / 2), (x / 2, -y / 2), (x / 2, y / 2), (-x / 2, y / 2))
    return PublishedObject(shape=Box(size=(x, y, THICKNESS)), outline=outline, mass=mass)


def _prism(mass: float, vertices: Array) -> PublishedObject:
    centroid = polygon_centroid(vertices)
    outline = tuple((float(x), float(y)) for x, y in vertices - centroid)
    return PublishedObject(
        shape=Prism(polygon=outline, height=THICKNESS),
        outline=outline,
        mass=mass,
        centroid=(float(centroid[0]), float(centroid[1])),
    )


def _triangle(mass: float, x: float, y: float) -> PublishedObject:
    corner = _CORNER
    return _prism(mass, np.array([[corner, corner], [corner - x, corner], [corner, corner - y]]))


def _ellipse(mass: float, x: float, y: float) -> PublishedObject:
    angles = 2.0 * np.pi * np.arange(ELLIPSE_VERTICES) / ELLIPSE_VERTICES
    return _prism(mass, np.column_stack([0.5 * x * np.cos(angles), 0.5 * y * np.sin(angles)]))


def _hexagon(mass: float, radius: float) -> PublishedObject:
    angles = np.pi / 3.0 * np.arange(6)
    return _prism(mass, radius * np.column_stack([np.cos(angles), np.sin(angles)]))


OBJECTS: Final[Mapping[str, PublishedObject]] = {
    "rect1": _rectangle(0.8374, 0.090, 0.090),
    "rect2": _rectangle(1.045, 0.08991, 0.11258),
    "rect3": _rectangle(1.2508, 0.13501, 0.08994),
    "tri1": _triangle(0.8028, 0.1259, 0.1259),
    "tri2": _triangle(0.9826, 0.1510, 0.1259),
    "tri3": _triangle(1.1326, 0.1765, 0.1256),
    "ellip1": _ellipse(0.8937, 0.105, 0.105),
    "ellip2": _ellipse(1.1104, 0.105, 0.1309),
    "ellip3": _ellipse(1.3338, 0.105, 0.157),
    "hex": _hexagon(0.9827, 0.0605),
}


def published_object(name: str, place: str) -> PublishedObject:
    """The object of that name.

    Args:
        name: as in the published file names.
        place: the file, for the message.

    Raises:
        RecordingError: if there is no such object, or its outline is not known here.
    """
    if name == "butter":
        raise RecordingError(
            f"{place}: the shape 'butter' is not convex, and this converter knows no outline of it;"
            " convert another shape, or write its recording with a prism of your own."
        )
    if name not in OBJECTS:
        raise RecordingError(f"{place}: unknown shape {shown(name)}; the known ones are {', '.join(OBJECTS)}.")
    return OBJECTS[name]
