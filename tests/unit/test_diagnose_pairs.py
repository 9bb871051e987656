"""Which of several pairs of effects is taken, and what is a rival of what."""

import dataclasses as dc
from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose import pairs
from physid_drake.diagnose.candidate import Candidate

PUSHES = 8
TETHER, TILT, SLOSHING, DRAG = (SimpleNamespace(name=name) for name in ("tether", "table_tilt", "sloshing", "drag"))
COORDINATES = {"tether": 3, "table_tilt": 2, "sloshing": 1, "drag": 1}


@dc.dataclass(frozen=True, eq=False)
class Named:
    """A score test that only says of what."""

    kind: SimpleNamespace


def model(score, chi2=1.0):
    return SimpleNamespace(each=np.full(PUSHES, score), reduced_chi2=chi2)


def pair_of(first, second, score, *, chi2=1.0, adds=(20.0, 20.0)):
    """A pair that predicts each left-out push with ``score``; each effect adds so much beside the other one."""
    fitted = model(score, chi2)
    kinds = (first, second)
    candidates = tuple(
        Candidate(
            score=SimpleNamespace(kind=kind, in_order=False), fitted=fitted,
            gains=np.full(PUSHES, gain), degenerate=False, coordinates=COORDINATES[kind.name],
        )
        for kind, gain in zip(kinds, adds, strict=True)
    )  # fmt: skip
    alone = (fitted.each - adds[1], fitted.each - adds[0])
    scores = tuple(Named(kind) for kind in kinds)
    return pairs.FittedPair(pair=scores, fitted=fitted, candidates=candidates, alone=alone)


@pytest.fixture
def confirmed(monkeypatch):
    """Confirms pairs that are given instead of fitted; returns those, and how many were asked for."""

    def of(*made, cost_each=10, most=1000, plain=6.0):
        pool = SimpleNamespace(count=0)
        left = iter(made)

        judged = {}

        def fitted(fitter, plain, pair):
            pool.count += cost_each
            judged[pair] = next(left)
            return judged[pair].fitted

        monkeypatch.setattr(pairs, "push_scores", lambda one: one.each)
        monkeypatch.setattr(pairs, "unexplained", lambda plain, one: one.reduced_chi2 > 1.5)
        monkeypatch.setattr(pairs, "promising", lambda plain, scores: [one.pair for one in made])
        monkeypatch.setattr(pairs, "_model_with", fitted)
        monkeypatch.setattr(pairs, "_judged", lambda fitter, pair, model: judged[pair])
        fitter = SimpleNamespace(case=SimpleNamespace(pool=pool))
        found = pairs.confirmed_pairs(fitter, model(-50.0, plain), (), lambda *said: None, most=most)
        return found, pool.count // cost_each

    return of


def names(pair):
    return [c.name for c in pair.candidates]


def test_the_simplest_of_the_pairs_that_do_as_well_is_taken(confirmed):
    far_spring, tilted = pair_of(TETHER, SLOSHING, 10.0), pair_of(SLOSHING, TILT, 9.8)
    found, _ = confirmed(far_spring, tilted)
    assert [names(one) for one in found] == [["sloshing", "table_tilt"], ["tether", "sloshing"]]


def test_an_effect_that_takes_the_place_of_another_is_its_rival(confirmed):
    found, _ = confirmed(pair_of(TETHER, SLOSHING, 10.0), pair_of(SLOSHING, TILT, 9.8))
    liquid, tilt = pairs.steps_of(found)
    assert [c.name for c in liquid] == ["sloshing"]
    assert [c.name for c in tilt] == ["table_tilt", "tether"]
    # Both over the liquid alone: 20 for the tilt, and 0.2 more for the spring.
    assert tilt[1].gains == pytest.approx(np.full(PUSHES, 20.2))


def test_a_pair_of_two_other_effects_is_nobodys_rival(confirmed):
    found, _ = confirmed(pair_of(TILT, SLOSHING, 10.0), pair_of(TETHER, DRAG, 9.9))
    assert [len(step) for step in pairs.steps_of(found)] == [1, 1]


@pytest.mark.parametrize("bad", [{"chi2": 2.0}, {"adds": (20.0, -1.0)}])
def test_a_pair_that_explains_too_little_or_has_an_idle_member_is_none(confirmed, bad):
    found, asked = confirmed(pair_of(TILT, SLOSHING, 10.0, **bad))
    assert (found, asked) == ([], 1)


def test_no_further_pair_is_fitted_beyond_the_budget(confirmed):
    made = [pair_of(TILT, SLOSHING, 10.0), pair_of(TETHER, SLOSHING, 10.0), pair_of(TILT, DRAG, 10.0)]
    assert confirmed(*made, cost_each=10, most=15)[1] == 2


def test_no_pair_is_fitted_where_none_could_promise_anything(confirmed):
    assert confirmed(pair_of(TILT, SLOSHING, 10.0), plain=0.9) == ([], 0)
    assert confirmed(pair_of(TILT, SLOSHING, 10.0), plain=1.1)[1] == 1


class Fits:
    """Leaves such a cost after the rounds in which the pushes' unknowns are held."""

    def __init__(self, left):
        self.left, self.rounds = left, 0
        self.case = None

    def start(self, u, effects):
        return effects

    def fit(self, state, *, rounds, careful=0, renew, like=None):
        self.rounds += rounds
        return SimpleNamespace(reduced_chi2=self.left, state=state)


@pytest.mark.parametrize(
    ("before", "left", "rounds"),
    [
        (100.0, 20.0, pairs.ROUNDS),
        (100.0, 60.0, pairs.CAREFUL),
        # Half of what noise does not account for, which is little here.
        (1.8, 1.3, pairs.ROUNDS),
        (1.8, 1.5, pairs.CAREFUL),
    ],
)
def test_a_pair_that_leads_nowhere_is_given_up_early(monkeypatch, before, left, rounds):
    monkeypatch.setattr(pairs, "start_of", lambda fitter, one: one)
    monkeypatch.setattr(pairs, "scanned_start", lambda fitter, plain, one, beside: (one, None))
    fits = Fits(left)
    plain = SimpleNamespace(reduced_chi2=before, state=SimpleNamespace(u=None))
    assert (pairs._model_with(fits, plain, (TILT, DRAG)) is None) == (rounds < pairs.ROUNDS)
    assert fits.rounds == rounds
