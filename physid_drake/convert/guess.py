"""Looks at a log and writes a first map of it, with what it doubts as comments.

Names tell most: what ends in x, y, z is a place, what ends in qw or holds four columns of norm 1 is a rotation, what
is called force or wrench is one. Numbers tell the rest: which axis is up, m or mm, the order of a quaternion.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from physid_drake.convert.bag import read_whole_bag
from physid_drake.convert.bag_reading import ENDINGS, is_packed
from physid_drake.convert.bag_roles import (
    QUATERNION,
    frame_lines,
    in_a_map,
    name_of,
    roles_in_bag,
    row_of,
    unread_lines,
)
from physid_drake.convert.bodies import Body, bodies_of, up_of
from physid_drake.convert.columns import Array, Columns
from physid_drake.convert.tables import ARRAYS, TEXTS, read_columns
from physid_drake.convert.units import FORCES, LENGTHS, TIMES
from physid_drake.progress import Progress
from physid_drake.recording.adapters.sources import source_files
from physid_drake.recording.clocks import LIKELY
from physid_drake.wording import named

OBJECT_WORDS: Final = ("object", "obj", "mug", "box", "block", "cube", "slider", "target", "item", "payload")
HAND_WORDS: Final = (
    "hand", "action", "tip", "finger", "tool", "tcp", "eef", "ee", "gripper", "pusher", "robot", "probe", "stylus",
)  # fmt: skip
PUSH_WORDS: Final = ("push", "episode", "trial", "run", "rep", "versuch", "segment")
FAR_AWAY: Final = 0.3
"""m from the table's top, along the vertical: the source's frame is that of a camera."""

FIXED: Final = 0.05
"""Of the object's way: what keeps its distance to it as well as this is fixed to it."""

MOST_UNREAD: Final = 8
"""Of what a log holds and is no column: so many are named in a map."""

METRES, CENTIMETRES = 5.0, 60.0
"""Places on a table that are nowhere larger are in m, or in cm."""

_OTHERS: Final = {"wxyz": "xyzw", "xyzw": "wxyz", "matrix": "inverse: true, if it is written column by column"}
_TIME: Final = re.compile(r"time|stamp|(^|[\s_/])t([\s_\[(]|$)|seconds|zeit", re.IGNORECASE)


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
def guess_map(source: Path, progress: Progress | None = None) -> Guess:
    """Looks at a table, a bag, or a folder of tables.

    Args:
        source: a file or a folder.
        progress: of a large bag, called with the file that is read, messages read and messages in all.

    Raises:
        RecordingError: if it cannot be read.
    """
    source = Path(source)
    return _guess_bag(source, progress) if is_bag(source) else _guess_table(source)


def is_bag(source: Path) -> bool:
    """Whether a file or a folder looks like a bag, packed or not, by its endings."""
    files = list(source.iterdir()) if source.is_dir() else [source]
    return any(file.suffix in ENDINGS or is_packed(file) for file in files)


def _guess_table(source: Path) -> Guess:
    files = source_files(source, *TEXTS, *ARRAYS)
    columns = read_columns(files[0])
    time, unit = _time_of(columns)
    clock = None if time is None else columns.numbers[time] * TIMES.get(unit, np.nan)
    rows = [_row(name, values, clock) for name, values in columns.numbers.items()]
    rows += [(name, str(len(texts)), "", "text", "") for name, texts in columns.texts.items()]
    rows += [(name, "", "", "not read", "") for name in columns.unread]
    bodies = bodies_of(columns)
    body, hand, force = _roles(bodies, columns)
    nameless = next((one for one in bodies if not one.position and one.rotation), None)
    if body is not None and nameless is not None and not body.rotation:
        body.rotation, body.kind, body.order = nameless.rotation, nameless.kind, nameless.order
    doubt = _set_units([one for one in (body, hand) if one is not None], columns)
    lines = [*_head(source, body, columns, hand is not None)]
    if time is None:
        lines.append('time: {column: "?", unit: s}   # CHANGE: no column looks like times')
    elif unit == "frames":
        lines.append(f"time: {{column: {_quoted(time)}, rate_hz: 100}}   # CHANGE: it counts frames; at which rate?")
    else:
        lines.append(f"time: {{column: {_quoted(time)}, unit: {unit}}}")
    for key, one in (("object", body), ("hand", hand)):
        if one is not None or key == "object":
            lines += _pose_lines(key, one, columns, doubt, time)
    if force is not None:
        lines += _force_lines(force, columns)
    lines.append(_cut_line(columns, time, many=len(files) > 1))
    text = "\n".join(lines)
    left = [name for name in columns.numbers if _quoted(name) not in text]
    if left:
        lines.append(f"# not used: {', '.join(left)}")
    lines += [f"# not read: {named(name)} ({why})" for name, why in list(columns.unread.items())[:MOST_UNREAD]]
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


def _roles(bodies: Sequence[Body], columns: Columns | None) -> tuple[Body | None, Body | None, Body | None]:
    """Which body is the object, which the hand, and which holds the force."""
    force = next((body for body in bodies if body.force), None)
    placed = [body for body in bodies if body.position]

    def called(words: Sequence[str]) -> Body | None:
        return next(
            (b for b in placed if set(re.split(r"[^a-z]+", b.name.lower())) & set(words)
             or any(len(w) > 3 and w in b.name.lower() for w in words)), None,
        )  # fmt: skip

    hand, body = called(HAND_WORDS), called(OBJECT_WORDS)
    rest = [one for one in placed if one is not hand and one is not body]
    if body is None:
        body = next((one for one in rest if one.rotation), rest[0] if rest else None)
        rest = [one for one in rest if one is not body]
    if hand is None and body is not None and columns is not None:
        # What keeps its distance to the object is one of its markers.
        hand = next((one for one in rest if _is_apart(one, body, columns)), None)
    elif hand is None and rest:
        hand = rest[0]
    return body, hand, force


def _is_apart(one: Body, body: Body, columns: Columns) -> bool:
    """Whether a body's distance to the object changes, or cannot be told."""
    here, there = (np.column_stack([columns.numbers[name] for name in which.position[:3]]) for which in (one, body))
    if here.shape != there.shape:
        return True
    distances = np.linalg.norm(here - there, axis=1)
    distances = distances[np.isfinite(distances)]
    return len(distances) < 2 or float(np.std(distances)) > FIXED * float(np.nanmax(np.nanstd(there, axis=0)))


def _head(source: Path, body: Body | None, columns: Columns, has_hand: bool) -> list[str]:
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


def _world_lines(body: Body, columns: Columns) -> list[str]:
    """Which axis is up: the one along which the object hardly moves; where the table's top is nobody knows."""
    values = np.column_stack([columns.numbers[name] for name in body.position])
    values = LENGTHS[body.unit or "m"] * values[np.isfinite(values).all(axis=1)]
    up = up_of(body.position, columns)
    if up is None:
        return []
    axes = {0: "[y, z, x]", 1: "[z, x, y]", 2: "[x, y, z]"}[up]
    if len(body.position) < len("xyz"):
        return [f"# The object has no {'xyz'[up]}, which is taken for up.", f"world: {{axes: {axes}}}"]
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


def _set_units(bodies: Sequence[Body], columns: Columns) -> str:
    """Gives all bodies a unit of length: the header's, else one that fits a table; the doubt that is left."""
    stated = next((body.unit for body in bodies if body.unit in LENGTHS), columns.length)
    values = [np.abs(columns.numbers[name]) for body in bodies for name in body.position]
    largest = max((float(np.nanmax(one, initial=0.0)) for one in values), default=0.0)
    likely = "m" if largest < METRES else "cm" if largest < CENTIMETRES else "mm"
    for body in bodies:
        body.unit = body.unit if body.unit in LENGTHS else stated or likely
    return "" if stated else "   # m, cm, inch or mm?"


def _pose_lines(key: str, body: Body | None, columns: Columns, doubt: str, time: str | None) -> list[str]:
    if body is None:
        return [
            f"{key}:",
            '  position: {columns: ["?", "?", "?"], unit: m}   # CHANGE: no columns look like places',
            "  rotation: none",
        ]
    lines = [
        f"{key}:   # {body.name}",
        *_own_time(body, columns, time),
        f"  position: {{columns: {_list(body.position)}, unit: {body.unit}}}{doubt}",
    ]
    if not body.rotation:
        lines.append("  rotation: none" + ("   # is it nowhere in the log?" if key == "object" else ""))
    elif body.kind in ("wxyz", "xyzw", "matrix"):
        other = "" if body.sure else f"   # or {_OTHERS[body.kind]}?"
        lines.append(f"  rotation: {{columns: {_list(body.rotation)}, as: {body.kind}}}{other}")
    else:
        values = np.concatenate([columns.numbers[name] for name in body.rotation])
        likely = "deg" if np.nanmax(np.abs(values), initial=0.0) > 2.5 * np.pi else "rad"
        unit = columns.unit_of(body.rotation[0]) or likely
        order = f", order: {body.order}" if body.kind == "euler" else ""
        lines.append(
            f"  rotation: {{columns: {_list(body.rotation)}, as: {body.kind}{order}, unit: {unit}}}   # deg or rad?"
        )
    if len(body.position) == 2:
        lines.append("  height_m: 0.05   # CHANGE: of its middle above the table, which nobody measured")
    return lines


def _own_time(body: Body, columns: Columns, time: str | None) -> list[str]:
    """A line for a body that has more or fewer samples than the clock of all, and another clock."""
    count = len(columns.numbers[body.position[0]])
    words = set(re.split(r"[^a-z]+", body.name.lower())) - {""}
    fitting = {name: values for name, values in columns.numbers.items() if len(values) == count}
    called = {n: v for n, v in fitting.items() if _TIME.search(n) and words & set(re.split(r"[^a-z]+", n.lower()))}
    fitting = called or fitting
    if time is None or (len(columns.numbers[time]) == count and time in (called or [time])):
        return []
    own, unit = _time_of(replace(columns, numbers=fitting))
    if own is None or unit == "frames":
        return ['  time: {column: "?", unit: s}   # CHANGE: it has times of its own']
    return [f"  time: {{column: {_quoted(own)}, unit: {unit}, offset_s: 0.0}}   # is it the same clock?"]


def _force_lines(force: Body, columns: Columns) -> list[str]:
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


def _guess_bag(source: Path, progress: Progress | None) -> Guess:
    bag = read_whole_bag(source, progress)
    rows = [row_of(key, track) for key, track in bag.tracks.items()]
    read = {topic for topic, _ in bag.tracks}
    rows += [(topic, str(count), "", kind, "") for topic, (kind, count) in bag.topics.items() if topic not in read]
    roles = roles_in_bag(bag, HAND_WORDS, OBJECT_WORDS)
    body, columns = None, Columns(source="", numbers={})
    if roles.body is not None:
        columns = bag.tracks[roles.body].columns
        body = Body(name=name_of(roles.body), position=["x", "y", "z"])
    lines = [*_head(source, body, columns, roles.hand is not None)]
    for role, key in (("object", roles.body), ("hand", roles.hand), ("force", roles.force)):
        if key is not None:
            lines += frame_lines(role, bag, key, roles.body or key)
            lines.append(_topic_line(role, in_a_map(bag, key), bag.tracks[key].columns))
        elif role == "object":
            lines.append('object: {topic: "?"}   # CHANGE: no topic holds poses that move')
    lines.append("pushes: {cut: rest}   # between two rests of the object")
    lines += unread_lines(bag, MOST_UNREAD)
    return Guess(text="\n".join(lines) + "\n", rows=tuple(rows))


def _topic_line(role: str, key: tuple[str, str | None], columns: Columns) -> str:
    topic, frame = key
    if role == "force":
        return f"force: {{topic: {_quoted(topic)}, axes: hand, acts_on: hand}}   # or world, object? tare_s: 0.2?"
    of = "" if frame is None else f", frame: {_quoted(frame)}"
    turn = "" if QUATERNION[0] in columns.numbers else ", rotation: none"
    return f"{role}: {{topic: {_quoted(topic)}{of}{turn}}}"


def _quoted(name: str) -> str:
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _list(names: Sequence[str]) -> str:
    return "[" + ", ".join(map(_quoted, names)) + "]"
