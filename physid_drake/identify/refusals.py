"""All that an identification would refuse of a recording, instead of the first of it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from physid_drake.cell.solid import solid_of
from physid_drake.errors import RecordingError
from physid_drake.identify.frames import (
    check_clocks,
    check_force_direction,
    check_free_start,
    check_hand_near,
    check_hand_outside,
    check_mass,
    check_on_table,
    check_upright,
)
from physid_drake.identify.hand_stream import beside_object
from physid_drake.identify.problem import noise_of
from physid_drake.recording import Recording


def refusals(recording: Recording) -> tuple[str, ...]:
    """What an identification or a diagnosis would refuse, in words; whether they can simulate it is not tried."""
    height, sigma = solid_of(recording.object.shape).height, noise_of(recording).position
    checks: list[Callable[[], object]] = [
        partial(check, recording)
        for check in (check_mass, check_hand_near, check_hand_outside, check_force_direction)
    ]
    for push in recording.pushes:
        checks += [
            partial(check_upright, recording, push),
            partial(check_on_table, recording, push),
            partial(check_clocks, push),
            partial(check_free_start, push),
            partial(beside_object, recording, push, height, sigma),
        ]
    found = []
    for check in checks:
        try:
            check()
        except RecordingError as error:
            found.append(str(error))
    return tuple(found)
