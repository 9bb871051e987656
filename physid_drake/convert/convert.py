"""From a foreign log to a recording: tables and bags, and the map that explains them."""

from __future__ import annotations

import hashlib
import tempfile
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from physid_drake.convert.bag import ENDINGS, RECEIVE, STAMP, bag_files, read_bag
from physid_drake.convert.columns import Columns
from physid_drake.convert.cutting import Piece
from physid_drake.convert.map_reading import read_map
from physid_drake.convert.mapping import Clock, ForceMap, Map, Offset, PoseMap, Quantity, Turn
from physid_drake.convert.prisms import prism_of, prism_of_boxes
from physid_drake.convert.streams import end_streams, streams_of
from physid_drake.convert.tables import ARRAYS, TEXTS, Logs, Parts, table_logs
from physid_drake.convert.take import push_of, reach_of, warned_pieces
from physid_drake.errors import RecordingError
from physid_drake.files import FileError, read_text, sha256_of
from physid_drake.recording import (
    Conversion,
    ObjectModel,
    Push,
    Recording,
    read_recording,
    write_recording,
)
from physid_drake.recording.adapters.sources import source_files
from physid_drake.wording import alike, named, shown


def convert_table(source: Path, folder: Path, map_file: Path) -> Recording:
    """Converts tables of numbers, and writes the recording.

    Args:
        source: a file of text (CSV, TSV), npz, HDF5 or Parquet; or a folder of them, in the order of names.
        folder: where the recording goes; must not exist, or be empty.
        map_file: says what the columns are.

    Returns:
        The recording as read back from ``folder``. What was left out is a ``UserWarning`` each.

    Raises:
        RecordingError: if source or map break a rule, or hold no push; nothing is written then.
        OutputError: if the folder cannot be written.
    """
    source = Path(source)
    if not source.exists():
        raise RecordingError(f"{named(source)}: there is no such file or folder.")
    if source.is_dir() and any(file.suffix in ENDINGS for file in source.iterdir()):
        raise RecordingError(f"{named(source)}: holds a bag; use `convert bag`.")
    files = source_files(source, *TEXTS, *ARRAYS)
    return _convert(source, folder, map_file, files, partial(table_logs, files))


def convert_bag(source: Path, folder: Path, map_file: Path) -> Recording:
    """Converts a ROS bag, and writes the recording.

    Args:
        source: a ``.bag``, ``.mcap`` or ``.db3`` file, or the folder of a ROS 2 bag.
        folder: where the recording goes; must not exist, or be empty.
        map_file: says what the topics are.

    Returns:
        The recording as read back from ``folder``. What was left out is a ``UserWarning`` each.

    Raises:
        RecordingError: if source or map break a rule, or hold no push; nothing is written then.
        OutputError: if the folder cannot be written.
    """
    files = bag_files(Path(source))

    def logs(chart: Map) -> Logs:
        yield files[0].name, partial(_bag_parts, Path(source), chart)

    return _convert(source, folder, map_file, files, logs)


def _convert(
    source: Path,
    folder: Path,
    map_file: Path,
    files: Sequence[Path],
    logs: Callable[[Map], Logs],
) -> Recording:
    chart = _with_prism(read_map(Path(map_file)))
    pushes: list[Push] = []
    with _warned_by_kind():
        for name, parts in logs(chart):
            try:
                pieces = _pieces(name, parts())
            except RecordingError as error:
                said = str(error)
                raise RecordingError(said if name in said else f"{named(name)}: {said}") from error
            for label, piece in pieces:
                note = f"{name}{label}, from {piece.begin:.10g} s"
                tare = 0.0 if chart.force is None else chart.force.tare
                pushes.append(push_of(piece, len(pushes) + 1, note, tare))
    if not pushes:
        raise RecordingError(f"{named(source)}: no push was found; see what was left out, and the map's 'pushes:'.")
    return _written(pushes, chart, _conversion(Path(source), files, chart), folder)


@contextmanager
def _warned_by_kind() -> Iterator[None]:
    """Of warnings that are alike but for their numbers, the first, and how many more there are."""
    caught: list[warnings.WarningMessage] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            yield
    finally:
        for one in caught:
            if one.category is not UserWarning:
                warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)
        for said in alike(str(one.message) for one in caught if one.category is UserWarning):
            more = f" ({len(said) - 1} more like it)" if len(said) > 1 else ""
            warnings.warn(f"{said[0]}{more}", UserWarning, stacklevel=3)


def _with_prism(chart: Map) -> Map:
    """The map with the prism that its mesh or its boxes are, and the pose of that in the tracked frame."""
    model = chart.model
    if isinstance(model, ObjectModel):
        return chart
    if chart.object.offset != Offset():
        raise RecordingError("object: offset stands beside recording.object.frame; give one of them.")
    if isinstance(model.parts, Path):
        made = prism_of(model.parts, model.scale, model.frame)
    else:
        made = prism_of_boxes(model.parts, model.scale, model.frame)
    warnings.warn(f"{made.says}.", UserWarning, stacklevel=2)
    end = chart.object.end
    body = replace(chart.object, offset=made.offset, end=None if end is None else replace(end, offset=made.offset))
    return replace(chart, object=body, model=ObjectModel(shape=made.shape, mass=model.mass, mass_std=model.mass_std))


def _pieces(name: str, parts: Parts) -> list[tuple[str, Piece]]:
    """Pushes of one log, each with what tells it from the others of the log."""
    found: list[tuple[str, Piece]] = []
    for label, chart, columns in parts:
        # What is out of all proportion is refused by what it makes.
        with np.errstate(over="ignore", invalid="ignore"):
            streams = end_streams(columns["object"], chart) if chart.cut.by == "rows" else streams_of(columns, chart)
        reach = reach_of(_solid(chart), chart.hand)
        found.extend((label, piece) for piece in warned_pieces(streams, chart.cut, reach, f"{name}{label}: "))
    return found


def _bag_parts(source: Path, chart: Map) -> Parts:
    """The topics that a map names, which in a bag have columns of known names."""
    streams = {"object": chart.object, "hand": chart.hand_path, "force": chart.force}
    wanted: dict[str, tuple[str, str | None]] = {}
    for key, stream in streams.items():
        if stream is not None:
            if stream.topic is None:
                raise RecordingError(f"{key}: a bag's stream needs its topic.")
            wanted[key] = (stream.topic, stream.frame if isinstance(stream, PoseMap) else None)
    if chart.cut.by == "column":
        raise RecordingError("pushes: a bag has no columns; cut by rest, gap or times.")
    found = read_bag(source, list(wanted.values()))
    columns = {key: found[where] for key, where in wanted.items()}
    hand, force = chart.hand_path, chart.force
    named_chart = replace(
        chart,
        object=_pose_columns("object", chart.object, columns["object"], chart),
        hand_path=None if hand is None else _pose_columns("hand", hand, columns["hand"], chart),
        force=None if force is None else _force_columns(force, columns["force"], chart),
    )
    return [("", named_chart, columns)]


def _pose_columns(key: str, pose: PoseMap, columns: Columns, chart: Map) -> PoseMap:
    turn = pose.turn
    if turn is not None and not turn.columns:
        if "qx" not in columns.numbers:
            raise RecordingError(f"{key}: {columns.source} has no rotation; write 'rotation: none'.")
        turn = Turn(columns=("qx", "qy", "qz", "qw"), kind="xyzw", inverse=turn.inverse)
    position = pose.position if pose.position.columns else Quantity(columns=("x", "y", "z"), unit=pose.position.unit)
    return replace(pose, position=position, turn=turn, clock=_clock(pose.clock, columns, chart))


def _force_columns(force: ForceMap, columns: Columns, chart: Map) -> ForceMap:
    quantity = force.force if force.force.columns else Quantity(columns=("x", "y", "z"), unit=force.force.unit)
    return replace(force, force=quantity, clock=_clock(force.clock, columns, chart))


def _clock(clock: Clock, columns: Columns, chart: Map) -> Clock:
    if clock.column is not None or chart.by_receive:
        return replace(clock, column=clock.column or RECEIVE)
    if STAMP not in columns.numbers:
        warnings.warn(
            f"{columns.source} has no stamps of its own: its times are those of arrival.", UserWarning, stacklevel=2
        )
        return replace(clock, column=RECEIVE)
    return replace(clock, column=STAMP)


def _solid(chart: Map) -> ObjectModel:
    assert isinstance(chart.model, ObjectModel)
    return chart.model


def _conversion(source: Path, files: Sequence[Path], chart: Map) -> Conversion:
    try:
        text = read_text(chart.file)
        hashes = [sha256_of(file) for file in files]
    except FileError as error:
        raise RecordingError(f"{named(source)}: {error}.") from error
    whole = hashes[0] if len(hashes) == 1 else hashlib.sha256("".join(hashes).encode()).hexdigest()
    return Conversion(
        source=source.name, source_sha256=whole, map=text, map_sha256=hashlib.sha256(text.encode()).hexdigest()
    )


def _written(pushes: list[Push], chart: Map, conversion: Conversion, folder: Path) -> Recording:
    recording = Recording(
        name=chart.name,
        description=chart.description,
        object=_solid(chart),
        table=chart.table,
        hand=chart.hand,
        sensors=chart.sensors,
        pushes=tuple(pushes),
        folder=chart.file.parent,
        conversion=conversion,
    )
    # Read before it is put in place, so that what is refused leaves nothing behind.
    with tempfile.TemporaryDirectory() as scratch:
        trial = Path(scratch) / "recording"
        write_recording(recording, trial)
        try:
            read_recording(trial)
        except RecordingError as error:
            said = str(error).replace(f"{trial}/", "")
            raise RecordingError(f"what the map makes of {shown(conversion.source)} is refused: {said}") from error
    write_recording(recording, folder)
    return read_recording(folder)
