"""What an identification or a diagnosis refuses of a recording: the first of it before any fit, or all of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial

from physid_drake.cell.solid import solid_of
from physid_drake.errors import RecordingError
from physid_drake.pushes.frame_checks import check_clocks, check_standing, checks_of, push_checks_of
from physid_drake.pushes.hand_stream import beside_object
from physid_drake.pushes.noise import noise_of
from physid_drake.recording import Recording, thinned


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
    seen = thinned(recording)
    # Where times are in no seconds, or what is up is not, nothing else can be asked.
    return _said(_clocks_of(recording)) or _said([partial(check_standing, seen)]) or _said(_others_of(seen))


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
