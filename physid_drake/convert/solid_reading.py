"""The object of a map: as in a recording, or a mesh or boxes that become a prism."""

from __future__ import annotations

from pathlib import Path
from typing import Final, cast

import numpy as np

from physid_drake.convert.map_values import rotation_from, size_of_unit
from physid_drake.convert.mapping import BoxPart, MeshFrame, SolidMap
from physid_drake.convert.units import LENGTHS
from physid_drake.recording import ObjectModel
from physid_drake.recording.description import Section, inside, object_from
from physid_drake.wording import shown

MOST_BOXES: Final = 50
"""Of an object that is made of them."""


def model_from(described: Section, folder: Path) -> ObjectModel | SolidMap:
    """The object; a mesh, or boxes, are looked at when the log is converted."""
    section = cast(Section, described.section("object"))
    kind = section.values.get("shape")
    if kind not in ("mesh", "boxes"):
        return object_from(described, folder)
    own = ("file", "up") if kind == "mesh" else ("boxes",)
    section.check_keys("shape", *own, "unit", "frame", "mass_kg", "mass_std_kg")
    parts: Path | tuple[BoxPart, ...]
    if kind == "boxes":
        parts = section.get("boxes", "a list of {size: [x, y, z], centre: [x, y, z], yaw_deg: 0}", _as_boxes)
    else:
        parts = _mesh_file(section, folder)
    frame = section.section("frame", required=False)
    if frame is not None:
        frame.check_keys("translation", "rotation_wxyz", "yaw_deg")
    place = frame.numbers("translation", 3) if frame is not None and frame.has("translation") else (0.0, 0.0, 0.0)
    up = section.choice("up", "x", "y", "z") if section.has("up") else "z"
    return SolidMap(
        parts=parts,
        scale=size_of_unit(section, LENGTHS, "m"),
        frame=MeshFrame(
            axes=np.roll(np.eye(3), "zxy".index(up), axis=1),
            translation=(place[0], place[1], place[2]),
            rotation=(1.0, 0.0, 0.0, 0.0) if frame is None else rotation_from(frame),
        ),
        mass=section.maybe_number("mass_kg"),
        mass_std=section.maybe_number("mass_std_kg"),
    )


def _mesh_file(section: Section, folder: Path) -> Path:
    name = section.text("file")
    file = inside(folder, name)
    if file is None:
        raise section.refuse("file", f"must lie in the map's folder, but got {shown(name)}; move it.")
    return file


def _as_boxes(value: object) -> tuple[BoxPart, ...] | None:
    if not isinstance(value, list) or not 0 < len(value) <= MOST_BOXES:
        return None
    boxes = []
    for one in value:
        if not isinstance(one, dict) or not {"size", "centre"} <= set(one) <= {"size", "centre", "yaw_deg"}:
            return None
        size, centre, yaw = _as_numbers(one["size"]), _as_numbers(one["centre"]), one.get("yaw_deg", 0.0)
        if size is None or centre is None or _as_numbers([yaw, 0, 0]) is None or min(size) <= 0.0:
            return None
        boxes.append(BoxPart(size=size, centre=centre, yaw=float(np.deg2rad(yaw))))
    return tuple(boxes)


def _as_numbers(value: object) -> tuple[float, float, float] | None:
    if not isinstance(value, list) or len(value) != 3:
        return None
    numbers = [float(one) if type(one) in (int, float) and abs(one) < 1e9 else np.nan for one in value]
    return (numbers[0], numbers[1], numbers[2]) if np.isfinite(numbers).all() else None
