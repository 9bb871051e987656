"""Long streams made short: what a fit of a second of motion needs of a log of minutes, or of a fast one."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
import numpy.typing as npt

from physid_drake.recording.rests import rests_of
from physid_drake.recording.values import Array, ForceStream, PoseStream, Push, Recording

MOST_SAMPLES: Final = 2000
"""Of poses in one push. Covariances and candidate knots of a hand's path grow with its square."""

REST: Final = 1.0
"""Of the rest before and after the motion, in s: that much stays of it where a stream is too long."""


def thinned(recording: Recording, most: int = MOST_SAMPLES) -> Recording:
    """The recording with at most ``most`` poses of object and hand in a push; shorter pushes are left as they are.

    Of a longer push the rests at its ends are cut to a second, and then every k-th pose is kept.
    """
    return replace(recording, pushes=tuple(_thinned(push, most) for push in recording.pushes))


def _thinned(push: Push, most: int) -> Push:
    if max(len(stream) for stream in (push.object, push.hand) if stream is not None) <= most:
        return push
    span = _motion(push)
    return replace(
        push,
        object=push.object if push.endpoint_only else _poses(push.object, span, most),
        hand=None if push.hand is None else _poses(push.hand, span, most),
        force=None if push.force is None else _forces(push.force, span),
    )


def _motion(push: Push) -> tuple[float, float]:
    """From a second before the object first moves to a second after it has come to rest [s].

    The hand's motion is what counts where only the object's ends are known.
    """
    stream = push.hand if push.endpoint_only and push.hand is not None else push.object
    times, rests = stream.times, rests_of(stream)
    begin, end = push.start_time, push.end_time
    if not rests or rests[0].stop - rests[0].start == len(times):
        return begin, end
    if rests[0].start == 0:
        begin = float(times[rests[0].stop - 1]) - REST
    if rests[-1].stop == len(times):
        end = float(times[rests[-1].start]) + REST
    return begin, end


def _poses(stream: PoseStream, span: tuple[float, float], most: int) -> PoseStream:
    rows = _rows(stream.times, span, most)
    return replace(
        stream, times=stream.times[rows], positions=stream.positions[rows], quaternions=stream.quaternions[rows]
    )


def _forces(stream: ForceStream, span: tuple[float, float]) -> ForceStream:
    """All samples of the span: they are compared as means, which more of them make surer."""
    rows = _rows(stream.times, span, len(stream))
    return ForceStream(times=stream.times[rows], forces=stream.forces[rows])


def _rows(times: Array, span: tuple[float, float], most: int) -> npt.NDArray[np.intp]:
    """Indices of the samples to keep of a stream with times (n,) [s]."""
    # One sample on either side, where there is one: a stream of few samples moves between them.
    first = max(0, int(np.searchsorted(times, span[0], side="right")) - 1)
    last = min(len(times), int(np.searchsorted(times, span[1])) + 1)
    if last - first < 2:  # a hand that was recorded at other times only
        first, last = 0, len(times)
    return np.arange(first, last, -(-(last - first) // most))
