"""What the columns of a table seem to be, by their names and numbers: places, rotations and forces of bodies."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from physid_drake.convert.columns import Array, Columns
from physid_drake.convert.names import axis_of, is_wanted, parts_of, unit_of, words_of
from physid_drake.convert.units import ANGLES, FORCES

MOST_TURNS: Final = 2000
"""Rotations that are looked at."""

CLEARLY: Final = 0.3
"""Of the turns about the vertical: by so much more, one order of a quaternion is the right one."""

FLAT: Final = 0.2
"""Of the way of an object on a table: its height changes less than that."""

UNIT: Final = 0.02
"""What a quaternion's norm, or a matrix' rows, may be off by the rounding of text."""

MOST_OF_ONE: Final = 7
"""Columns of one array that is the whole log, and holds no more than one body's place and rotation."""

_ARRAY: Final = re.compile(r"\[?[\d,]+\]?$")
"""What follows an array's name in those of its columns."""

FORCE_WORDS: Final = frozenset(("f", "fext", "ft", "force", "forces", "wrench", "netft", "loadcell", "fts"))

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
        named: whether the order of a quaternion's columns is, by their names.
        unit: of the position, if the header states one.
        wanted: whether it is where something was to be, and was not measured.
        where: column and value of the rows that are its own; None if all are.
        doubt: what may be wrong, as a comment.
    """

    name: str
    position: list[str] = field(default_factory=list)
    rotation: list[str] = field(default_factory=list)
    kind: str = "wxyz"
    order: str = "ZYX"
    sure: bool = True
    named: bool = False
    force: list[str] = field(default_factory=list)
    unit: str | None = None
    wanted: bool = False
    where: tuple[str, str] | None = None
    doubt: str = ""


def bodies_of(columns: Columns) -> list[Body]:
    """Bodies that have a place, sensors of a force, and a rotation without a name, in the order of the columns."""
    bodies: dict[str, Body] = {}
    groups = _groups(columns)
    if len(groups) == 1 and len(next(iter(groups.values()))) == len(columns.numbers) > MOST_OF_ONE:
        return _nameless(columns)
    for (owner, quantity), axes in groups.items():
        body = bodies.setdefault(owner, Body(name=owner or "?"))
        found = _read(owner, quantity, axes, columns)
        body.position = body.position or found.position
        body.force = body.force or found.force
        body.unit = body.unit or found.unit
        # A quaternion or a matrix needs no convention of angles.
        if found.rotation and (not body.rotation or len(found.rotation) > len(body.rotation)):
            body.rotation, body.kind, body.order = found.rotation, found.kind, found.order
            body.sure, body.named = found.sure, found.named
    for body in bodies.values():
        if len({len(columns.numbers[name]) for name in body.position}) > 1:
            body.position = []
    nameless = bodies.get("")
    kept = [body for body in bodies.values() if body.position or body.force or (body is nameless and body.rotation)]
    for body in kept:
        if len(body.rotation) == 4 and not body.named:
            body.kind, body.sure = _order_of(body.rotation, body.position, columns)
        body.wanted = is_wanted(body.name, [other.name for other in kept])
    if not any(body.rotation for body in kept):
        # What turns may stand in an array of a state, such as MuJoCo's qpos.
        used = {name for body in kept for name in body.position + body.force}
        kept += [body for body in _nameless(columns) if (body.rotation or not kept) and not used & set(body.position)]
    return kept


def up_of(place: Sequence[str], columns: Columns) -> int | None:
    """The axis along which a body hardly moves, or that is missing between two; None if that is not known."""
    if len(place) < 3:
        missing = set("xyz") - {(axis_of(name, columns) or "?")[-1] for name in place}
        return "xyz".index(missing.pop()) if len(missing) == 1 else None
    values = filled(place, columns)
    return int(np.argmin(_ways(values))) if len(values) else None


def filled(names: Sequence[str], columns: Columns) -> Array:
    """Columns (n, k) side by side, without rows in which one is empty; none if they are not equally long."""
    if len({len(columns.numbers[name]) for name in names}) != 1:
        return np.empty((0, len(names)))
    values = np.column_stack([columns.numbers[name] for name in names])
    return np.asarray(values[np.isfinite(values).all(axis=1)])


def rises(values: Array) -> bool:
    """Whether numbers go up from almost every row to the next."""
    seen = values[np.isfinite(values)]
    return len(seen) > 2 and float(np.mean(np.diff(seen) > 0.0)) > 0.9


def _groups(columns: Columns) -> dict[tuple[str, str], _Found]:
    """Columns of one body and quantity."""
    found: dict[tuple[str, str], _Found] = {}
    for name, part in parts_of(columns).items():
        found.setdefault((part.owner, part.quantity), {}).setdefault(part.axis, name)
    split: dict[tuple[str, str], _Found] = {}
    for (owner, quantity), axes in found.items():
        split |= {(owner + row, quantity): own for row, own in _rows_of(axes, columns)}
    return split


def _rows_of(axes: _Found, columns: Columns) -> Iterator[tuple[str, _Found]]:
    """Each row of an array of two indices by itself, as of one body each, unless the array is a matrix."""
    matrix = _in_order(axes, [f"{i},{j}" for i in range(3) for j in range(3)])
    if "0,0" not in axes or (matrix and _is_matrix(matrix, columns)):
        yield "", axes
        return
    rows: dict[str, _Found] = {}
    for axis, name in axes.items():
        row, _, column = axis.partition(",")
        rows.setdefault(f"[{row}]", {})[column] = name
    yield from rows.items()


def _read(owner: str, quantity: str, axes: _Found, columns: Columns) -> Body:
    """What one group of columns is."""
    body = Body(name=owner)
    # MATLAB counts from 1.
    numbered = _in_order(axes, [str(k) for k in range(len(axes))])
    numbered = numbered or _in_order(axes, [str(k + 1) for k in range(len(axes))])
    quantity = _by_unit(next(iter(axes.values())), columns) or quantity
    if "0,0" in axes:
        _read_matrix(body, axes)
    elif numbered:
        _read_numbered(body, quantity, numbered, columns)
    else:
        _read_named(body, quantity, axes, columns)
    if body.position:
        body.unit = unit_of(body.position[0], columns)[1]
    return body


def _by_unit(name: str, columns: Columns) -> str:
    """What a column without a word for it must be by its unit; nothing if it may be a place."""
    unit = unit_of(name, columns)[1]
    part = axis_of(name, columns)
    if part not in ("x", "0", "1"):
        return ""
    return "turn" if unit in ANGLES else "force" if unit in FORCES else ""


def _read_matrix(body: Body, axes: _Found) -> None:
    body.rotation = _in_order(axes, [f"{i},{j}" for i in range(3) for j in range(3)])
    body.position = _in_order(axes, [f"{i},3" for i in range(3)])
    body.kind = "matrix"


def _read_numbered(body: Body, quantity: str, names: list[str], columns: Columns) -> None:
    count = len(names)
    called_force = quantity == "force" or bool(FORCE_WORDS & set(words_of(body.name)))
    if quantity == "force" or (called_force and count == 6):
        body.force = names[:3] if count in (3, 6) else []
    elif count == 4 and _is_quaternion(names, columns):
        body.rotation = names
    elif count == 9 and _is_matrix(names, columns):
        body.rotation, body.kind, body.sure = names, "matrix", False
    elif quantity == "vector" and count == 3:
        body.rotation, body.kind = names, "rotation_vector"
    elif quantity in ("turn", "vector", "q"):
        return
    elif count in (12, 16) and (found := _transform(names, columns)):
        body.rotation, body.position, body.kind = found[0], found[1], "matrix"
    elif count > 6 and (found := _with_quaternion(names, columns)):
        body.rotation, body.position = found
    elif count == 6 and quantity == "pose":
        body.position, body.rotation, body.kind = names[:3], names[3:], "rotation_vector"
    elif count == 3 and quantity != "place" and not _has_height(names, columns):
        body.position, body.rotation, body.kind = names[:2], names[2:], "yaw"
    elif count in (2, 3):
        body.position = names


def _read_named(body: Body, quantity: str, axes: _Found, columns: Columns) -> None:
    letters = _in_order(axes, "xyz") or _in_order(axes, "xy")
    body.force = letters if quantity == "force" else _in_order(axes, ("fx", "fy", "fz"))
    if quantity == "force":
        return
    four = _in_order(axes, "xyzw")
    if four and _is_quaternion(four, columns):
        _set_quaternion(body, four, columns)
        return
    if quantity in ("turn", "vector"):
        body.rotation = letters if len(letters) == 3 else _angles(axes)
        body.kind, body.order = ("euler", "XYZ" if letters else "ZYX") if quantity == "turn" else (
            "rotation_vector", "ZYX",
        )  # fmt: skip
        return
    # Beside forces, T is for torque.
    shifts = [] if body.force else _in_order(axes, ("tx", "ty", "tz"))
    body.position = letters or shifts or _in_order(axes, "xz")
    _read_turn(body, axes, columns)


def _read_turn(body: Body, axes: _Found, columns: Columns) -> None:
    """The rotation that stands beside a place, each axis with a letter of its own.

    Four columns of norm 1 are a quaternion, whatever they are called, before three of them are angles.
    """
    used = {*body.position, *body.force}
    for four in _fours({axis: name for axis, name in axes.items() if name not in used}, columns):
        last = {axis[-1]: name for axis, name in axes.items() if name in four}
        by_name = _in_order(last, "xyzw") or _in_order(last, "xyz0")
        if by_name:
            _set_quaternion(body, by_name, columns)
        else:
            body.rotation = four
        return
    for kind, names in (
        ("euler", ("yaw", "pitch", "roll")),
        ("euler", "abc" if body.position else ()),
        ("rotation_vector", ("rx", "ry", "rz")),
        *(("yaw", (name,)) for name in ("yaw", "theta", "phi", "heading")),
    ):
        found = _in_order(axes, names)
        if found:
            body.rotation, body.kind = found, kind
            return


def _fours(axes: _Found, columns: Columns) -> Iterator[list[str]]:
    """Four columns that follow one another and have norm 1 in every row."""
    places = list(columns.numbers)
    names = sorted(axes.values(), key=places.index)
    for k in range(len(names) - 3):
        four = names[k : k + 4]
        if _is_quaternion(four, columns, every=True):
            yield four


def _angles(axes: _Found) -> list[str]:
    return _in_order(axes, ("yaw", "pitch", "roll"))


def _set_quaternion(body: Body, names: Sequence[str], columns: Columns) -> None:
    """Of columns x, y, z, w: from w on if it stands in front."""
    places = list(columns.numbers)
    front = min(names, key=places.index) == names[3]
    body.rotation = [names[3], *names[:3]] if front else list(names)
    body.kind, body.named = "wxyz" if front else "xyzw", True


def _nameless(columns: Columns) -> list[Body]:
    """Bodies of columns that have no names, by their numbers, each of one array."""
    whole: dict[str, list[str]] = {}
    for name in columns.numbers:
        whole.setdefault(_ARRAY.sub("", unit_of(name, columns)[0]), []).append(name)
    alone = [names[0] for names in whole.values() if len(names) == 1]
    arrays = [alone, *(names for names in whole.values() if len(names) > 1)]
    bodies = [body for names in arrays for body in _in_array(names, columns)]
    for body in bodies:
        body.doubt = "   # CHANGE? taken by its numbers alone: the columns have no names"
        body.wanted = is_wanted(body.name, [other.name for other in bodies])
    return sorted(bodies, key=lambda body: list(columns.numbers).index(body.position[0]))


def _in_array(array: Sequence[str], columns: Columns) -> list[Body]:
    """Transforms, or quaternions with a place before or behind and the triples beside them."""
    names = [name for name in array if not rises(columns.numbers[name])]
    owner = _ARRAY.sub("", array[0]) if len(array) > 1 else "?"
    owner = "?" if owner.strip() in ("", "column") else owner
    found = _transform(array, columns) if len(array) in (12, 16) else None
    if found:
        return [Body(name=owner, position=found[1], rotation=found[0], kind="matrix")]
    bodies: list[Body] = []
    while with_turn := _with_quaternion(names, columns):
        turn, place = with_turn
        kind, sure = _order_of(turn, place, columns)
        bodies.append(Body(name=owner, position=place, rotation=turn, kind=kind, sure=sure))
        names = [name for name in names if name not in turn + place]
    for run in _runs(names, list(columns.numbers)) if bodies else ():
        if len(run) in (2, 3):
            bodies.append(Body(name=owner, position=run))
    return bodies


def _runs(names: Sequence[str], order: Sequence[str]) -> list[list[str]]:
    """Names that follow one another in the table."""
    runs: list[list[str]] = []
    for name in names:
        if runs and order.index(name) == order.index(runs[-1][-1]) + 1:
            runs[-1].append(name)
        else:
            runs.append([name])
    return runs


def _with_quaternion(names: list[str], columns: Columns) -> tuple[list[str], list[str]] | None:
    """Four columns of norm 1 and the three before them, or behind them if there are none."""
    for k in range(len(names) - 3):
        turn = names[k : k + 4]
        place = names[k - 3 : k] if k >= 3 else names[k + 4 : k + 7]
        if len(place) == 3 and _is_quaternion(turn, columns):
            return turn, place
    return None


def _transform(names: Sequence[str], columns: Columns) -> tuple[list[str], list[str]] | None:
    """Rotation, row by row, and place of twelve or sixteen columns of a transform, by rows or by columns."""
    by_rows = [list(names[4 * i : 4 * i + 3]) for i in range(3)], [names[3], names[7], names[11]]
    across = [[names[i + 4 * j] for j in range(3)] for i in range(3)], list(names[12:15])
    by_columns = [across] if len(names) == 16 else [
        ([[names[i + 3 * j] for j in range(3)] for i in range(3)], list(names[9:12]))
    ]  # fmt: skip
    for rows, place in (by_rows, *by_columns):
        rotation = [name for row in rows for name in row]
        values = filled(place, columns)
        if _is_matrix(rotation, columns) and (len(names) == 12 or np.ptp(values, axis=0).any() or values.any()):
            return rotation, place
    return None


def _in_order(axes: Mapping[str, str], wanted: Sequence[str]) -> list[str]:
    """The columns of some axes; none if one is not there."""
    found = [axes[axis] for axis in wanted if axis in axes]
    return found if len(found) == len(wanted) else []


def _ways(values: Array) -> Array:
    """How far each of some columns (n, k) goes, but for its ends."""
    return np.asarray(np.quantile(values, 0.95, axis=0) - np.quantile(values, 0.05, axis=0))


def _has_height(names: Sequence[str], columns: Columns) -> bool:
    values = filled(names, columns)
    if not len(values):
        return True
    ways = _ways(values)
    # What is never below 0, and goes no farther than the others, is the height of what is lifted at times.
    return bool(ways.min() < FLAT * ways.max() or (values[:, 2].min() >= 0.0 and ways[2] < ways.max()))


def _is_quaternion(names: Sequence[str], columns: Columns, *, every: bool = False) -> bool:
    """Whether rows have norm 1: most of them, or every one but those of zeros, in which nothing was seen."""
    values = filled(names, columns)
    if every:
        values = values[(values != 0.0).any(axis=1)]
    off = np.abs(np.linalg.norm(values, axis=1) - 1.0)
    return len(values) > 0 and bool((np.max if every else np.median)(off) < UNIT)


def _is_matrix(names: Sequence[str], columns: Columns) -> bool:
    values = filled(names, columns).reshape(-1, 3, 3)
    off = np.abs(values @ values.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    return len(values) > 0 and bool(np.median(off) < UNIT)


def _order_of(names: Sequence[str], place: Sequence[str], columns: Columns) -> tuple[str, bool]:
    """The order of a quaternion by its numbers, and whether that is sure."""
    values = filled(names, columns)
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
