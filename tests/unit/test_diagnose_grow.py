"""Growing a model: effects that later ones make superfluous, and plain fits in a wrong basin."""

import dataclasses as dc
from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose import grow
from physid_drake.diagnose.candidate import Candidate
from physid_drake.diagnose.confirm import ENOUGH
from physid_drake.diagnose.evidence import unexplained
from physid_drake.diagnose.model import State

PUSHES = 8


def fitted(names, score_per_push):
    effects = tuple(SimpleNamespace(kind=SimpleNamespace(name=name)) for name in names)
    state = State(u=np.zeros(2), effects=effects, own=(), scatter=1.0)
    return SimpleNamespace(state=state, scores=np.full(PUSHES, score_per_push) + 0.1 * np.arange(PUSHES))


def step(name):
    score = SimpleNamespace(kind=SimpleNamespace(name=name), in_order=False)
    return (Candidate(score=score, fitted=None, gains=np.full(PUSHES, 5.0), degenerate=False),)


class Refits:
    """Fits whose score, and the error of simulated left-out pushes, depend on which effects are left."""

    case = None

    def __init__(self, scores, errors=()):
        self.scores, self.errors = scores, dict(errors)

    def left_out(self, model):
        return self.errors.get(tuple(e.kind.name for e in model.state.effects), -model.scores[0])

    def fit(self, state, **how):
        names = tuple(e.kind.name for e in state.effects)
        return fitted(names, self.scores[names])


@pytest.fixture
def grown(monkeypatch):
    monkeypatch.setattr(grow, "push_scores", lambda one: one.scores)
    monkeypatch.setattr(grow, "comes_nearer", lambda case, before, after: 1.2 * after <= before)
    monkeypatch.setattr(
        grow.Looked,
        "at",
        classmethod(lambda cls, one, signatures, rng: cls(fitted=one, signatures=tuple(signatures), screening=None)),
    )
    base = grow.Looked(fitted=fitted((), -50.0), signatures=(), screening=None)
    last = grow.Looked(fitted=fitted(("magnet", "table_tilt"), -1.0), signatures=(), screening=None)
    return grow.Grown(base=base, last=last, steps=(step("magnet"), step("table_tilt")), rejected=())


def tried(name, gains, *, coordinates=1, chi2=1.0, degenerate=False):
    score = SimpleNamespace(kind=SimpleNamespace(name=name), in_order=False)
    return Candidate(
        score=score, fitted=SimpleNamespace(reduced_chi2=chi2), gains=np.asarray(gains, dtype=float),
        degenerate=degenerate, coordinates=coordinates,
    )  # fmt: skip


@pytest.fixture
def before(monkeypatch):
    monkeypatch.setattr(grow, "push_scores", lambda one: one.scores)
    monkeypatch.setattr(grow, "unexplained", lambda base, last: last.reduced_chi2 > 2.0)
    return SimpleNamespace(reduced_chi2=6.0, scores=np.zeros(8), state=with_effects_of("table"))


def with_effects_of(*elements):
    return SimpleNamespace(effects=tuple(SimpleNamespace(kind=SimpleNamespace(element=e)) for e in elements))


def test_the_best_is_added_where_the_simpler_one_leaves_too_much(before):
    simple, best = tried("table_tilt", [49.0] * 8, chi2=5.5), tried("tether", [50.0] * 8, coordinates=4, chi2=2.0)
    assert [c.name for c in grow.worth_adding(before, before, (simple, best))] == ["tether", "table_tilt"]
    enough = tried("table_tilt", [49.0] * 8, chi2=2.2)
    assert [c.name for c in grow.worth_adding(before, before, (enough, best))] == ["table_tilt", "tether"]


def test_nothing_is_added_that_pushes_do_not_confirm(before):
    lost = tried("magnet", [50.0] * 8, degenerate=True)
    assert grow.worth_adding(before, before, (tried("table_tilt", [-1.0] * 8), lost)) == ()
    assert grow.worth_adding(before, before, ()) == ()


ONE_PUSH = [300.0, -9.0, -9.0, -9.0, -9.0, -9.0, -9.0, -9.0]


@pytest.mark.parametrize(("left", "added"), [(1.6, ["uneven_support", "magnet"]), (2.4, [])])
def test_what_pushes_confirm_and_explains_them_goes_before_what_one_push_makes_the_most_of(before, left, added):
    odd, sure = tried("magnet", ONE_PUSH), tried("uneven_support", [6.0] * 8, chi2=left)
    assert odd.gain > sure.gain
    assert [c.name for c in grow.worth_adding(before, before, (odd, sure))] == added


@pytest.mark.parametrize(
    ("explained", "left", "added"), [(7000.0, 1.6, True), (9000.0, 1.6, False), (9000.0, 6.0, True)]
)
def test_what_the_law_of_a_large_effect_may_be_wrong_by_is_no_second_one(before, explained, left, added):
    base = SimpleNamespace(reduced_chi2=60.0, scores=np.full(8, -explained / 8.0))
    before.reduced_chi2 = left
    small = tried("magnet", [10.0] * 8)
    assert bool(grow.worth_adding(base, before, (small,))) == added
    # What a tracker does to poses is not simulated, so that no law of it is wrong.
    before.state = with_effects_of("sensor", "sensor")
    assert grow.worth_adding(base, before, (small,))
    before.state = with_effects_of("sensor", "object")
    assert bool(grow.worth_adding(base, before, (small,))) == added


def names_of(grown):
    return [candidates[0].name for candidates in grown.steps]


def growth(fitter):
    return grow.Growth(fitter=fitter, kinds=(), alpha=0.01, rng=None, tick=lambda *said: None)


def test_an_effect_that_a_later_one_makes_superfluous_is_taken_out(grown):
    pruned = growth(Refits({("magnet",): -9.0, ("table_tilt",): -1.2})).pruned(grown)
    assert names_of(pruned) == ["table_tilt"]
    assert [step[0].name for step in pruned.superfluous] == ["magnet"]
    assert [e.kind.name for e in pruned.last.fitted.state.effects] == ["table_tilt"]


def test_two_effects_that_both_matter_stay(grown):
    pruned = growth(Refits({("magnet",): -9.0, ("table_tilt",): -9.0})).pruned(grown)
    assert names_of(pruned) == ["magnet", "table_tilt"]
    assert pruned.last is grown.last


def test_an_effect_that_makes_no_simulated_push_better_is_taken_out(grown):
    errors = {("magnet", "table_tilt"): 1.0, ("magnet",): 1.1}
    pruned = growth(Refits({("magnet",): -9.0}, errors)).pruned(grown)
    assert names_of(pruned) == ["magnet"]


@pytest.fixture
def rivalled(grown, monkeypatch):
    """A magnet that a tilted table is like, and a drag beside it; (without the first effect, -60 a push)."""
    monkeypatch.setattr(grow, "class_of", lambda plain, step: ("table_tilt",))
    monkeypatch.setattr(grow.Growth, "_model_with", lambda self, state, plain, which: self.fitter.fit(state))
    magnet = dc.replace(step("magnet")[0], coordinates=4)
    rival = dc.replace(step("table_tilt")[0], fitted=fitted(("table_tilt",), -60.0), coordinates=1)
    last = dc.replace(grown.last, fitted=fitted(("magnet", "viscous_drag"), -5.0))
    return dc.replace(grown, last=last, steps=((magnet, rival, step("uneven_support")[0]), step("viscous_drag")))


@pytest.mark.parametrize(("beside", "first"), [(-4.0, "table_tilt"), (-5.5, "table_tilt"), (-12.0, "magnet")])
def test_a_rival_that_does_better_beside_a_later_effect_takes_the_place(rivalled, beside, first):
    """Also one that does as well with fewer coordinates; not one that is 7 nats a push worse."""
    refits = Refits({("table_tilt", "viscous_drag"): beside, ("viscous_drag",): -60.0})
    judged = growth(refits).reconsidered(rivalled, 0)
    assert names_of(judged) == [first, "viscous_drag"]
    assert {c.name for c in judged.steps[0]} == {"magnet", "table_tilt"}
    assert [c.name for c in judged.rejected] == ["uneven_support"]
    assert [e.kind.name for e in judged.last.fitted.state.effects] == [first, "viscous_drag"]
    gains = {c.name: c.gain for c in judged.steps[0]}
    assert gains["magnet"] == pytest.approx(PUSHES * (60.0 - 5.0))  # over the drag alone: what each adds to it
    assert gains["table_tilt"] == pytest.approx(PUSHES * (60.0 + beside))
    assert {c.name: [e.kind.name for e in c.fitted.state.effects] for c in judged.steps[0]} == {
        "magnet": ["magnet", "viscous_drag"],
        "table_tilt": ["table_tilt", "viscous_drag"],
    }


def test_a_step_without_rivals_stays(rivalled, monkeypatch):
    monkeypatch.setattr(grow, "class_of", lambda plain, step: ())
    assert growth(Refits({})).reconsidered(rivalled, 0) is rivalled


def test_a_plain_fit_in_a_wrong_basin_is_left_if_an_effect_leads_out_of_it():
    class FromThere:
        """Plain fits from anywhere end at one score."""

        def __init__(self, score):
            self.end = SimpleNamespace(score=score, state=None)

        def start(self, u):
            return u

        def fit(self, state, **how):
            return self.end

    stuck = SimpleNamespace(score=-500.0)
    led_out = SimpleNamespace(fitted=SimpleNamespace(score=-60.0, reduced_chi2=1.0, state=SimpleNamespace(u=None)))
    assert growth(FromThere(-62.0)).plain_from(stuck, led_out).score == -62.0
    assert growth(FromThere(-495.0)).plain_from(stuck, led_out) is None
    no_better = SimpleNamespace(fitted=SimpleNamespace(score=-497.0, reduced_chi2=1.0))
    assert growth(FromThere(-62.0)).plain_from(stuck, no_better) is None
    lost = SimpleNamespace(fitted=SimpleNamespace(score=-60.0, reduced_chi2=50.0))
    assert growth(FromThere(-62.0)).plain_from(stuck, lost) is None


@pytest.mark.parametrize(
    ("before", "after", "left"),
    [
        (5.0, 1.5, False),
        (5.0, 1.7, True),
        (1.6, 1.2, False),
        (1.6, 1.4, True),
        (150.0, 2.4, False),
        (150.0, 3.5, True),
        (900.0, 3.5, True),
    ],
)
def test_a_large_effect_may_leave_what_two_honest_laws_of_it_differ_by(before, after, left):
    usual = SimpleNamespace(scatter=1.0)
    plain, final = SimpleNamespace(reduced_chi2=before), SimpleNamespace(reduced_chi2=after, state=usual, doubt=0.0)
    assert unexplained(plain, final) is left


@pytest.mark.parametrize(("doubt", "left"), [(0.0, True), (0.05, True), (0.2, False)])
def test_noise_that_rests_hardly_tell_may_be_left(doubt, left):
    usual = SimpleNamespace(scatter=1.0)
    plain, final = SimpleNamespace(reduced_chi2=2.5), SimpleNamespace(reduced_chi2=1.35, state=usual, doubt=doubt)
    assert unexplained(plain, final) is left


class Basins:
    """Fits that end in one of four places, by the corner from which they start; a renewed fit stays there."""

    def __init__(self, scores, explains, rollouts=0):
        self.scores, self.explains, self.tried, self.rollouts = scores, explains, 0, rollouts
        self.case = SimpleNamespace(problems=[None], pool=SimpleNamespace(count=0))

    def fit(self, state, **how):
        if how.get("renew"):
            return self.at(state.own)
        self.tried += 1
        self.case.pool.count += self.rollouts
        return self.at(state)

    def at(self, where):
        kind = SimpleNamespace(name="friction_patch")
        state = SimpleNamespace(effects=(SimpleNamespace(kind=kind),), own=where)
        score = self.scores[where]
        return SimpleNamespace(state=state, score=score, reduced_chi2=1.1 if score >= self.explains else 3.0)


FAR_OFF = SimpleNamespace(reduced_chi2=8.0)


@pytest.fixture
def four_corners(monkeypatch):
    monkeypatch.setattr(grow, "corners", lambda fitter, model, which: [0, 1, 2, 3])
    monkeypatch.setattr(grow, "of_other_shape", lambda fitter, model, corner, which: corner)


@pytest.mark.parametrize(
    ("scores", "end", "tried"),
    [
        ([-500.0, -60.0, -55.0, -900.0], 1, 2),  # the first that explains
        ([-500.0, -495.0, -300.0, -295.0], 2, 4),  # the best where none does; a few nats are no other basin
        ([-600.0, -495.0, -502.0, -700.0], "here", 4),
    ],
)
def test_a_shape_that_does_not_explain_is_looked_for_elsewhere(four_corners, scores, end, tried):
    basins = Basins(dict(enumerate(scores)) | {"here": -500.0}, explains=-100.0)
    here = basins.at("here")
    model = growth(basins)._of_other_shape(here, FAR_OFF)
    assert model.state.own == end
    assert basins.tried == tried
    assert (model is here) == (end == "here")


def test_other_shapes_are_tried_as_long_as_rollouts_last(four_corners):
    basins = Basins(dict.fromkeys(range(4), -500.0) | {"here": -500.0}, explains=-100.0, rollouts=0.6 * ENOUGH)
    growth(basins)._of_other_shape(basins.at("here"), FAR_OFF)
    assert basins.tried == 2


def test_a_shape_that_explains_stays(four_corners):
    basins = Basins({"here": -50.0}, explains=-100.0)
    here = basins.at("here")
    assert growth(basins)._of_other_shape(here, FAR_OFF) is here
    assert basins.tried == 0


def test_a_shape_that_takes_little_away_is_not_looked_for_elsewhere(four_corners):
    basins = Basins(dict.fromkeys(range(4), -50.0) | {"here": -500.0}, explains=-100.0)
    here = basins.at("here")
    assert growth(basins)._of_other_shape(here, SimpleNamespace(reduced_chi2=4.5)) is here  # of 3.5, two are left
    assert basins.tried == 0
    assert growth(basins)._of_other_shape(here, SimpleNamespace(reduced_chi2=5.5)) is not here


@pytest.mark.parametrize(
    ("left", "promised", "leads"), [(2.9, 10.0, True), (20.0, 2000.0, False), (20.0, 3000.0, True)]
)
def test_far_from_an_explanation_the_next_effect_must_promise_much(left, promised, leads):
    """The right first effect leads near the next one; 500 degrees of freedom, of which 20 times as much is left."""
    model = SimpleNamespace(reduced_chi2=left, excess=500.0 * (left - 1.0))
    scores = (SimpleNamespace(gain=promised), SimpleNamespace(gain=5.0))
    looked = grow.Looked(fitted=model, signatures=(), screening=SimpleNamespace(scores=scores))
    assert looked.leads_on == leads


class Thetas:
    """Fits that end at the theta from which they start, with the score that it has."""

    case = None

    def __init__(self, scores):
        self.scores, self.fits = scores, 0

    def start(self, u, effects):
        return SimpleNamespace(u=u, effects=effects)

    def fit(self, state, **how):
        self.fits += 1
        return self.at(state)

    def at(self, state):
        return SimpleNamespace(state=state, score=self.scores[float(state.u[0])])


@pytest.mark.parametrize(("searched", "end", "fits"), [(0.8, 0.8, 1), (0.3, 0.2, 1), (0.2, 0.2, 0)])
def test_a_model_that_is_far_off_goes_to_a_better_theta_beside_its_effects(monkeypatch, searched, end, fits):
    beside = []

    def search_theta(case, rng, tick, *, effects, near):
        beside.append(effects)
        return near if searched == near[0] else np.array([searched])

    monkeypatch.setattr(grow, "search_theta", search_theta)
    thetas = Thetas({0.2: -900.0, 0.3: -950.0, 0.8: -60.0})
    effects = (SimpleNamespace(kind=SimpleNamespace(name="tracker_bias")),)
    model = thetas.at(thetas.start(np.array([0.2]), effects))
    found = growth(thetas)._from_another_theta(model)
    assert (found.state.u[0], thetas.fits) == (end, fits)
    assert beside == [effects] and found.state.effects == effects


@pytest.mark.parametrize(("left", "added"), [(2.0, 2), (11.0, 2), (15.0, 1)])
def test_what_took_long_goes_on_only_if_it_may_be_right(monkeypatch, left, added):
    pool = SimpleNamespace(count=0)
    costs = iter([left, 1.0])

    def confirm(*_, **__):
        pool.count += 2 * grow.LONGEST * PUSHES
        return (SimpleNamespace(name="one", fitted=SimpleNamespace(state=None)),)

    def looked(cost):
        p_value = 0.5 if cost <= 1.0 else 1e-9
        return SimpleNamespace(
            fitted=SimpleNamespace(reduced_chi2=cost), screening=SimpleNamespace(scores=()), signatures=(),
            p_value=p_value, leads_on=True,
        )  # fmt: skip

    monkeypatch.setattr(grow, "confirm", confirm)
    monkeypatch.setattr(grow, "unexplained", lambda base, model: model.reduced_chi2 > 3.0)
    monkeypatch.setattr(grow, "worth_adding", lambda base, last, candidates: candidates)
    monkeypatch.setattr(grow.Growth, "plain_from", lambda *_: None)
    monkeypatch.setattr(grow.Growth, "_model_with", lambda *_: SimpleNamespace(reduced_chi2=next(costs)))
    monkeypatch.setattr(grow.Growth, "_what_is_left", lambda self, model, *_: looked(model.reduced_chi2))
    case = SimpleNamespace(pool=pool, problems=range(PUSHES))
    growing = dc.replace(growth(SimpleNamespace(case=case)), kinds=(None,) * 3)
    assert len(growing._added_to(looked(70.0)).steps) == added


@pytest.mark.parametrize(("tests_cost", "effects"), [(1, 3), (grow.LONGEST + 1, 2)])
def test_what_costly_score_tests_found_is_fitted_but_no_more(monkeypatch, tests_cost, effects):
    """Two effects whose first takes long are known by the tests beside it: it would be a waste not to look."""
    pool = SimpleNamespace(count=0)
    fitter = SimpleNamespace(case=SimpleNamespace(pool=pool, problems=[None]))
    names = ["tether", "actuator_lag", "sloshing"]

    def looked(count):
        model = fitted(names[:count], -50.0).state
        return SimpleNamespace(
            fitted=SimpleNamespace(state=model, reduced_chi2=4.0), p_value=0.0, leads_on=True,
            signatures=(), screening=SimpleNamespace(scores=[len(model.effects)]),
        )  # fmt: skip

    def next_one(fitter, model, scores, tick, most):
        state = fitted(names[: scores[0] + 1], -40.0).state
        return [dc.replace(step(names[scores[0]])[0], fitted=SimpleNamespace(state=state))]

    def tests(self, model, before, alpha):
        pool.count += tests_cost if alpha > 0.0 else 0
        return looked(len(model.state.effects))

    monkeypatch.setattr(grow, "confirm", next_one)
    monkeypatch.setattr(grow, "worth_adding", lambda base, last, candidates: tuple(candidates))
    monkeypatch.setattr(grow, "unexplained", lambda base, model: True)
    monkeypatch.setattr(grow.Growth, "plain_from", lambda self, plain, candidate: None)
    monkeypatch.setattr(
        grow.Growth, "_model_with", lambda self, state, before: SimpleNamespace(state=state, reduced_chi2=4.0)
    )
    monkeypatch.setattr(grow.Growth, "_what_is_left", tests)
    growth = grow.Growth(fitter=fitter, kinds=range(24), alpha=0.01, rng=None, tick=lambda *stage: None)
    steps = growth._added_to(looked(0)).steps
    assert [one[0].name for one in steps] == names[:effects]


@pytest.mark.parametrize(
    ("p_value", "scatter", "alpha", "anew"),
    [(0.5, 1.0, 0.01, False), (1e-9, 1.0, 0.01, True), (0.5, 1.5 * grow.WIDE, 0.01, True), (1e-9, 9.0, 0.0, False)],
)
def test_score_tests_are_taken_anew_where_something_is_left_or_frictions_may_hide_it(
    monkeypatch, p_value, scatter, alpha, anew
):
    """Beside a tether, frictions of 7 % hid a drag whose change of the plain cell's pushes says nothing there."""
    monkeypatch.setattr(grow, "signatures", lambda fitter, model, kinds: ["anew"])
    monkeypatch.setattr(grow, "Fitter", lambda case: None)
    monkeypatch.setattr(
        grow.Looked,
        "at",
        classmethod(lambda cls, model, found, rng: SimpleNamespace(signatures=found, p_value=p_value)),
    )
    model = SimpleNamespace(state=State(u=np.zeros(2), effects=(), own=(), scatter=scatter))
    before = [SimpleNamespace(kind=None)]
    looked = growth(SimpleNamespace(case=None))._what_is_left(model, before, alpha)
    assert looked.signatures == (["anew"] if anew else before)
