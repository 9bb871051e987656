"""Looks at a bag, and writes a first map of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from physid_drake.convert.bag import RECEIVE, STAMP, TopicInfo, holds_numbers, read_bag, topics_of
from physid_drake.convert.bodies import Body
from physid_drake.convert.columns import Columns
from physid_drake.convert.map_text import Guess, head_lines, quoted
from physid_drake.convert.roles import roles_of
from physid_drake.convert.times import step_of


def guess_bag(source: Path) -> Guess:
    """Looks at the topics of a bag.

    Raises:
        RecordingError: if it cannot be read.
    """
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
        key: Body(name=f"{key[0]} {key[1] or ''}".strip(), position=["x", "y", "z"], rotation=_turn_columns(columns))
        for key, columns in found.items()
        if "tx" not in columns.numbers
    }
    roles = roles_of(list(bodies.values()), None)
    body, hand = roles.object, roles.hand
    force = next((key for key, columns in found.items() if "tx" in columns.numbers), None)
    where = {one.name: key for key, one in bodies.items()}
    columns = found[where[body.name]] if body is not None else Columns(source="", numbers={})
    lines = [*head_lines(source, body, columns, hand is not None)]
    for key, one in (("object", body), ("hand", hand)):
        if one is not None:
            topic, frame = where[one.name]
            turn = "" if one.rotation else ", rotation: none"
            of = "" if frame is None else f", frame: {quoted(frame)}"
            lines.append(f"{key}: {{topic: {quoted(topic)}{of}{turn}}}")
    if body is None:
        lines.append('object: {topic: "?"}   # CHANGE: no topic holds poses')
    if force is not None:
        lines.append(
            f"force: {{topic: {quoted(force[0])}, axes: hand, acts_on: hand}}   # or world, object? tare_s: 0.2?"
        )
    lines.append("pushes: {cut: rest}   # between two rests of the object")
    return Guess(text="\n".join(lines) + "\n", rows=tuple(rows))


def _usable(info: TopicInfo) -> bool:
    return holds_numbers(info.kind)


def _turn_columns(columns: Columns) -> list[str]:
    return [name for name in ("qx", "qy", "qz", "qw") if name in columns.numbers]


def _topic_row(topic: str, frame: str | None, columns: Columns) -> tuple[str, ...]:
    clock = columns.numbers.get(STAMP, columns.numbers[RECEIVE])
    step = step_of(clock)
    rate = f"{1.0 / step:.4g}" if np.isfinite(step) else ""
    values = np.column_stack([columns.numbers[name] for name in ("x", "y", "z")])
    least, largest = (", ".join(f"{v:.4g}" for v in side(values, axis=0)) for side in (np.min, np.max))
    return f"{topic} {frame or ''}".strip(), str(len(clock)), rate, least, largest
