"""Looks at a bag, and writes a first map of it."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from physid_drake.convert.bag import read_whole_bag
from physid_drake.convert.bag_roles import (
    QUATERNION,
    frame_lines,
    in_a_map,
    name_of,
    roles_in_bag,
    row_of,
    unread_lines,
)
from physid_drake.convert.bodies import Body
from physid_drake.convert.columns import Columns
from physid_drake.convert.map_text import Guess, head_lines, quoted
from physid_drake.convert.roles import HAND_WORDS, OBJECT_WORDS
from physid_drake.progress import Progress

MOST_UNREAD: Final = 8
"""Of what a bag holds and could not be followed: so many are named in a map."""


def guess_bag(source: Path, progress: Progress | None = None) -> Guess:
    """Looks at the topics of a bag.

    Args:
        source: a file, or the folder of a bag.
        progress: called with the file that is read, messages read and messages in all.

    Raises:
        RecordingError: if it cannot be read.
    """
    bag = read_whole_bag(source, progress)
    rows = [row_of(key, track) for key, track in bag.tracks.items()]
    read = {topic for topic, _ in bag.tracks}
    rows += [(topic, str(count), "", kind, "") for topic, (kind, count) in bag.topics.items() if topic not in read]
    roles = roles_in_bag(bag, HAND_WORDS, OBJECT_WORDS)
    body, columns = None, Columns(source="", numbers={})
    if roles.body is not None:
        columns = bag.tracks[roles.body].columns
        body = Body(name=name_of(roles.body), position=["x", "y", "z"])
    lines = [*head_lines(source, body, columns, roles.hand is not None)]
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
        return f"force: {{topic: {quoted(topic)}, axes: hand, acts_on: hand}}   # or world, object? tare_s: 0.2?"
    of = "" if frame is None else f", frame: {quoted(frame)}"
    turn = "" if QUATERNION[0] in columns.numbers else ", rotation: none"
    return f"{role}: {{topic: {quoted(topic)}{of}{turn}}}"
