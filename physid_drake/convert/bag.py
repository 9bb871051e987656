"""ROS bags: ROS 1, and ROS 2 in SQLite and MCAP; the topics that a map names, each as columns of a table.

Messages are taken apart by the definitions of the standard types, not by those that a bag carries: what is in a bag
is data. Each file of a bag's folder is read by itself, so that no path in its metadata is followed.
"""

from __future__ import annotations

import importlib
import tempfile
from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from physid_drake.convert.columns import Array, Columns
from physid_drake.errors import RecordingError
from physid_drake.files import FileError, check_plain
from physid_drake.wording import named, one_line, shown

ENDINGS: Final = (".bag", ".mcap", ".db3")
STAMP, RECEIVE = "stamp", "receive"
MOST_MESSAGES: Final = 3_000_000
"""Of the topics that are read: an hour and a half at 500 Hz."""

CUT_OFF: Final = "no bag that can be read, or one that is cut off or damaged"

_NEEDED: Final = "reading bags needs rosbags, which is not installed; run `pip install physid_drake[bags]`."
_POSE: Final = ("x", "y", "z", "qx", "qy", "qz", "qw")
_WRENCH: Final = ("x", "y", "z", "tx", "ty", "tz")

Row = tuple[float, tuple[float, ...]]


@dataclass(frozen=True, kw_only=True)
class TopicInfo:
    """What a bag has of one topic: its type, how many messages, and the child frames of transforms."""

    kind: str
    count: int
    frames: tuple[str, ...] = ()


def bag_files(source: Path) -> list[Path]:
    """The files of a bag: itself, or those in its folder, in the order of their names.

    Raises:
        RecordingError: if there is none.
    """
    try:
        files = sorted(f for f in source.iterdir() if f.suffix in ENDINGS) if source.is_dir() else [source]
    except OSError as error:
        raise RecordingError(f"{named(source)}: cannot be read: {one_line(error)}.") from error
    if not files or files[0].suffix not in ENDINGS:
        packed = source.is_dir() and any(source.glob("*.zstd"))
        why = "its files are packed; unpack them with `zstd -d`" if packed else f"give a {', '.join(ENDINGS)} file"
        raise RecordingError(f"{named(source)}: no bag here; {why}, or the folder with them.")
    return files


def holds_numbers(kind: str) -> bool:
    """Whether messages of a type hold a pose, a point or a force."""
    return kind.rpartition("/")[2] in _TAKEN


def topics_of(source: Path) -> dict[str, TopicInfo]:
    """The topics of a bag that a map can use: poses, points, transforms and forces.

    Raises:
        RecordingError: if it cannot be read.
    """
    found: dict[str, TopicInfo] = {}
    frames: dict[str, set[str]] = defaultdict(set)
    for reader in _readers(source):
        for connection in reader.connections:
            known = found.get(connection.topic)
            count = connection.msgcount + (known.count if known else 0)
            found[connection.topic] = TopicInfo(kind=connection.msgtype, count=count)
        transforms = {c.topic for c in reader.connections if c.msgtype.endswith("/TFMessage")}
        for topic, _, message in _messages(reader, transforms):
            frames[topic].update(t.child_frame_id for t in message.transforms)
    return {
        topic: TopicInfo(kind=info.kind, count=info.count, frames=tuple(sorted(frames[topic])))
        for topic, info in sorted(found.items())
    }


def read_bag(source: Path, wanted: Collection[tuple[str, str | None]]) -> dict[tuple[str, str | None], Columns]:
    """The columns of topics, or of one child frame of transforms.

    Poses have columns ``x y z qx qy qz qw`` [m], forces ``x y z tx ty tz`` [N, N m], points ``x y z``; all have
    ``stamp``, the time in the message's header, if it has one, and ``receive``, that of its arrival [s].

    Args:
        source: a file, or a folder of them.
        wanted: topics, each with a frame where it holds transforms.

    Raises:
        RecordingError: if the bag cannot be read, or a topic is not there, empty, or of a type that holds none of
            these.
    """
    rows: dict[tuple[str, str | None], list[tuple[float, float, tuple[float, ...]]]] = {key: [] for key in wanted}
    kinds: dict[str, str] = {}
    seen: set[str] = set()
    children: dict[str, set[str]] = {topic: set() for topic, _ in wanted}
    for reader in _readers(source):
        seen.update(c.topic for c in reader.connections)
        chosen = {c.topic: c.msgtype for c in reader.connections if any(c.topic == topic for topic, _ in wanted)}
        for topic, kind in chosen.items():
            if not holds_numbers(kind):
                raise RecordingError(f"topic {shown(topic)} is of {kind}, which holds no pose, point or force.")
        kinds |= chosen
        for topic, receive, message in _messages(reader, chosen):
            for frame, stamp, values in _TAKEN[kinds[topic].rpartition("/")[2]](message):
                if frame is not None:
                    children[topic].add(frame)
                for key in {(topic, frame), (topic, None)}:
                    if key in rows:
                        rows[key].append((stamp, receive, values))
    for topic, frame in wanted:
        if topic not in seen:
            raise RecordingError(f"{named(source.name)} has no topic {shown(topic)}; it has {_some(sorted(seen))}.")
        if frame is None and (kinds[topic].endswith("/TFMessage") or len(children[topic]) > 1):
            raise RecordingError(
                f"topic {shown(topic)} holds transforms of {_some(sorted(children[topic]))}; add the child frame that"
                " is followed: frame."
            )
        if not rows[topic, frame]:
            of = "" if frame is None else f" of frame {shown(frame)}"
            raise RecordingError(f"topic {shown(topic)} has no message{of}.")
    return {key: _columns(f"topic {key[0]}", kinds[key[0]], found) for key, found in rows.items()}


def _columns(source: str, kind: str, rows: list[tuple[float, float, tuple[float, ...]]]) -> Columns:
    names = _POSE if len(rows[0][2]) == 7 else _WRENCH if len(rows[0][2]) == 6 else _POSE[:3]
    values = np.array([row[2] for row in rows], dtype=np.float64)
    numbers: dict[str, Array] = {name: values[:, k] for k, name in enumerate(names)}
    stamps, arrivals = (np.array([row[k] for row in rows], dtype=np.float64) for k in (0, 1))
    if np.isfinite(stamps).all() and (stamps != 0.0).any():
        numbers[STAMP] = stamps
    numbers[RECEIVE] = arrivals
    return Columns(source=f"{source} ({kind.rpartition('/')[2]})", numbers=numbers)


def _some(names: list[str]) -> str:
    return ", ".join(shown(name) for name in names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")


def _rosbags(module: str) -> Any:
    try:
        return importlib.import_module(f"rosbags.{module}")
    except ImportError as error:
        raise RecordingError(_NEEDED) from error


def _readers(source: Path) -> Iterator[Any]:
    """Readers of all files of a bag, one open at a time."""
    for file in bag_files(source):
        with _opened(file) as reader:
            yield reader


@contextmanager
def _opened(file: Path) -> Iterator[Any]:
    first, second = _rosbags("rosbag1"), _rosbags("rosbag2")
    with tempfile.TemporaryDirectory() as folder:
        try:
            check_plain(file)
            # SQLite reads options from a file's name.
            plain = Path(folder) / f"bag{file.suffix}"
            plain.symlink_to(file.resolve())
            with (first.Reader if file.suffix == ".bag" else second.Reader)(plain) as reader:
                yield reader
        except RecordingError:
            raise
        except FileError as error:
            raise RecordingError(f"{named(file)}: {error}.") from error
        except Exception as error:  # a bag that is cut off breaks wherever its reader happens to be
            raise RecordingError(f"{named(file)}: {CUT_OFF}.") from error


def _messages(reader: Any, topics: Collection[str] | Mapping[str, str]) -> Iterator[tuple[str, float, Any]]:
    """Topic, time of arrival [s] and content of the messages of some topics."""
    connections = [c for c in reader.connections if c.topic in topics]
    if not connections:
        return
    read = _typestore(is_first=type(reader).__module__.startswith("rosbags.rosbag1"))
    messages = iter(reader.messages(connections=connections))
    for _ in range(MOST_MESSAGES):
        try:
            connection, time, raw = next(messages)
            message = read(raw, connection.msgtype)
        except StopIteration:
            return
        except Exception as error:
            raise RecordingError(f"it is {CUT_OFF}.") from error
        yield connection.topic, 1e-9 * time, message
    raise RecordingError(f"its topics have more than {MOST_MESSAGES:,} messages; cut the pushes out of the bag.")


def _typestore(*, is_first: bool) -> Callable[[bytes, str], Any]:
    types = _rosbags("typesys")
    store = types.get_typestore(types.Stores.ROS1_NOETIC if is_first else types.Stores.ROS2_HUMBLE)
    read: Callable[[bytes, str], Any] = store.deserialize_ros1 if is_first else store.deserialize_cdr
    return read


def _stamp(message: Any) -> float:
    header = getattr(message, "header", None)
    if header is None:
        return np.nan
    return float(header.stamp.sec) + 1e-9 * float(header.stamp.nanosec)


def _place(point: Any) -> tuple[float, ...]:
    return float(point.x), float(point.y), float(point.z)


def _turn(quaternion: Any) -> tuple[float, ...]:
    return float(quaternion.x), float(quaternion.y), float(quaternion.z), float(quaternion.w)


_Taken = Iterator[tuple[str | None, float, tuple[float, ...]]]


def _of_pose(message: Any) -> _Taken:
    pose = getattr(message, "pose", message)
    pose = getattr(pose, "pose", pose)  # with a covariance
    yield None, _stamp(message), _place(pose.position) + _turn(pose.orientation)


def _of_transform(message: Any) -> _Taken:
    transform = getattr(message, "transform", message)
    child = getattr(message, "child_frame_id", None)
    yield child, _stamp(message), _place(transform.translation) + _turn(transform.rotation)


def _of_transforms(message: Any) -> _Taken:
    for one in message.transforms:
        yield from _of_transform(one)


def _of_point(message: Any) -> _Taken:
    yield None, _stamp(message), _place(getattr(message, "point", getattr(message, "vector", message)))


def _of_wrench(message: Any) -> _Taken:
    wrench = getattr(message, "wrench", message)
    yield None, _stamp(message), _place(wrench.force) + _place(wrench.torque)


def _of_twist(message: Any) -> _Taken:
    twist = getattr(message, "twist", message)
    yield None, _stamp(message), _place(twist.linear) + _place(twist.angular)


_TAKEN: Final[Mapping[str, Callable[[Any], _Taken]]] = {
    "Pose": _of_pose, "PoseStamped": _of_pose, "PoseWithCovarianceStamped": _of_pose, "Odometry": _of_pose,
    "Transform": _of_transform, "TransformStamped": _of_transform, "TFMessage": _of_transforms,
    "Point": _of_point, "PointStamped": _of_point, "Vector3": _of_point, "Vector3Stamped": _of_point,
    "Wrench": _of_wrench, "WrenchStamped": _of_wrench,
    "Twist": _of_twist, "TwistStamped": _of_twist,
}  # fmt: skip
"""What is taken from a message, by the name of its type: child frame, stamp [s], numbers."""
