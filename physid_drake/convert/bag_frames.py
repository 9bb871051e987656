"""The frames that a bag's messages say they are in: the object's is the one that a map speaks of.

What is in another one comes into it where transforms that never change lead there, and is warned about otherwise.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from physid_drake.convert.bag import Track
from physid_drake.convert.bag_values import POSE
from physid_drake.convert.columns import Array, Columns
from physid_drake.convert.mapping import ForceMap, Map, PoseMap
from physid_drake.convert.transforms import Placed, Tree
from physid_drake.errors import RecordingError
from physid_drake.wording import shown


def in_one_frame(tracks: Mapping[str, Track], chart: Map, tree: Tree) -> dict[str, Columns]:
    """The columns of a map's streams in the frame that the object is in; a ``UserWarning`` for each that is not.

    A stream with a ``world:`` of its own, or a force in the hand's axes, stays as it is.

    Args:
        tracks: of ``object``, ``hand`` and ``force``.
        chart: the map.
        tree: of the bag's transforms.
    """
    for key, track in tracks.items():
        for line in _doubts(key, track):
            _warn(line)
    columns = {key: track.columns for key, track in tracks.items()}
    body = _frame_of(tracks["object"])
    for key, stream in (("hand", chart.hand_path), ("force", chart.force)):
        frame = _frame_of(tracks[key]) if key in tracks else None
        if stream is None or frame in (None, body) or body is None or _is_told(stream, chart):
            continue
        assert frame is not None
        turns_back = isinstance(stream, PoseMap) and stream.turn is not None and stream.turn.inverse
        pose = None if turns_back else joined(tree, frame, body)
        if pose is None:
            _warn(f"{key}: {apart(frame, body)}; {_advice(key, frame)}.")
        else:
            columns[key] = _moved(columns[key], pose)
            way = f"from frame {shown(frame)} into the object's, {shown(body)}"
            _warn(f"{key}: brought {way}, by transforms of the bag that never change.")
    return columns


def apart(frame: str, body: str) -> str:
    """That something is not in the object's frame."""
    return (
        f"it is in frame {shown(frame)} and the object in {shown(body)}, and no transforms of the bag that never"
        " change join them"
    )


def joined(tree: Tree, frame: str, body: str) -> Placed | None:
    """The pose of a frame in the object's; None where nothing fixed leads there, or it is ambiguous."""
    try:
        return tree.joined(frame, body)
    except RecordingError:
        return None


def _doubts(key: str, track: Track) -> list[str]:
    lines = []
    if len(track.frames) > 1:
        names = ", ".join(map(shown, track.frames[:4]))
        lines.append(
            f"{key}: {track.columns.source} changes its frame along the way ({names}), and is taken as if it did not;"
            " cut the bag where it does."
        )
    if track.through and track.frames:
        way = ", ".join(map(shown, track.through[:4])) + (" and others" if len(track.through) > 4 else "")
        lines.append(f"{key}: its transforms are composed through {way}; it is in frame {shown(track.frames[0])}.")
    if track.unsteady:
        source = track.columns.source
        lines.append(f"{key}: {source} has more poses at times; is the same index always the same thing?")
    return lines


def _frame_of(track: Track) -> str | None:
    """The one frame of a track; None where there is none, or more."""
    return track.frames[0] if len(track.frames) == 1 else None


def _is_told(stream: PoseMap | ForceMap, chart: Map) -> bool:
    """Whether the map says how a stream lies, beside the object."""
    turns_with_hand = isinstance(stream, ForceMap) and stream.in_hand
    return stream.world is not None or chart.object.world is not None or turns_with_hand


def _advice(key: str, frame: str) -> str:
    turning = "write axes: hand if it turns with the hand, or " if key == "force" else ""
    return f"{turning}give {key} a world: of its own, which says where W lies in {shown(frame)}"


def _moved(columns: Columns, pose: Placed) -> Columns:
    """Columns in another frame, of which a pose (1,) says where their own is in it; forces are only turned."""
    numbers = dict(columns.numbers)
    is_force = "tx" in numbers
    for names in (("x", "y", "z"), ("tx", "ty", "tz")) if is_force else (("x", "y", "z"),):
        with np.errstate(over="ignore", invalid="ignore"):  # what is out of all proportion is refused later
            moved = pose.turns.apply(_stack(columns, names)) + (0.0 if is_force else pose.places)
        numbers |= dict(zip(names, moved.T, strict=True))
    if "qx" in numbers:
        turns = _stack(columns, POSE[3:])
        norms = np.linalg.norm(turns, axis=1)
        good = np.isfinite(norms) & (norms > 0.0)
        # Norms stay, which tell a quaternion from what is none.
        turns[good] = norms[good, None] * (pose.turns * Rotation.from_quat(turns[good])).as_quat()
        numbers |= dict(zip(POSE[3:], turns.T, strict=True))
    return replace(columns, numbers=numbers)


def _stack(columns: Columns, names: Sequence[str]) -> Array:
    return np.column_stack([columns.numbers[name] for name in names])


def _warn(line: str) -> None:
    warnings.warn(line, UserWarning, stacklevel=3)
