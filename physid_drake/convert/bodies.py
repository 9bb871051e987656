"""What the columns of a table seem to be, by their names and numbers: places, rotations and forces of bodies.

A name ends in an axis (``x``, ``qw``, ``Rot[4]``, ``pose_3``, ``T[0,3]``) and perhaps a unit; before it stands a
word for what is measured (position, rotation, force) and the body's name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from physid_drake.convert.columns import Array, Columns
from physid_drake.convert.units import ANGLES, FORCES, LENGTHS

MOST_TURNS: Final = 2000
"""Rotations that are looked at."""

CLEARLY: Final = 0.3
"""Of the turns about the vertical: by so much more, one order of a quaternion is the right one."""

FLAT: Final = 0.2
"""Of the way of an object on a table: its height changes less than that."""

UNIT: Final = 0.02
"""What a quaternion's norm, or a matrix' rows, may be off by the rounding of text."""

_AXIS: Final = re.compile(
    r"^(?P<stem>.*?)[\s_./\-:]*"
    r"(?P<axis>q[wxyz]|[rtf][xyz]|[xyzw](?=\d*$)|roll|pitch|yaw|phi|theta|heading|\[\d+\]|\[\d,\d\]|(?<=_)\d+)"
    r"(?P<digit>\d*)$",
    re.IGNORECASE,
)
_UNIT: Final = re.compile(
    r"^(?P<name>.*?)[\s_]*(?:[\[(](?P<bracketed>{0})[\])]|(?<=[\s_])(?P<bare>{0}))$".format(
        "|".join(sorted([*LENGTHS, *ANGLES, *FORCES], key=len, reverse=True))
    )
)
_QUANTITIES: Final[Sequence[tuple[str, str]]] = (
    ("force", r"force|wrench|ft"),
    ("turn", r"rotation|rot|orientation|quat\w*|euler\w*|rpy"),
    ("place", r"position|pos|translation|place|xyz"),
    ("pose", r"pose|transform|state"),
)
"""What a name's last word before the axis says is measured."""

_Found = dict[str, str]
"""Columns by their axis."""


@dataclass(kw_only=True)
class Body:
    """What was found of one body or sensor.

    Attributes:
        name: of the body, as it stands before the axes.
        position, rotation, force: columns, in the order of the axes.
        kind: how the rotation is written, as in a map.
        order: of Euler angles.
        sure: whether the kind is.
        unit: of the position, if the header states one.
    """

    name: str
    position: list[str] = field(default_factory=list)
    rotation: list[str] = field(default_factory=list)
    kind: str = "wxyz"
    order: str = "ZYX"
    sure: bool = True
    force: list[str] = field(default_factory=list)
    unit: str | None = None


def bodies_of(columns: Columns) -> list[Body]:
    """Bodies that have a place, sensors of a force, and a rotation without a name, in the order of the columns."""
    bodies: dict[str, Body] = {}
    for (owner, quantity), axes in _groups(columns).items():
        body = bodies.setdefault(owner, Body(name=owner or "?"))
        found = _read(owner, quantity, axes, columns)
        body.position = body.position or found.position
        body.force = body.force or found.force
        body.unit = body.unit or found.unit
        # A quaternion or a matrix needs no convention of angles.
        if found.rotation and (not body.rotation or len(found.rotation) > len(body.rotation)):
            body.rotation, body.kind, body.order, body.sure = found.rotation, found.kind, found.order, found.sure
    for body in bodies.values():
        if len(body.rotation) == 4:
            body.kind, body.sure = _order_of(body.rotation, body.position, columns)
    nameless = bodies.get("")
    return [body for body in bodies.values() if body.position or body.force or (body is nameless and body.rotation)]


def up_of(place: Sequence[str], columns: Columns) -> int | None:
    """The axis along which a body hardly moves, or that is missing between two; None if that is not known."""
    if len(place) < 3:
        letters = [match["axis"].lower()[-1] for name in place if (match := _AXIS.match(_unit_of(name, columns)[0]))]
        missing = set("xyz") - set(letters)
        return "xyz".index(missing.pop()) if len(missing) == 1 else None
    values = _filled(place, columns)
    return int(np.argmin(_ways(values))) if len(values) else None


def _groups(columns: Columns) -> dict[tuple[str, str], _Found]:
    """Columns of one body and quantity."""
    found: dict[tuple[str, str], _Found] = {}
    for name in columns.numbers:
        bare, _ = _unit_of(name, columns)
        match = _AXIS.match(bare)
        if match is None:
            continue
        axis, stem = match["axis"].lower(), match["stem"] + match["digit"]
        owner, quantity = stem, ""
        for kind, words in _QUANTITIES:
            split = re.match(rf"^(?P<owner>.*?)[\s_./\-:]*\b(?:{words})$", stem.replace("_", " "), re.IGNORECASE)
            if split:
                owner, quantity = stem[: len(split["owner"])], kind
                break
        found.setdefault((owner, quantity), {}).setdefault(axis.strip("[]"), name)
    return found


def _unit_of(name: str, columns: Columns) -> tuple[str, str | None]:
    """A column's name without its unit, and the unit, of a line of its own or of the name."""
    match = _UNIT.match(name)
    stated = columns.units.get(name)
    if match is None:
        return name, stated
    return match["name"], stated or match["bracketed"] or match["bare"]


def _read(owner: str, quantity: str, axes: _Found, columns: Columns) -> Body:
    """What one group of columns is."""
    body = Body(name=owner)
    numbered = _in_order(axes, [str(k) for k in range(len(axes))])
    if "0,0" in axes:
        _read_matrix(body, axes)
    elif numbered:
        _read_numbered(body, quantity, numbered, columns)
    else:
        _read_named(body, quantity, axes, columns)
    if body.position:
        body.unit = _unit_of(body.position[0], columns)[1]
    return body


def _read_matrix(body: Body, axes: _Found) -> None:
    body.rotation = _in_order(axes, [f"{i},{j}" for i in range(3) for j in range(3)])
    body.position = _in_order(axes, [f"{i},3" for i in range(3)])
    body.kind = "matrix"


def _read_numbered(body: Body, quantity: str, names: list[str], columns: Columns) -> None:
    count = len(names)
    if quantity == "force":
        body.force = names[:3] if count in (3, 6) else []
    elif count == 4 and _is_quaternion(names, columns):
        body.rotation = names
    elif count == 9 and _is_matrix(names, columns):
        body.rotation, body.kind, body.sure = names, "matrix", False
    elif quantity == "turn":
        return
    elif count == 7 and _is_quaternion(names[3:], columns):
        body.position, body.rotation = names[:3], names[3:]
    elif count == 6 and quantity == "pose":
        body.position, body.rotation, body.kind = names[:3], names[3:], "rotation_vector"
    elif count == 3 and quantity != "place" and not _has_height(names, columns):
        body.position, body.rotation, body.kind = names[:2], names[2:], "yaw"
    elif count in (2, 3):
        body.position = names
    elif count == 6:
        body.force = names[:3]


def _read_named(body: Body, quantity: str, axes: _Found, columns: Columns) -> None:
    letters = _in_order(axes, "xyz") or _in_order(axes, "xy")
    four = _in_order(axes, "xyzw")
    body.force = letters if quantity == "force" else _in_order(axes, ("fx", "fy", "fz"))
    if quantity == "force":
        return
    if four and _is_quaternion(four, columns):
        body.rotation = _by_column(four, columns)
        return
    if quantity == "turn":
        body.rotation, body.kind, body.order = (letters if len(letters) == 3 else []), "euler", "XYZ"
        return
    body.position = letters or _in_order(axes, ("tx", "ty", "tz")) or _in_order(axes, "xz")
    for kind, wanted in (
        ("wxyz", ("qx", "qy", "qz", "qw")),
        ("euler", ("yaw", "pitch", "roll")),
        ("rotation_vector", ("rx", "ry", "rz")),
        *(("yaw", (name,)) for name in ("yaw", "theta", "phi", "heading")),
    ):
        found = _in_order(axes, wanted)
        if found:
            body.rotation, body.kind = (_by_column(found, columns) if kind == "wxyz" else found), kind
            return


def _in_order(axes: Mapping[str, str], wanted: Sequence[str]) -> list[str]:
    """The columns of some axes; none if one is not there."""
    found = [axes[axis] for axis in wanted if axis in axes]
    return found if len(found) == len(wanted) else []


def _by_column(names: Sequence[str], columns: Columns) -> list[str]:
    """Of a quaternion x, y, z, w: from w on if it stands in front."""
    places = list(columns.numbers)
    first = min(names, key=places.index)
    return [names[3], *names[:3]] if first == names[3] else list(names)


def _filled(names: Sequence[str], columns: Columns) -> Array:
    values = np.column_stack([columns.numbers[name] for name in names])
    return np.asarray(values[np.isfinite(values).all(axis=1)])


def _ways(values: Array) -> Array:
    """How far each of some columns (n, k) goes, but for its ends."""
    return np.asarray(np.quantile(values, 0.95, axis=0) - np.quantile(values, 0.05, axis=0))


def _has_height(names: Sequence[str], columns: Columns) -> bool:
    values = _filled(names, columns)
    if not len(values):
        return True
    ways = np.sort(_ways(values))
    return bool(ways[0] < FLAT * ways[-1])


def _is_quaternion(names: Sequence[str], columns: Columns) -> bool:
    if len({len(columns.numbers[name]) for name in names}) > 1:
        return False
    values = _filled(names, columns)
    return len(values) > 0 and bool(np.median(np.abs(np.linalg.norm(values, axis=1) - 1.0)) < UNIT)


def _is_matrix(names: Sequence[str], columns: Columns) -> bool:
    values = _filled(names, columns).reshape(-1, 3, 3)
    off = np.abs(values @ values.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    return len(values) > 0 and bool(np.median(off) < UNIT)


def _order_of(names: Sequence[str], place: Sequence[str], columns: Columns) -> tuple[str, bool]:
    """The order of a quaternion, and whether that is sure."""
    last = re.sub(r"[\[(].*", "", names[0]).lower()
    if last.endswith("x") and not re.search(r"\d\]?$", names[0]):
        return "xyzw", True
    if last.endswith("w"):
        return "wxyz", True
    values = _filled(names, columns)
    values = values[(values != 0.0).any(axis=1)][:: max(1, len(values) // MOST_TURNS)]
    up = up_of(place, columns)
    if len(values) < 2 or up is None:
        return "wxyz", False
    # What stands on a table turns about its normal alone: by the wrong order, it turns about other axes, too.
    shares = {"wxyz": _share_about(up, np.roll(values, -1, axis=1)), "xyzw": _share_about(up, values)}
    best = max(shares, key=lambda kind: shares[kind])
    return best, abs(shares["wxyz"] - shares["xyzw"]) > CLEARLY


def _share_about(up: int, quaternions: Array) -> float:
    """Of all turns since the first, how much is about one axis; quaternions x, y, z, w."""
    turns = (Rotation.from_quat(quaternions) * Rotation.from_quat(quaternions[0]).inv()).as_rotvec()
    squares = (turns**2).sum(axis=0)
    return float(squares[up] / max(float(squares.sum()), 1e-12))
