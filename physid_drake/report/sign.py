"""A sign that stands in a Meshcat scene: lines of text on a plate, as Drake's Meshcat has no text of its own."""

from __future__ import annotations

import base64
import io
import json
import textwrap
from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.figure import Figure
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh, Mesh

SIZE: Final = (0.24, 0.13)  # m
MOST_LINES, COLUMNS = 8, 38
PIXELS = 5000  # per m


def sign(lines: Sequence[str]) -> Mesh:
    """A plate in the plane x, z with its middle at the origin, to be read from -y; the last lines where not all fit.

    Args:
        lines: from top to bottom; long ones are wrapped.
    """
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    # glTF's y is up, and Drake turns it to z: x right, y up.
    places = np.column_stack([0.5 * corners * SIZE, np.zeros(4)]).astype(np.float32)
    texture = (0.5 * (1.0 + corners * [1.0, -1.0])).astype(np.float32)  # its origin is the upper left corner
    faces = np.array([0, 1, 2, 0, 2, 3], dtype=np.uint16)
    parts = [places.tobytes(), texture.tobytes(), faces.tobytes()]
    offsets = np.cumsum([0, *map(len, parts)]).tolist()
    content = {
        "asset": {"version": "2.0"},
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0.0},
            "doubleSided": True, "extensions": {"KHR_materials_unlit": {}},
        }],
        "extensionsUsed": ["KHR_materials_unlit"],
        "textures": [{"source": 0}], "images": [{"uri": _uri("image/png", _picture(lines))}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
             "min": places.min(axis=0).tolist(), "max": places.max(axis=0).tolist()},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": len(part)}
            for start, part in zip(offsets, parts, strict=False)
        ],
        "buffers": [{"byteLength": offsets[-1], "uri": _uri("application/octet-stream", b"".join(parts))}],
    }  # fmt: skip
    file = MemoryFile(json.dumps(content).encode(), ".gltf", "sign.gltf")
    return Mesh(InMemoryMesh(mesh_file=file))


def _picture(lines: Sequence[str]) -> bytes:
    """The text as PNG, dark on white."""
    wrapped = [part for line in lines for part in textwrap.wrap(line, COLUMNS) or [""]][-MOST_LINES:]
    inches = 30.0  # per m
    figure = Figure(figsize=(inches * SIZE[0], inches * SIZE[1]), dpi=PIXELS / inches, facecolor="#fcfcfd")
    for k, line in enumerate(wrapped):
        figure.text(0.03, 0.95 - 0.118 * k, line, va="top", fontsize=22, color="black", parse_math=False)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=PIXELS / inches, metadata={"Software": None})
    return buffer.getvalue()


def _uri(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
