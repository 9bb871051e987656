"""When a law beside the catalogue takes a name away."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose import foils
from physid_drake.effects.foils import FOILS, HandClock


def fitter(*, has_hand=True):
    return SimpleNamespace(case=SimpleNamespace(around=SimpleNamespace(has_hand=has_hand)))


def test_what_needs_a_hand_is_not_tried_without_one(monkeypatch):
    tried = []
    monkeypatch.setattr(foils, "signatures", lambda fitter, model, kinds: tried.append(kinds) or [])
    monkeypatch.setattr(foils, "best_family", lambda every: SimpleNamespace(gain=0.0))
    without, model = SimpleNamespace(score=0.0), SimpleNamespace(score=25.0)
    for has_hand in (True, False):
        foils.better_foil(fitter(has_hand=has_hand), without, model, "viscous_drag", lambda *said: None)
    assert tried == [list(FOILS), [kind for kind in FOILS if kind is not HandClock]]


@pytest.mark.parametrize(
    ("promised", "held_out", "taken", "fits"),
    [
        (40.0, 130.0, True, 1),
        (40.0, 101.0, False, 1),  # by less than what the scores themselves are sure of
        (40.0, 70.0, False, 1),
        (20.0, 130.0, False, 0),  # not half of what the effect gained: not worth a fit
    ],
)
def test_a_foil_must_predict_left_out_pushes_better_than_the_effect(monkeypatch, promised, held_out, taken, fits):
    without, model, better = (
        SimpleNamespace(score=s, held_out=h) for s, h in ((0.0, 0.0), (25.0, 100.0), (30.0, held_out))
    )
    made = []

    def fit_with(fitter, before, one):
        made.append(one)
        return better

    best = SimpleNamespace(kind=FOILS[0], gain=promised)
    monkeypatch.setattr(foils, "FOILS", FOILS[:1])
    monkeypatch.setattr(foils, "signatures", lambda fitter, model, kinds: [best])
    monkeypatch.setattr(foils, "score", lambda model, one: one)
    monkeypatch.setattr(foils, "best_family", lambda every: every[0])
    monkeypatch.setattr(foils, "push_scores", lambda one: np.full(10, one.held_out / 10))
    monkeypatch.setattr(foils, "fit_with", fit_with)
    found = foils.better_foil(fitter(), without, model, "viscous_drag", lambda *said: None)
    assert (found is not None) == taken and len(made) == fits
    if found is not None:
        assert found.instead_of == "viscous_drag" and found.statement == FOILS[0].statement
        assert found.gain == pytest.approx(held_out - 100.0)
