"""What a recording may have got wrong: the recording that it would be, and what to write instead."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from physid_drake.recording import Push, Recording


@dataclass(frozen=True, kw_only=True)
class Convention:
    """One thing that may be wrong.

    Attributes:
        says: what is so, if it is wrong: the end of a sentence that begins with "if".
        remedy: what to write, and where.
        recording: with it put right.
    """

    says: str
    remedy: str
    recording: Recording


def each_push(recording: Recording, change: Callable[[Push], Push]) -> Recording:
    """The recording with every push changed alike."""
    return replace(recording, pushes=tuple(map(change, recording.pushes)))
