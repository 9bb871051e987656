"""Reads a map: every key is checked, and what breaks a rule is refused by file, line and key."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Final, TypeVar, cast

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from physid_drake.convert.map_values import not_negative, positive, rotation_from, size_of_unit, truth, unit_of
from physid_drake.convert.mapping import (
    COUNTS,
    CUTS,
    FORMAT,
    ROTATIONS,
    Clock,
    Cut,
    ForceMap,
    Map,
    Offset,
    PoseMap,
    Quantity,
    Rows,
    Stated,
    Turn,
    World,
)
from physid_drake.convert.solid_reading import model_from
from physid_drake.convert.text_table import Dialect
from physid_drake.convert.units import ANGLES, FORCES, LENGTHS, SPEEDS, TIMES, factor
from physid_drake.errors import RecordingError
from physid_drake.recording import Conversion
from physid_drake.recording.description import (
    Section,
    hand_from,
    load_section,
    section_of,
    sensors_from,
    table_from,
)
from physid_drake.wording import shown

Array = NDArray[np.float64]
_T = TypeVar("_T")

_ROWS_KEYS: Final = ("file", "section", "where")
_TOP_KEYS: Final = ("format", "recording", "source", "world", "time", "object", "hand", "force", "pushes")


def read_map(file: Path) -> Map:
    """Reads a map.

    Args:
        file: of YAML, in the format ``physid-map/1``.

    Raises:
        RecordingError: if it cannot be read or breaks a rule; one line that names file, line and key.
    """
    file = Path(file)
    top = load_section(file, FORMAT, _TOP_KEYS)
    described = cast(Section, top.section("recording"))
    described.check_keys("name", "description", "object", "table", "hand", "sensors")
    hand = hand_from(described)
    path = _maybe(top, "hand", _pose)
    force = _maybe(top, "force", _force)
    body, cut = _pose(cast(Section, top.section("object"))), _maybe(top, "pushes", _cut) or Cut()
    _check_rows(top, body, path, force, cut)
    if (hand is None) != (path is None):
        missing, there = ("recording.hand", "hand") if hand is None else ("hand", "recording.hand")
        raise top.refuse(missing, f"is missing, but there is {there}; give both or neither.")
    if force is not None and path is None:
        raise top.refuse("force", "needs a hand; add hand and recording.hand.")
    return Map(
        file=file,
        name=described.text("name"),
        description=described.text("description", ""),
        model=model_from(described, file.parent),
        table=table_from(described),
        hand=hand,
        sensors=sensors_from(described),
        dialect=_maybe(top, "source", _dialect) or Dialect(),
        by_receive=_by_receive(top),
        world=_maybe(top, "world", _world) or World(),
        clock=_maybe(top, "time", _clock) or Clock(),
        object=body,
        hand_path=path,
        force=force,
        cut=cut,
    )


def stated_in(conversion: Conversion | None) -> Stated | None:
    """What the map of a converted recording says of its streams; None where there is no map that can be read."""
    return None if conversion is None else _stated_in(conversion.map)


@lru_cache(maxsize=8)
def _stated_in(text: str) -> Stated | None:
    try:
        top = section_of(text, Path("map"), FORMAT, _TOP_KEYS)
        return Stated(
            world=_maybe(top, "world", _world) or World(),
            object=_pose(cast(Section, top.section("object"))),
            hand=_maybe(top, "hand", _pose),
            force=_maybe(top, "force", _force),
            lines=top.lines,
        )
    except RecordingError:  # of another version, or changed by hand
        return None


def _check_rows(top: Section, body: PoseMap, path: PoseMap | None, force: ForceMap | None, cut: Cut) -> None:
    """Where a row is a push, its first and last poses are given, and how fast the hand was; nowhere else."""
    for key, pose in (("object", body), ("hand", path)):
        if pose is not None and (pose.end is not None) != (cut.by == "rows"):
            rule = "needs start and end" if cut.by == "rows" else "has start and end, which are of cut: rows"
            raise top.refuse(key, f"{rule}; correct one of them.")
    if cut.by == "rows" and path is not None and path.speed is None:
        raise top.refuse("hand", "needs speed [m/s], or its column: nobody could tell how fast the push was.")
    if cut.by == "rows" and path is not None and path.rows != body.rows:
        raise top.refuse("hand", "and object are of one table with cut: rows; remove file, section and where.")
    if cut.by == "rows" and force is not None:
        raise top.refuse("force", "is of logs with times; leave it out with cut: rows.")


def _maybe(top: Section, key: str, read: Callable[[Section], _T]) -> _T | None:
    section = top.section(key, required=False)
    return None if section is None else read(section)


def _dialect(section: Section) -> Dialect:
    section.check_keys("separator", "decimal", "header_lines", "skip_lines", "encoding", "section", "stamp")
    separator = section.text("separator") if section.has("separator") else None
    if separator is not None and len(separator) != 1:
        raise section.refuse("separator", f'must be one character, but got {shown(separator)}; write a tab as "\\t".')
    return Dialect(
        separator=separator,
        decimal=section.choice("decimal", ".", ",") if section.has("decimal") else None,
        header_lines=_whole(section, "header_lines", 0) if section.has("header_lines") else None,
        skip_lines=_whole(section, "skip_lines", 0) if section.has("skip_lines") else 0,
        encoding=section.text("encoding") if section.has("encoding") else None,
        section=_whole(section, "section", 1) if section.has("section") else 1,
    )


def _by_receive(top: Section) -> bool:
    section = top.section("source", required=False)
    if section is None or not section.has("stamp"):
        return False
    return section.choice("stamp", "header", "receive") == "receive"


def _whole(section: Section, key: str, least: int) -> int:
    value = section.number(key)
    if value != int(value) or value < least:
        raise section.refuse(key, f"must be a whole number of at least {least}, but got {value:g}.")
    return int(value)


def _world(section: Section) -> World:
    section.check_keys("axes", "left_handed", "origin", "unit", "rotation_wxyz", "yaw_deg", "pose")
    if section.has("pose"):
        return _world_by_pose(section)
    axes = _axes(section) if section.has("axes") else np.eye(3)
    left = truth(section, "left_handed")
    if (np.linalg.det(axes) < 0.0) != left:
        kind = "a mirror image" if not left else "none"
        raise section.refuse(
            "axes", f"these make {kind} of the source; set left_handed: {str(not left).lower()} only if its axes are"
            " left-handed (thumb x, forefinger y, middle finger z of the left hand), else correct the axes."
        )  # fmt: skip
    scale = size_of_unit(section, LENGTHS, "m")
    origin = section.numbers("origin", 3) if section.has("origin") else (0.0, 0.0, 0.0)
    return World(
        axes=axes, origin=(scale * origin[0], scale * origin[1], scale * origin[2]), rotation=rotation_from(section)
    )


def _world_by_pose(section: Section) -> World:
    """The source's frame, as a camera's, by its pose in W: p_W = R p_S + t."""
    for key in section.values:
        if key != "pose":
            raise section.refuse(str(key), "stands beside pose, which says all; remove one of them.")
    pose = cast(Section, section.section("pose"))
    pose.check_keys("translation", "unit", "rotation_wxyz", "yaw_deg")
    place, turn = np.multiply(size_of_unit(pose, LENGTHS, "m"), pose.numbers("translation", 3)), rotation_from(pose)
    origin = -Rotation.from_quat(np.roll(turn, -1)).inv().apply(place)
    return World(origin=(float(origin[0]), float(origin[1]), float(origin[2])), rotation=turn)


def _axes(section: Section) -> Array:
    said = section.get("axes", "three of x, y, z, -x, -y, -z", _as_axes)
    rows = np.zeros((3, 3))
    for k, axis in enumerate(said):
        rows[k, "xyz".index(axis[-1])] = -1.0 if axis[0] == "-" else 1.0
    return rows


def _as_axes(value: object) -> list[str] | None:
    if not isinstance(value, list) or len(value) != 3:
        return None
    words = [str(one) for one in value]
    good = all(word.lstrip("-") in ("x", "y", "z") and len(word) <= 2 for word in words)
    return words if good and len({word[-1] for word in words}) == 3 else None


def _clock(section: Section) -> Clock:
    section.check_keys("column", "columns", "unit", "rate_hz", "offset_s")
    if section.has("unit") and section.has("rate_hz"):
        raise section.refuse("rate_hz", "is of frames that are numbered, which have no unit; remove one of them.")
    unit = section.text("unit") if section.has("unit") else None
    if unit is not None:
        with section.naming("unit"):
            factor(unit, TIMES, "times")
    column, fine = section.text("column") if section.has("column") else None, None
    if section.has("columns"):
        if column is not None or unit is not None or section.has("rate_hz"):
            raise section.refuse(
                "columns", "are of seconds and nanoseconds; nothing else says how times are written."
            )
        column, fine = _names(section, (2,))
        unit = "s"
    rate = positive(section, "rate_hz", 1.0) if section.has("rate_hz") else None
    return Clock(column=column, fine=fine, unit=unit, rate=rate, offset=section.maybe_number("offset_s") or 0.0)


def _pose(section: Section) -> PoseMap:
    """One body; where a row is a push, what it is at first, with what it is at last."""
    if not section.has("start"):
        return _one_pose(section)
    section.check_keys("start", "end", "speed", "world", *_ROWS_KEYS)
    first, last = (_one_pose(cast(Section, section.section(key))) for key in ("start", "end"))
    speed: Quantity | float | None = None
    if isinstance(section.values.get("speed"), dict):
        speed = _quantity(cast(Section, section.section("speed")), SPEEDS, (1,))
    elif section.has("speed"):
        speed = positive(section, "speed", 1.0)
    world = _maybe(section, "world", _world)
    return replace(first, end=replace(last, world=world), speed=speed, world=world, rows=_rows(section))


def _one_pose(section: Section) -> PoseMap:
    section.check_keys("topic", "frame", *_ROWS_KEYS, "time", "position", "rotation", "offset", "height_m", "world")
    position = _maybe(section, "position", lambda inner: _quantity(inner, LENGTHS, (2, 3)))
    topic = section.text("topic") if section.has("topic") else None
    if position is None and topic is None:
        raise section.refuse("position", "is required, but missing; give its columns, or the topic of a bag.")
    return PoseMap(
        topic=topic,
        frame=section.text("frame") if section.has("frame") else None,
        rows=_rows(section),
        clock=_maybe(section, "time", _clock) or Clock(),
        position=position or Quantity(),
        turn=_turn(section),
        offset=_maybe(section, "offset", _offset) or Offset(),
        height=section.maybe_number("height_m"),
        world=_maybe(section, "world", _world),
    )


def _rows(section: Section) -> Rows:
    """Which rows of a source's tables are a stream's."""
    if any(section.has(key) for key in _ROWS_KEYS) and section.has("topic"):
        raise section.refuse("topic", f"is of bags, and {', '.join(_ROWS_KEYS)} are of tables; remove one of them.")
    where = section.get("where", "columns, each with a number or a text", _as_values) if section.has("where") else ()
    return Rows(
        file=section.text("file") if section.has("file") else None,
        section=_whole(section, "section", 1) if section.has("section") else None,
        where=where,
    )


def _as_values(value: object) -> tuple[tuple[str, float | str], ...] | None:
    if not isinstance(value, dict) or not value:
        return None
    good = all(isinstance(k, str) and isinstance(v, str | int | float) for k, v in value.items())
    # True and False are texts in a table: YAML takes them for truth values.
    plain = {name: str(one) if isinstance(one, bool) else one for name, one in value.items()} if good else {}
    return tuple((name, one if isinstance(one, str) else float(one)) for name, one in plain.items()) if good else None


def _turn(section: Section) -> Turn | None:
    """The rotation; None where the map says that there is none, and as the messages have it where it says nothing."""
    if section.values.get("rotation") == "none":
        return None
    inner = section.section("rotation", required=section.values.get("topic") is None)
    if inner is None:
        return Turn()
    inner.check_keys("columns", "as", "unit", "order", "inverse")
    kind = inner.choice("as", *ROTATIONS) if inner.has("as") else "wxyz"
    columns = _names(inner, COUNTS[kind]) if inner.has("columns") else ()
    order = inner.text("order") if kind == "euler" else "XYZ"
    if kind == "euler" and (sorted(order.lower()) != sorted(set(order.lower())) or _bad_order(order)):
        raise inner.refuse("order", f"must be such as XYZ (about the body's axes) or xyz, but got {shown(order)}.")
    return Turn(
        columns=columns,
        kind=kind,
        unit=unit_of(inner, ANGLES, "angles"),
        order=order,
        inverse=truth(inner, "inverse"),
    )


def _bad_order(order: str) -> bool:
    try:
        Rotation.from_euler(order, np.zeros(3))
    except ValueError:
        return True
    return False


def _force(section: Section) -> ForceMap:
    section.check_keys(
        "topic", *_ROWS_KEYS, "time", "columns", "unit", "axes", "offset", "acts_on", "weight_n", "tare_s", "world"
    )
    topic = section.text("topic") if section.has("topic") else None
    columns = _names(section, (2, 3)) if topic is None or section.has("columns") else ()
    return ForceMap(
        topic=topic,
        rows=_rows(section),
        clock=_maybe(section, "time", _clock) or Clock(),
        force=Quantity(columns=columns, unit=unit_of(section, FORCES, "forces")),
        in_hand=section.has("axes") and section.choice("axes", "world", "hand") == "hand",
        offset=_maybe(section, "offset", _offset) or Offset(),
        on_hand=section.has("acts_on") and section.choice("acts_on", "object", "hand") == "hand",
        weight=not_negative(section, "weight_n", 0.0),
        tare=not_negative(section, "tare_s", 0.0),
        world=_maybe(section, "world", _world),
    )


def _quantity(section: Section, kind: Mapping[str, float], counts: tuple[int, ...]) -> Quantity:
    section.check_keys("columns", "unit")
    columns = _names(section, counts) if section.has("columns") else ()
    if isinstance(section.values.get("unit"), int | float):
        return Quantity(columns=columns, size=positive(section, "unit", 1.0))
    return Quantity(columns=columns, unit=unit_of(section, kind, "it"))


def _names(section: Section, counts: tuple[int, ...]) -> tuple[str, ...]:
    wanted = " or ".join(map(str, counts))

    def accept(value: object) -> tuple[str, ...] | None:
        names = [value] if isinstance(value, str) else value
        good = isinstance(names, list) and len(names) in counts and all(isinstance(one, str) for one in names)
        return tuple(cast("list[str]", names)) if good else None

    return section.get("columns", f"the names of {wanted} column(s)", accept)


def _offset(section: Section) -> Offset:
    section.check_keys("translation", "unit", "rotation_wxyz", "yaw_deg")
    scale = size_of_unit(section, LENGTHS, "m")
    place = section.numbers("translation", 3) if section.has("translation") else (0.0, 0.0, 0.0)
    return Offset(translation=(scale * place[0], scale * place[1], scale * place[2]), rotation=rotation_from(section))


def _cut(section: Section) -> Cut:
    section.check_keys("cut", "column", "gap_s", "still_s", "lead_s", "tail_s", "times_s")
    by = section.choice("cut", *CUTS)
    for key, of in (("column", "column"), ("gap_s", "gap"), ("times_s", "times")):
        if section.has(key) and by != of:
            raise section.refuse(key, f"is of cut: {of}, but cut is {by}; remove it.")
    plain = Cut()
    column = section.text("column") if by == "column" else None
    times = section.get("times_s", "a list of [begin, end] in s", _as_times) if by == "times" else ()
    return Cut(
        by=by,
        column=column,
        gap=positive(section, "gap_s", plain.gap),
        still=positive(section, "still_s", plain.still),
        lead=positive(section, "lead_s", plain.lead),
        tail=positive(section, "tail_s", plain.tail),
        times=times,
    )


def _as_times(value: object) -> tuple[tuple[float, float], ...] | None:
    if not isinstance(value, list) or not value:
        return None
    pairs = []
    for one in value:
        good = isinstance(one, list) and len(one) == 2 and all(isinstance(t, int | float) for t in one)
        if not good or not one[0] < one[1]:
            return None
        pairs.append((float(one[0]), float(one[1])))
    return tuple(pairs)
