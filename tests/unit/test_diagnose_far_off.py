"""Far from an explanation: where fits begin again, and which are gone on with."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose import confirm
from physid_drake.diagnose.candidate import Candidate
from physid_drake.effects import effect_named

CASE = SimpleNamespace(pool=SimpleNamespace(count=0), problems=range(8))


@pytest.fixture
def step_of(monkeypatch):
    """A step with candidates that are there already; the model before leaves each push as likely as it was."""
    monkeypatch.setattr(confirm, "push_scores", lambda fitted: np.zeros(8))

    def of(fitter, before, found):
        return confirm.Confirmation(fitter=fitter, before=before, tick=lambda *said: None, found=found)

    return of


@pytest.mark.parametrize(("seen", "fits"), [(-500.0, 0), (-90.0, 1)])
def test_no_fit_begins_where_all_of_a_scan_is_worse_than_no_effect(monkeypatch, seen, fits):
    made = []

    def fit(state, **how):
        made.append(state)
        return "fitted"

    monkeypatch.setattr(confirm, "scanned_start", lambda fitter, before, one: ("point", np.zeros(1), seen))
    fitter = SimpleNamespace(start=lambda u, effects: (u, effects), fit=fit)
    before = SimpleNamespace(score=-100.0, state=SimpleNamespace(u=np.full(1, 0.5), effects=()))
    again = confirm._fit_from_afar(fitter, before, None)
    assert (again, len(made)) == ("fitted" if fits else None, fits)


class Places:
    """Fits that end where they start: at the value of the last effect, whose pushes cost what ``left`` says there."""

    case = None

    def __init__(self, left):
        self.left, self.ended = left, []

    def start(self, u, effects):
        return SimpleNamespace(u=u, effects=effects)

    def fit(self, state, *, rounds, careful=0, like):
        self.ended.append((state.effects[-1], rounds))
        left = self.left[state.effects[-1]]
        return SimpleNamespace(state=state, reduced_chi2=left, score=-100.0 * left)


@pytest.mark.parametrize(
    ("left", "best", "fits"),
    [
        ({"a": 3.0, "b": 1.2, "c": 1.0}, "b", [("a", 3), ("b", 3), ("b", 4)]),
        ({"a": 3.0, "b": 9.0, "c": 2.5}, "c", [("a", 3), ("b", 3), ("c", 3), ("c", 4)]),
        ({"a": 5.0, "b": 9.0, "c": 6.0}, None, [("a", 3), ("b", 3), ("c", 3)]),
    ],
)
def test_other_places_are_tried_until_one_explains_the_pushes(monkeypatch, left, best, fits):
    monkeypatch.setattr(confirm, "elsewhere", lambda case, score: list(left))
    monkeypatch.setattr(confirm, "start_of", lambda fitter, place: place)
    before = SimpleNamespace(state=SimpleNamespace(u=np.zeros(1), effects=()), reduced_chi2=20.0)
    candidate = SimpleNamespace(score=None, fitted=SimpleNamespace(score=-400.0, reduced_chi2=4.0))
    places = Places(left)
    found = confirm._fit_elsewhere(places, before, candidate)
    assert (None if found is None else found.state.effects[-1]) == best
    assert places.ended == fits


@pytest.mark.parametrize(
    ("left", "tried"),
    [
        ([1.5, 4.0], []),  # explained
        ([10.4, 10.4, 10.4], ["magnet", "friction_patch"]),
        ([10.6, 10.4], ["friction_patch"]),  # the other one left most of it
        ([10.4, 10.6, 10.6, 10.4], ["magnet"]),  # a drag has no place
    ],
)
def test_only_what_takes_most_away_and_does_not_explain_all_is_tried_elsewhere(monkeypatch, step_of, left, tried):
    ended = []
    monkeypatch.setattr(confirm, "ranked", list)
    monkeypatch.setattr(confirm, "_fit_elsewhere", lambda fitter, before, one: ended.append(one.name))
    monkeypatch.setattr(confirm, "elsewhere", lambda case, name: [] if name == "viscous_drag" else ["there"])
    names = ["magnet", "friction_patch", "tether", "viscous_drag"]
    found = [
        SimpleNamespace(name=name, score=name, fitted=SimpleNamespace(reduced_chi2=chi2))
        for name, chi2 in zip(names, left, strict=False)
    ]
    before = SimpleNamespace(reduced_chi2=20.0)
    step = step_of(SimpleNamespace(case=CASE), before, found)
    step.try_elsewhere()
    assert step.found == found
    assert ended == tried


@pytest.mark.parametrize(
    ("left", "degenerate", "fits"),
    [
        ({"tether": 1.6, "table_tilt": 100.0, "viscous_drag": 100.0}, True, ["table_tilt"]),  # a drag promised little
        ({"tether": 1.4, "table_tilt": 100.0, "viscous_drag": 100.0}, False, []),  # the answer is there
        ({"tether": 2.5, "table_tilt": 100.0, "viscous_drag": 100.0}, False, ["table_tilt"]),
        ({"tether": 2.5, "table_tilt": 2.6, "viscous_drag": 100.0}, False, []),
        ({"tether": 40.0, "table_tilt": 100.0, "viscous_drag": 100.0}, True, []),  # nobody knows where theta is
        ({}, False, []),
    ],
)
@pytest.mark.parametrize("plain", [139.0, 2.0])
def test_what_ended_far_off_is_tried_from_the_theta_of_what_came_near(
    monkeypatch, step_of, left, degenerate, fits, plain
):
    """A spring that ran to its weakest stands for a tilt, whose own fit was lost from the theta of the plain cell."""
    made = []

    def fit(state, *, rounds, careful, renew):
        made.append(state.effects[-1].kind.name)
        return SimpleNamespace(state=state, reduced_chi2=1.0, score=-1.0)

    def fitted(chi2):
        return SimpleNamespace(reduced_chi2=chi2, score=-chi2, state=SimpleNamespace(u=np.full(1, chi2), effects=()))

    def judged(fitter, one, model, *_):
        assert model.state.u == min(left.values())
        return Candidate(score=one, fitted=model, gains=np.full(8, 50.0), degenerate=False)

    monkeypatch.setattr(confirm, "start_of", lambda fitter, one: one)
    monkeypatch.setattr(confirm, "candidate_of", judged)
    promised = {"tether": 1000.0, "table_tilt": 900.0, "viscous_drag": 400.0}
    found = [
        Candidate(
            score=SimpleNamespace(gain=promised[name], kind=effect_named(name), in_order=False), fitted=fitted(chi2),
            gains=np.full(8, 20.0), degenerate=degenerate and name == "tether",
        )
        for name, chi2 in left.items()
    ]  # fmt: skip
    fitter = SimpleNamespace(case=CASE, start=lambda u, effects: SimpleNamespace(u=u, effects=effects), fit=fit)
    before = SimpleNamespace(reduced_chi2=plain, state=SimpleNamespace(effects=()))
    step = step_of(fitter, before, found)
    step.try_from_nearer_theta()
    assert made == fits
    assert len(step.found) == len(found) and (not fits or step.found[0].name == fits[0])


@pytest.mark.parametrize(
    ("promised", "reached", "confirmed", "fitted_again"),
    [
        (1000.0, 889.0, True, True),
        (800.0, 889.0, True, False),  # it promised less, and is something else
        (1000.0, 910.0, True, False),  # it came as far already
        (1000.0, 889.0, False, False),  # nothing is found yet
    ],
)
def test_the_same_physics_with_fewer_coordinates_is_fitted_from_the_theta_of_the_best(
    monkeypatch, step_of, promised, reached, confirmed, fitted_again
):
    """A spring anchored thirty metres away was named, since the fit of a tilt had stopped a hundredth short."""
    made = []

    def candidate(name, gain, score, coordinates, gains=None):
        state = SimpleNamespace(u=name, effects=(name,))
        return Candidate(
            score=SimpleNamespace(gain=gain, kind=effect_named(name), in_order=False),
            fitted=SimpleNamespace(reduced_chi2=0.9, score=score, state=state), degenerate=False,
            gains=np.full(8, (score if confirmed else -score) / 8), coordinates=coordinates,
        )  # fmt: skip

    def fit(state, *, rounds, careful, renew):
        made.append((state.u, state.effects))
        return SimpleNamespace(state=state, reduced_chi2=0.9, score=909.0)

    def judged(fitter, one, model, *_):
        return Candidate(score=one, fitted=model, gains=np.full(8, 909.0 / 8), degenerate=False, coordinates=2)

    monkeypatch.setattr(confirm, "candidate_of", judged)
    found = [candidate("tether", 1000.0, 909.5, 4), candidate("table_tilt", promised, reached, 2)]
    fitter = SimpleNamespace(case=CASE, start=lambda u, effects: SimpleNamespace(u=u, effects=effects), fit=fit)
    step = step_of(fitter, None, found)
    step.try_simpler_from_the_best()
    assert made == ([("tether", ("table_tilt",))] if fitted_again else [])
    assert step.found[0].name == ("table_tilt" if fitted_again or reached > 909.5 else "tether")
    assert {c.name for c in step.found} == {"tether", "table_tilt"}


@pytest.mark.parametrize(
    ("left", "beside", "gone_on_with", "first"),
    [
        ({"friction_patch": 11.4, "friction_gradient": 12.6, "sloshing": 18.0}, True, 2, "friction_gradient"),
        ({"friction_patch": 11.4, "friction_gradient": 12.6, "sloshing": 18.0}, False, 0, "friction_patch"),
        ({"friction_patch": 11.4, "friction_gradient": 19.0}, True, 0, "friction_patch"),  # there is no choice
        ({"friction_patch": 2.9, "friction_gradient": 12.6}, True, 0, "friction_patch"),  # one leads near
    ],
)
def test_far_off_the_best_fits_go_on_before_one_is_chosen(monkeypatch, step_of, left, beside, gone_on_with, first):
    """Beside a bounce a gradient's fit had stopped short of a patch's, which led nowhere."""
    ends = {"friction_patch": 16.6, "friction_gradient": 0.95}
    made = []

    def fitted(name, chi2):
        return SimpleNamespace(reduced_chi2=chi2, score=-chi2, state=SimpleNamespace(u=name, effects=(name,)))

    def fit(state, *, rounds, careful, renew):
        made.append(state.u)
        return fitted(state.u, ends[state.u])

    def judged(fitter, one, model, *_):
        return Candidate(score=one, fitted=model, gains=np.full(8, 50.0 - model.reduced_chi2), degenerate=False)

    monkeypatch.setattr(confirm, "candidate_of", judged)
    found = [
        judged(None, SimpleNamespace(kind=effect_named(name), in_order=False), fitted(name, chi2), None)
        for name, chi2 in left.items()
    ]
    fitter = SimpleNamespace(case=CASE, start=lambda u, effects: SimpleNamespace(u=u, effects=effects), fit=fit)
    before = SimpleNamespace(reduced_chi2=20.0, state=SimpleNamespace(effects=("bounce",) if beside else ()))
    step = step_of(fitter, before, found)
    step.go_on()
    assert made == list(left)[:gone_on_with]
    assert len(step.found) == len(found) and step.found[0].name == first
    assert step.found[0].fitted.score == max(one.fitted.score for one in step.found)


@pytest.mark.parametrize("in_order", [True, False])
def test_frictions_that_follow_an_order_are_fitted_with_fresh_derivatives(monkeypatch, in_order):
    """They may differ by a half, where the derivatives of the model before are those of a few percent."""
    monkeypatch.setattr(confirm, "nearer_start", lambda fitter, before, one: "start")
    made = []
    fitter = SimpleNamespace(fit=lambda state, *, rounds, like: made.append((state, like)))
    before = SimpleNamespace(reduced_chi2=1.0)
    confirm._fit(fitter, before, SimpleNamespace(in_order=in_order))
    assert made == [("start", None if in_order else before)]
