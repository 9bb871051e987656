"""What is said of a mismatch that an effect takes away in part."""

import dataclasses as dc
import math
from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose import classes, conclude, ranking, verdict
from physid_drake.diagnose.candidate import Candidate
from physid_drake.diagnose.foils import Foil
from physid_drake.diagnose.sentence import sentence
from physid_drake.pushes.features import PushFeatures
from physid_drake.pushes.misfit import FAILED

PUSHES, WINDOWS = 6, 5
SIGMAS = np.array([1e-3, 1e-3, 1e-2])


def model_that_leaves(chi2):
    return SimpleNamespace(reduced_chi2=chi2)


def errors(times_noise):
    """Of pushes left out, so many standard deviations in every window."""
    return (times_noise * np.repeat([1.0, 1.0, -1.0], WINDOWS),) * PUSHES


def features():
    return PushFeatures(
        averaging=np.eye(WINDOWS), middles=np.zeros(WINDOWS), sigmas=SIGMAS, recorded=np.zeros(3 * WINDOWS),
        noise=np.eye(3 * WINDOWS), force_std=np.zeros(0), force_way=np.zeros(0), force_size=0.0,
    )  # fmt: skip


def evidence(*, steps=(), rejected=(), superfluous=(), final=None, after=10.0, foil=None):
    plain = model_that_leaves(100.0)
    screening = SimpleNamespace(scores=(SimpleNamespace(kind=SimpleNamespace(name="viscous_drag")),))
    return SimpleNamespace(
        case=SimpleNamespace(features=[features()] * PUSHES, noise=SimpleNamespace(position=3e-4, known=True)),
        plain=plain, nearest=plain, screening=screening,
        remaining=SimpleNamespace(scores=()), steps=steps, rejected=rejected, superfluous=superfluous,
        final=final or plain,
        errors_before=errors(10.0), errors_after=errors(after), foil=foil,
    )  # fmt: skip


def tried(name, gain, model, in_order=False):
    score = SimpleNamespace(kind=SimpleNamespace(name=name), in_order=in_order)
    return Candidate(score=score, fitted=model, gains=np.full(PUSHES, gain), degenerate=False)


def test_the_best_effect_that_pushes_confirm_is_said_to_take_its_part():
    best = tried("viscous_drag", 50.0, model_that_leaves(16.0))
    found = conclude._partly(evidence(rejected=(tried("magnet", -1.0, None), best), after=4.0))
    assert found.effects == ("viscous_drag",)
    assert found.share == pytest.approx(1.0 - 0.4**2)
    assert found.position == pytest.approx(np.sqrt(2.0) * 4e-3) and found.rotation == pytest.approx(4e-2)
    said = sentence("unexplained", (), found, None)
    assert "viscous_drag would take 84 % of the squared error away" in said
    plain = evidence().plain
    assert conclude._left(evidence(), "unexplained", plain, found).endswith("with viscous_drag 4.0 times")


def test_a_foil_that_does_better_takes_the_name_away_and_says_what_it_is():
    foil = Foil(statement="friction grows", instead_of="viscous_drag", gain=20.0)
    steps = ((tried("viscous_drag", 50.0, None),),)
    told = evidence(steps=steps, final=model_that_leaves(1.0), after=1.0, foil=foil)
    assert not verdict.is_explained(told) and conclude._partly(told) is None
    said = sentence("unexplained", (), None, foil)
    assert said.endswith("viscous_drag explains less than this would: friction grows.")
    assert "friction grows" in conclude._left(told, "unexplained", told.plain, None)


def test_effects_that_were_added_and_did_not_suffice_are_said_together():
    steps = tuple((tried(name, 50.0, None),) for name in ("magnet", "table_tilt"))
    found = conclude._partly(evidence(steps=steps, final=model_that_leaves(9.0), after=3.0))
    assert found.effects == ("magnet", "table_tilt")


@pytest.mark.parametrize(("rejected", "after"), [((), 10.0), ((-1.0,), 1.0), ((9.0,), 9.0)])
def test_what_is_not_confirmed_or_takes_little_away_is_not_worth_a_word(rejected, after):
    candidates = tuple(tried("magnet", gain, model_that_leaves(4.0)) for gain in rejected)
    assert conclude._partly(evidence(rejected=candidates, after=after)) is None
    told = evidence()
    assert "nothing in the catalogue accounts for it" in sentence("unexplained", (), None, None)
    assert conclude._left(told, "unexplained", told.plain, None).endswith(
        "is viscous_drag, which does not account for it"
    )


def test_what_a_verdict_rests_on_is_said_with_it():
    assert "at least 3" in sentence("underpowered", (), None, None, fewest=3)
    assert "would have to be large" in sentence("underpowered", (), None, None)
    assert "nobody states" in sentence("consistent", (), None, None, known=False)
    assert "nobody states" not in sentence("consistent", (), None, None)


@pytest.mark.parametrize(
    ("verdict", "rms", "said"),
    [
        ("explained", 7.2, True),
        ("consistent", 7.2, True),
        ("unexplained", 7.2, False),
        ("underpowered", 7.2, False),
        ("explained", 2.0, False),
        ("consistent", math.nan, False),
    ],
)
def test_what_only_each_push_for_itself_makes_up_for_is_said(verdict, rms, said):
    warnings = conclude._hidden(verdict, SimpleNamespace(rms_after=rms))
    assert [("off by 7.2 standard deviations" in warning) for warning in warnings] == ([True] if said else [])


@pytest.mark.parametrize(
    ("named", "gain", "why"),
    [
        (set(), 50.0, "pushes that were left out confirm it, but it leaves more than noise"),
        ({"magnet"}, 50.0, "predicts pushes that were left out worse"),
        ({"magnet"}, -1.0, "pushes that were left out do not confirm it"),
    ],
)
def test_why_an_effect_that_was_fitted_is_not_what_is_missing(named, gain, why):
    assert ranking._why("viscous_drag", tried("viscous_drag", gain, None), named, set(), evidence(after=4.0)) == why


def test_of_a_noise_that_nobody_states_half_must_go():
    told = evidence(after=4.0)
    assert ranking._why_partly(told) == "takes a part away, and leaves more than noise"
    told.case.noise.known = False
    for why in (ranking._why_partly(told), ranking._why_not_named(told)):
        assert why.endswith("leaves more than half of the noise that the plain cell needs and nobody states")


def test_an_effect_that_was_taken_back_is_said_to_be():
    one = tried("viscous_drag", 50.0, None)
    told = evidence(
        steps=((tried("magnet", 50.0, None),),), superfluous=((one, tried("tether", 9.0, None)),), after=1.0
    )
    assert ranking._why("viscous_drag", one, {"magnet"}, set(), told).startswith("was taken back")
    assert ranking._why("tether", told.superfluous[0][1], {"magnet"}, set(), told).startswith("predicts pushes")


def test_a_model_that_predicts_left_out_pushes_worse_explains_nothing(monkeypatch):
    worse = evidence(steps=((tried("magnet", 50.0, model_that_leaves(1.0)),),), after=12.0)
    assert not verdict.is_explained(worse)
    why = ranking._why("magnet", tried("magnet", 50.0, None), set(), set(), worse)
    assert why == "pushes that were left out are simulated hardly better with it"
    hidden = SimpleNamespace(reduced_chi2=1.2, state=SimpleNamespace(scatter=4.7))
    hides = "what a friction would hide that scatters by 12 % from push to push"
    for trend, said in ((None, hides), ("less the faster it is pushed", f"{hides}, less the faster it is pushed")):
        monkeypatch.setattr(conclude, "friction_trend", lambda case, after, trend=trend: trend)
        assert conclude._left(worse, "unexplained", hidden, None) == said
    said = conclude._left(worse, "consistent", hidden, None)
    assert said.startswith("nothing beyond noise") and said.endswith("faster it is pushed, which may hide an effect")
    usual = SimpleNamespace(reduced_chi2=1.2, state=SimpleNamespace(scatter=2.0))
    assert conclude._left(worse, "consistent", usual, None).endswith("the simulator's own error")
    # Beside a name, too, where nobody states how much friction scatters.
    for p_value, said in ((0.001, hides), (0.1, "nothing beyond noise")):
        monkeypatch.setattr(conclude, "friction_trend", lambda case, after: None)
        monkeypatch.setattr(conclude, "scatter_p_value", lambda fitted, p=p_value: p)
        assert conclude._left(worse, "explained", hidden, None).startswith(said)


@pytest.mark.parametrize(("after", "predicts"), [(8.0, True), (8.5, False)])
@pytest.mark.parametrize("loud", [None, ("as loud as it leaves", "screened there")], ids=["known noise", "unknown"])
def test_an_effect_that_shows_in_no_simulated_push_is_neither_named_nor_a_mismatch(
    monkeypatch, loud, after, predicts
):
    """A likelihood may rise by what an effect takes of the cell's own error; the fit does not visibly improve."""
    told = evidence(steps=((tried("friction_patch", 50.0, model_that_leaves(1.0)),),), after=after)
    told.loud = loud
    monkeypatch.setattr(verdict, "mismatch", lambda plain, screening: 0.5 if screening is None else 1e-9)
    assert verdict.predicts(told) is predicts
    assert verdict.p_value_of(told) == (1e-9 if predicts else 0.5)


@pytest.mark.parametrize(("odd", "predicts"), [(1, True), (2, False)])
def test_one_push_that_goes_another_way_does_not_speak_against_a_model(odd, predicts):
    told = evidence(steps=((tried("magnet", 50.0, model_that_leaves(1.0)),),), after=1.0)
    told.errors_after = errors(100.0)[:odd] + told.errors_after[odd:]
    assert verdict.predicts(told) is predicts


@pytest.mark.parametrize(("others", "explained"), [(10.5, False), (9.5, False), (9.0, True), (7.0, True)])
def test_a_model_with_which_one_push_alone_comes_nearer_is_no_answer(monkeypatch, others, explained):
    """The mismatch stands; a little nearer will do where all pushes come nearer."""
    monkeypatch.setattr(verdict, "unexplained", lambda plain, final: False)
    told = evidence(steps=((tried("friction_patch", 50.0, model_that_leaves(1.0)),),), after=others)
    told.case.noise.known = True
    told.errors_before = errors(40.0)[:1] + told.errors_before[1:]
    told.errors_after = errors(4.0)[:1] + told.errors_after[1:]
    assert verdict.predicts(told)
    assert verdict.is_explained(told) is explained
    why = ranking._why("friction_patch", told.steps[0][0], set(), set(), told)
    assert why.startswith("one push that was left out") is not explained


@pytest.mark.parametrize(
    ("in_order", "several"), [((), False), ((False,), False), ((True,), True), ((True, False), False)]
)
def test_an_order_of_many_pushes_is_not_the_work_of_one(in_order, several):
    """Beside an effect that orders frictions, another one has to show by itself."""
    told = evidence(steps=tuple((tried("friction_drift", 50.0, None, one),) for one in in_order))
    told.errors_before = errors(40.0)[:1] + errors(10.0)[1:]
    told.errors_after = errors(4.0)[:1] + errors(10.5)[1:]
    assert verdict.by_several(told) is several


@pytest.mark.parametrize(
    ("loudest", "in_order", "alike"),
    [(160.0, False, ("tracker_bias",)), (40.0, False, ()), (160.0, True, ())],
)
def test_what_one_push_speaks_for_loudly_is_no_name_and_yet_in_the_class(loudest, in_order, alike):
    """As in CMU's ``patch``: a name with a probability of 0.29 was said to explain the pushes."""
    found = tried("uneven_support", 15.0, model_that_leaves(1.0), in_order)
    other = tried("tracker_bias", 0.0, model_that_leaves(1.0))
    gains = np.full(PUSHES, 1.0)
    gains[0] = loudest
    other = dc.replace(other, gains=gains)
    assert found.accepted and not other.accepted
    assert classes.class_of(evidence().plain, (found, other)) == alike


def test_what_the_model_has_beside_an_effect_is_no_rival_of_it(monkeypatch):
    gains = {"size_error": 50.0, "stribeck_friction": 49.0, "viscous_drag": 49.0}
    size, stribeck, drag = (tried(name, gain, model_that_leaves(1.0)) for name, gain in gains.items())
    monkeypatch.setattr(classes, "class_of", lambda plain, step: tuple(c.name for c in step[1:]))
    alone = evidence(steps=((size, stribeck, drag),))
    both = evidence(steps=((size, stribeck, drag), (stribeck,)))
    assert classes.class_beside(alone, 0) == ("stribeck_friction", "viscous_drag")
    assert classes.class_beside(both, 0) == ("viscous_drag",)
    monkeypatch.setattr(classes, "out_of_question", lambda best, other: False)
    three, two = (classes.probability_of(e.steps[0], classes.others_than(e, 0)) for e in (alone, both))
    assert three < two < 1.0


@pytest.mark.parametrize(
    ("noise", "times", "want"),
    [(1e-5, 0.05, 1.0), (1e-5, 0.3, 1e-9), (1e-4, 0.05, 1e-9)],
    ids=["as near as simulators are", "further off", "noise that hides it"],
)
def test_what_a_simulation_without_noise_differs_by_is_no_physics(monkeypatch, noise, times, want):
    monkeypatch.setattr(verdict, "mismatch", lambda plain, screening: 1e-9)
    clean = evidence()
    clean.case.noise = SimpleNamespace(position=noise)
    clean.errors_before, clean.loud = errors(times), None  # times 1 mm and 10 mrad
    assert verdict.p_value_of(clean) == want


@pytest.mark.parametrize(
    ("sigmas", "unfelt", "blind"),
    [
        ((3.0, 4.0, 50.0), 0, False),
        ((3.0, 4.0, 50.0), 2, True),
        ((30.0, 4.0, 50.0), 0, True),
        ((), 0, True),
        ((), 3, True),
    ],
)
def test_pushes_that_would_not_show_most_effects_show_nothing(sigmas, unfelt, blind):
    """One that no push feels at all counts as not shown."""
    detectable = [SimpleNamespace(name=f"shown_{i}", sigmas=s) for i, s in enumerate(sigmas)]
    names = [*(d.name for d in detectable), *(f"unfelt_{i}" for i in range(unfelt))]
    told = SimpleNamespace(signatures=[SimpleNamespace(kind=SimpleNamespace(name=name)) for name in names])
    assert verdict._blind(told, detectable) is blind


def test_pushes_that_the_model_cannot_simulate_are_said():
    case = SimpleNamespace(problems=[SimpleNamespace(name=name) for name in ("001", "002", "003")])
    simulated, fallen = np.zeros(4), np.full(4, FAILED)
    assert conclude._diverged(case, SimpleNamespace(predicted=(simulated,) * 3)) == ()
    (said,) = conclude._diverged(case, SimpleNamespace(predicted=(fallen, simulated, fallen)))
    assert said.endswith(": 001, 003")


@pytest.mark.parametrize(("memory", "said"), [(0.0, {"hand_m"}), (0.05, {"hand_m", "hand_correlation_time_s"})])
def test_a_slow_noise_of_the_hand_is_said(memory, said):
    case = SimpleNamespace(
        recording=SimpleNamespace(hand=object()), sensors=SimpleNamespace(hand=3e-4, hand_memory=memory), problems=()
    )
    assert conclude._noise_of_sensors(case).keys() == said
