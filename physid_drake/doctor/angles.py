"""Angles of the object that may be in another unit than was said: in rad or in degrees."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from physid_drake.convert.map_reading import stated_in
from physid_drake.convert.mapping import Turn
from physid_drake.convert.source_frame import SourceFrame, source_frame
from physid_drake.doctor.convention import Convention, each_push
from physid_drake.doctor.gaps import gap_of
from physid_drake.pushes.standing import place_in_map
from physid_drake.recording import Push, Recording
from physid_drake.recording.turns import unwrapped

Array = NDArray[np.float64]

ANGLES: Final = {"yaw": "yaw is", "euler": "Euler angles are", "rotation_vector": "rotation vectors are"}
"""Rotations that are written as angles."""
FACTORS: Final = {"deg": math.radians(1.0), "rad": math.degrees(1.0)}
"""What puts angles right that are in that unit, and were taken for the other."""
MOST_TURNS: Final = 29
"""Of a heading within half a turn, in degrees that are called rad."""


def angles_of(recording: Recording) -> Iterator[Convention]:
    """The object's angles in the other unit, in the frame of the log."""
    stated = stated_in(recording.conversion)
    turn = Turn(kind="yaw") if stated is None else stated.object.turn
    rotations = {push.object.rotation for push in recording.pushes}
    if turn is None or turn.kind not in ANGLES or not (rotations - {"none"} if stated else "yaw" in rotations):
        return
    frame = source_frame(stated, None if stated is None else stated.object)
    for unit, factor in FACTORS.items():
        if unit != turn.unit and (unit == "rad" or turn.kind != "yaw" or _spins(recording)):
            yield Convention(
                says=f"the object's {ANGLES[turn.kind]} in {'degrees' if unit == 'deg' else unit}",
                remedy=f"{place_in_map(stated, 'object.rotation')}: unit: {unit}"
                + ("; or object_yaw_rad in rad" if stated is None else ""),
                recording=_scaled(recording, turn, frame, factor),
            )


def _spins(recording: Recording) -> bool:
    """Whether the object turns by more than a full turn in some push: in degrees that are called rad it soon does."""
    return max(float(np.ptp(push.object.planar[:, 2])) for push in recording.pushes) > 2.0 * math.pi


def _scaled(recording: Recording, turn: Turn, frame: SourceFrame, factor: float) -> Recording:
    change = partial(_with_angles, turn=turn, frame=frame, factor=factor)
    if factor > 1.0 or turn.kind != "yaw":
        return each_push(recording, change)
    # Whole turns are not in the recording, but in degrees they count: the tip is at the object that it pushes.
    pushes = []
    for push in recording.pushes:
        turned = [change(push, turns=count) for count in sorted(range(-MOST_TURNS, MOST_TURNS + 1), key=abs)]
        gaps = [gap_of(replace(recording, pushes=(one,))) for one in turned]
        pushes.append(turned[int(np.nanargmin(gaps))] if np.isfinite(gaps).any() else turned[0])
    return replace(recording, pushes=tuple(pushes))


def _with_angles(push: Push, turn: Turn, frame: SourceFrame, factor: float, turns: int = 0) -> Push:
    """With so many times the angles that were written, and whole turns more of a yaw."""
    stream = push.object
    if stream.rotation == "none":
        return push
    written, order = frame.rotations(stream), cast(Any, turn.order)
    if turn.kind == "euler":
        angles = np.column_stack([unwrapped(stream.times, one) for one in written.as_euler(order).T])
        rotations = Rotation.from_euler(order, factor * angles)
    elif turn.kind == "yaw":
        up = frame.world.axes[2]
        yaws = unwrapped(stream.times, written.as_rotvec() @ up) + 2.0 * math.pi * turns
        rotations = Rotation.from_rotvec(factor * np.outer(yaws, up))
    else:
        rotations = Rotation.from_rotvec(factor * written.as_rotvec())
    return replace(push, object=frame.with_rotations(stream, rotations))
