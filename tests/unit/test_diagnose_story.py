"""The order of a diagnosis: what is looked at, and with which tolerances."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose import story
from physid_drake.effects import Surroundings, applicable, tolerated

AROUND = Surroundings(
    mass=0.2, friction=0.3, size=np.array([0.12, 0.05]), height=0.03, region=np.array([[-0.5, -0.5], [0.5, 0.5]]),
    top_speed=0.5, pushes=10, has_hand=True, rolls=False,
)  # fmt: skip
NAMED = [None, ["table_tilt"], ["size_error", "viscous_drag"]]


@pytest.mark.parametrize("names", NAMED)
def test_pushes_may_share_the_same_whatever_is_looked_for(names, monkeypatch):
    asked = applicable(AROUND, names)
    monkeypatch.setattr(
        story, "_looks", lambda case, first, kinds, *_: ((), [SimpleNamespace(kind=k) for k in kinds])
    )
    monkeypatch.setattr(story, "tolerances", lambda case, found: [s.kind for s in found])
    monkeypatch.setattr(
        story, "Fitter", lambda case, guard, shared: SimpleNamespace(guard=lambda first: first, shared=shared)
    )
    monkeypatch.setattr(story, "Looked", SimpleNamespace(at=lambda model, found, rng: [s.kind for s in found]))
    monkeypatch.setattr(story, "Growth", lambda **_: SimpleNamespace(grow=lambda looked: looked))
    monkeypatch.setattr(story, "_better_foil", lambda growth, grown: None)
    search = story._Search(kinds=asked, alpha=0.01, rng=np.random.default_rng(0), tick=lambda *_: None)
    answer = search.answer(None, SimpleNamespace(around=AROUND), None, None)
    assert answer.grown == list(asked)
    assert set(tolerated(AROUND)) <= set(answer.fitter.shared)


def test_lengths_times_and_pressures_have_tolerances():
    assert {kind.name for kind in tolerated(AROUND)} == {
        "actuator_lag", "com_offset", "hand_offset", "rotational_inertia", "size_error", "tracker_latency",
        "uneven_support",
    }  # fmt: skip
