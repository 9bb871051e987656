"""All that an identification would refuse of a recording, instead of the first of it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from physid_drake.cell.solid import solid_of
from physid_drake.errors import RecordingError
from physid_drake.identify.frames import checks_of, push_checks_of
from physid_drake.identify.hand_stream import beside_object
from physid_drake.identify.noise import noise_of
from physid_drake.recording import Recording


def refusals(recording: Recording) -> tuple[str, ...]:
    """What an identification or a diagnosis would refuse, in words; whether they can simulate it is not tried."""
    height, sigma = solid_of(recording.object.shape).height, noise_of(recording).position
    checks: list[Callable[[], object]] = [*checks_of(recording)]
    for push in recording.pushes:
        checks += [*push_checks_of(recording, push), partial(beside_object, recording, push, height, sigma)]
    found = []
    for check in checks:
        try:
            check()
        except RecordingError as error:
            found.append(str(error))
    return tuple(found)
