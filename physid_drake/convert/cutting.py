"""Cuts streams into pushes, and leaves out what is none: an object that was put back by hand, or lifted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from physid_drake.convert.columns import Array
from physid_drake.convert.mapping import Cut
from physid_drake.convert.streams import Streams
from physid_drake.errors import RecordingError
from physid_drake.recording import ForceStream, PoseStream
from physid_drake.recording.rests import rests_of
from physid_drake.recording.screening import find_repeats

_Stream = TypeVar("_Stream", PoseStream, ForceStream)

LEAST_WAY: Final = 1e-3
"""m between two rests: what goes less far, and turns less than ``LEAST_TURN``, was not pushed."""
LEAST_TURN: Final = np.deg2rad(1.0)
LIFTED: Final = 0.02
"""m above both rests: the object was not pushed, but lifted."""
REACH: Final = 0.05
"""m between the hand's tip and the largest circle about the object: nobody pushes from so far."""


@dataclass(frozen=True, kw_only=True)
class Piece:
    """One push: its streams, and when it begins by the log's clock [s]."""

    streams: Streams
    begin: float


def pieces_of(streams: Streams, cut: Cut, reach: float) -> tuple[list[Piece], list[str]]:
    """The pushes of one log, and a line for each piece that was left out.

    Args:
        streams: of the log.
        cut: how it is cut.
        reach: the object's largest radius and the tip's together [m].

    Raises:
        RecordingError: if the cut finds no push.
    """
    if cut.by == "times":
        spans = list(cut.times)
    elif cut.by == "gap":
        spans = _between_gaps(streams.object.times, cut.gap)
    elif cut.by == "rest":
        spans = _between_rests(streams.object, cut)
    else:
        spans = [(-np.inf, np.inf)]
    kept: list[Piece] = []
    left: dict[str, list[str]] = {}
    for begin, end in spans:
        problem = None
        piece = _within(streams, begin, end)
        if piece is None:
            problem = "holds fewer than two poses of the object or the hand"
        elif cut.by == "rest":
            problem = _no_push(piece, reach)
        if problem is None and piece is not None:
            kept.append(Piece(streams=piece, begin=float(piece.object.times[0])))
        else:
            left.setdefault(problem or "", []).append(_span(begin, end))
    return kept, [f"{spans[0]}{_more(spans)} {problem}; left out." for problem, spans in left.items()]


def _more(spans: list[str]) -> str:
    return f", and {len(spans) - 1} more like it," if len(spans) > 1 else ""


def _span(begin: float, end: float) -> str:
    return "the log" if not np.isfinite(begin) else f"{begin:.10g} to {end:.10g} s"


def _between_gaps(times: Array, gap: float) -> list[tuple[float, float]]:
    breaks = np.flatnonzero(np.diff(times) > gap)
    firsts, lasts = np.append(0, breaks + 1), np.append(breaks, len(times) - 1)
    return [(float(times[a]), float(times[b])) for a, b in zip(firsts, lasts, strict=True)]


def _between_rests(stream: PoseStream, cut: Cut) -> list[tuple[float, float]]:
    """From a while before the object moves until a while after it rests, of every motion between two rests."""
    stream = _seen_once(stream)
    rests = [(float(stream.times[r.start]), float(stream.times[r.stop - 1])) for r in rests_of(stream)]
    rests = [(begin, end) for begin, end in rests if end - begin >= cut.still]
    if len(rests) < 2:
        lasts, usual = float(np.ptp(stream.times)), float(np.median(np.diff(stream.times)))
        raise RecordingError(
            f"pushes: the object is not seen to rest twice for {cut.still:g} s in a log of {lasts:.3g} s with poses"
            f" {usual:.3g} s apart; correct the unit of time if it is another, make still_s smaller, or cut by times."
        )
    return [
        (max(before[0], before[1] - cut.lead), min(after[1], after[0] + cut.tail))
        for before, after in pairwise(rests)
    ]


def _seen_once(stream: PoseStream) -> PoseStream:
    """Without the repeats of a tracker that is slower than the log: in steps, nothing seems to rest or to move."""
    once = ~find_repeats(stream.positions, stream.quaternions)
    return replace(
        stream, times=stream.times[once], positions=stream.positions[once], quaternions=stream.quaternions[once]
    )


def _within(streams: Streams, begin: float, end: float) -> Streams | None:
    body = _part(streams.object, begin, end)
    hand = None if streams.hand is None else _part(streams.hand, begin, end)
    if body is None or (streams.hand is not None and hand is None):
        return None
    force = None if streams.force is None else _part(streams.force, begin, end)
    return Streams(object=body, hand=hand, force=force)


def _part(stream: _Stream, begin: float, end: float) -> _Stream | None:
    """What of a stream lies within a time; None where that is less than two samples."""
    inside = (stream.times >= begin) & (stream.times <= end)
    if inside.sum() < 2:
        return None
    kept: dict[str, Any] = {
        name: value[inside]
        for name in ("times", "positions", "quaternions", "forces")
        if isinstance(value := getattr(stream, name, None), np.ndarray)
    }
    return replace(stream, **kept)


def _no_push(piece: Streams, reach: float) -> str | None:
    """Why what happens between two rests is no push; None where it is one."""
    planar, heights = piece.object.planar, piece.object.positions[:, 2]
    way = np.abs(planar[-1] - planar[0])
    if np.hypot(way[0], way[1]) < LEAST_WAY and way[2] < LEAST_TURN:
        return "moves the object by less than 1 mm and 1 degree"
    if heights.max() > max(heights[0], heights[-1]) + LIFTED:
        return "lifts the object"
    if piece.hand is not None and _nearest(piece.object, piece.hand) > reach + REACH:
        return "moves the object while the hand is elsewhere"
    return None


def _nearest(body: PoseStream, hand: PoseStream) -> float:
    """The least distance between the hand's tip and the object's origin, seen from above [m]."""
    at = np.column_stack([np.interp(body.times, hand.times, hand.positions[:, k]) for k in (0, 1)])
    gaps: Array = np.linalg.norm(at - body.positions[:, :2], axis=1)
    return float(gaps.min())


def sizes_said(streams: Streams) -> str:
    """How far object and hand go along x, y and z, for a person who may have mistaken a unit."""
    said = ["the object " + _ways(streams.object)]
    if streams.hand is not None:
        said.append("the hand " + _ways(streams.hand))
    return " and ".join(said)


def _ways(stream: PoseStream) -> str:
    ways = np.ptp(stream.positions, axis=0)
    return "goes over " + ", ".join(f"{way:.3g}" for way in ways) + " m"


def rows_by_value(values: Array) -> Iterator[tuple[float, NDArray[np.intp]]]:
    """Runs of rows in which a column keeps its value; empty fields and negative ones are between pushes."""
    counted = np.where(np.isfinite(values), values, -1.0)
    edges = np.flatnonzero(np.diff(counted)) + 1
    for rows in np.split(np.arange(len(values)), edges):
        if len(rows) and counted[rows[0]] >= 0.0:
            yield float(counted[rows[0]]), rows
