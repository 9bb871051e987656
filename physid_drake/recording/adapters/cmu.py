"""Converts the CMU pushes of an aluminium triangle (Zhou, Paolini, Bagnell, Mason, ICRA 2016).

Source: the raw logs of github.com/robinzhoucmu/MLab_EXP, folder PushExp/sensor_log. What the logs do not say
was determined from them (406 pushes with a clear contact in the middle of an edge):

* Object frame. The logged pose is that of the right-angle corner, x and y along the legs: so read, the
  logged tool point lies within 1 mm (median) of the pushed edge, both where the force rises and where the
  log ends. Here B is at the triangle's centroid, (50, 50) mm from that corner.
* Force frame. The hand's x axis points along the push in every push (within 0.2 degrees, one standard
  deviation), and the force is logged in a frame that turns with the hand. Turned into W by the hand's
  yaw, it lies within a friction cone of about 35 degrees about the pushed edge's normal; not turned, in
  any direction. Logs up to the afternoon of 10 August 2015 have the sensor turned by 135 degrees from
  the later ones; each log is converted with the mounting under which the force points along the push.
* Tip. Fitting ``distance of the tool point to the edge = radius + dx cos(a) + dy sin(a)``, a the angle
  between push and edge normal, where the force rises: radius 0.97 +- 0.24 mm and tip centre (-1.9, -0.9)
  mm from the tool point in the hand's frame (later mounting, 256 pushes, residual 0.7 mm); 0.6 +- 0.7 mm
  and (-1.0, -0.4) mm (earlier, 150 pushes, residual 1.2 mm). Used: 1 mm, a pointed finger.
* End of the push. The robot's log stops about 0.33 s before the hand does: the tool point is further from
  the edge at the end than at first contact by 0.7 mm at 2.5 mm/s, 1.2 mm at 5 mm/s and 3.0 mm at 10 mm/s.
  The hand's path is continued at its speed for that time, and the object's final pose stands at its end.
* Height. No file gives it. 1.518 kg of solid aluminium (2700 kg/m3) on this triangle is 50 mm high. The
  tip runs 10 to 12.5 mm above the object's frame; the authors' ``min_height`` is 12.5 mm, which is used
  here.

The published dimensions: legs 150 mm, 1.518 kg. The support points are in the folder's name and nowhere else;
they do not enter the recording.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from physid_drake.errors import RecordingError
from physid_drake.files import FileError, read_text
from physid_drake.recording.adapters.sources import drawn, source_files
from physid_drake.recording.object_model import ObjectModel, Prism
from physid_drake.recording.outlines import outline_distance
from physid_drake.recording.planar import planar_poses, turned
from physid_drake.recording.reading import read_recording
from physid_drake.recording.values import Array, ForceStream, Hand, Push, Recording, Sensors, Table
from physid_drake.recording.writing import write_recording
from physid_drake.wording import named

LEG: Final = 0.150
HEIGHT: Final = 0.050
MASS: Final = 1.518
TIP_RADIUS: Final = 0.001
TIP_LENGTH: Final = 0.020
TIP_HEIGHT: Final = 0.0125
UNLOGGED_TIME: Final = 0.33
"""Time in s for which the hand moves on after the log ends."""

OUTLINE: Final = ((-LEG / 3, -LEG / 3), (2 * LEG / 3, -LEG / 3), (-LEG / 3, 2 * LEG / 3))

_S: Final = float(np.sqrt(0.5))


@dataclass(frozen=True, kw_only=True)
class _Mounting:
    """How sensor and finger sit on the hand.

    Attributes:
        force: (2, 2) turns a sensor reading into the force on the object in the hand's frame.
        tip: tip centre from the tool point, in the hand's frame, in m.
    """

    force: tuple[tuple[float, float], tuple[float, float]]
    tip: tuple[float, float]


_LATER: Final = _Mounting(force=((-_S, -_S), (-_S, _S)), tip=(-0.0019, -0.0009))
_EARLIER: Final = _Mounting(force=((1.0, 0.0), (0.0, -1.0)), tip=(-0.0010, -0.0004))

# Limits beyond which a pair of motion-capture poses cannot be of one push of this object.
_LARGEST_TILT: Final = np.deg2rad(8.0)
_LARGEST_CLIMB: Final = 0.005
_LARGEST_TIP_GAP: Final = 0.006
_LARGEST: Final = 1e10  # of any number: the clock's seconds are since 1970
_TARE_SAMPLES: Final = 5
_SHORTEST_INTERVAL: Final = 1e-3

_DESCRIPTION: Final = (
    "CMU pushes (Zhou, Paolini, Bagnell, Mason, ICRA 2016): an aluminium right triangle, legs 150 mm, "
    "pushed by a pointed finger on a hard blackboard; object pose before and after each push by motion "
    "capture, put flat on the table (z half the height, yaw only; the logged height and tilt are the "
    "calibration's). Object height (50 mm) from mass and density; tip radius (1 mm), tip offset and the"
    " hand's last 0.33 s, which the robot's log cuts off, from the contacts in the logs; table size "
    "assumed."
)


@dataclass(frozen=True, kw_only=True)
class _RawPush:
    """One push of a log: poses (7,) before and after, force rows (n, 3) and robot rows (m, 8), in mm."""

    label: str
    before: Array
    after: Array
    force: Array
    robot: Array


def convert_cmu(source: Path, folder: Path, limit: int | None = None, seed: int = 0) -> Recording:
    """Converts raw CMU logs, and writes the recording.

    A push that cannot be used (tracker error, log cut short) is left out with a ``UserWarning`` naming it.

    Args:
        source: one log, or a folder of them.
        folder: where the recording goes; must not exist, or be empty.
        limit: draw so many pushes at random, and keep their order; None takes all.
        seed: of that draw.

    Returns:
        The recording as read back from ``folder``.

    Raises:
        RecordingError: if ``limit`` is below 1, or there is no log, or no usable push in it.
        OutputError: if the folder cannot be written.
    """
    files = source_files(source, ".txt")
    converted = _convert_logs(files)
    kept = drawn(len(converted), limit, np.random.default_rng(seed))
    pushes = [replace(converted[k], name=f"pushes/{n + 1:03d}.csv") for n, k in enumerate(kept)]
    if not pushes:
        raise RecordingError(f"{source}: no usable push in {len(files)} log(s); are these logs of the CMU pushes?")
    # A folder's name holds the support points, the answer to a blind test: only a log's own name is used.
    stem = f"_{files[0].stem}" if Path(source).is_file() else ""
    recording = Recording(
        name=f"cmu_triangle{stem}",
        description=_DESCRIPTION,
        object=ObjectModel(shape=Prism(polygon=OUTLINE, height=HEIGHT), mass=MASS),
        table=Table(size=(1.0, 1.0), centre=(0.55, 0.0)),
        hand=Hand(tip="cylinder", radius=TIP_RADIUS, length=TIP_LENGTH, stream="measured"),
        sensors=Sensors(),
        pushes=tuple(pushes),
    )
    write_recording(recording, folder)
    return read_recording(folder)


def _convert_logs(files: list[Path]) -> list[Push]:
    converted: list[Push] = []
    seen: set[bytes] = set()
    for file in files:
        usable = [raw for raw in _read_log(file) if _is_usable(raw)]
        # Some logs repeat an earlier log in full; a push held out must not be trained on under another name.
        fresh = [raw for raw in usable if raw.robot.tobytes() not in seen]
        seen.update(raw.robot.tobytes() for raw in usable)
        if len(fresh) < len(usable):
            _warn(f"{file.name}: {len(usable) - len(fresh)} pushes are copies of an earlier log's; left out.")
        mounting = _mounting_of(usable)
        pushes = [_convert(raw, raw.label, mounting) for raw in fresh]
        converted.extend(push for push in pushes if push is not None)
    return converted


def _read_log(file: Path) -> Iterator[_RawPush]:
    try:
        lines = [line.split() for line in read_text(file).splitlines() if line.strip()]
    except FileError as error:
        raise RecordingError(f"{named(file)}: {error}.") from error
    # The oldest log starts with the first pose, without the number of pushes.
    at = 1 if lines and len(lines[0]) == 1 else 0
    number = 0
    while at < len(lines):
        number += 1
        label = f"{file.name}, push {number}"
        try:
            before, after = _numbers(lines, at, 1, 7)[0], _numbers(lines, at + 1, 1, 7)[0]
            forces = _count(lines, at + 2)
            force = _numbers(lines, at + 3, forces, 3)
            robots = _count(lines, at + 3 + forces)
            robot = _numbers(lines, at + 4 + forces, robots, 8)
        except (ValueError, IndexError):
            _warn(f"{label}: the log is cut short or garbled from here on; left out with all that follows.")
            return
        at += 4 + forces + robots
        yield _RawPush(label=label, before=before, after=after, force=force, robot=robot)


def _numbers(lines: list[list[str]], first: int, count: int, columns: int) -> Array:
    rows = [[float(text) for text in line] for line in lines[first : first + count]]
    if len(rows) != count or any(len(row) != columns for row in rows):
        raise ValueError
    return np.array(rows, dtype=np.float64).reshape(count, columns)


def _count(lines: list[list[str]], at: int) -> int:
    (text,) = lines[at]
    count = int(text)
    if count < 0:
        raise ValueError
    return count


def _is_usable(raw: _RawPush) -> bool:
    problem = None
    stacked = np.vstack([raw.before, raw.after])
    if min(len(raw.force), len(raw.robot)) < 2 * _TARE_SAMPLES:
        problem = f"only {len(raw.force)} force and {len(raw.robot)} robot samples"
    elif not all((np.abs(values) <= _LARGEST).all() for values in (stacked, raw.force, raw.robot)):
        problem = f"a number that is not finite, or beyond {_LARGEST:g}"
    elif (np.abs(np.linalg.norm(stacked[:, 3:], axis=1) - 1.0) > 1e-3).any():
        problem = "tracker error: a quaternion that is no rotation"
    else:
        tilt = 2.0 * np.arcsin(np.clip(np.hypot(stacked[:, 4], stacked[:, 5]), 0.0, 1.0)).max()
        climb = abs(raw.after[2] - raw.before[2]) * 1e-3
        travel = np.ptp(raw.robot[:, 1:3], axis=0) * 1e-3
        moved = np.linalg.norm(raw.after[:2] - raw.before[:2]) * 1e-3
        gap = _tip_gap(raw)
        if tilt > _LARGEST_TILT:
            problem = f"tracker error: the object tilts by {np.rad2deg(tilt):.1f} degrees"
        elif climb > _LARGEST_CLIMB:
            problem = f"tracker error: the object climbs by {climb * 1e3:.1f} mm"
        elif moved > 2.0 * np.hypot(*travel) + 0.005:
            problem = f"tracker error: the object moves {moved:.3f} m for {np.hypot(*travel):.3f} m of the hand"
        elif abs(gap) > _LARGEST_TIP_GAP:
            problem = f"tracker error: the finger ends {gap * 1e3:.1f} mm from the object's edge"
    if problem is not None:
        _warn(f"{raw.label}: {problem}; left out.")
    return problem is None


def _tip_gap(raw: _RawPush) -> float:
    """Signed distance in m of the last logged tool point from the triangle after the push."""
    centroid = _centroids(raw)[1]
    local = turned(-centroid[2], raw.robot[-1:, 1:3] * 1e-3 - centroid[:2])
    return float(outline_distance(OUTLINE, local)[0])


def _yaws(quaternions: Array) -> Array:
    w, x, y, z = quaternions.T
    yaws: Array = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return yaws


def _centroids(raw: _RawPush) -> Array:
    """(2, 3) x, y in m and yaw in rad of B before and after."""
    stacked = np.vstack([raw.before, raw.after])
    yaws = _yaws(stacked[:, 3:])
    offsets = turned(yaws, np.full((2, 2), LEG / 3))
    return np.column_stack([stacked[:, :2] * 1e-3 + offsets, np.unwrap(yaws)])


def _hand_forces(raw: _RawPush, mounting: _Mounting) -> Array:
    """Forces on the object (n, 2) in the hand's frame, in N; samples before the hand moves are the tare."""
    tare = raw.force[:_TARE_SAMPLES, 1:].mean(axis=0)
    forces: Array = (raw.force[:, 1:] - tare) @ np.array(mounting.force).T
    return forces


def _mounting_of(pushes: list[_RawPush]) -> _Mounting:
    """The mounting under which the forces of a log point along the pushes (the hand's x axis)."""
    along = [
        sum(float(_hand_forces(raw, mounting).mean(axis=0)[0]) for raw in pushes) for mounting in (_LATER, _EARLIER)
    ]
    return _LATER if along[0] >= along[1] else _EARLIER


def _convert(raw: _RawPush, name: str, mounting: _Mounting) -> Push | None:
    kept = _increasing(raw.force[:, 0])
    force_rows, robot_rows = raw.force[kept], raw.robot[_increasing(raw.robot[:, 0])]
    if min(len(force_rows), len(robot_rows)) < 2 * _TARE_SAMPLES:
        _warn(f"{raw.label}: its clock stands still; left out.")
        return None
    start = min(force_rows[0, 0], robot_rows[0, 0])
    yaws = _yaws(robot_rows[:, 4:])
    hand = robot_rows[:, 1:3] * 1e-3 + turned(yaws, np.tile(mounting.tip, (len(yaws), 1)))
    hand_times, hand = _continued(robot_rows[:, 0] - start, hand)
    forces = _hand_forces(raw, mounting)[kept]
    force_yaws = np.interp(force_rows[:, 0], robot_rows[:, 0], np.unwrap(yaws))
    forces = turned(force_yaws, forces)
    flat = np.zeros(len(hand_times))
    end = max(hand_times[-1], force_rows[-1, 0] - start)
    return Push(
        name=name,
        object=planar_poses([0.0, end], _centroids(raw), 0.5 * HEIGHT),
        hand=planar_poses(hand_times, np.column_stack([hand, flat]), TIP_HEIGHT),
        force=ForceStream(
            times=force_rows[:, 0] - start, forces=np.column_stack([forces, np.zeros(len(force_rows))])
        ),
        note=raw.label,
    )


def _increasing(times: Array) -> list[int]:
    """Indices of times (n,) that are at least a millisecond after the one before; the logger repeats some."""
    latest, kept = -np.inf, []
    for k, time in enumerate(times):
        if time - latest >= _SHORTEST_INTERVAL:
            kept.append(k)
            latest = time
    return kept


def _continued(times: Array, path: Array) -> tuple[Array, Array]:
    """The path (n, 2) at times (n,), continued at its last second's speed for the time the log leaves out."""
    recent = min(int(np.flatnonzero(times >= times[-1] - 1.0)[0]), len(times) - 2)
    velocity = (path[-1] - path[recent]) / (times[-1] - times[recent])
    steps = np.linspace(0.0, UNLOGGED_TIME, 12)[1:]
    return np.concatenate([times, times[-1] + steps]), np.vstack([path, path[-1] + steps[:, None] * velocity])


def _warn(message: str) -> None:
    warnings.warn(message, UserWarning, stacklevel=2)
