"""Trees of frames: transforms between two frames each, composed from a frame up to the root of its tree.

A tree's moving transforms come on one topic (``/tf``), those that never change on its partner (``/tf_static``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from physid_drake.convert.mapping import NORM_TOLERANCE
from physid_drake.errors import RecordingError
from physid_drake.wording import shown

Array = NDArray[np.float64]

STATIC: Final = "_static"
"""Ends the name of a topic whose transforms never change."""

DEEPEST: Final = 32
"""Transforms from a frame to its root; no robot with what it holds has more."""

STAMPED, ARRIVED = 0, 1
"""Columns of a link's table that are times [s]."""


@dataclass(frozen=True, kw_only=True)
class Link:
    """The transforms of one frame.

    Attributes:
        parents: the frames that it was given in; empty where nothing says.
        table: (n, 9): stamp, time of arrival [s], place x, y, z [m] and quaternion x, y, z, w in the parent.
        static: whether it comes on a topic of those that never change.
    """

    parents: tuple[str, ...]
    table: Array
    static: bool = False

    @property
    def held(self) -> bool:
        """Whether it never changes."""
        return self.static or bool((self.table[:, 2:] == self.table[0, 2:]).all())


@dataclass(frozen=True, kw_only=True)
class Placed:
    """Rigid poses (n,) of one frame in another; NaN where a place is not known."""

    places: Array
    turns: Rotation

    def after(self, parent: Placed) -> Placed:
        """The same, in what the parent is in."""
        with np.errstate(over="ignore", invalid="ignore"):  # what is out of all proportion is refused later
            places = parent.turns.apply(self.places) + parent.places
            return Placed(places=places, turns=_product(parent.turns, self.turns))

    def inverse(self) -> Placed:
        """The other in this one."""
        back = self.turns.inv()
        return Placed(places=-back.apply(self.places), turns=back)


@dataclass(frozen=True, kw_only=True)
class Tree:
    """Frames and what they hang from.

    Attributes:
        links: by the child frame.
    """

    links: Mapping[str, Link] = field(default_factory=dict)

    def chain(self, frame: str) -> tuple[list[str], str]:
        """The frames from one up to below its root, and the root, empty where it has no name.

        Raises:
            RecordingError: if one has two parents, or they hang from one another in a loop.
        """
        names: list[str] = []
        at = frame
        while at and at in self.links:
            if at in names:
                raise RecordingError(f"frame {shown(frame)} hangs in a loop of {_listed(names)}; take one link out.")
            if len(names) == DEEPEST:
                raise RecordingError(f"frame {shown(frame)} is more than {DEEPEST} transforms below its root.")
            names.append(at)
            parents = self.links[at].parents
            if len(parents) > 1:
                raise RecordingError(
                    f"frame {shown(at)} has several parents, {_listed(parents)}; leave only one of them in the bag."
                )
            at = parents[0] if parents else ""
        return names, at

    def composed(self, frame: str, *, by_arrival: bool = False) -> Array:
        """A frame's poses in its root (n, 9), as a link's table.

        Its rows are those of the moving transform next to it; the others are taken between their samples. Rows are
        left out where one of the others was not recorded. A frame right below its root is as it was sent.

        Args:
            frame: one of the links.
            by_arrival: goes by the times of arrival, as where stamps are wrong.

        Raises:
            RecordingError: if there is no way to one root, or the transforms were not recorded at the same time.
        """
        names, _ = self.chain(frame)
        if len(names) == 1:
            return self.links[frame].table
        moving = [name for name in names if not self.links[name].held]
        base = (moving or names)[0]
        clock = ARRIVED if by_arrival or not all(_stamped(self.links[name]) for name in moving) else STAMPED
        rows = _usable(base, self.links[base])
        found: Placed | None = None
        for name in names:
            at = _poses_of(rows) if name == base else _between(name, self.links[name], rows[:, clock], clock)
            found = at if found is None else found.after(at)
        assert found is not None
        table = np.column_stack([rows[:, :2], found.places, found.turns.as_quat()])
        table = table[np.isfinite(found.places).all(axis=1)]
        if not len(table):
            raise RecordingError(f"the transforms above frame {shown(frame)} were never recorded at the same time.")
        return table

    def joined(self, frame: str, other: str) -> Placed | None:
        """The pose (1,) of one frame in another, through transforms that never change; None without a way."""
        ours, theirs = self._held_above(frame), self._held_above(other)
        common = next((name for name in ours if name in theirs), None)
        return None if common is None else ours[common].after(theirs[common].inverse())

    def _held_above(self, frame: str) -> dict[str, Placed]:
        """The poses of a frame in those above it that it keeps its place in, and in itself."""
        found = {frame: Placed(places=np.zeros((1, 3)), turns=Rotation.from_quat([[0.0, 0.0, 0.0, 1.0]]))}
        names, root = self.chain(frame)
        for name, above in zip(names, [*names[1:], root], strict=False):
            if not above or not self.links[name].held:
                break
            found[above] = found[name].after(_held_pose(name, self.links[name]))
        return found


def _product(first: Rotation, second: Rotation) -> Rotation:
    """What SciPy's own product gives, ten times as fast: a robot has many links."""
    (x, y, z, w), (a, b, c, d) = first.as_quat().T, second.as_quat().T
    return Rotation.from_quat(
        np.column_stack([
            w * a + x * d + y * c - z * b, w * b - x * c + y * d + z * a,
            w * c + x * b - y * a + z * d, w * d - x * a - y * b - z * c,
        ])
    )  # fmt: skip


def partner_of(topic: str) -> str:
    """The topic with the other transforms of a tree: those that never change, or those that move."""
    return topic.removesuffix(STATIC) if topic.endswith(STATIC) else topic + STATIC


def _stamped(link: Link) -> bool:
    stamps = link.table[:, STAMPED]
    return bool(np.isfinite(stamps).all() and (stamps != 0.0).any())


def _usable(name: str, link: Link) -> Array:
    """Rows of a link's table that hold a pose.

    Raises:
        RecordingError: if there is none, or quaternions are none.
    """
    rows: Array = link.table[np.isfinite(link.table[:, 2:]).all(axis=1)]
    norms = np.linalg.norm(rows[:, 5:], axis=1)
    rows, norms = rows[norms > 0.0], norms[norms > 0.0]
    if not len(rows):
        raise RecordingError(f"frame {shown(name)} has no transform that can be used.")
    if (np.abs(norms - 1.0) > NORM_TOLERANCE).any():
        raise RecordingError(f"transforms of frame {shown(name)} have quaternions whose norm is not 1.")
    return rows


def _poses_of(rows: Array) -> Placed:
    return Placed(places=rows[:, 2:5], turns=Rotation.from_quat(rows[:, 5:]))


def _held_pose(name: str, link: Link) -> Placed:
    rows = _usable(name, link)
    if (rows[:, 2:] != rows[0, 2:]).any():
        raise RecordingError(
            f"frame {shown(name)} changes its place among transforms that never change; cut the bag where it does."
        )
    return _poses_of(rows[:1])


def _between(name: str, link: Link, times: Array, clock: int) -> Placed:
    """Poses of a link at other times (n,) [s]; NaN before its first and after its last."""
    if link.held:
        pose = _held_pose(name, link)
        return Placed(places=np.repeat(pose.places, len(times), axis=0), turns=pose.turns[np.zeros(len(times), int)])
    rows = _usable(name, link)
    _, first = np.unique(rows[:, clock], return_index=True)
    rows = rows[first]
    own = rows[:, clock]
    same = np.minimum(np.searchsorted(own, times), len(own) - 1)
    if (own[same] == times).all():  # as of a robot that sends all of its links at once
        return _poses_of(rows[same])
    at = np.clip(times, own[0], own[-1])
    turns = Rotation.from_quat(rows[:, 5:])
    turns = Slerp(own, turns)(at) if len(own) > 1 else turns[np.zeros(len(times), int)]
    places = np.column_stack([np.interp(times, own, rows[:, k], left=np.nan, right=np.nan) for k in (2, 3, 4)])
    return Placed(places=places, turns=turns)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(shown(name) for name in names[:4]) + (" and others" if len(names) > 4 else "")
