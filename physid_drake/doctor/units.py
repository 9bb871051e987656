"""Units of places that may be others than was said, in the frame of the log; and those of where W lies in it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.convert.conventions import places_in_world
from physid_drake.convert.map_reading import stated_in
from physid_drake.convert.source_frame import SourceFrame, source_frame
from physid_drake.convert.units import LENGTHS
from physid_drake.doctor.convention import Convention, each_push
from physid_drake.errors import RecordingError
from physid_drake.pushes.standing import place_in_map
from physid_drake.recording import Push, Recording

Array = NDArray[np.float64]

LEAST_ORIGIN: Final = 5e-3
"""m from the log's zero to W's: nobody gives one that is less."""
LARGEST_ORIGIN: Final = 5.0
"""m: a tracker's or a robot's zero is nearer to the table that they see."""
UNITS: Final = {
    1e-3: "1000 times too large (mm for m)", 1e-2: "100 times too large (cm for m)",
    0.1: "10 times too large (mm for cm)", 0.0254: "39.4 times too large (inch for m)",
    10.0: "10 times too small (cm for mm)", 100.0: "100 times too small (m for cm)",
    1e3: "1000 times too small (m for mm)",
}  # fmt: skip
"""Factors that put places right whose unit is another one than was said."""


def units_of(recording: Recording) -> Iterator[Convention]:
    """Places of one stream, or of both, in another unit than was said: about the log's zero, or W's."""
    stated = stated_in(recording.conversion)
    body, hand = (None, None) if stated is None else (stated.object, stated.hand)
    frames = source_frame(stated, body), source_frame(stated, hand)
    streams: Sequence[tuple[str, tuple[str, ...], bool, bool]] = (
        ("the hand's places", ("hand",), False, True), ("the object's places", ("object",), True, False),
        ("the places of object and hand", ("object", "hand"), True, True),
    )  # fmt: skip
    for said, keys, of_object, of_hand in streams:
        poses = [pose for pose, some in ((body, of_object), (hand, of_hand)) if some and pose is not None]
        far = max(_origin(frame) for frame, some in zip(frames, (of_object, of_hand), strict=True) if some)
        for factor, how, unit in _other_units({pose.position.unit for pose in poses}):
            factors = factor if of_object else 1.0, factor if of_hand else 1.0
            places = place_in_map(stated, *(f"{key}.position" for key in keys))
            yield from _resized(
                recording, frames, factors, f"{said} are {how}", f"{places}: unit{f': {unit}' if unit else ''}"
            )
            if far > 0.0 and factor * far > LEAST_ORIGIN:
                yield from _resized(
                    recording, (SourceFrame(), SourceFrame()), factors, f"{said} are {how}, and so is W's origin",
                    f"{place_in_map(stated, *(f'{key}.position' for key in keys), 'world')}: unit of each",
                )  # fmt: skip


def _origin(frame: SourceFrame) -> float:
    """How far W's zero is from the log's [m]."""
    return float(np.linalg.norm(frame.world.origin))


def _other_units(said: set[str | None]) -> Iterator[tuple[float, str, str]]:
    """Factors that put places right, in words, and the unit by name: of the one that the map says, or of any."""
    factors = dict(UNITS)
    base = next(iter(said)) if len(said) == 1 else None
    if base is not None:
        for unit, size in LENGTHS.items():
            factor = size / LENGTHS[base]
            if factor != 1.0 and unit != "in":
                factors = {one: how for one, how in factors.items() if not math.isclose(one, factor)}
                way, times = ("small", factor) if factor > 1.0 else ("large", 1.0 / factor)
                digits = f"{times:.3g}" if times < 1000.0 else f"{times:.0f}"
                yield factor, f"{digits} times too {way} ({unit} for {base})", unit
    for factor, how in factors.items():
        yield factor, how, ""


def _resized(
    recording: Recording,
    frames: tuple[SourceFrame, SourceFrame],
    factors: tuple[float, float],
    says: str,
    remedy: str,
) -> Iterator[Convention]:
    """Places of object and hand, so many times as large in the log; none if that is further than anything is."""

    def change(push: Push) -> Push:
        assert push.hand is not None
        body, hand = (
            frame.with_places(stream, factor * frame.places(stream)) if factor != 1.0 else stream
            for frame, stream, factor in zip(frames, (push.object, push.hand), factors, strict=True)
        )
        return replace(push, object=body, hand=hand)

    try:
        yield Convention(says=says, remedy=remedy, recording=each_push(recording, change))
    except RecordingError:
        return


def origins_of(recording: Recording) -> Iterator[Convention]:
    """An origin in another unit than was said: of the object's stream, the hand's or both."""
    stated = stated_in(recording.conversion)
    if stated is None or stated.hand is None:
        return
    worlds = [stated.world_of(pose) for pose in (stated.object, stated.hand)]
    shared = worlds[0] is worlds[1]
    streams = (
        [("world", "W's origin", True, True)]
        if shared
        else [("object.world", "the origin of the object's frame", True, False),
              ("hand.world", "the origin of the hand's frame", False, True)]
    )  # fmt: skip
    for key, said, of_object, of_hand in streams:
        frame = source_frame(stated, stated.object if of_object else stated.hand)
        for factor, how in UNITS.items():
            if _origin(frame) > 0.0 and (not shared or _origin(frame) > LARGEST_ORIGIN > factor * _origin(frame)):
                move = (factor - 1.0) * places_in_world(np.zeros((1, 3)), frame.world)[0]
                yield from _moved(recording, move, of_object, of_hand, f"{said} is {how}", place_in_map(stated, key))


def _moved(
    recording: Recording, move: Array, of_object: bool, of_hand: bool, says: str, place: str
) -> Iterator[Convention]:
    def change(push: Push) -> Push:
        assert push.hand is not None
        body, hand = (
            replace(stream, positions=stream.positions + move) if some else stream
            for stream, some in ((push.object, of_object), (push.hand, of_hand))
        )
        return replace(push, object=body, hand=hand)

    try:
        yield Convention(says=says, remedy=f"{place}: unit", recording=each_push(recording, change))
    except RecordingError:
        return
