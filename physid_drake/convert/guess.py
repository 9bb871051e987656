"""Looks at a log and writes a first map of it, with what it doubts as comments.

Names tell most: what ends in x, y, z is a place, what ends in qw or holds four columns of norm 1 is a rotation, what
is called force or wrench is one. Numbers tell the rest: which axis is up, m or mm, the order of a quaternion.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from physid_drake.convert.bag import ENDINGS, RECEIVE, STAMP, TopicInfo, holds_numbers, read_bag, topics_of
from physid_drake.convert.columns import Array, Columns
from physid_drake.convert.convert import ARRAYS, TEXTS, read_columns
from physid_drake.convert.units import ANGLES, FORCES, LENGTHS, TIMES
from physid_drake.recording.adapters.sources import source_files
from physid_drake.recording.clocks import LIKELY

OBJECT_WORDS: Final = ("object", "obj", "mug", "box", "block", "cube", "slider", "target", "item", "payload")
HAND_WORDS: Final = (
    "hand", "action", "tip", "finger", "tool", "tcp", "eef", "ee", "gripper", "pusher", "robot", "probe", "stylus",
)  # fmt: skip
PUSH_WORDS: Final = ("push", "episode", "trial", "run", "rep", "versuch", "segment")
MOST_TURNS: Final = 2000
"""Rotations that are looked at."""

CLEARLY: Final = 0.3
"""Of the turns about the vertical: by so much more, one order of a quaternion is the right one."""

FAR_AWAY: Final = 0.3
"""m from the table's top, along the vertical: the source's frame is that of a camera."""

METRES, CENTIMETRES = 5.0, 60.0
"""Places on a table that are nowhere larger are in m, or in cm."""

_AXES: Final = re.compile(
    r"^(?P<stem>.*?)[\s_./\-:]*(?P<axis>q[wxyz]|[rtf][xyz]|[xyzw]|roll|pitch|yaw|theta|heading|\[\d+\])"
    r"(?:[\s_]*[\[(]?(?P<unit>"
    + "|".join(sorted([*LENGTHS, *ANGLES, *FORCES], key=len, reverse=True))
    + r")[\])]?)?$",
    re.IGNORECASE,
)
_TIME: Final = re.compile(r"time|stamp|(^|[\s_/])t([\s_\[(]|$)|seconds|zeit", re.IGNORECASE)


@dataclass(kw_only=True)
class _Body:
    """What was found of one body or sensor: columns by kind."""

    name: str
    position: list[str] = field(default_factory=list)
    rotation: list[str] = field(default_factory=list)
    kind: str = "wxyz"
    sure: bool = True
    force: list[str] = field(default_factory=list)
    unit: str | None = None


@dataclass(frozen=True, kw_only=True)
class Guess:
    """A first map, and what the log holds.

    Attributes:
        text: of the map.
        rows: of a table for the terminal: name, samples, rate [Hz], least, largest.
    """

    text: str
    rows: tuple[tuple[str, ...], ...]


@np.errstate(over="ignore", invalid="ignore")  # numbers out of all proportion are looked at as well
def guess_map(source: Path) -> Guess:
    """Looks at a table, a bag, or a folder of tables.

    Raises:
        RecordingError: if it cannot be read.
    """
    source = Path(source)
    return _guess_bag(source) if is_bag(source) else _guess_table(source)


def is_bag(source: Path) -> bool:
    """Whether a file or a folder looks like a bag, by its endings."""
    return source.suffix in ENDINGS or (source.is_dir() and any(f.suffix in ENDINGS for f in source.iterdir()))


def _guess_table(source: Path) -> Guess:
    files = source_files(source, *TEXTS, *ARRAYS)
    columns = read_columns(files[0])
    time, unit = _time_of(columns)
    clock = None if time is None else columns.numbers[time] * TIMES.get(unit, np.nan)
    rows = [_row(name, values, clock) for name, values in columns.numbers.items()]
    rows += [(name, str(len(texts)), "", "text", "") for name, texts in columns.texts.items()]
    bodies = _bodies(columns)
    body, hand, force = _roles(bodies)
    doubt = _set_units([one for one in (body, hand) if one is not None], columns)
    lines = [*_head(source, body, columns, hand is not None)]
    if time is None:
        lines.append('time: {column: "?", unit: s}   # CHANGE: no column looks like times')
    elif unit == "frames":
        lines.append(f"time: {{column: {_quoted(time)}, rate_hz: 100}}   # CHANGE: it counts frames; at which rate?")
    else:
        lines.append(f"time: {{column: {_quoted(time)}, unit: {unit}}}")
    lines += _pose_lines("object", body, columns, doubt)
    if hand is not None:
        lines += _pose_lines("hand", hand, columns, doubt)
    if force is not None:
        lines += _force_lines(force, columns)
    lines.append(_cut_line(columns, time, many=len(files) > 1))
    text = "\n".join(lines)
    left = [name for name in columns.numbers if _quoted(name) not in text]
    if left:
        lines.append(f"# not used: {', '.join(left)}")
    return Guess(text="\n".join(lines) + "\n", rows=tuple(rows))


def _row(name: str, values: Array, times: Array | None) -> tuple[str, ...]:
    seen = values[np.isfinite(values)]
    if not len(seen):
        return name, "0", "", "empty", ""
    rate = ""
    if times is not None and len(times) == len(values) and len(seen) > 2:
        rate = _rate(times[np.isfinite(values)])
    return name, str(len(seen)), rate, f"{seen.min():.6g}", f"{seen.max():.6g}"


def _step(times: Array) -> float:
    """The usual step of times (n,); NaN of too few."""
    steps = np.diff(times[np.isfinite(times)])
    return float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else np.nan


def _rate(times: Array) -> str:
    step = _step(times)
    return f"{1.0 / step:.4g}" if np.isfinite(step) else ""


def _time_of(columns: Columns) -> tuple[str | None, str]:
    """The column of times and its unit; ``frames`` for one that counts them."""
    rising = [name for name, values in columns.numbers.items() if _rises(values)]
    likely = [name for name in rising if _TIME.search(name.rsplit("/", 1)[-1])]
    for name in likely:
        return name, _time_unit(name, columns)
    frames = [name for name in rising if (np.diff(columns.numbers[name]) == 1.0).mean() > 0.9]
    return (frames[0], "frames") if frames else (None, "s")


def _rises(values: Array) -> bool:
    seen = values[np.isfinite(values)]
    return len(seen) > 2 and float(np.mean(np.diff(seen) > 0.0)) > 0.9


def _time_unit(name: str, columns: Columns) -> str:
    if name in columns.units and columns.units[name] in TIMES:
        return columns.units[name]
    stated = re.search(r"[\[(_ ](ms|us|ns|s)[\])]?$", name)
    if stated:
        return stated[1]
    usual = _step(columns.numbers[name])
    return next((unit for unit, size in TIMES.items() if usual * size <= LIKELY), "s")


def _bodies(columns: Columns) -> list[_Body]:
    """Columns by what their names begin with."""
    found: dict[str, dict[str, str]] = {}
    units: dict[str, str] = {}
    for name in columns.numbers:
        match = _AXES.match(name)
        if match:
            axes = found.setdefault(match["stem"], {})
            axes.setdefault(match["axis"].lower(), name)
            if match["unit"] or name in columns.units:
                units[name] = columns.units.get(name) or match["unit"]
    bodies: dict[str, _Body] = {}
    for stem, axes in found.items():
        place, turn, force = _split_axes(stem, axes, columns)
        owner = re.sub(
            r"[\s_./\-:]*(position|pos|translation|rotation|rot|orientation|quat\w*|pose|force|wrench)$", "", stem,
            flags=re.IGNORECASE,
        )  # fmt: skip
        body = bodies.setdefault(owner, _Body(name=owner or "?"))
        body.position = body.position or place
        body.force = body.force or force
        if turn and not body.rotation:
            body.rotation = turn
        unit = next((units[name] for name in place if name in units), None)
        body.unit = body.unit or unit
    for body in bodies.values():
        if body.rotation:
            body.kind, body.sure = _rotation_kind(body.rotation, body.position, columns)
    return [body for body in bodies.values() if body.position or body.force]


def _split_axes(stem: str, axes: Mapping[str, str], columns: Columns) -> tuple[list[str], list[str], list[str]]:
    """Columns of places, rotations and forces under one stem."""
    numbered = [axes[f"[{k}]"] for k in range(len(axes)) if f"[{k}]" in axes]
    if len(numbered) == 7 and _is_unit(numbered[3:], columns):
        return numbered[:3], numbered[3:], []
    if numbered and len(numbered) in (2, 3) and not re.search("force|wrench|ft", stem, re.IGNORECASE):
        return numbered, [], []
    if len(numbered) == 3 or len(numbered) == 6:
        return [], [], numbered[:3]
    some = [axes[a] for a in ("x", "y", "z") if a in axes]
    four = [axes[a] for a in ("x", "y", "z", "w") if a in axes]
    if len(four) == 4 and _is_unit(four, columns):
        return [], four, []
    forced = [axes[a] for a in ("fx", "fy", "fz") if a in axes]
    if re.search("force|wrench|ft", stem, re.IGNORECASE) and len(some) >= 2:
        return [], [], some
    place = some if len(some) >= 2 else [axes[a] for a in ("tx", "ty", "tz") if a in axes]
    quaternion = [axes[a] for a in ("qx", "qy", "qz", "qw") if a in axes]
    euler = [axes[a] for a in ("yaw", "pitch", "roll") if a in axes]
    vector = [axes[a] for a in ("rx", "ry", "rz") if a in axes]
    heading = [axes[a] for a in ("yaw", "theta", "heading") if a in axes][:1]
    turn = next(
        (found for found, n in ((quaternion, 4), (euler, 3), (vector, 3), (heading, 1)) if len(found) == n), []
    )
    return place if len(place) >= 2 else [], turn, forced if len(forced) >= 2 else []


def _is_unit(names: Sequence[str], columns: Columns) -> bool:
    values = np.column_stack([columns.numbers[name] for name in names])
    values = values[np.isfinite(values).all(axis=1)]
    return len(values) > 0 and bool(np.median(np.abs(np.linalg.norm(values, axis=1) - 1.0)) < 0.02)


def _rotation_kind(names: Sequence[str], place: Sequence[str], columns: Columns) -> tuple[str, bool]:
    """How a rotation is written, and whether that is sure."""
    if len(names) == 1:
        return "yaw", True
    if len(names) == 3:
        return ("euler" if re.search("roll|pitch|yaw", names[0], re.IGNORECASE) else "rotation_vector"), True
    if names[0].lower().rstrip("]").endswith("x"):
        return "xyzw", True
    values = np.column_stack([columns.numbers[name] for name in names])
    values = values[np.isfinite(values).all(axis=1) & (values != 0.0).any(axis=1)][
        :: max(1, len(values) // MOST_TURNS)
    ]
    up = _up_of(place, columns)
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


def _up_of(place: Sequence[str], columns: Columns) -> int | None:
    """The axis along which a body hardly moves; None where no height was measured."""
    if len(place) < 3:
        return None
    values = np.column_stack([columns.numbers[name] for name in place])
    values = values[np.isfinite(values).all(axis=1)]
    if not len(values):
        return None
    return int(np.argmin(np.quantile(values, 0.95, axis=0) - np.quantile(values, 0.05, axis=0)))


def _roles(bodies: Sequence[_Body]) -> tuple[_Body | None, _Body | None, _Body | None]:
    """Which body is the object, which the hand, and which holds the force."""
    force = next((body for body in bodies if body.force), None)
    placed = [body for body in bodies if body.position]

    def called(words: Sequence[str]) -> _Body | None:
        return next(
            (b for b in placed if set(re.split(r"[^a-z]+", b.name.lower())) & set(words)
             or any(len(w) > 3 and w in b.name.lower() for w in words)), None,
        )  # fmt: skip

    hand, body = called(HAND_WORDS), called(OBJECT_WORDS)
    rest = [one for one in placed if one is not hand and one is not body]
    if body is None:
        body = next((one for one in rest if one.rotation), rest[0] if rest else None)
        rest = [one for one in rest if one is not body]
    if hand is None and rest:
        hand = rest[0]
    return body, hand, force


def _head(source: Path, body: _Body | None, columns: Columns, has_hand: bool) -> list[str]:
    world = [] if body is None else _world_lines(body, columns)
    hand = ["  hand: {tip: sphere, radius_m: 0.01, stream: measured}   # CHANGE: the tip's shape and size"]
    return [
        f"# A first map of {source.name}. Lines with CHANGE need your knowledge; the others are worth a look.",
        "# Every key: docs/bring_your_data.md",
        "format: physid-map/1",
        "recording:",
        f"  name: {_quoted(source.stem)}",
        "  object: {shape: box, size_m: [0.1, 0.1, 0.1]}   # CHANGE: measure it; mass_kg: if you weighed it",
        "  table: {size_m: [1.2, 0.8], centre_m: [0, 0]}   # CHANGE: its size, and where its middle is in W",
        *(hand if has_hand else []),
        *world,
    ]


def _world_lines(body: _Body, columns: Columns) -> list[str]:
    """Which axis is up: the one along which the object hardly moves; where the table's top is nobody knows."""
    values = np.column_stack([columns.numbers[name] for name in body.position])
    values = LENGTHS[body.unit or "m"] * values[np.isfinite(values).all(axis=1)]
    up = _up_of(body.position, columns)
    if up is None:
        return []
    axes = {0: "[y, z, x]", 1: "[z, x, y]", 2: "[x, y, z]"}[up]
    height = float(np.median(values[:, up]))
    return [
        f"# {'xyz'[up]} of the object changes least, and is taken for up. It is {height:.4g} m: unless that is",
        "# how high the object's middle is above the table, give origin, too.",
        *(
            ["# So far away, the frame may be a camera's: then give its pose in W instead (world: {pose: ...})."]
            if abs(height) > FAR_AWAY
            else []
        ),
        f"world: {{axes: {axes}}}",
    ]


def _set_units(bodies: Sequence[_Body], columns: Columns) -> str:
    """Gives all bodies a unit of length: the header's, else one that fits a table; the doubt that is left."""
    stated = next((body.unit for body in bodies if body.unit in LENGTHS), None)
    values = [np.abs(columns.numbers[name]) for body in bodies for name in body.position]
    largest = max((float(np.nanmax(one, initial=0.0)) for one in values), default=0.0)
    likely = "m" if largest < METRES else "cm" if largest < CENTIMETRES else "mm"
    for body in bodies:
        body.unit = body.unit if body.unit in LENGTHS else stated or likely
    return "" if stated else "   # m, cm or mm?"


def _pose_lines(key: str, body: _Body | None, columns: Columns, doubt: str) -> list[str]:
    if body is None:
        return [
            f"{key}:",
            '  position: {columns: ["?", "?", "?"], unit: m}   # CHANGE: no columns look like places',
            "  rotation: none",
        ]
    lines = [
        f"{key}:   # {body.name}",
        f"  position: {{columns: {_list(body.position)}, unit: {body.unit}}}{doubt}",
    ]
    if not body.rotation:
        lines.append("  rotation: none" + ("   # is it nowhere in the log?" if key == "object" else ""))
    elif body.kind in ("wxyz", "xyzw"):
        other = "" if body.sure else "   # or " + {"wxyz": "xyzw", "xyzw": "wxyz"}[body.kind] + "?"
        lines.append(f"  rotation: {{columns: {_list(body.rotation)}, as: {body.kind}}}{other}")
    else:
        values = np.concatenate([columns.numbers[name] for name in body.rotation])
        unit = "deg" if np.nanmax(np.abs(values), initial=0.0) > 2.5 * np.pi else "rad"
        order = ", order: ZYX" if body.kind == "euler" else ""
        lines.append(
            f"  rotation: {{columns: {_list(body.rotation)}, as: {body.kind}{order}, unit: {unit}}}   # deg or rad?"
        )
    if len(body.position) == 2:
        lines.append("  height_m: 0.05   # CHANGE: of its middle above the table, which nobody measured")
    return lines


def _force_lines(force: _Body, columns: Columns) -> list[str]:
    unit = next((columns.units[n] for n in force.force if columns.units.get(n) in FORCES), "N")
    return [
        f"force: {{columns: {_list(force.force)}, unit: {unit}, axes: world, acts_on: object}}"
        "   # or axes: hand, acts_on: hand? tare_s: 0.2 takes an offset away"
    ]


def _cut_line(columns: Columns, time: str | None, *, many: bool) -> str:
    if many:
        return "pushes: {cut: whole}   # one file is one push"
    for name, values in columns.numbers.items():
        called = any(word in name.lower() for word in PUSH_WORDS)
        if called and np.isfinite(values).all() and (values == np.round(values)).all() and len(set(values)) > 1:
            return f"pushes: {{cut: column, column: {_quoted(name)}}}"
    if time is not None:
        steps = np.diff(columns.numbers[time])
        if (steps > 50.0 * np.median(steps)).any():
            return "pushes: {cut: gap, gap_s: 0.5}"
    return "pushes: {cut: rest}   # between two rests of the object"


def _guess_bag(source: Path) -> Guess:
    topics = topics_of(source)
    wanted = [
        (topic, frame)
        for topic, info in topics.items()
        if info.count
        for frame in (info.frames or (None,))
        if _usable(info)
    ]
    found = read_bag(source, wanted) if wanted else {}
    rows = [_topic_row(topic, frame, columns) for (topic, frame), columns in found.items()]
    read = {topic for topic, _ in found}
    rows += [(topic, str(info.count), "", info.kind, "") for topic, info in topics.items() if topic not in read]
    bodies = {
        key: _Body(name=f"{key[0]} {key[1] or ''}".strip(), position=["x", "y", "z"], rotation=_turn_columns(columns))
        for key, columns in found.items()
        if "tx" not in columns.numbers
    }
    body, hand, _ = _roles(list(bodies.values()))
    force = next((key for key, columns in found.items() if "tx" in columns.numbers), None)
    where = {one.name: key for key, one in bodies.items()}
    columns = found[where[body.name]] if body is not None else Columns(source="", numbers={})
    lines = [*_head(source, body, columns, hand is not None)]
    for key, one in (("object", body), ("hand", hand)):
        if one is not None:
            topic, frame = where[one.name]
            turn = "" if one.rotation else ", rotation: none"
            of = "" if frame is None else f", frame: {_quoted(frame)}"
            lines.append(f"{key}: {{topic: {_quoted(topic)}{of}{turn}}}")
    if body is None:
        lines.append('object: {topic: "?"}   # CHANGE: no topic holds poses')
    if force is not None:
        lines.append(
            f"force: {{topic: {_quoted(force[0])}, axes: hand, acts_on: hand}}   # or world, object? tare_s: 0.2?"
        )
    lines.append("pushes: {cut: rest}   # between two rests of the object")
    return Guess(text="\n".join(lines) + "\n", rows=tuple(rows))


def _usable(info: TopicInfo) -> bool:
    return holds_numbers(info.kind)


def _turn_columns(columns: Columns) -> list[str]:
    return [name for name in ("qx", "qy", "qz", "qw") if name in columns.numbers]


def _topic_row(topic: str, frame: str | None, columns: Columns) -> tuple[str, ...]:
    clock = columns.numbers.get(STAMP, columns.numbers[RECEIVE])
    values = np.column_stack([columns.numbers[name] for name in ("x", "y", "z")])
    least, largest = (", ".join(f"{v:.4g}" for v in side(values, axis=0)) for side in (np.min, np.max))
    return f"{topic} {frame or ''}".strip(), str(len(clock)), _rate(clock), least, largest


def _quoted(name: str) -> str:
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _list(names: Sequence[str]) -> str:
    return "[" + ", ".join(map(_quoted, names)) + "]"
