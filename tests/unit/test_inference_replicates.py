"""Replicates on linear problems whose answer is known: chance has its stated rate, and what is there is seen."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from physid_drake.effects import Coordinate, Family
from physid_drake.effects.drag import ViscousDrag
from physid_drake.effects.fields import TableTilt
from physid_drake.inference import replicates
from physid_drake.inference.push import LinearPush, weighed
from physid_drake.inference.replicates import gain_of, gains_by_chance, p_value, surprise
from physid_drake.inference.scatter import SCATTERS
from physid_drake.inference.scores import Column, scores

PUSHES, ROWS, SHARED = 10, 20, 2
PRIOR = np.array([1.0, 1.0])
SCATTER = SCATTERS[len(SCATTERS) // 2]


def problem(rng, amount=0.0):
    """A fit at its optimum and two columns, of the first of which there is so much in the recording."""
    shapes = [(rng.normal(size=(ROWS, SHARED)), rng.normal(size=(ROWS, 2))) for _ in range(PUSHES)]
    families = Family(point=(0.0,), free=(0,)), Family(point=(0.0, 0.0), free=(0,))
    columns = [
        Column(
            kind=kind, family=family, index=0, coordinate=Coordinate(name="c", step=1.0, lower=lower),
            pushes=tuple(rng.normal(size=(PUSHES, ROWS))),
        )
        for kind, family, lower in zip((ViscousDrag, TableTilt), families, (0.0, -np.inf), strict=True)
    ]  # fmt: skip
    pushes = tuple(
        LinearPush(
            residual=amount * column + nuisance @ (PRIOR * rng.normal(size=2)) + rng.normal(size=ROWS),
            shared=shared,
            nuisance=nuisance,
        )
        for (shared, nuisance), column in zip(shapes, columns[0].pushes, strict=True)
    )
    hypothesis = SimpleNamespace(
        dimension=SHARED, mean=np.zeros(SHARED), known=np.arange(SHARED), precision=1e-2 * np.eye(SHARED),
        whitening=0.1 * np.eye(SHARED),
    )  # fmt: skip
    fit = SimpleNamespace(
        hypothesis=hypothesis, pushes=pushes, scatter=SCATTER, noise_scale=1.0, tail=1e6,
        point=SimpleNamespace(z=np.zeros(SHARED)),
        weighed=tuple(weighed(p.residual, p.shared, p.nuisance, PRIOR, 1.0, 1e6) for p in pushes),
    )  # fmt: skip
    return SimpleNamespace(priors=lambda scatter: [PRIOR] * PUSHES), fit, columns


def test_chance_has_its_rate(monkeypatch):
    monkeypatch.setattr(replicates, "REPLICATES", 200)
    rng = np.random.default_rng(0)
    values = [p_value(*gains_by_chance(*problem(rng), rng)) for _ in range(150)]
    assert stats.kstest(values, "uniform").pvalue > 0.01
    assert np.mean(np.array(values) < 0.05) == pytest.approx(0.05, abs=0.05)


def test_what_is_there_is_seen_and_the_wrong_sign_is_not():
    rng = np.random.default_rng(1)
    assert p_value(*gains_by_chance(*problem(rng, amount=0.5), rng)) < 1e-6
    seen, chance = gains_by_chance(*problem(rng, amount=-0.5), rng)  # no less than none, of a drag
    assert p_value(seen, chance) > 1e-3


def test_the_score_test_finds_how_much_there_is():
    fitter, fit, columns = problem(np.random.default_rng(2), amount=0.5)
    best = scores(fitter, fit, columns)[0]
    assert best.kind is ViscousDrag
    assert best.point[0] == pytest.approx(0.5, abs=0.25)
    assert best.gain > 5.0
    wrong = scores(fitter, fit, columns[1:])[0]
    assert wrong.gain < 0.5 * best.gain


def test_a_value_has_the_probability_of_an_exponential_tail_or_its_rank():
    chance = np.random.default_rng(3).exponential(2.0, size=20_000)
    far, middle, none = np.exp(-surprise(np.array([40.0, np.median(chance), 0.0]), chance))
    assert far == pytest.approx(np.exp(-20.0), rel=1.0)
    assert (middle, none) == pytest.approx((0.5, 1.0), abs=0.01)


def test_surprise_is_that_of_an_exponential_tail_and_goes_back():
    draws = np.random.default_rng(3).exponential(2.0, size=3000)
    asked = np.array([4.0, 10.0, 30.0])
    assert surprise(asked, draws) == pytest.approx(asked / 2.0, rel=0.1)
    assert surprise(np.array([-np.inf]), draws)[0] == 0.0
    assert surprise(np.array([gain_of(9.0, draws)]), draws)[0] == pytest.approx(9.0)


def test_an_effect_that_gains_much_by_chance_does_not_hide_one_that_does_not():
    rng = np.random.default_rng(4)
    chance = {"wide": rng.exponential(6.0, size=300), "narrow": rng.exponential(0.5, size=300)}
    assert p_value({"wide": 8.0, "narrow": 12.0}, chance) < 1e-4
    assert p_value({"wide": 8.0, "narrow": 0.2}, chance) > 0.1
