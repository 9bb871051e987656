"""Where theta is looked for."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose import plain
from physid_drake.pushes.misfit import FAILED
from physid_drake.space import Parameter, ParameterSpace

SPACE = ParameterSpace(
    parameters=(
        Parameter(name="support_friction", unit="-", lower=0.0, upper=1.0, prior_mean=0.4),
        Parameter(name="hand_friction", unit="-", lower=0.0, upper=1.0, prior_mean=0.2),
    )
)
TRUE = np.array([0.31, 0.77])


class Bowl:
    """Rollouts whose features are theta's distance from the true one."""

    effects: tuple = ()

    def __init__(self, case):
        self.case = case

    def start(self, u, effects=()):
        Bowl.effects = effects
        return u

    def task(self, state, i):
        return state

    def vectors(self, tasks):
        return [np.asarray(SPACE.from_unit(u)) for u in tasks]


@pytest.fixture
def case(monkeypatch):
    monkeypatch.setattr(plain, "Fitter", Bowl)
    features = [SimpleNamespace(recorded=TRUE)] * 8
    return SimpleNamespace(thetas=SimpleNamespace(space=SPACE), problems=[None] * 8, features=features)


def searched(case, **given):
    said = []
    u = plain.search_theta(case, np.random.default_rng(0), lambda stage, done, total: said.append(stage), **given)
    return np.asarray(SPACE.from_unit(u)), u, said[0]


def test_the_search_ends_nearer_than_where_people_would_start(case):
    theta, _, stage = searched(case)
    assert np.linalg.norm(theta - TRUE) < 0.1 < np.linalg.norm(SPACE.nominal - TRUE)
    assert Bowl.effects == () and stage == "greedy entropy search"


def test_a_push_that_diverges_takes_nothing_from_what_the_others_say(case, monkeypatch):
    simulate = Bowl.vectors
    found = searched(case)[1]

    def one_lost(self, tasks):
        return [np.full(2, FAILED), *simulate(self, tasks[1:])]

    monkeypatch.setattr(Bowl, "vectors", one_lost)
    np.testing.assert_allclose(searched(case)[1], found, atol=1e-6)


@pytest.mark.parametrize(("fails", "lost"), [(lambda u: True, (2, 5)), (lambda u: u[0] < 0.7, ()), (None, ())])
def test_what_diverges_at_every_theta_is_lost(case, monkeypatch, fails, lost):
    """Pushes 2 and 5 do at all, at some, at no thetas."""
    monkeypatch.setattr(Bowl, "task", lambda self, state, i: (i, state))
    made = []

    def vectors(self, tasks):
        made.append(len(tasks))
        return [np.full(2, FAILED) if fails and i in (2, 5) and fails(u) else np.zeros(2) for i, u in tasks]

    monkeypatch.setattr(Bowl, "vectors", vectors)
    assert plain.lost_pushes(case) == lost
    assert made[0] == 8 and set(made[1:]) <= {2, 1}


def test_effects_stay_in_the_cell_meanwhile(case):
    effects = (SimpleNamespace(kind=SimpleNamespace(name="tracker_bias")),)
    _, _, stage = searched(case, effects=effects)
    assert Bowl.effects == effects and stage == "greedy entropy search beside tracker_bias"


def test_what_nothing_is_better_than_is_returned_as_it_was_given(case):
    near = np.asarray(SPACE.to_unit(TRUE))
    assert searched(case, near=near)[1] is near


def test_what_is_given_is_left_for_something_better(case):
    theta, u, _ = searched(case, near=np.array([0.95, 0.05]))
    assert u[0] != 0.95 and np.linalg.norm(theta - TRUE) < 0.1


@pytest.mark.parametrize(
    ("loudness", "few"),
    [([50.0, 7.0, 7.0, 5.0, 5.0, 5.0, 2.0, 1.0], True), ([9.0, 8.0, 7.0, 6.0, 5.0], False), ([9.0], False)],
)
def test_what_a_quarter_of_the_pushes_leaves_is_odd(loudness, few):
    pushes = tuple(SimpleNamespace(residual=np.full(6, size)) for size in loudness)
    assert plain._few_are_odd(SimpleNamespace(pushes=pushes)) == few


class Fork:
    """Two pushes tell theta, and a third goes the other way from everywhere but near the truth.

    A fit goes to where it leaves least, with each push as noisy as its features say.
    """

    def __init__(self, case):
        self.case = case
        self.noise = [one.noise[0, 0] for one in case.features]

    def start(self, u):
        return u

    def _left(self, u):
        odd = 0.0 if abs(u - 0.7) < 0.1 else 50.0 + 10.0 * (1.0 - u)
        return np.array([5.0 * abs(u - 0.7), 5.0 * abs(u - 0.7), odd])

    def fit(self, u, **_):
        grid = np.linspace(max(0.0, u - 0.3), min(1.0, u + 0.3), 61)
        near = [v for v in grid if (abs(v - 0.7) < 0.1) == (abs(u - 0.7) < 0.1)] if self.noise[2] == 1.0 else grid
        costs = [float(np.sum(self._left(v) ** 2 / self.noise)) for v in near]
        best = near[int(np.argmin(costs))]
        pushes = tuple(SimpleNamespace(residual=np.array([left])) for left in self._left(best))
        return SimpleNamespace(state=SimpleNamespace(u=best), pushes=pushes, score=-min(costs))


def test_one_push_that_goes_the_other_way_does_not_keep_theta_from_the_others(monkeypatch):
    monkeypatch.setattr(plain, "Fitter", Fork)

    @dataclass(frozen=True)
    class One:
        noise: np.ndarray

    @dataclass(frozen=True)
    class Case:
        features: tuple

    case = Case(features=(One(np.eye(1)),) * 3)
    stuck = Fork(case).fit(0.95)
    assert stuck.state.u > 0.9
    assert plain._without_the_odd(case, stuck).state.u == pytest.approx(0.7, abs=0.02)


class Flat:
    """A plain cell that fits end where they begin, off by how far that is from 0.3."""

    loudness = 100.0

    def __init__(self, case):
        pass

    def start(self, u):
        return u

    def fit(self, u, **_):
        return self.seen_from(None, getattr(u, "u", u))

    def linearise(self, u, **_):
        return self.seen_from(None, u)

    def seen_from(self, model, u, **_):
        left = self.loudness * abs(float(np.mean(u)) - 0.3)
        pushes = (SimpleNamespace(residual=np.array([left])),) * 4
        return SimpleNamespace(state=SimpleNamespace(u=u), pushes=pushes, reduced_chi2=left**2, score=-(left**2))


@pytest.mark.parametrize(("searched", "by_hand", "ends"), [(0.9, 0.4, 0.4), (0.35, 0.4, 0.35), (0.9, 0.301, 0.301)])
def test_far_from_an_explanation_theta_also_starts_where_people_would(monkeypatch, searched, by_hand, ends):
    nominal = SimpleNamespace(nominal=np.array([by_hand]), to_unit=lambda theta: theta)
    case = SimpleNamespace(thetas=SimpleNamespace(space=nominal), problems=[None] * 4)
    monkeypatch.setattr(plain, "Fitter", Flat)
    monkeypatch.setattr(plain, "search_theta", lambda *_: np.array([searched]))
    monkeypatch.setattr(plain, "least_squares", lambda case, at: at)
    assert plain.fit_plain(case, np.random.default_rng(0), lambda *_: None).state.u == pytest.approx(ends)
