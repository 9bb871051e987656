"""One long log of arrays as pushes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from foreign.common import assert_rests_agree, take

from physid_drake.api import pushes_of_take, read_recording
from physid_drake.errors import RecordingError
from physid_drake.recording import ForceStream, Recording

SEALED = Path(__file__).parents[2] / "recordings" / "sealed_01"


@pytest.fixture(scope="module")
def sealed() -> Recording:
    return read_recording(SEALED)


def test_a_take_is_cut_at_its_rests_and_what_is_carried_is_said(sealed: Recording) -> None:
    times, body, tip = take(sealed)
    force = ForceStream(times=times, forces=np.tile([1.0, 0.0, 0.0], (len(times), 1)))
    with pytest.warns(UserWarning, match=r"and 9 more like it, lifts the object; left out\."):
        pushes = pushes_of_take(sealed.object, body, tip, force, hand=sealed.hand)
    assert [push.name for push in pushes] == [push.name for push in sealed.pushes]
    for push, other in zip(sealed.pushes, pushes, strict=True):
        assert_rests_agree(push.object, other.object)
        assert other.object.times[0] == 0.0 and other.hand is not None and other.force is not None
        assert len(other.force.times) == len(other.object)


def test_a_take_without_pushes_is_refused(sealed: Recording) -> None:
    _, body, tip = take(sealed)
    away = replace(tip, positions=tip.positions + np.array([3.0, 0.0, 0.0]))
    with (
        pytest.warns(UserWarning),
        pytest.raises(RecordingError, match="no push was found between the object's rests"),
    ):
        pushes_of_take(sealed.object, body, away, hand=sealed.hand)
    with pytest.raises(RecordingError, match="is not seen to rest twice for 60 s"):
        pushes_of_take(sealed.object, body, tip, hand=sealed.hand, still=60.0)
