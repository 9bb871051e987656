"""The order of a diagnosis: what is looked at, and with which tolerances."""

import dataclasses as dc
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
    answer = search.answer(None, SimpleNamespace(around=AROUND), None)
    assert answer.grown == list(asked)
    assert set(tolerated(AROUND)) <= set(answer.fitter.shared)


def test_lengths_times_and_pressures_have_tolerances():
    assert {kind.name for kind in tolerated(AROUND)} == {
        "actuator_lag", "com_offset", "hand_offset", "rotational_inertia", "size_error", "tracker_latency",
        "uneven_support",
    }  # fmt: skip


@pytest.mark.parametrize(("quiet_finds", "share"), [({"tether"}, 0.9), ({"tether", "magnet"}, 0.2), (set(), 0.2)])
def test_an_unknown_noise_is_what_the_model_at_the_end_leaves(monkeypatch, quiet_finds, share):
    """A tether and a magnet make the noise a fifth; if the tether alone is left, it does not."""
    left = {frozenset(): 1.0, frozenset({"tether"}): 0.9, frozenset({"tether", "magnet"}): 0.2}

    def grown(names):
        model = SimpleNamespace(state=frozenset(names))
        steps = tuple((SimpleNamespace(name=name),) for name in names)
        last = SimpleNamespace(fitted=model)
        base = SimpleNamespace(fitted=SimpleNamespace(state=frozenset()), p_value=1e-9, screening=None)
        return SimpleNamespace(steps=steps, last=last, base=base)

    class Search(story._Search):
        def answer(self, case, rough, first):
            found = {"tether", "magnet"} if case == left[frozenset()] else quiet_finds
            return story._Answer(case=case, fitter=None, grown=grown(found))

    fitter = SimpleNamespace(linearise=lambda state: state, fit=lambda state, renew: state)
    monkeypatch.setattr(story, "Fitter", lambda case: fitter)
    monkeypatch.setattr(story, "as_loud_as_left", lambda case, rough, model: (left[model], left[model], model))
    monkeypatch.setattr(story, "quieter", lambda before, after: after / before)
    monkeypatch.setattr(story, "_in_question", lambda grown: [])
    search = Search(kinds=[], alpha=0.01, rng=np.random.default_rng(0), tick=lambda *_: None)
    answer = search.answer_by_ratios("case", "rough", frozenset())
    assert answer.noise_share == share
    assert {step[0].name for step in answer.grown.steps} == quiet_finds


def point(name):
    return SimpleNamespace(kind=SimpleNamespace(name=name))


@dc.dataclass(frozen=True)
class Model:
    """A state that only has theta and effects."""

    u: float
    effects: tuple[SimpleNamespace, ...]


def step(*names, beside=()):
    """Candidates of a step, each fitted in place of the first one with a theta of its own."""
    return tuple(
        SimpleNamespace(
            name=name, degenerate=False, fitted=SimpleNamespace(state=Model(k, (*map(point, beside), point(name))))
        )
        for k, name in enumerate(names, start=1)
    )


@pytest.mark.parametrize(
    ("alike", "expected"),
    [
        ({0: ("actuator_lag",)}, ["actuator_lag", "table_tilt"]),  # though nothing is like the last effect
        ({1: ("tether",)}, ["tracker_latency", "tether"]),
        ({}, ["tracker_latency", "magnet"]),  # what came next to it
    ],
)
def test_the_next_push_is_to_tell_what_these_cannot(monkeypatch, alike, expected):
    evidence = SimpleNamespace(
        steps=(
            step("tracker_latency", "actuator_lag"),
            step("table_tilt", "magnet", "tether", beside=["size_error"]),
        ),
        final=SimpleNamespace(reduced_chi2=1.0, state=Model(0, (point("tracker_latency"), point("table_tilt")))),
    )
    monkeypatch.setattr(story, "class_beside", lambda evidence, k: alike.get(k, ()))
    final, rival = story._rival_states(evidence)
    assert final is evidence.final.state
    assert [e.kind.name for e in rival.effects] == expected and rival.u != final.u


def test_what_the_model_has_beside_it_is_no_rival():
    steps = (step("table_tilt", "magnet", "tether"), step("magnet"))
    state = Model(0, (point("table_tilt"), point("magnet")))
    evidence = SimpleNamespace(steps=steps, final=SimpleNamespace(reduced_chi2=1.0, state=state))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(story, "class_beside", lambda evidence, k: ("tether",) if k == 0 else ())
        _, rival = story._rival_states(evidence)
    assert [e.kind.name for e in rival.effects] == ["tether", "magnet"]
    steps = (step("tether"), step("table_tilt", "tether"))
    evidence = SimpleNamespace(steps=steps, final=SimpleNamespace(reduced_chi2=1.0, state=state))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(story, "class_beside", lambda evidence, k: ())
        assert story._rival_states(evidence) == [state]


def test_a_model_that_explains_nothing_has_no_next_push():
    far = SimpleNamespace(steps=(step("table_tilt", "tether"),), final=SimpleNamespace(reduced_chi2=50.0, state=None))
    assert story._rival_states(far) == []


@pytest.mark.parametrize(("left", "explains", "tried"), [(1.0, True, 1), (1.22, False, 1), (1.6, False, 0)])
def test_a_name_that_short_ticks_may_bear_out_is_compared_with_foils(monkeypatch, left, explains, tried):
    asked = []
    monkeypatch.setattr(story, "unexplained", lambda plain, model: not explains)
    monkeypatch.setattr(story, "better_foil", lambda *given: asked.append(given[3]))
    model = SimpleNamespace(fitted=SimpleNamespace(reduced_chi2=left))
    grown = SimpleNamespace(steps=[[SimpleNamespace(name="actuator_lag")]], base=model, last=model)
    assert story._better_foil(SimpleNamespace(fitter=None, tick=None), grown) is None
    assert asked == ["actuator_lag"] * tried
