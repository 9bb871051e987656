"""The files of a bag, of ROS 1 or 2, and the messages of its topics.

Messages are taken apart by the definitions of the standard types, not by those that a bag carries: what is in a bag
is data. Each file of a bag's folder is read by itself, so that no path in its metadata is followed.
"""

from __future__ import annotations

import importlib
import tempfile
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from physid_drake.errors import RecordingError
from physid_drake.files import FileError, check_plain
from physid_drake.wording import named, one_line

ENDINGS: Final = (".bag", ".mcap", ".db3")
PACKED: Final = (".zstd", ".zst")
"""Endings of files that were compressed as a whole, behind those of bags."""

MOST_MESSAGES: Final = 3_000_000
"""Of the topics that are read: an hour and a half at 500 Hz."""

LARGEST_MESSAGE: Final = 1 << 26
"""Bytes that one message may unpack to; poses and forces are much smaller."""

CUT_OFF: Final = "no bag that can be read, or one that is cut off or damaged"

_NEEDED: Final = "reading bags needs rosbags, which is not installed; run `pip install physid_drake[bags]`."
_ZSTD: Final = b"\x28\xb5\x2f\xfd"
"""First bytes of what zstd has compressed; a message that is not begins with 0."""

_FIRST: Final = b"#ROSBAG V2.0\n"
"""The first line of a bag of ROS 1."""

_TRANSFORMS: Final = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
"""Types of ROS 1 that rosbags does not know, though every robot sends them."""

_Read = Callable[[bytes, str], Any]


@dataclass(frozen=True, kw_only=True)
class BagFile:
    """One file of a bag, open.

    Attributes:
        file: for messages.
        reader: of rosbags.
    """

    file: Path
    reader: Any

    @property
    def kinds(self) -> dict[str, str]:
        """The types of its topics."""
        return {connection.topic: connection.msgtype for connection in self.reader.connections}

    def counts(self) -> Iterator[tuple[str, int]]:
        """How many messages its topics have."""
        for connection in self.reader.connections:
            yield connection.topic, connection.msgcount

    def messages(self, topics: Collection[str]) -> Iterator[tuple[str, str, float, Any]]:
        """Topic, type, time of arrival [s] and content of the messages of some topics.

        Raises:
            RecordingError: if one cannot be read, or there are too many.
        """
        connections = [c for c in self.reader.connections if c.topic in topics]
        if not connections:
            return
        read = _typestore(is_first=type(self.reader).__module__.startswith("rosbags.rosbag1"))
        messages = iter(self.reader.messages(connections=connections))
        for _ in range(MOST_MESSAGES):
            try:
                connection, time, raw = next(messages)
                message, receive = read(raw, connection.msgtype), 1e-9 * time
            except StopIteration:
                return
            except RecordingError as error:
                raise RecordingError(f"{named(self.file)}: {error}") from error
            except Exception as error:
                raise RecordingError(f"{named(self.file)}: {CUT_OFF}.") from error
            yield connection.topic, connection.msgtype, receive, message
        raise RecordingError(
            f"{named(self.file)}: its topics have more than {MOST_MESSAGES:,} messages; cut the pushes out of it."
        )


def is_packed(file: Path) -> bool:
    """Whether a file looks like one of a bag that was compressed as a whole, by its endings."""
    return file.suffix in PACKED and Path(file.stem).suffix in ENDINGS


def bag_files(source: Path) -> list[Path]:
    """The files of a bag: itself, or those in its folder, in the order of their names.

    Raises:
        RecordingError: if there is none.
    """
    try:
        inside = sorted(source.iterdir()) if source.is_dir() else [source]
    except OSError as error:
        raise RecordingError(f"{named(source)}: cannot be read: {one_line(error)}.") from error
    files = [file for file in inside if file.suffix in ENDINGS]
    if not files:
        if any(map(is_packed, inside)):
            raise RecordingError(
                f"{named(source)}: a bag that is packed as a whole; unpack its files with `zstd -d`."
            )
        raise RecordingError(
            f"{named(source)}: no bag here; give a {', '.join(ENDINGS)} file, or the folder with them."
        )
    return files


def opened_files(source: Path) -> Iterator[BagFile]:
    """All files of a bag, one open at a time.

    Raises:
        RecordingError: if there is none, or one cannot be read.
    """
    for file in bag_files(source):
        with _opened(file) as reader:
            # SQLite keeps whatever is written into a column.
            if not all(isinstance(name, str) for c in reader.connections for name in (c.topic, c.msgtype)):
                raise RecordingError(f"{named(file)}: {CUT_OFF}.")
            yield BagFile(file=file, reader=reader)


@contextmanager
def _opened(file: Path) -> Iterator[Any]:
    first, second = _rosbags("rosbag1"), _rosbags("rosbag2")
    with tempfile.TemporaryDirectory() as folder:
        try:
            check_plain(file)
            _check_first_line(file)
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


def _check_first_line(file: Path) -> None:
    """Its reader takes all of a file for the first line where no line ends."""
    if file.suffix == ".bag":
        with file.open("rb") as opened:
            if opened.read(len(_FIRST)) != _FIRST:
                raise RecordingError(f"{named(file)}: {CUT_OFF}.")


def _rosbags(module: str) -> Any:
    try:
        return importlib.import_module(f"rosbags.{module}")
    except ImportError as error:
        raise RecordingError(_NEEDED) from error


def _typestore(*, is_first: bool) -> _Read:
    types = _rosbags("typesys")
    if not is_first:
        read: _Read = types.get_typestore(types.Stores.ROS2_HUMBLE).deserialize_cdr
        return lambda raw, kind: read(_unpacked(raw), kind)
    store = types.get_typestore(types.Stores.ROS1_NOETIC)
    for name in _TRANSFORMS:
        store.register(types.get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", name))
    first: _Read = store.deserialize_ros1
    return first


def _unpacked(raw: bytes) -> bytes:
    """A message of ROS 2, which may have been compressed by itself."""
    if bytes(raw[: len(_ZSTD)]) != _ZSTD:
        return raw
    unpacker = _zstd().ZstdDecompressor()
    plain: bytes = unpacker.decompress(bytes(raw), max_length=LARGEST_MESSAGE)
    if not unpacker.eof:
        raise RecordingError(f"a message is cut off, or unpacks to more than {LARGEST_MESSAGE:,} bytes.")
    return plain


def _zstd() -> Any:
    for module in ("compression.zstd", "backports.zstd"):  # of Python 3.14, and what stands for it before
        try:
            return importlib.import_module(module)
        except ImportError:
            continue
    raise RecordingError("its messages are compressed with zstd; run `pip install backports.zstd`.")
