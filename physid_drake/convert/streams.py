"""Streams of a log in W: poses of object and hand, forces of the hand on the object, by one clock."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from physid_drake.convert.clocks import increasing
from physid_drake.convert.columns import Array, Columns
from physid_drake.convert.conventions import (
    forces_in_world,
    in_space,
    places_in_world,
    rotation_of,
    rotations_in_world,
    with_offset,
    wxyz_of,
)
from physid_drake.convert.lost import lost_rows
from physid_drake.convert.mapping import Clock, ForceMap, Map, PoseMap, Quantity, Rows, Turn, World
from physid_drake.convert.units import ANGLES, FORCES, LENGTHS, SPEEDS, TIMES, factor
from physid_drake.errors import RecordingError
from physid_drake.recording import ForceStream, PoseStream
from physid_drake.recording.values import RotationKind
from physid_drake.wording import shown

BEFORE: Final = 0.3
AFTER: Final = 1.0
"""s: a hand of which only the ends are known rests for so long before it goes, and the object comes to rest in."""

MOST_ANGLE: Final = 6.5
"""rad: no Euler angle or rotation vector is larger than a whole turn."""

STEP: Final = 0.01
"""s between samples of such a hand."""


@dataclass(frozen=True, kw_only=True)
class Streams:
    """All of one log in W, before it is cut; times in s by the common clock."""

    object: PoseStream
    hand: PoseStream | None
    force: ForceStream | None


def streams_of(columns: Mapping[str, Columns], chart: Map) -> Streams:
    """The streams that a map finds in a log's columns.

    Args:
        columns: of ``object``, ``hand`` and ``force``; in a table they are the same.
        chart: the map.

    Raises:
        RecordingError: if what the map names is not there, or is not what it says; one line that names the key.
    """
    with _naming("object"):
        body = _poses(columns["object"], chart.object, chart)
    hand = force = None
    if chart.hand_path is not None:
        with _naming("hand"):
            if _is_the_same(columns, chart.object, chart.hand_path):
                raise RecordingError("its columns are those of the object; nothing pushes itself.")
            hand = _poses(columns["hand"], chart.hand_path, chart)
    if chart.force is not None:
        with _naming("force"):
            force = _forces(columns["force"], chart.force, hand, chart)
    return Streams(object=body, hand=hand, force=force)


def _is_the_same(columns: Mapping[str, Columns], body: PoseMap, hand: PoseMap) -> bool:
    """Whether the hand's places are read from the object's columns, in the same rows."""
    if columns["hand"] is not columns["object"]:
        return False
    names = [list(map(columns["object"].find, pose.position.columns)) for pose in (body, hand)]
    return names[0] == names[1]


def end_streams(columns: Columns, chart: Map) -> Streams:
    """The streams of a push of which a row tells where object and hand were first and last, and the hand's speed.

    The hand rests for ``BEFORE``, goes straight at its speed, and rests; nobody recorded more of it.

    Args:
        columns: of one row.
        chart: the map.

    Raises:
        RecordingError: if what the map names is not there or empty, or the hand goes nowhere.
    """
    with _naming("object"):
        body = _ends(columns, chart.object, chart, (0.0, BEFORE))
    if chart.hand_path is None:
        return Streams(object=body, hand=None, force=None)
    with _naming("hand"):
        ends = _ends(columns, chart.hand_path, chart, (0.0, BEFORE))
        speed = _speed(columns, chart.hand_path)
        way = float(np.linalg.norm(ends.positions[1, :2] - ends.positions[0, :2]))
        if not way > 0.0:
            raise RecordingError("it ends where it starts; the two must be apart.")
        times = BEFORE + np.arange(0.0, way / speed, STEP)
        times = np.concatenate([[0.0], times, [BEFORE + way / speed, BEFORE + way / speed + AFTER]])
        share = np.clip((times - BEFORE) * speed / way, 0.0, 1.0)[:, None]
        hand = replace(
            ends,
            times=times,
            positions=(1.0 - share) * ends.positions[0] + share * ends.positions[1],
            quaternions=np.repeat(ends.quaternions[:1], len(times), axis=0),
        )
    return Streams(object=replace(body, times=np.array([0.0, times[-1]])), hand=hand, force=None)


def _ends(columns: Columns, pose: PoseMap, chart: Map, times: tuple[float, float]) -> PoseStream:
    """First and last pose of a body."""
    assert pose.end is not None
    both = [_placed(columns, one, np.array([time]), chart) for one, time in zip((pose, pose.end), times, strict=True)]
    return replace(
        both[0],
        times=np.array(times),
        positions=np.vstack([one.positions for one in both]),
        quaternions=np.vstack([one.quaternions for one in both]),
    )


def _speed(columns: Columns, pose: PoseMap) -> float:
    speed = pose.speed
    if isinstance(speed, Quantity):
        speed = float(_scaled(columns, speed, SPEEDS, "m/s")[0, 0])
    if speed is None or not speed > 0.0:
        raise RecordingError("its speed must be positive.")
    return speed


@contextmanager
def _naming(key: str) -> Iterator[None]:
    try:
        yield
    except RecordingError as error:
        raise RecordingError(f"{key}: {error}") from error


def _poses(columns: Columns, pose: PoseMap, chart: Map) -> PoseStream:
    times = _times(columns, pose.clock, chart, pose.rows, len(columns.stack(pose.position.columns)))
    return _placed(columns, pose, times, chart)


def _placed(columns: Columns, pose: PoseMap, times: Array, chart: Map) -> PoseStream:
    """The rows of a body that are filled, in W."""
    if not pose.position.columns:
        raise RecordingError("position needs columns; a topic is a bag's.")
    place = _scaled(columns, pose.position, LENGTHS, "m")
    turn = None if pose.turn is None else _turns(columns, pose.turn)
    seen = np.isfinite(place).all(axis=1) & np.isfinite(times)
    if turn is not None:
        seen &= np.isfinite(turn).all(axis=1) & (turn != 0.0).any(axis=1) if turn.shape[1] == 4 else (
            np.isfinite(turn).all(axis=1))  # fmt: skip
    if not seen.any():
        raise RecordingError("no row has all of its columns filled.")
    lost = lost_rows(place[seen])
    if lost.any():
        seen[np.flatnonzero(seen)[lost]] = False
        warnings.warn(
            f"{columns.source}: {int(lost.sum())} rows hold one place far from those before and after: the track was"
            " lost; left out.",
            UserWarning, stacklevel=2,
        )  # fmt: skip
    rows = np.flatnonzero(seen)[increasing(times[seen], columns, seen)]
    times, place = times[rows], place[rows]
    rotation = (
        None if pose.turn is None or turn is None else _rotation(columns, pose.turn, turn[rows], chart.world_of(pose))
    )
    return _pose_stream(times, place, rotation, pose, chart)


def _pose_stream(times: Array, place: Array, rotation: Rotation | None, pose: PoseMap, chart: Map) -> PoseStream:
    """A body's stream in W.

    Args:
        times: (n,) [s] by the common clock, which increase.
        place: (n, 3), or (n, 2) where no height was measured [m], in the log's world.
        rotation: n of them in the log's world; None where none was measured.
        pose: what the map says of the body.
        chart: the map.

    Raises:
        RecordingError: if an offset turns with a rotation that was not measured.
    """
    kind: RotationKind = "full"
    if rotation is None:
        kind = "none"
    elif pose is chart.object and pose.turn is not None and pose.turn.kind == "yaw":
        kind = "yaw"
    world = chart.world_of(pose)
    positions = places_in_world(in_space(place, world), world)
    turned = None if rotation is None else rotations_in_world(rotation, world)
    positions, turned = with_offset(positions, turned, pose.offset)
    if pose.height is not None:
        positions[:, 2] = pose.height
    quaternions = np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1)) if turned is None else wxyz_of(turned)
    return PoseStream(times=times, positions=positions, quaternions=quaternions, rotation=kind)


def _forces(columns: Columns, force: ForceMap, hand: PoseStream | None, chart: Map) -> ForceStream:
    if not force.force.columns:
        raise RecordingError("it needs columns; a topic is a bag's.")
    world = chart.world_of(force)
    values = in_space(_scaled(columns, force.force, FORCES, "N"), World() if force.in_hand else world)
    times = _times(columns, force.clock, chart, force.rows, len(values))
    seen = np.isfinite(values).all(axis=1) & np.isfinite(times)
    if not seen.any():
        raise RecordingError("no row has all of its columns filled.")
    rows = np.flatnonzero(seen)[increasing(times[seen], columns, seen)]
    times, values = times[rows], values[rows]
    turns = _turns_at(times, hand) if force.in_hand and hand is not None else None
    return ForceStream(times=times, forces=forces_in_world(values, force, turns, world))


def _times(columns: Columns, clock: Clock, chart: Map, rows: Rows, count: int) -> Array:
    """Times (n,) [s] by the common clock, of so many rows."""
    own = clock if clock.column is not None or clock.rate is not None else chart.clock
    offset = clock.offset or chart.clock.offset
    if own.column is None:
        if own.rate is None:
            raise RecordingError("there are no times; name their column in time.column, or give rate_hz.")
        if rows.where:
            raise RecordingError("rows that are picked come at no rate; name a column of times, or one that counts.")
        return np.arange(count) / own.rate + offset
    name = columns.find(own.column)
    stated = columns.unit_of(name)
    if own.unit is not None and stated in TIMES and own.unit != stated:
        raise RecordingError(f"the map says {own.unit}, but times in column {shown(name)} are in {stated}.")
    unit = own.unit or stated or "s"
    scale = factor(unit, TIMES, f"times in column {shown(name)}") if own.rate is None else 1.0 / own.rate
    if len(columns.numbers[name]) != count:
        raise RecordingError(
            f"column {shown(name)} has {len(columns.numbers[name])} times, but there are {count} rows; name the times"
            " that belong to them."
        )
    times: Array = columns.numbers[name] * scale + offset
    if own.fine is not None:
        times = times + 1e-9 * columns.stack([own.fine])[:, 0]
    return times


def _scaled(columns: Columns, quantity: Quantity, kind: Mapping[str, float], default: str) -> Array:
    values = columns.stack(quantity.columns)
    if quantity.size is not None:
        return quantity.size * values
    stated = {unit for unit in map(columns.unit_of, quantity.columns) if unit is not None}
    if kind is LENGTHS and not stated and columns.length is not None:
        stated = {columns.length}
    if quantity.unit is None and len(stated) > 1:
        raise RecordingError(f"its columns are in {' and '.join(sorted(stated))}; give columns of one unit.")
    unit = quantity.unit or next(iter(stated), default)
    if stated and kind.get(unit) not in map(kind.get, stated):
        raise RecordingError(f"the map says {unit}, but the table's header says {', '.join(sorted(stated))}.")
    return values * factor(unit, kind, "these columns")


def _turns(columns: Columns, turn: Turn) -> Array:
    if not turn.columns:
        raise RecordingError("rotation needs columns, or 'rotation: none' if it was not measured.")
    return columns.stack(turn.columns)


def _rotation(columns: Columns, turn: Turn, values: Array, world: World) -> Rotation:
    stated = next((unit for unit in map(columns.unit_of, turn.columns) if unit in ANGLES), None)
    if None not in (turn.unit, stated) and turn.unit != stated:
        raise RecordingError(f"rotation: the map says {turn.unit}, but the table's header says {stated}.")
    unit = turn.unit or stated
    if unit is None and turn.kind not in ("wxyz", "xyzw", "matrix"):
        raise RecordingError("rotation: angles need a unit, rad or deg; add it.")
    largest = float(np.abs(values).max(initial=0.0))
    if unit == "rad" and turn.kind in ("euler", "rotation_vector") and largest > MOST_ANGLE:
        raise RecordingError(f"rotation: angles are said to be in rad, but one is {largest:.4g}; are they in deg?")
    return rotation_of(turn, values, ANGLES[unit or "rad"], world)


def _turns_at(times: Array, hand: PoseStream) -> Rotation:
    """Rotations of the hand at other times, between its samples."""
    rotations = Rotation.from_quat(np.roll(hand.quaternions, -1, axis=1))
    if len(hand) < 2:
        return Rotation.concatenate([rotations] * len(times))
    return Slerp(hand.times, rotations)(np.clip(times, hand.times[0], hand.times[-1]))
