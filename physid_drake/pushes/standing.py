"""Whether an object stands on the table as it is recorded; if not, by which axes or quaternions it would.

An object on a table moves in the table's plane and turns about the table's normal, whatever pushes it. Where another
axis is taken for up it moves in a vertical plane, and where quaternions are in another order headings become leans.
Neither takes a fit to be seen.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from physid_drake.cell.solid import solid_of
from physid_drake.convert.conventions import rotation_wxyz
from physid_drake.convert.map_reading import stated_in
from physid_drake.convert.mapping import Stated, World, listed
from physid_drake.convert.source_frame import SourceFrame, source_frame
from physid_drake.errors import RecordingError
from physid_drake.recording import Box, Cylinder, PoseStream, Push, Recording

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LEANS: Final = 8.0
"""Degrees by which an object's lean changes: on a table it stands on its face."""
TIPPED: Final = 30.0
"""Degrees from the vertical: an object that leans more does not stand on its face."""
RISES: Final = 8e-3
"""m by which an object's height changes: on a table it does not."""
FLAT: Final = 0.2
"""Of an object's way on a table: its height changes by less, or by less than ``RISES``."""
SOME: Final = 0.25
"""Of the pushes: in fewer the object may tip, or be lifted."""
LITTLE, HALF = 0.1, 0.5
"""Of the pushes: by so little two readings may differ and be as good; so many are hardly all odd."""
TURNED: Final = 2.0
"""Degrees from a push's first poses to its last: less may be a tracker's noise."""
MOSTLY: Final = 3.0
"""Times as far: an object on a table turns about its normal, and hardly about anything else."""
END: Final = 5
"""Poses at an end of a push."""

UPS: Final = {
    "x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2), "-x": (2, 1, 0), "-y": (0, 2, 1), "-z": (1, 0, 2),
}  # fmt: skip
"""Which axes of a right-handed log are W's x, y and z, by the one that is up."""
ORDERS: Final = {1: ("x, y, z, w", "xyzw"), -1: ("w, x, y, z", "wxyz")}
"""Of quaternions that were taken for the other order, by how far they have to be rolled."""
EULER: Final = (
    "xyz", "ZYX", "XYZ", "zyx", "zxy", "ZXY", "yxz", "YXZ", "yzx", "YZX", "xzy", "XZY",
)  # fmt: skip
"""Orders of Euler angles, the usual ones first: near the upright, several are alike."""


@dataclass(frozen=True, kw_only=True)
class Reading:
    """Another reading of the same log.

    Attributes:
        axes: (3, 3) of the world, as in a map; None if they are as they were read.
        roll: of quaternions, by which they come in the order w, x, y, z.
        order: of Euler angles, as in a map; None if it is as they were read.
        says: what is so, if it is right.
        remedy: what to write, and where.
    """

    axes: Array | None = None
    roll: int = 0
    order: str | None = None
    says: str
    remedy: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Standing:
    """How an object stands and moves by one reading.

    Attributes:
        flat: (n,) the pushes in which it moves in the table's plane.
        upright: (n,) those in which it stays on its face, and turns about the vertical.
        tipped: whether it leans by so much that it is refused, in any push.
        upside_down: whether its z axis points down.
        off: how far its middle is from where it is as it stands on the table, as pushes begin [m].
    """

    flat: Flags
    upright: Flags
    tipped: bool
    upside_down: bool
    off: float

    @property
    def stands(self) -> Flags:
        """(n,) the pushes in which it does what an object on a table does."""
        return self.flat & self.upright

    @property
    def seldom(self) -> bool:
        """Whether that is not so in more than some of the pushes: objects tip, and are lifted."""
        return bool(np.mean(~self.stands) > SOME)


def likelier_reading(recording: Recording) -> Reading | None:
    """By which the object stands on the table in many pushes in which it does not as it is read.

    None where there is none, or nothing is odd. One by which it stands on its feet is likelier than one by which it
    stands on its head: nobody gives it a frame that way.
    """
    here = standing_of(recording)
    if not (here.seldom or here.upside_down):
        return None
    found = []
    for reading in readings_of(recording, turned=bool(np.mean(~here.flat) > SOME)):
        other = _standing_by(recording, reading)
        if other is not None and _is_likelier(other, here):
            changes = (reading.axes is not None) + (reading.roll != 0 or reading.order is not None)
            found.append((float(other.stands.mean()), (changes, other.upside_down, other.off), reading))
    most = max((share for share, _, _ in found), default=0.0)
    alike = [(rank, reading) for share, rank, reading in found if share > most - LITTLE]
    return min(alike, key=lambda pair: pair[0])[1] if alike else None


def _is_likelier(other: Standing, here: Standing) -> bool:
    """Whether a reading explains pushes that another does not, and hardly the other way round."""
    gained = int((other.stands & ~here.stands).sum())
    lost = int((here.stands & ~other.stands).sum())
    if not here.seldom:
        return lost == 0 and not other.upside_down
    if gained > HALF * len(here.stands) and lost <= LITTLE * gained:
        return True
    # Where objects are carried as well, the table's height tells.
    return gained > SOME * len(here.stands) and lost <= HALF * gained and other.off <= here.off


def misread(recording: Recording) -> str:
    """What is odd about how the object stands, and the reading by which nothing is; empty where there is none."""
    reading = likelier_reading(recording)
    if reading is None:
        return ""
    instead = f"if {reading.says} ({reading.remedy})"
    if reading.axes is not None:
        return (
            f"the object moves in a vertical plane; it moves in the table's plane and stands on the table {instead}"
        )
    if standing_of(recording).seldom:
        return f"the object leans, or turns about other axes than the vertical; it stands on the table {instead}"
    return f"the object stands on its head; it stands on its feet {instead}"


def readings_of(recording: Recording, *, turned: bool = True) -> Iterator[Reading]:
    """Other orders of quaternions, and with ``turned`` other axes of the world, one or both at once."""
    stated = stated_in(recording.conversion)
    full = any(push.object.rotation == "full" for push in recording.pushes)
    orders = list(_orders(stated)) if full else []
    yield from orders
    for axes in _axes(stated) if turned else ():
        yield axes
        for order in orders:
            says, remedy = f"{axes.says}, and {order.says}", f"{axes.remedy}; {order.remedy}"
            yield replace(order, axes=axes.axes, says=says, remedy=remedy)


def mirrored(reading: Reading) -> Reading | None:
    """The reading by axes of the other hand, by which an object stands as well; None where no axes are changed."""
    if reading.axes is None:
        return None
    axes = reading.axes[[1, 0, 2]]
    left = bool(np.linalg.det(axes) < 0.0)
    return replace(
        reading,
        axes=axes,
        says=f"{reading.says}, and its axes are {'left' if left else 'right'}-handed",
        remedy=reading.remedy.replace(_names(reading.axes), f"{_names(axes)}, left_handed: {str(left).lower()}"),
    )


def read_as(recording: Recording, reading: Reading) -> Recording:
    """The recording by another reading; without forces where its axes are others.

    Raises:
        RecordingError: if it is none by that reading.
    """
    stated = stated_in(recording.conversion)
    body, hand = (None, None) if stated is None else (stated.object, stated.hand)
    frame = source_frame(stated, body)
    written = "" if body is None or body.turn is None else body.turn.order
    # A hand in a frame of its own has axes of its own.
    shared = stated is None or (hand is not None and stated.world_of(hand) is stated.world_of(stated.object))

    def change(push: Push) -> Push:
        path = push.hand
        if path is not None and reading.axes is not None and shared:
            path = _with_axes(path, source_frame(stated, hand), reading.axes)
        force = push.force if reading.axes is None else None
        return replace(push, object=_read_as(push.object, frame, reading, written), hand=path, force=force)

    with np.errstate(over="ignore", invalid="ignore"):
        return replace(recording, pushes=tuple(map(change, recording.pushes)))


def standing_of(recording: Recording) -> Standing:
    """How the object stands and moves."""
    shape = recording.object.shape
    streams = [push.object for push in recording.pushes]
    begins = np.array([float(np.median(stream.positions[:END, 2])) for stream in streams])
    rolls = isinstance(shape, Cylinder) and shape.axis == "y"
    seen = [stream.rotation == "full" and not rolls for stream in streams]
    leans = [_leans(stream, isinstance(shape, Box | Cylinder)) for stream in streams]  # upside down they are the same
    turns = [_turns(stream) for stream in streams]
    upright = [not s or _stays(lean, turn) for s, lean, turn in zip(seen, leans, turns, strict=True)]
    return Standing(
        flat=np.array([_is_flat(stream) for stream in streams]),
        upright=np.array(upright),
        tipped=any(s and float(np.quantile(lean, 0.95)) > TIPPED for s, lean in zip(seen, leans, strict=True)),
        upside_down=any(seen) and float(np.median([np.median(_cosines(stream)) for stream in streams])) < 0.0,
        off=float(np.median(np.abs(begins - 0.5 * solid_of(shape).height))),
    )


def _standing_by(recording: Recording, reading: Reading) -> Standing | None:
    try:
        return standing_of(read_as(recording, reading))
    except RecordingError:
        return None


def _is_flat(stream: PoseStream) -> bool:
    """Whether an object moves in the plane, but for a few samples."""
    x, y, z = np.ptp(np.quantile(stream.positions, [0.05, 0.95], axis=0), axis=0).tolist()
    return bool(z <= max(RISES, FLAT * math.hypot(x, y)))


def _stays(leans: Array, turns: tuple[float, float]) -> bool:
    """Whether an object with leans (n,) stays on its face, and turns about the vertical."""
    low, high = np.quantile(leans, [0.05, 0.95]).tolist()
    about, across = turns
    return high <= TIPPED and high - low <= LEANS and across <= max(TURNED, MOSTLY * about)


def _cosines(stream: PoseStream) -> Array:
    """Of the angle (n,) between the object's z axis and the vertical."""
    _, x, y, _ = stream.quaternions.T
    return np.asarray(1.0 - 2.0 * (x * x + y * y))


def _leans(stream: PoseStream, either: bool) -> Array:
    """That angle (n,) in degrees; of the axis, whichever way it points, for ``either``."""
    cosines = _cosines(stream)
    return np.asarray(np.degrees(np.arccos(np.clip(np.abs(cosines) if either else cosines, -1.0, 1.0))))


def _turns(stream: PoseStream) -> tuple[float, float]:
    """How far an object has turned about the vertical, and about other axes [degrees]; not at all of few poses."""
    if len(stream) < 2 * END:
        return 0.0, 0.0
    first, last = (
        Rotation.from_quat(np.roll(stream.quaternions[part], -1, axis=1)).mean()
        for part in (slice(END), slice(-END, None))
    )
    x, y, z = np.degrees((last * first.inv()).as_rotvec()).tolist()
    return abs(z), math.hypot(x, y)


def _read_as(stream: PoseStream, frame: SourceFrame, reading: Reading, written: str) -> PoseStream:
    if reading.roll and stream.rotation == "full":
        numbers = np.roll(frame.rotations(stream).as_quat(), 1 + reading.roll, axis=1)
        stream = frame.with_rotations(stream, Rotation.from_quat(np.roll(numbers, -1, axis=1)))
    if reading.order is not None and stream.rotation == "full":
        angles = frame.rotations(stream).as_euler(cast(Any, written))
        stream = frame.with_rotations(stream, Rotation.from_euler(cast(Any, reading.order), angles))
    return stream if reading.axes is None else _with_axes(stream, frame, reading.axes)


def _with_axes(stream: PoseStream, frame: SourceFrame, axes: Array) -> PoseStream:
    """A stream of which other axes of the log are W's. A yaw is about W's vertical, whichever axis that is."""
    other = replace(frame, world=replace(frame.world, axes=axes))
    moved = other.with_places(stream, frame.places(stream))
    return other.with_rotations(moved, frame.rotations(stream)) if stream.rotation == "full" else moved


def _orders(stated: Stated | None) -> Iterator[Reading]:
    """Other orders of the object's quaternions, or of its Euler angles, whichever its rotation was written as."""
    turn = None if stated is None else stated.object.turn
    if stated is not None and turn is not None and turn.kind == "euler":
        for order in EULER:
            if order != turn.order:
                yield Reading(
                    order=order,
                    says=f"the columns of the object's Euler angles are about {', '.join(order.lower())}",
                    remedy=f"{stated.place('object.rotation')}: order: {order}",
                )
        return
    if turn is None or not turn.columns:
        rolls: tuple[int, ...] = (1, -1)
    else:
        rolls = {"wxyz": (1,), "xyzw": (-1,)}.get(turn.kind, ())
    for roll in rolls:
        order, name = ORDERS[roll]
        yield Reading(
            roll=roll,
            says=f"the object's quaternions are {order}",
            remedy=f"{place_in_map(stated, 'object.rotation')}: as: {name}",
        )


def _axes(stated: Stated | None) -> Iterator[Reading]:
    """Other axes of the log that are up; none where a pose, which turns it as it likes, was given instead."""
    world = World() if stated is None else stated.world_of(stated.object)
    if abs(float(rotation_wxyz(world.rotation).as_matrix()[2, 2])) < 1.0 - 1e-9:
        return
    key = "world" if stated is None or stated.object.world is None else "object.world"
    posed = stated is not None and f"{key}.pose" in stated.lines
    for up, (i, j, k) in UPS.items():
        axes = np.zeros((3, 3))
        axes[0, i], axes[1, j], axes[2, k] = 1.0, 1.0, -1.0 if up[0] == "-" else 1.0
        if np.linalg.det(axes) * np.linalg.det(world.axes) < 0.0:
            axes = axes[[1, 0, 2]]
        if not np.array_equal(axes[2], world.axes[2]):
            yield Reading(
                axes=axes,
                says=f"the {'recording' if stated is None else 'log'}'s {up} axis is up",
                remedy=f"{place_in_map(stated, key)}: {'instead of pose, ' * posed}axes: {_names(axes)}",
            )


def _names(axes: Array) -> str:
    """Of the axes, as a map has them."""
    rows = [("-" if row.sum() < 0.0 else "") + "xyz"[int(np.argmax(np.abs(row)))] for row in axes]
    return f"[{', '.join(rows)}]"


def place_in_map(stated: Stated | None, *keys: str) -> str:
    """Where keys of the map stand, or would stand."""
    return f"map: {listed(keys)}" if stated is None else stated.place(*keys)
