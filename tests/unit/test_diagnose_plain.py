"""Where theta is looked for."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose import plain
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
