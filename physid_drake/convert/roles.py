"""Which of the bodies of a log is the object, which the hand, and which sensor holds the force.

Names tell first. Where they do not, the motion does: a hand moves before the object, and while it rests.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.convert.bag_roles import FIRST
from physid_drake.convert.bag_roles import MOVES as LEAVES
from physid_drake.convert.bodies import Body, filled
from physid_drake.convert.columns import Array, Columns
from physid_drake.convert.names import words_of
from physid_drake.convert.units import LENGTHS, likely_length

OBJECT_WORDS: Final = ("object", "obj", "mug", "box", "block", "cube", "slider", "target", "item", "payload")
HAND_WORDS: Final = (
    "hand", "action", "tip", "finger", "tool", "tcp", "eef", "ee", "gripper", "pusher", "robot", "probe", "stylus",
)  # fmt: skip

FIXED: Final = 0.05
"""Of the object's way: what keeps its distance to it as well as this is fixed to it."""

WINDOWS: Final = 400
"""Pieces of a log in each of which a body moves or rests."""

MOVES: Final = 0.1
"""Of the way in the liveliest pieces: what goes less far in a piece rests in it."""

LIVELY: Final = 0.98
"""Of all pieces are no livelier."""

ONE_UNIT: Final = 30.0
"""Times as fast: bodies whose speeds differ by more are not in the same unit of length."""

LEAST_ALONE: Final = 3
"""Pieces in which a body must move alone to be told from the other."""

CLEARLY: Final = 2.0
"""So many times as often must one body move first, or alone, as the other, to be the hand."""

DOUBT: Final = "   # CHANGE? neither names nor motion tell object and hand apart"


@dataclass(frozen=True, kw_only=True)
class Roles:
    """Bodies by what they are, None where there is none."""

    object: Body | None
    hand: Body | None
    force: Body | None


def roles_of(
    bodies: Sequence[Body],
    columns: Callable[[Body], Columns] | None,
    times: Callable[[Body], Array | None] = lambda _: None,
) -> Roles:
    """The roles of bodies, each of which has one.

    Args:
        bodies: of a log.
        columns: where those of a body are; None if only names can be compared.
        times: in s, of the rows of a body's columns, as far as they are known.
    """
    there = [body for body in bodies if body.position]
    if columns is not None:
        # What never moves has no role, unless nothing does.
        there = [body for body in there if _leaves(body, columns(body))] or there
    placed = [body for body in there if not body.wanted]
    hand = _called(HAND_WORDS, placed) or _called(HAND_WORDS, [body for body in there if body.wanted])
    body = _called(OBJECT_WORDS, [one for one in placed if one is not hand])
    rest = [one for one in placed if one is not hand and one is not body]
    named = hand is not None or body is not None
    if body is None:
        body = _likely_object(rest, hand, columns)
        rest = [one for one in rest if one is not body]
    if hand is None and body is not None:
        # What keeps its distance to the object is one of its markers.
        hand = next((one for one in rest if columns is None or _is_apart(one, body, columns)), None)
    if not named and body is not None and hand is not None and columns is not None:
        body, hand = _by_motion(body, hand, columns, times)
    if hand is not None and hand.wanted:
        hand.doubt = "   # CHANGE? set points, which were not measured: then 'stream: commanded' above"
    forces = sorted((one for one in bodies if one.force), key=lambda one: one.wanted)
    return Roles(object=body, hand=hand, force=forces[0] if forces else None)


def _called(words: Sequence[str], bodies: Sequence[Body]) -> Body | None:
    """The first body with one of the words in its name."""
    for body in bodies:
        own = {word.rstrip("0123456789") for word in words_of(body.name)}
        if own & set(words) or any(len(word) > 3 and word in body.name.lower() for word in words):
            return body
    return None


def _likely_object(
    bodies: Sequence[Body], hand: Body | None, columns: Callable[[Body], Columns] | None
) -> Body | None:
    """Of bodies without such a name one that moves, apart from the hand, and has a rotation, as far as one does."""
    if columns is None:
        return next((one for one in bodies if one.rotation), bodies[0] if bodies else None)

    def worth(one: Body) -> tuple[bool, bool, bool, int]:
        apart = hand is None or _is_apart(one, hand, columns)
        return _way(one, columns(one)) > 0.0, apart, bool(one.rotation), len(filled(one.position, columns(one)))

    return max(bodies, key=worth, default=None)


def _leaves(body: Body, columns: Columns) -> bool:
    """Whether a body is ever farther from where it was at first than a tracker's noise brings it."""
    values = filled(body.position, columns)
    stated = body.unit or ""
    unit = stated if stated in LENGTHS else columns.length or likely_length(values)
    away = np.linalg.norm(values - np.median(values[:FIRST], axis=0), axis=1) * LENGTHS[unit] > LEAVES
    # Once is an outlier.
    return bool((away[1:] & away[:-1]).any())


def _way(body: Body, columns: Columns) -> float:
    """How far a body goes, along the axis along which it goes farthest, but for its ends."""
    values = filled(body.position, columns)
    if not len(values):
        return 0.0
    return float(np.ptp(np.quantile(values, (0.05, 0.95), axis=0), axis=0).max())


def _is_apart(one: Body, other: Body, columns: Callable[[Body], Columns]) -> bool:
    """Whether a body's distance to another one changes, or cannot be told."""
    here, there = (_places(which, columns(which)) for which in (one, other))
    if here.shape != there.shape or columns(one) is not columns(other):
        return True
    distances = np.linalg.norm(here - there, axis=1)
    distances = distances[np.isfinite(distances)]
    return len(distances) < 2 or float(np.std(distances)) > FIXED * float(np.nanmax(np.nanstd(there, axis=0)))


def _places(body: Body, columns: Columns) -> Array:
    """Places (n, 3) of a body, NaN where it is not seen."""
    return np.column_stack([columns.numbers[name] for name in body.position[:3]])


def _by_motion(
    body: Body, hand: Body, columns: Callable[[Body], Columns], times: Callable[[Body], Array | None]
) -> tuple[Body, Body]:
    """Object and hand, the other way round if the one that is taken for the object moves first, or alone."""
    places = [_places(one, columns(one)) for one in (body, hand)]
    clocks = [times(one) for one in (body, hand)]
    known = [clock for clock in clocks if clock is not None and np.isfinite(clock).any()]
    if len(known) == len(places):
        begin, end = max(float(np.nanmin(clock)) for clock in known), min(float(np.nanmax(clock)) for clock in known)
    elif len(places[0]) == len(places[1]):
        known, begin, end = [np.arange(float(len(one))) for one in places], 0.0, float(len(places[0]))
    else:
        return body, hand
    count = min(WINDOWS, max(1, min(map(len, places)) // 4))
    edges = np.linspace(begin, end, count + 1)
    moves = _moves([_steps(one, clock, edges) for one, clock in zip(places, known, strict=True)])
    alone = [float((moves[k] & ~moves[1 - k]).sum()) for k in (0, 1)]
    for votes, least in ((_begun(moves), 0.0), (alone, LEAST_ALONE)):
        object_votes, hand_votes = votes
        if object_votes > max(CLEARLY * hand_votes, least):
            return hand, body
        if hand_votes > max(CLEARLY * object_votes, least):
            return body, hand
    hand.doubt = hand.doubt or DOUBT
    return body, hand


def _begun(moves: Sequence[NDArray[np.bool_]]) -> tuple[int, int]:
    """Of the pieces that follow one another and in which one of two bodies moves, how often each was the first."""
    padded = np.concatenate([[False], moves[0] | moves[1]])
    onsets = np.flatnonzero(padded[1:] & ~padded[:-1])
    first, second = moves[0][onsets], moves[1][onsets]
    return int((first & ~second).sum()), int((second & ~first).sum())


def _steps(places: Array, times: Array, edges: Array) -> Array:
    """How far a body goes from each of the pieces of a log to the next."""
    seen = np.isfinite(places).all(axis=1) & np.isfinite(times) & (times >= edges[0]) & (times <= edges[-1])
    piece = np.clip(np.searchsorted(edges, times[seen], side="right") - 1, 0, len(edges) - 2)
    counts = np.bincount(piece, minlength=len(edges) - 1)
    sums = np.column_stack([np.bincount(piece, c, minlength=len(edges) - 1) for c in places[seen].T])
    steps = np.linalg.norm(np.diff(sums / np.maximum(counts, 1)[:, None], axis=0), axis=1)
    return np.where((counts[1:] == 0) | (counts[:-1] == 0), 0.0, steps)


def _moves(steps: Sequence[Array]) -> list[NDArray[np.bool_]]:
    """Where each of two bodies moves: as fast as the slower one does at times, since both do when they touch."""
    fast = [float(np.quantile(one, LIVELY, method="higher")) if len(one) else 0.0 for one in steps]
    if min(fast) * ONE_UNIT > max(fast):
        fast = [min(fast)] * len(fast)
    return [one > MOVES * least for one, least in zip(steps, fast, strict=True)]
