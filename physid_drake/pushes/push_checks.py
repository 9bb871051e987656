"""What an identification or a diagnosis refuses of a recording: the first of it before any fit, or all of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial

import numpy as np

from physid_drake.cell.solid import solid_of
from physid_drake.errors import RecordingError
from physid_drake.pushes.frame_checks import (
    check_clocks,
    check_moved_by_something,
    check_standing,
    checks_of,
    push_checks_of,
)
from physid_drake.pushes.hand_stream import beside_object
from physid_drake.pushes.noise import noise_of
from physid_drake.pushes.tracker_noise import TrackerNoise, tracker_noise
from physid_drake.recording import Push, Recording, rest_segments, thinned

LEAST_MOTION = 6.0  # standard deviations: an object that moves less in every push does not move


def refuse(recording: Recording) -> None:
    """Raise the first refusal, before anything that takes long: no path is fitted, nothing is simulated.

    Raises:
        RecordingError: if there is one.
    """
    for check in _clocks_of(recording):
        check()
    seen = thinned(recording)
    check_standing(seen)
    for check in _others_of(seen):
        check()


def refusals(recording: Recording) -> tuple[str, ...]:
    """All that would be refused, in words; whether it can be simulated is not tried."""
    # Where times are in no seconds, or what is up is not, nothing else can be asked.
    if clocks := _said(_clocks_of(recording)):
        return clocks
    shorter = thinned(recording)
    if misread := _said([partial(check_standing, shorter)]):
        return misread
    return _said(_others_of(shorter)) or _said(iter([lambda: check_motion(shorter, tracker_noise(shorter)[0])]))


def check_motion(recording: Recording, noise: TrackerNoise) -> None:
    """Refuse a recording whose object stays where it is, or is moved by nothing.

    Raises:
        RecordingError: if that is so in all pushes.
    """
    if max(_way(push, noise) for push in recording.pushes) < LEAST_MOTION:
        raise RecordingError(
            f"recording '{recording.name}': the object never moves by more than the tracker's noise"
            f" ({1e3 * noise.position:.2g} mm); there is nothing to diagnose."
        )
    check_moved_by_something(recording, noise.position)


def _way(push: Push, noise: TrackerNoise) -> float:
    """How far an object comes from where it rests at first, at most, in standard deviations of the tracker."""
    planar, rests = push.object.planar, rest_segments(push)
    start = planar[rests[0]].mean(axis=0) if rests and rests[0].start == 0 else planar[0]
    return float((np.abs(planar - start) / noise.sigmas).max())


def _said(checks: Iterable[Callable[[], object]]) -> tuple[str, ...]:
    found = []
    for check in checks:
        try:
            check()
        except RecordingError as error:
            found.append(str(error))
    return tuple(found)


def _clocks_of(recording: Recording) -> Iterator[Callable[[], object]]:
    return (partial(check_clocks, push) for push in recording.pushes)


def _others_of(recording: Recording) -> Iterator[Callable[[], object]]:
    """Of what is left of long streams, as it is identified from."""
    yield from checks_of(recording)
    for push in recording.pushes:
        yield from push_checks_of(recording, push)
    if recording.hand is not None:
        height, sigma = solid_of(recording.object.shape).height, noise_of(recording).position
        for push in recording.pushes:
            yield partial(beside_object, recording, push, height, sigma)
