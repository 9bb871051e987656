"""One long log as pushes, each from time zero."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Final

import numpy as np

from physid_drake.convert.cutting import Piece, pieces_of, sizes_said
from physid_drake.convert.mapping import Cut
from physid_drake.convert.streams import Streams
from physid_drake.errors import RecordingError
from physid_drake.recording import Box, Cylinder, ForceStream, Hand, ObjectModel, PoseStream, Prism, Push

LARGEST_REACH: Final = 1.0
"""m: of a mesh, whose file is not read here."""


def pushes_of_take(
    model: ObjectModel,
    body: PoseStream,
    tip: PoseStream | None = None,
    force: ForceStream | None = None,
    *,
    hand: Hand | None = None,
    still: float = 0.5,
) -> tuple[Push, ...]:
    """The pushes of one long log, which is cut where the object rests.

    What the object does between two rests without being pushed is left out: it is lifted, it moves while the hand is
    elsewhere, or it does not move. A ``UserWarning`` says so.

    Args:
        model: the object.
        body: its poses in W, by the log's clock.
        tip: the hand's, by the same clock; None where nothing pushes.
        force: of the hand on the object in W, by the same clock.
        hand: the hand, of which the radius counts here.
        still: the shortest rest between two pushes [s].

    Returns:
        The pushes in their order, named as ``write_recording`` writes them.

    Raises:
        RecordingError: if the object does not rest twice, or is never pushed.
    """
    streams = Streams(object=body, hand=tip, force=force)
    pieces = warned_pieces(streams, Cut(by="rest", still=still), reach_of(model, hand), "")
    if not pieces:
        raise RecordingError("no push was found between the object's rests; see what was left out.")
    return tuple(push_of(piece, k + 1, f"from {piece.begin:.10g} s") for k, piece in enumerate(pieces))


def warned_pieces(streams: Streams, cut: Cut, reach: float, label: str) -> list[Piece]:
    """The pieces of a log; what is left out is a ``UserWarning``, which begins with the label."""
    pieces, left = pieces_of(streams, cut, reach)
    if not pieces and cut.by == "rest":
        left.append(f"along x, y, z of W {sizes_said(streams)}; are units and axes right?")
    for line in left:
        warnings.warn(f"{label}{line}", UserWarning, stacklevel=3)
    return pieces


def push_of(piece: Piece, number: int, note: str, tare: float = 0.0) -> Push:
    """A push from time zero.

    Args:
        piece: of a log.
        number: in the recording, from 1.
        note: where it comes from.
        tare: so long [s] nothing is touched, and the force's mean is taken away.

    Raises:
        RecordingError: if the push is shorter than that.
    """
    hand, force = piece.streams.hand, piece.streams.force
    force = None if force is None else replace(force, times=force.times - piece.begin)
    if force is not None and tare > 0.0:
        force = _tared(force, tare, note)
    return Push(
        name=f"pushes/{number:03d}.csv",
        object=replace(piece.streams.object, times=piece.streams.object.times - piece.begin),
        hand=None if hand is None else replace(hand, times=hand.times - piece.begin),
        force=force,
        note=note,
    )


def _tared(force: ForceStream, seconds: float, note: str) -> ForceStream:
    untouched = force.times < force.times[0] + seconds
    if untouched.all():
        raise RecordingError(f"{note}: force: tare_s, {seconds:g} s, is longer than the push.")
    return replace(force, forces=force.forces - force.forces[untouched].mean(axis=0))


def reach_of(model: ObjectModel, hand: Hand | None) -> float:
    """The largest radius [m] of the object about its origin, and the tip's."""
    return _radius(model) + (0.0 if hand is None else hand.radius)


def _radius(model: ObjectModel) -> float:
    shape = model.shape
    if isinstance(shape, Box):
        return 0.5 * float(np.hypot(*shape.size[:2]))
    if isinstance(shape, Cylinder):
        return shape.radius if shape.axis == "z" else float(np.hypot(shape.radius, 0.5 * shape.length))
    if isinstance(shape, Prism):
        return float(np.linalg.norm(shape.polygon, axis=1).max())
    return LARGEST_REACH
