"""When held-out gains confirm an effect, and which regimes a recording spans."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.cell import HandPath, Start
from physid_drake.diagnose import confirm
from physid_drake.diagnose.candidate import Candidate, push_scores, ranked, rivals
from physid_drake.diagnose.linear import LinearPush, Whitened, solve
from physid_drake.diagnose.model import EffectPoint, Fitted, State
from physid_drake.diagnose.regimes import _by_heading, _by_speed, speed_of
from physid_drake.effects import Effect, effect_named


def candidate(gains, *, degenerate=False, coordinates=1, left=1.0, in_order=False):
    return Candidate(
        score=SimpleNamespace(in_order=in_order),
        fitted=SimpleNamespace(reduced_chi2=left),
        gains=np.asarray(gains, dtype=float),
        degenerate=degenerate,
        coordinates=coordinates,
    )


@pytest.mark.parametrize(
    ("gains", "confirmed"),
    [
        ([3.0, 2.5, 4.0, 1.0, 2.0, 3.5, 0.5, 2.2], True),  # a little in every push
        ([0.1, -0.2, 0.3, 0.1, -0.1, 0.2, 0.0, 0.1], False),  # nothing
        (
            [-0.6, 6.4, -2.3, -0.9, -1.8, 8.0, -3.6, 10.5, 10.4],
            False,
        ),  # as a simulator's own error gives
        ([-1.0, -0.5, 120.0, 0.2, -1.5, 260.0, 90.0, -0.3, -0.2], True),  # a patch that three pushes cross
        ([-1.0, -0.5, 500.0, 0.2, -1.5, 0.3, -0.4, -0.3, -0.2], False),  # one odd push is no physics
        # Every push that feels it gains, one far more than the others.
        ([-0.8, -1.1, 12.8, -0.2, 0.5, 2.3, 1.4, 41.2, 9.9, 2.2, -0.4, 0.0, 3.2, 8.7, 0.2], True),
        ([-3.0, -2.0, -4.0, -1.0, -2.0, -3.5], False),
    ],
)
def test_held_out_gains_confirm_an_effect(gains, confirmed):
    assert candidate(gains).accepted is confirmed


@pytest.mark.parametrize(
    ("gains", "in_order", "confirmed"),
    [
        ([3.1, 2.3, 1.4, 1.3, 0.8, 1.0, -0.6, -2.7, 2.4], False, False),  # frictions that grow by 7 % a push
        ([3.1, 2.3, 1.4, 1.3, 0.8, 1.0, -0.6, -2.7, 2.4], True, True),
        (
            [0.5, 0.3, 0.4, 0.3, 0.8, 0.5, -0.6, -0.7, 0.4],
            True,
            False,
        ),  # what was in order may be so by another effect
    ],
)
def test_frictions_in_order_confirm_what_orders_them_if_left_out_pushes_gain(gains, in_order, confirmed):
    assert candidate(gains, in_order=in_order).accepted is confirmed


def test_an_effect_that_ran_to_nothing_is_not_confirmed():
    assert not candidate([5.0] * 8, degenerate=True).accepted
    assert not candidate([5.0] * 8, degenerate=True, in_order=True).accepted


def test_a_rival_is_one_whose_deficit_is_not_sure():
    rng = np.random.default_rng(0)
    best = candidate(20.0 + rng.standard_normal(10))
    near = candidate(best.gains + 2.0 * rng.standard_normal(10))
    far = candidate(best.gains - 5.0)
    assert rivals(best, (best, near, far)) == (near,)


def test_a_few_nats_make_nothing_sure_however_alike_all_pushes_say_them():
    """Simulators differ, too: 7 nats with a standard error of 2 made a lag of 2 ms out of a latency."""
    best = candidate(np.full(14, 2.0))
    assert rivals(best, (best, candidate(best.gains - 0.25)))
    assert not rivals(best, (best, candidate(best.gains - 0.35)))


def test_what_leaves_the_pushes_unexplained_is_no_rival_of_what_explains_them():
    gains = np.array([350.0, 370.0, 540.0, 1000.0, 1040.0, 1540.0, 1610.0, 20000.0])
    best = candidate(gains)
    for left, alike in ((1.2, True), (20.0, False)):
        other = candidate(0.5 * gains, left=left)  # a deficit that one push makes unsure
        assert rivals(best, (best, other)) == ((other,) if alike else ())
    assert rivals(candidate(gains, left=9.0), (other,)) == (other,)  # where nothing explains them, it is one


def test_the_simplest_of_those_that_do_as_well_comes_first():
    far_spring = candidate(np.full(10, 10.0), coordinates=4)
    tilt = candidate(np.full(10, 9.7), coordinates=2)  # 3 nats less with two coordinates fewer
    nothing = candidate(np.full(10, 9.9), coordinates=1, degenerate=True)
    assert ranked((far_spring, nothing, tilt)) == [tilt, far_spring, nothing]


def test_where_much_is_explained_two_laws_may_differ_by_more():
    spring, tilt = candidate(np.full(10, 100.0), coordinates=4), candidate(np.full(10, 98.8), coordinates=2)
    assert ranked((spring, tilt))[0] is tilt  # 12 nats less: 4 for two coordinates, 10 for a thousand explained


def test_what_does_worse_is_not_preferred_for_being_simple():
    spring, tilt = candidate(np.full(10, 10.0), coordinates=4), candidate(np.full(10, 9.0), coordinates=2)
    assert ranked((tilt, spring)) == [spring, tilt]


def fitted_to_a_shared_error(error, *, with_effect):
    """A linear model of pushes that all share ``error`` tolerances; the effect, if any, is free to explain it."""
    rng = np.random.default_rng(0)
    pushes = []
    for _ in range(8):
        column = rng.normal(size=(12, 1))
        shared = np.hstack([column, column]) if with_effect else column
        residual = error * column[:, 0] + rng.normal(size=12)
        pushes.append(
            LinearPush(residual=residual, shared=shared, own=np.zeros((12, 1)), noise=np.eye(12), friction=0)
        )
    std = np.array([np.inf, 1.0] if with_effect else [1.0])
    mean = np.zeros(len(std))
    return Fitted(
        state=State(
            u=np.zeros(0),
            effects=(EffectPoint(kind=Effect, point=np.zeros(1), free=(0,), origin=np.zeros(1)),) * with_effect,
            own=(np.zeros(1),) * 8,
            scatter=1.0,
        ),
        pushes=tuple(pushes), prior_mean=mean, prior_std=std,
        solution=solve(Whitened.of(pushes, 1.0), mean, std), predicted=(np.zeros(12),) * 8, score=0.0,
    )  # fmt: skip


@pytest.mark.parametrize(("error", "confirmed"), [(0.0, False), (1.0, False), (10.0, True)])
def test_what_goes_far_beyond_a_tolerance_is_not_excused_by_it(error, confirmed):
    plain, model = (fitted_to_a_shared_error(error, with_effect=w) for w in (False, True))
    gains = push_scores(model) - push_scores(plain)
    assert candidate(gains).accepted is confirmed
    assert gains.sum() == pytest.approx(0.5 * error**2, abs=3.0)


def pushes(speeds, headings):
    made = []
    for speed, heading in zip(speeds, headings, strict=True):
        ahead = np.array([np.cos(heading), np.sin(heading)])
        path = HandPath(times=np.array([0.0, 1.0]), velocities=np.array([speed * ahead] * 2), start=np.zeros(2))
        end = np.array([[0.1 * ahead[0], 0.1 * ahead[1], 0.0]])
        start = Start(pose=(0.0, 0.0, 0.0))
        made.append(SimpleNamespace(path=path, start=start, poses=end, moving=(0.0, np.inf)))
    return SimpleNamespace(problems=made)


def test_slow_and_fast_pushes_are_two_regimes():
    case = pushes([0.05, 0.4, 0.06, 0.5, 0.04, 0.6], [0.0] * 6)
    assert _by_speed(case) == ((4, 0, 2), (1, 3, 5))
    assert _by_heading(case) is None


def test_how_fast_a_hand_came_is_not_how_fast_it_pushes():
    """0.4 m/s until 0.5 s, then 0.03 m/s; the object moves from 0.6 s on."""
    case, problem = pushes([0.4], [0.0]), pushes([0.4], [0.0]).problems[0]
    knots, speeds = np.array([0.0, 0.45, 0.5, 2.0]), np.array([0.4, 0.4, 0.03, 0.03])
    problem.path = HandPath(times=knots, velocities=np.outer(speeds, [1.0, 0.0]), start=np.zeros(2))
    problem.moving = (0.6, 2.0)
    case.problems[0] = problem
    assert speed_of(case, 0) == pytest.approx(0.03)


def test_pushes_to_either_side_are_two_regimes():
    case = pushes([0.2] * 6, [0.1, 3.0, -0.1, 3.2, 0.0, 3.1])
    assert _by_speed(case) is None
    halves = _by_heading(case)
    assert {frozenset(half) for half in halves} == {frozenset({0, 2, 4}), frozenset({1, 3, 5})}


def test_few_pushes_span_no_regimes():
    case = pushes([0.05, 0.5, 0.04, 0.6], [0.0, 3.0, 0.1, 3.1])
    assert _by_speed(case) is None and _by_heading(case) is None


FITTER = SimpleNamespace(case=SimpleNamespace(pool=SimpleNamespace(count=0), problems=range(8)))  # of few rollouts


def acting_at(place):
    """State of a model whose last effect acts in a place, or in none."""
    return SimpleNamespace(effects=(SimpleNamespace(effect=lambda case: SimpleNamespace(place=place)),))


@pytest.mark.parametrize(
    ("place", "promised", "score", "first", "fits"),
    [
        ((0.1, 0.0), 60.0, 90.0, "magnet", 1),
        ((0.1, 0.0), 60.0, 40.0, "friction_patch", 1),
        ((0.1, 0.0), 40.0, 90.0, "friction_patch", 0),  # promises too little there
        (None, 60.0, 90.0, "friction_patch", 0),
    ],
)
def test_what_else_may_act_in_the_place_of_the_best_is_fitted_there(monkeypatch, place, promised, score, first, fits):
    """A magnet of 3 sigma was called a patch: of its own, wide grid of places none promised much."""
    patch, magnet = effect_named("friction_patch"), effect_named("magnet")
    test = SimpleNamespace(kind=magnet, gain=promised, in_order=False)
    tested, fitted = [], []

    def fit(fitter, before, one):
        fitted.append(one)
        return SimpleNamespace(reduced_chi2=1.0, score=score, state=acting_at(place))

    def candidate_at(fitter, one, model, point, plain):
        return Candidate(score=one, fitted=model, gains=np.full(8, model.score / 8), degenerate=False)

    def in_place(fitter, before, others, where):
        tested.extend(others)
        return [test] if where == (0.1, 0.0) else []

    monkeypatch.setattr(confirm, "_fit", fit)
    monkeypatch.setattr(confirm, "candidate_of", candidate_at)
    monkeypatch.setattr(confirm, "push_scores", lambda one: np.zeros(8))
    monkeypatch.setattr(confirm, "in_place", in_place)
    scores = [SimpleNamespace(kind=kind, gain=gain, in_order=False) for kind, gain in ((patch, 100.0), (magnet, 9.0))]
    best = candidate_at(None, scores[0], SimpleNamespace(reduced_chi2=1.1, score=80.0, state=acting_at(place)), 0, 0)
    step = confirm.Confirmation(fitter=FITTER, before=None, tick=lambda *said: None, found=[best])
    step.try_in_the_same_place(scores)
    assert step.found[0].name == first
    assert len(fitted) == fits
    assert tested == ([] if place is None else [magnet])


@pytest.mark.parametrize(("gains", "tried"), [([-9.0] * 8, 3), ([9.0] * 8, 2)])
def test_what_left_out_pushes_do_not_confirm_keeps_no_weaker_effect_from_a_try(monkeypatch, gains, tried):
    """Where a noise is taken to be what is left, every fit leaves no more than noise, also those of wrong effects."""
    kept = {"kept": (0,), "log_p": -5.0, "in_order": False}
    strong = {"tracker_bias": 100.0, "actuator_lag": 80.0, "uneven_support": 40.0}
    scores = [SimpleNamespace(gain=gain, kind=effect_named(name), **kept) for name, gain in strong.items()]
    fitted = SimpleNamespace(reduced_chi2=1.0, score=1000.0, state=acting_at(None))
    monkeypatch.setattr(confirm, "push_scores", lambda one: np.zeros(8))
    monkeypatch.setattr(confirm, "_fit", lambda fitter, before, one: fitted)
    judged = {"gains": np.array(gains), "degenerate": False}
    monkeypatch.setattr(
        confirm, "candidate_of", lambda fitter, one, fitted, *_: Candidate(score=one, fitted=fitted, **judged)
    )
    found = confirm.confirm(FITTER, SimpleNamespace(reduced_chi2=1.0, score=0.0), scores, lambda *said: None, most=4)
    assert len(found) == tried


@pytest.mark.parametrize(
    ("promised", "again"),
    [
        ([900.0, 800.0, 700.0, 600.0], [0, 1]),
        ([100.0, 800.0, 700.0, 900.0], [3, 0, 1]),  # what came of it may be a fit that went astray
        ([100.0], [0]),
        ([], []),
    ],
)
def test_the_effect_that_promised_most_is_tried_again_whatever_came_of_it(promised, again):
    found = [SimpleNamespace(score=SimpleNamespace(gain=gain)) for gain in promised]
    assert [found.index(one) for one in confirm._once_more(found)] == again


@pytest.mark.parametrize(
    ("effects", "before", "after", "promised", "explained", "again"),
    [
        ((), 2.5, 2.4, 50.0, False, True),  # alone: it may be in a wrong basin
        (("a",), 2.5, 2.4, 50.0, False, False),  # beside another that leaves little, of which it takes little
        (("a",), 2.5, 1.7, 50.0, False, True),
        (("a",), 9.0, 8.0, 50.0, False, True),  # far from an explanation linear steps mislead
        ((), 2.5, 1.2, 50.0, True, False),
        ((), 2.5, 1.2, 500.0, True, True),  # fell short of its promise
    ],
)
def test_a_fit_is_tried_again_where_that_may_find_more(effects, before, after, promised, explained, again):
    start = SimpleNamespace(reduced_chi2=before, score=0.0, state=SimpleNamespace(effects=effects))
    end = SimpleNamespace(reduced_chi2=after, score=25.0)
    one = SimpleNamespace(fitted=end, score=SimpleNamespace(gain=promised))
    assert confirm._may_do_better(start, one, explained) == again


@pytest.mark.parametrize(("again", "tried"), [(1.0, []), (15.0, ["tracker_latency", "sloshing"])])
def test_what_promised_much_is_tried_again_before_what_promises_little(monkeypatch, again, tried):
    kept = {"kept": (0,), "log_p": -5.0, "in_order": False}
    promised = {"tracker_bias": 1000.0, "tracker_latency": 200.0, "sloshing": 150.0}
    scores = [SimpleNamespace(gain=gain, kind=effect_named(name), **kept) for name, gain in promised.items()]
    made = []

    def fitted(name, left):
        made.append(name)
        return SimpleNamespace(reduced_chi2=left, score=-100.0 * left, state=acting_at(None))

    def judged(fitter, one, fitted, *_):
        return Candidate(score=one, fitted=fitted, gains=np.full(8, 9.0), degenerate=False)

    monkeypatch.setattr(confirm, "push_scores", lambda one: np.zeros(8))
    monkeypatch.setattr(confirm, "_fit", lambda fitter, before, one: fitted(one.kind.name, 15.0))
    monkeypatch.setattr(
        confirm, "_fit_from_afar", lambda fitter, before, one: fitted(one.kind.name + " again", again)
    )
    monkeypatch.setattr(confirm, "candidate_of", judged)
    monkeypatch.setattr(confirm, "_once_more", lambda found: [])
    before = SimpleNamespace(reduced_chi2=20.0, score=-2000.0, state=SimpleNamespace(effects=()))
    confirm.confirm(FITTER, before, scores, lambda *said: None, most=4)
    assert made == ["tracker_bias", "tracker_bias again", *tried]
