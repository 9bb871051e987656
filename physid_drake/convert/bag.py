"""ROS bags: the topics that a map names, each as columns of a table, and the frames that they are measured in."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from physid_drake.convert.bag_reading import opened_files
from physid_drake.convert.bag_values import (
    POINT,
    POSE,
    WRENCH,
    Taken,
    frame_name,
    holds_numbers,
    holds_poses,
    holds_transforms,
    taken_from,
)
from physid_drake.convert.columns import Array, Columns
from physid_drake.convert.transforms import STATIC, Link, Tree, partner_of
from physid_drake.errors import RecordingError
from physid_drake.progress import Progress
from physid_drake.wording import named, shown

STAMP, RECEIVE = "stamp", "receive"
MOST_POSES: Final = 8
"""Of the poses of one message: so many are looked at for a first map."""

TOLD: Final = 5000
"""Messages, after which somebody who waits is told how far it is."""

_TREE: Final = "/tf"
_NAMES: Final = {len(names): names for names in (POINT, WRENCH, POSE)}

Key = tuple[str, str | None]
"""A topic, and which of its frames or poses."""


@dataclass(frozen=True, kw_only=True)
class Track:
    """One pose, point or force along a bag.

    Attributes:
        columns: its numbers and times.
        frames: that it is measured in, in the order in which they come; none where no message says.
        through: the frames between it and the one it is measured in, from below, if transforms were composed.
        unsteady: whether it is one of several poses in a message, whose number changes along the way.
    """

    columns: Columns
    frames: tuple[str, ...] = ()
    through: tuple[str, ...] = ()
    unsteady: bool = False


@dataclass(frozen=True, kw_only=True)
class Bag:
    """What was read of a bag.

    Attributes:
        tracks: of what was wanted.
        tree: of its transforms on ``/tf`` and ``/tf_static``; the latter alone where nothing else was wanted.
        topics: type and messages of all its topics.
        refused: why something is no track, where all were wanted.
    """

    tracks: Mapping[Key, Track]
    tree: Tree
    topics: Mapping[str, tuple[str, int]]
    refused: Mapping[Key, str] = field(default_factory=dict)


def read_bag(source: Path, wanted: Collection[Key], *, by_arrival: bool = False) -> Bag:
    """The columns of topics, or of one frame of a tree of transforms in the root of that.

    Poses have columns ``x y z qx qy qz qw`` [m], forces ``x y z tx ty tz`` [N, N m], points ``x y z``; all have
    ``stamp``, the time in the message's header, if it has one, and ``receive``, that of its arrival [s].

    Args:
        source: a file, or a folder of them.
        wanted: topics, each with a frame where it holds transforms, or an index such as ``[0]`` where it holds poses.
        by_arrival: goes by the times of arrival where transforms are composed.

    Raises:
        RecordingError: if the bag cannot be read, a topic is not there, empty, or of a type that holds none of these,
            or a frame has no way to one root.
    """
    asked = {(topic, None if child is None else frame_name(child)) for topic, child in wanted}
    topics = {topic for topic, _ in asked}

    def chosen(topic: str, kind: str) -> bool:
        if topic in topics and not holds_numbers(kind):
            raise RecordingError(
                f"topic {shown(topic)} is of {kind}, no standard type of a pose, a point or a force."
            )
        others = {partner_of(one) for one in (*topics, _TREE)}
        return topic in topics or (topic in others and holds_transforms(kind))

    found = _Gathered()
    found.gather(source, chosen, lambda topic, child: (topic, child) in asked or (topic, None) in asked)
    for topic in topics - set(found.kinds):
        known = _some(sorted(found.kinds))
        raise RecordingError(f"{named(source.name)} has no topic {shown(topic)}; it has {known}.")
    tracks = {
        key: found.track(key[0], None if key[1] is None else frame_name(key[1]), by_arrival=by_arrival)
        for key in wanted
    }
    return Bag(tracks=tracks, tree=found.tree(_TREE), topics=found.topics())


def read_whole_bag(source: Path, progress: Progress | None = None) -> Bag:
    """All that a map could name, with why something cannot be followed.

    Args:
        source: a file, or a folder of them.
        progress: called with the file that is read, messages read and messages in all.

    Raises:
        RecordingError: if the bag cannot be read.
    """
    found = _Gathered()
    some = {f"[{index}]" for index in range(MOST_POSES)}
    found.gather(
        source,
        lambda _, kind: holds_numbers(kind),
        lambda topic, child: not holds_poses(found.kinds[topic]) or child in some,
        progress,
    )
    tracks: dict[Key, Track] = {}
    refused: dict[Key, str] = {}
    for topic, child in sorted(found.rows, key=lambda key: (key[0], key[1] or "")):
        try:
            tracks[topic, child] = found.track(topic, child)
        except RecordingError as error:
            refused[topic, child] = str(error)
    return Bag(tracks=tracks, tree=found.tree(_TREE), topics=found.topics(), refused=refused)


class _Rows:
    """Numbers of one track as they come: stamp, time of arrival [s] and values."""

    def __init__(self) -> None:
        self.frames: dict[str, None] = {}
        self._numbers = array("d")
        self._width = 0

    def add(self, topic: str, taken: Taken, receive: float) -> None:
        self._width = self._width or 2 + len(taken.values)
        if self._width != 2 + len(taken.values):
            raise RecordingError(f"topic {shown(topic)} has messages of several types; leave one of them in the bag.")
        self._numbers.extend((taken.stamp, receive, *taken.values))
        if taken.frame:
            self.frames[taken.frame] = None

    def table(self) -> Array:
        """All of them (n, 2 + values)."""
        return np.array(self._numbers, dtype=np.float64).reshape(-1, self._width)


class _Gathered:
    """What was read of a bag's messages."""

    def __init__(self) -> None:
        self.kinds: dict[str, str] = {}
        self.rows: dict[Key, _Rows] = {}
        self._children: dict[str, dict[str, int]] = {}
        self._counts: dict[str, int] = {}
        self._trees: dict[str, Tree] = {}

    def gather(
        self,
        source: Path,
        chosen: Callable[[str, str], bool],
        kept: Callable[[str, str | None], bool],
        progress: Progress | None = None,
    ) -> None:
        """Reads the topics that are chosen by name and type, and keeps what is wanted of them; trees as a whole."""
        for file in opened_files(source):
            self.kinds |= file.kinds
            topics = {topic for topic, kind in file.kinds.items() if chosen(topic, kind)}
            total = 0
            for topic, count in file.counts():
                self._counts[topic] = self._counts.get(topic, 0) + count
                total += count if topic in topics else 0
            for done, (topic, kind, receive, message) in enumerate(file.messages(topics)):
                if progress is not None and done % TOLD == TOLD - 1:
                    progress(f"reading {file.file.name}", done, total)
                if holds_numbers(kind):
                    self._add(topic, kind, receive, message, kept)

    def _add(
        self, topic: str, kind: str, receive: float, message: Any, kept: Callable[[str, str | None], bool]
    ) -> None:
        for taken in taken_from(message, kind):
            if taken.child is not None:
                children = self._children.setdefault(topic, {})
                children[taken.child] = children.get(taken.child, 0) + 1
            if holds_transforms(kind) or kept(topic, taken.child):
                key = topic, taken.child
                if key not in self.rows:
                    self.rows[key] = _Rows()
                self.rows[key].add(topic, taken, receive)

    def topics(self) -> dict[str, tuple[str, int]]:
        """Type and number of messages of all topics."""
        return {topic: (kind, self._counts[topic]) for topic, kind in sorted(self.kinds.items())}

    def tree(self, topic: str) -> Tree:
        """The tree of a topic and its partner; its own transforms come first."""
        if topic not in self._trees:
            links: dict[str, Link] = {}
            for one in (partner_of(topic), topic):
                for (of, child), rows in self.rows.items():
                    if of == one and child is not None and holds_transforms(self.kinds[one]):
                        static = one.endswith(STATIC)
                        links[child] = Link(parents=tuple(rows.frames), table=rows.table(), static=static)
            self._trees[topic] = Tree(links=links)
        return self._trees[topic]

    def track(self, topic: str, child: str | None, *, by_arrival: bool = False) -> Track:
        """One track.

        Raises:
            RecordingError: if there is none, or it is not said which.
        """
        counts = self._children.get(topic, {})
        children = list(counts)
        if child is None and (len(children) > 1 or (children and holds_transforms(self.kinds[topic]))):
            of = "poses" if holds_poses(self.kinds[topic]) else "transforms"
            add = "the one" if of == "poses" else "the child frame"
            raise RecordingError(
                f"topic {shown(topic)} holds {of} of {_some(sorted(children))}; add {add} that is followed: frame."
            )
        if holds_transforms(self.kinds[topic]) and child is not None:
            return self._followed(topic, child, by_arrival=by_arrival)
        child = children[0] if child is None and children else child
        rows = self.rows.get((topic, child))
        if rows is None:
            raise self._nothing(topic, child)
        return Track(
            columns=self._columns(topic, rows.table()),
            frames=tuple(rows.frames),
            unsteady=holds_poses(self.kinds[topic]) and len(set(counts.values())) > 1,
        )

    def _followed(self, topic: str, child: str, *, by_arrival: bool) -> Track:
        tree = self.tree(topic)
        if child not in tree.links:
            raise self._nothing(topic, child)
        names, root = tree.chain(child)
        table = tree.composed(child, by_arrival=by_arrival)
        return Track(columns=self._columns(topic, table), frames=(root,) if root else (), through=tuple(names[1:]))

    def _nothing(self, topic: str, child: str | None) -> RecordingError:
        of = "" if child is None else f" of frame {shown(child)}"
        return RecordingError(f"topic {shown(topic)} has no message{of}.")

    def _columns(self, topic: str, table: Array) -> Columns:
        numbers: dict[str, Array] = {name: table[:, 2 + k] for k, name in enumerate(_NAMES[table.shape[1] - 2])}
        stamps = table[:, 0]
        if np.isfinite(stamps).all() and (stamps != 0.0).any():
            numbers[STAMP] = stamps
        numbers[RECEIVE] = table[:, 1]
        return Columns(source=f"topic {topic} ({self.kinds[topic].rpartition('/')[2]})", numbers=numbers)


def _some(names: list[str]) -> str:
    return ", ".join(shown(name) for name in names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")
