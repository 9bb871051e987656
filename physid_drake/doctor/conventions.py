"""What a recording may have got wrong, each as the recording that it would then be.

A convention is a hypothesis like any other: it is put right, and the pushes are fitted again. What reflects
everything alike cannot be told, since the physics of pushes is the same in a mirror.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from physid_drake.convert.map_reading import stated_in
from physid_drake.convert.source_frame import SourceFrame, source_frame
from physid_drake.doctor.angles import angles_of
from physid_drake.doctor.convention import Convention, each_push
from physid_drake.doctor.gaps import driven_samples, gaps_at
from physid_drake.doctor.units import origins_of, units_of
from physid_drake.pushes.standing import Reading, likelier_reading, mirrored, place_in_map, read_as, readings_of
from physid_drake.recording import (
    Box,
    Cylinder,
    PoseStream,
    Prism,
    Push,
    Recording,
    Shape,
)
from physid_drake.recording.planar import turned

Array = NDArray[np.float64]

LATEST: Final = 1.0
"""s between the clocks of hand and object, at most, that are looked for; in steps of ``TICK``."""
TIME_STEP: Final = 0.01
LEAST_LATE: Final = 0.015
LEAST_SHIFT: Final = 2e-3
"""s, m: clocks and frames that differ by less are physics (lag, offset), or noise."""


def conventions_of(recording: Recording) -> Iterator[Convention]:
    """Everything that may be wrong with places, turns, sizes and clocks, one at a time."""
    for propose in _kinds(recording):
        yield from propose(recording)


def pairs_of(recording: Recording) -> Iterator[Convention]:
    """Two of these at once, of different kinds; what is measured, such as a shift, after what is not."""
    kinds = _kinds(recording)
    for k, propose in enumerate(kinds):
        for first in propose(recording):
            for other in kinds[k + 1 :]:
                for second in other(first.recording):
                    yield Convention(
                        says=f"{first.says}, and {second.says}",
                        remedy=f"{first.remedy}; {second.remedy}",
                        recording=second.recording,
                    )


def _kinds(recording: Recording) -> list[Callable[[Recording], Iterator[Convention]]]:
    """Of one kind, one thing is wrong at most."""
    if recording.hand is None:
        return [_rotations, _ups, _sizes_of_object]
    # What is of the log's numbers goes before what is of the frame that its map gives it.
    return [
        units_of,
        _rotations,
        _ups,
        origins_of,
        _axes,
        _sizes_of_object,
        _sizes_of_tip,
        _clocks,
        _shifts,
        _exchanged,
    ]


def _rotations(recording: Recording) -> Iterator[Convention]:
    kinds = {push.object.rotation for push in recording.pushes}
    for reading in _different(recording):
        yield _by_reading(recording, reading)
    if kinds & {"full", "yaw"}:
        stated = stated_in(recording.conversion)
        frame = source_frame(stated, None if stated is None else stated.object)
        yield Convention(
            says="the object's rotations turn the other way (R_BW, or an axis that is mirrored)",
            remedy=f"{place_in_map(stated, 'object.rotation')}: inverse: {str(not frame.inverse).lower()},"
            " or world.left_handed",
            recording=each_push(recording, partial(_inverted, frame=frame)),
        )
    yield from angles_of(recording)
    if kinds & {"full", "yaw"}:
        for degrees in (90, 180, 270):
            yield Convention(
                says=f"the object's frame is turned by {degrees} degrees in it",
                remedy=f"map: object.offset: yaw_deg: {degrees}",
                recording=each_push(recording, partial(_turned_in_itself, turn=math.radians(degrees))),
            )


def _different(recording: Recording) -> Iterator[Reading]:
    """Readings of its rotations; of Euler angles one for each column that may be about the vertical.

    Of an object that stands, others are alike.
    """
    stated = stated_in(recording.conversion)
    up = 2 if stated is None else int(np.argmax(np.abs(source_frame(stated, stated.object).world.axes[2])))
    seen = set()
    for reading in readings_of(recording, turned=False):
        column = None if reading.order is None else reading.order.lower().index("xyz"[up])
        if column is None or column not in seen:
            yield reading
        seen.add(column)


def _with_turn(push: Push, quaternions: Array) -> Push:
    return replace(push, object=replace(push.object, quaternions=quaternions))


def _by_reading(recording: Recording, reading: Reading) -> Convention:
    return Convention(says=reading.says, remedy=reading.remedy, recording=read_as(recording, reading))


def _ups(recording: Recording) -> Iterator[Convention]:
    """Another axis that is up, by which the object moves in the table's plane; of axes of either hand."""
    reading = likelier_reading(recording)
    if reading is not None and (other := mirrored(reading)) is not None:
        yield _by_reading(recording, reading)
        yield _by_reading(recording, other)


def _inverted(push: Push, frame: SourceFrame) -> Push:
    return replace(push, object=frame.with_rotations(push.object, frame.rotations(push.object).inv()))


def _turned_in_itself(push: Push, turn: float) -> Push:
    """The object's frame, turned about its own z [rad]."""
    c, s = math.cos(0.5 * turn), math.sin(0.5 * turn)
    w, x, y, z = push.object.quaternions.T
    return _with_turn(push, np.column_stack([w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s]))


def _axes(recording: Recording) -> Iterator[Convention]:
    """Axes of the plane that one stream, or both, has another way; rotations are left as they are."""
    matrices = {
        "y is mirrored": [[1.0, 0.0], [0.0, -1.0]],
        "x is mirrored": [[-1.0, 0.0], [0.0, 1.0]],
        "x and y are swapped": [[0.0, 1.0], [1.0, 0.0]],
        "its axes are turned by 90 degrees": [[0.0, -1.0], [1.0, 0.0]],
        "its axes are turned by 180 degrees": [[-1.0, 0.0], [0.0, -1.0]],
        "its axes are turned by 270 degrees": [[0.0, 1.0], [-1.0, 0.0]],
    }
    for said, matrix in matrices.items():
        yield Convention(
            says=f"of the hand, {said}",
            remedy="map: columns of hand.position, or world for the hand's stream",
            recording=each_push(recording, partial(_hand_axes, matrix=np.array(matrix))),
        )
    for said in ("y is mirrored", "x is mirrored", "x and y are swapped"):
        yield Convention(
            says=f"of the object's places, but not of its rotations, {said}",
            remedy="map: columns of object.position, or world for the object's stream",
            recording=each_push(recording, partial(_object_axes, matrix=np.array(matrices[said]))),
        )
    for said in ("y is mirrored", "x and y are swapped"):
        yield Convention(
            says=f"of both places, but not of the rotations, {said}",
            remedy="map: world.axes with left_handed: true, or columns of object.position and hand.position",
            recording=each_push(recording, partial(_both_axes, matrix=np.array(matrices[said]))),
        )


def _hand_axes(push: Push, matrix: Array) -> Push:
    assert push.hand is not None
    return replace(push, hand=_turned(push.hand, matrix))


def _object_axes(push: Push, matrix: Array) -> Push:
    return replace(push, object=_turned(push.object, matrix))


def _both_axes(push: Push, matrix: Array) -> Push:
    return _hand_axes(_object_axes(push, matrix), matrix)


def _turned(stream: PoseStream, matrix: Array) -> PoseStream:
    positions = stream.positions.copy()
    positions[:, :2] = positions[:, :2] @ matrix.T
    return replace(stream, positions=positions)


def _sizes_of_tip(recording: Recording) -> Iterator[Convention]:
    assert recording.hand is not None
    for factor, said in ((0.5, "a diameter"), (2.0, "half of it")):
        radius = factor * recording.hand.radius
        yield Convention(
            says=f"the tip's radius is {said}",
            remedy=f"hand: radius_m: {radius:.4g}",
            recording=replace(recording, hand=replace(recording.hand, radius=radius)),
        )


def _sizes_of_object(recording: Recording) -> Iterator[Convention]:
    for said, shape in _other_shapes(recording.object.shape):
        yield Convention(
            says=f"the object's {said}",
            remedy="object: its size in recording.yaml",
            recording=replace(recording, object=replace(recording.object, shape=shape)),
        )


def _other_shapes(shape: Shape) -> Iterator[tuple[str, Shape]]:
    if isinstance(shape, Box):
        x, y, z = shape.size
        yield "size_m are half sizes", Box(size=(2.0 * x, 2.0 * y, z))
        yield "size_m are twice its size", Box(size=(0.5 * x, 0.5 * y, z))
        if x != y:
            yield "sizes along x and y are swapped", Box(size=(y, x, z))
    elif isinstance(shape, Cylinder) and shape.axis == "z":
        yield "radius_m is its diameter", replace(shape, radius=0.5 * shape.radius)
        yield "radius_m is half of its radius", replace(shape, radius=2.0 * shape.radius)
    elif isinstance(shape, Prism):
        for said, factor in (("polygon_m is half as large as it is", 2.0), ("polygon_m is twice as large", 0.5)):
            yield said, replace(shape, polygon=tuple((factor * px, factor * py) for px, py in shape.polygon))


def _clocks(recording: Recording) -> Iterator[Convention]:
    """The clock of the hand's stream beside the object's, which brings the tip to the object as that moves."""
    lates = np.arange(-LATEST, LATEST + TIME_STEP, TIME_STEP)
    rows = [driven_samples(push) for push in recording.pushes]
    if not sum(map(len, rows)):
        return
    costs = [float(np.median(np.abs(gaps_at(recording, rows, float(late))))) for late in lates]
    late = float(lates[int(np.nanargmin(costs))])
    if abs(late) >= LEAST_LATE:
        yield Convention(
            says=f"the hand's times are {abs(1e3 * late):.0f} ms too {'early' if late > 0.0 else 'late'}",
            remedy=f"map: hand.time: offset_s: {late:.3g}, added to what is there",
            recording=each_push(recording, partial(_later, late=late)),
        )


def _later(push: Push, late: float) -> Push:
    assert push.hand is not None
    force = push.force
    return replace(
        push,
        hand=replace(push.hand, times=push.hand.times + late),
        force=None if force is None else replace(force, times=force.times + late),
    )


def _shifts(recording: Recording) -> Iterator[Convention]:
    """The hand's frame, shifted in W, or the object's in itself, so that the tip is at the object as that moves."""
    for change, what, key in (
        (_hand_shifted, "the hand's frame is off by", "world.origin for the hand's stream, or hand.offset"),
        (_recentred, "the middle of the object is, in the frame that was tracked, at", "object.offset: translation"),
    ):
        shift = _shift(recording, change)
        if shift is not None and float(np.linalg.norm(shift)) >= LEAST_SHIFT:
            said = f"({1e3 * shift[0]:.1f}, {1e3 * shift[1]:.1f}) mm"
            yield Convention(
                says=f"{what} {said}",
                remedy=f"map: {key}: [{shift[0]:.4f}, {shift[1]:.4f}, 0], added to what is there",
                recording=each_push(recording, partial(change, shift=shift)),
            )


def _hand_shifted(push: Push, shift: Array) -> Push:
    assert push.hand is not None
    positions = push.hand.positions.copy()
    positions[:, :2] += shift
    return replace(push, hand=replace(push.hand, positions=positions))


def _recentred(push: Push, shift: Array) -> Push:
    positions = push.object.positions.copy()
    positions[:, :2] += turned(push.object.planar[:, 2], np.tile(shift, (len(positions), 1)))
    return replace(push, object=replace(push.object, positions=positions))


def _exchanged(recording: Recording) -> Iterator[Convention]:
    """The hand for the object: what is pushed does not move before what pushes it."""
    pairs = [(push.object, push.hand) for push in recording.pushes if push.hand is not None]
    leads = [_sets_out(hand) - _sets_out(body) for body, hand in pairs]
    if len(pairs) == len(recording.pushes) and float(np.median(leads)) > 0.0:
        yield Convention(
            says="object and hand are exchanged",
            remedy="map: columns or topics of object and hand",
            recording=each_push(recording, _with_exchanged),
        )


def _sets_out(stream: PoseStream) -> float:
    """When a body has left its first place by a tenth of its way in the plane [s]."""
    ways = np.linalg.norm(stream.positions[:, :2] - stream.positions[0, :2], axis=1)
    return float(stream.times[int(np.argmax(ways > 0.1 * ways.max()))])


def _with_exchanged(push: Push) -> Push:
    assert push.hand is not None
    return replace(push, object=push.hand, hand=push.object)


def _shift(recording: Recording, change: Callable[..., Push]) -> Array | None:
    """The shift (2,) that brings the tip to the outline; None where no gap is seen."""
    rows = [driven_samples(push) for push in recording.pushes]
    if sum(map(len, rows)) < 3:
        return None

    def gaps(shift: Array) -> Array:
        return gaps_at(each_push(recording, partial(change, shift=shift)), rows)

    found = least_squares(gaps, np.zeros(2), loss="soft_l1", f_scale=2e-3, x_scale=0.01, max_nfev=12)
    return np.asarray(found.x)
