"""Frictions that wander along the way: found where they are drawn, and not where errors are white."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.inference.process_noise import EVEN_SURFACES, learned
from physid_drake.inference.push import NO_TAIL, LinearPush

PUSHES, ROWS, HATS = 12, 30, 7
PRIOR = np.array([1.0])


def left(table, tip, seed=0):
    """A fit that leaves white noise, and so much of two sets of columns."""
    rng = np.random.default_rng(seed)
    found = [(30.0 * rng.normal(size=(ROWS, HATS)), 30.0 * rng.normal(size=(ROWS, HATS))) for _ in range(PUSHES)]
    pushes = []
    for w, v in found:
        nuisance = rng.normal(size=(ROWS, 1))
        wandering = table * w @ rng.normal(size=HATS) + tip * v @ rng.normal(size=HATS)
        residual = rng.normal(size=ROWS) + nuisance @ rng.normal(size=1) + wandering
        pushes.append(LinearPush(residual=residual, shared=np.zeros((ROWS, 0)), nuisance=nuisance))
    fit = SimpleNamespace(
        pushes=pushes, noise_scale=1.0, tail=NO_TAIL, point=SimpleNamespace(nuisance=(), z=None),
        hypothesis=SimpleNamespace(physics=lambda z: None),
    )  # fmt: skip
    predictor = SimpleNamespace(wanders=lambda nuisance, physics: found)
    return SimpleNamespace(predictor=predictor, least=1.0, priors=lambda scatter: [PRIOR] * PUSHES), fit


@pytest.mark.parametrize("seed", range(5))
def test_white_errors_are_no_process_noise(seed):
    rough, added = learned(*left(0.0, 0.0, seed))
    assert rough == EVEN_SURFACES and rough.is_none
    assert all(not one.any() for one in added)


def test_what_wanders_is_found_where_it_is_and_adds_its_covariance():
    fitter, fit = left(0.08, 0.0)
    rough, added = learned(fitter, fit)
    assert rough.table == 0.08 and rough.tip <= 0.02
    w, v = fitter.predictor.wanders(None, None)[0]
    np.testing.assert_allclose(added[0], rough.table**2 * w @ w.T + rough.tip**2 * v @ v.T)
    assert learned(*left(0.0, 0.16))[0].tip == 0.16
