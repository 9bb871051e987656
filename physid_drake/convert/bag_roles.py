"""What the topics of a bag seem to be: which is the object, which the hand, and in which frames they are."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from physid_drake.convert.bag import RECEIVE, STAMP, Bag, Key, Track
from physid_drake.convert.bag_frames import joined
from physid_drake.convert.bag_values import holds_transforms
from physid_drake.convert.columns import Array
from physid_drake.convert.transforms import STATIC

MOVES: Final = 0.005
"""m: what never is so far from where it was at first does not move, give or take a tracker's noise."""

FIRST: Final = 10
"""Samples whose median is where something was at first."""

QUATERNION: Final = ("qx", "qy", "qz", "qw")


@dataclass(frozen=True, kw_only=True)
class BagRoles:
    """Which tracks of a bag seem to be the object, the hand and the force; None where there is none."""

    body: Key | None
    hand: Key | None
    force: Key | None


def roles_in_bag(bag: Bag, hand_words: Sequence[str], body_words: Sequence[str]) -> BagRoles:
    """The roles, by names, and by what moves and when: the hand before the object.

    What never moves has no role, unless nothing does.
    """
    placed = {key: track for key, track in bag.tracks.items() if "tx" not in track.columns.numbers}
    force = next((key for key in bag.tracks if key not in placed), None)
    begins = {key: onset for key, track in placed.items() if (onset := _onset(track)) is not None}
    candidates = list(begins or placed)
    body = _called(candidates, placed, body_words)
    hand = _called([key for key in candidates if key != body], placed, hand_words)
    if body is None:
        # What carries the hand, or is a part of it, moves with it.
        chain = set() if hand is None else {hand[1], *placed[hand].through} - {None}
        rest = [key for key in candidates if key != hand and key[1] not in chain]
        rest = [key for key in rest if not _holds(name_of(key).lower(), hand_words)] or rest
        turned = [key for key in rest if QUATERNION[0] in placed[key].columns.numbers] or rest
        # With a hand of no name, one alone is the object.
        body = max(turned, key=lambda key: begins.get(key, 0.0), default=None)
    rest = [key for key in candidates if key not in (hand, body)]
    if hand is None and body is not None:
        hand = min(rest, key=lambda key: begins.get(key, 0.0), default=None)
    return BagRoles(body=body, hand=hand, force=force)


def row_of(key: Key, track: Track) -> tuple[str, ...]:
    """A row of what a bag holds: name and frame, samples, rate [Hz], least and largest places or forces."""
    numbers = track.columns.numbers
    clock = numbers.get(STAMP, numbers[RECEIVE])
    values = np.column_stack([numbers[name] for name in ("x", "y", "z")])
    least, largest = (", ".join(f"{v:.4g}" for v in side(values, axis=0)) for side in (np.min, np.max))
    within = f" in {' / '.join(track.frames[:4])}" if track.frames else ""
    return f"{name_of(key)}{within}", str(len(clock)), _rate(clock), least, largest


def name_of(key: Key) -> str:
    """A topic, with which of its frames or poses."""
    return f"{key[0]} {key[1] or ''}".strip()


def in_a_map(bag: Bag, key: Key) -> Key:
    """How a map names a track: a frame of a tree by the topic of what moves there."""
    topic, child = key
    moving = topic.removesuffix(STATIC)
    kind, _ = bag.topics.get(moving, ("", 0))
    return (moving, child) if holds_transforms(kind) else key


def frame_lines(key: str, bag: Bag, where: Key, body: Key) -> list[str]:
    """What a map says of the frame of one of its streams, in comments above it."""
    track = bag.tracks[where]
    frames, those = track.frames, bag.tracks[body].frames
    lines = []
    if frames:
        way = f", through {_listed(track.through)}" if track.through else ""
        lines.append(f"# {key}: in frame {_listed(frames)}{way}")
    if len(frames) > 1:
        lines.append("# CHANGE: cut the bag where the frame changes; a map cannot say when it does.")
    elif frames and len(those) == 1 and frames != those and key != "force":
        if joined(bag.tree, frames[0], those[0]) is None:
            lines.append(
                f"# CHANGE: the object is in {_listed(those)}, and no fixed transform joins the two: give {key} a"
                " world of its own,"
            )
            lines.append(f"# world: {{pose: ...}}, the pose of {_listed(frames)} in W.")
        else:
            lines.append(f"# The bag's fixed transforms bring it into the object's, {_listed(those)}.")
    if track.unsteady:
        lines.append("# CHANGE: a message has more poses at times: is the same index always the same thing?")
    return lines


def unread_lines(bag: Bag, most: int) -> list[str]:
    """What of a bag could not be followed, in comments."""
    return [f"# not read: {_plain(name_of(key))} ({_plain(why)})" for key, why in list(bag.refused.items())[:most]]


def _called(candidates: Sequence[Key], tracks: Mapping[Key, Track], words: Sequence[str]) -> Key | None:
    """The candidate whose name holds one of some words; of several the one that most frames lead to, as to a tip."""
    named = [key for key in candidates if _holds(name_of(key).lower(), words)]
    return max(named, key=lambda key: len(tracks[key].through), default=None)


def _holds(name: str, words: Sequence[str]) -> bool:
    return bool(set(re.split(r"[^a-z]+", name)) & set(words)) or any(len(word) > 3 and word in name for word in words)


def _onset(track: Track) -> float | None:
    """When something first leaves where it was [s], by arrival; None if it never does."""
    numbers = track.columns.numbers
    places = np.column_stack([numbers[name] for name in ("x", "y", "z")])
    seen = np.isfinite(places).all(axis=1)
    places, times = places[seen], numbers[RECEIVE][seen]
    if len(places) < 2:
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        away = np.linalg.norm(places - np.median(places[:FIRST], axis=0), axis=1) > MOVES
    # Once is an outlier.
    steady = np.flatnonzero(away[1:] & away[:-1]) + 1
    return float(times[steady[0]]) if len(steady) else None


def _rate(times: Array) -> str:
    steps = np.diff(times[np.isfinite(times)])
    steps = steps[steps > 0.0]
    return f"{1.0 / float(np.median(steps)):.4g}" if len(steps) else ""


def _listed(names: Sequence[str]) -> str:
    said = ", ".join(f'"{_plain(name)}"' for name in names[:4])
    return said + (" and others" if len(names) > 4 else "")


def _plain(text: str) -> str:
    """Text that can stand in a comment, which ends with its line."""
    return "".join(c if c.isprintable() else "?" for c in text)
