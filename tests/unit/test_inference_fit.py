"""Fits on the recordings that ship with the project, whose truth is known."""

import numpy as np
import pytest
from runs import shipped_pushes

from physid_drake.diagnose.hypotheses import halved, with_one_more
from physid_drake.diagnose.proposals import Proposal, with_part
from physid_drake.effects.drag import ViscousDrag
from physid_drake.effects.fields import TableTilt
from physid_drake.effects.friction import AnisotropicTable
from physid_drake.identify.baseline import baseline, settled, with_tolerances
from physid_drake.inference.fit import Fitter
from physid_drake.inference.multistart import reseated
from physid_drake.inference.predictions import Predictor
from physid_drake.inference.push import normal_equations
from physid_drake.inference.rollouts import Ask, Physics
from physid_drake.inference.scores import columns, scores
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig

TRUTH = {"hand_friction": 0.22, "support_friction": 0.27}  # eraser_reference
GRAIN, ANGLE = 1.187, 1.679  # sealed_01


def fitter_of(recording):
    case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=1)
    return Fitter(case, Predictor(case))


def plain_of(fitter):
    return baseline(fitter, np.random.default_rng(0))


@pytest.fixture(scope="module")
def eraser():
    fitter = fitter_of(shipped_pushes(6))
    return fitter, plain_of(fitter)


@pytest.fixture(scope="module")
def grain():
    fitter = fitter_of(shipped_pushes(8, "sealed_01"))
    return fitter, with_tolerances(fitter, plain_of(fitter))


def test_the_baseline_is_identified_within_its_own_uncertainty(eraser):
    fitter, fit = eraser
    space, h = fitter.case.thetas.space, fit.hypothesis
    precision, _ = normal_equations(fit.weighed, h.mean - fit.point.z, h.precision)
    stds = np.sqrt(np.diag(np.linalg.inv(precision)))
    truth = np.asarray(space.to_unit([TRUTH.get(p.name, p.prior_mean) for p in space.parameters]))
    assert fit.noise_scale == 1.0
    assert np.all(np.abs(fit.point.z - truth)[1:] < 4.0 * stds[1:])
    assert h.theta(fit.point.z)[1:] == pytest.approx([0.22, 0.27], rel=0.03)


def test_a_fit_is_where_no_step_gains(eraser):
    fitter, fit = eraser
    again = fitter.fitted([fit.again()], 3)[0]
    assert abs(again.cost - fit.cost) < 1.0
    assert settled(fitter, fit, np.random.default_rng(1)).log_likelihood == pytest.approx(fit.log_likelihood, abs=1.0)


def test_a_push_on_the_wrong_one_of_its_ways_is_put_back(eraser):
    fitter, fit = eraser
    off = tuple(nuisance + 2.0 for nuisance in fit.point.nuisance)
    point = fitter.points([fit.hypothesis], [fit.point.z], [off])[0]
    lost = fitter.started([fit.hypothesis], [point], [None], fit.tail)[0]
    assert lost.cost > fit.cost + 10.0
    assert reseated(fitter, lost, np.random.default_rng(0)).cost < fit.cost + 5.0


def test_null_effects_change_not_a_bit(eraser):
    fitter, fit = eraser
    h, point = fit.hypothesis, fit.point
    null = with_part(h, TableTilt, np.zeros(2))
    z = np.concatenate([point.z, np.zeros(2)])
    asks = [
        Ask(0, Physics(one.theta(at), one.effects(at)), point.nuisance[0]) for one, at in ((h, point.z), (null, z))
    ]
    plain, with_null = fitter.predictor.vectors(asks)
    assert np.array_equal(plain, with_null)


def test_score_tests_and_fits_find_the_grain_and_its_size(grain):
    fitter, plain = grain
    found = columns(fitter, plain, [AnisotropicTable, TableTilt, ViscousDrag])
    assert scores(fitter, plain, found)[0].kind is AnisotropicTable
    fits = with_one_more(fitter, plain, found)
    gains = {f.hypothesis.name: float((fitter.held_out(f) - fitter.held_out(plain)).sum()) for f in fits}
    effect = fits[0].hypothesis.effects(fits[0].point.z)[0]
    assert max(gains, key=gains.get) == "anisotropic_table"
    assert gains["anisotropic_table"] > 2.0 * max(gains["table_tilt"], gains["viscous_drag"])
    assert (effect.ratio, effect.angle) == pytest.approx((GRAIN, ANGLE), rel=0.02)


def test_a_fit_starts_where_it_is_proposed_and_stays_within_bounds(grain):
    fitter, plain = grain
    h = with_part(plain.hypothesis, ViscousDrag, np.array([0.5]))
    n = plain.hypothesis.simulated
    z = np.concatenate([plain.point.z[:n], [0.5], plain.point.z[n:]])
    fit = halved(fitter, plain, [Proposal(hypothesis=h, z=z)] * 2)[0]
    least, most = h.bounds
    assert np.all((fit.point.z >= least) & (fit.point.z <= most))
    assert fit.log_likelihood >= plain.log_likelihood - 3.0  # a drag may be none


def test_what_the_twin_cannot_roll_out_is_no_point(eraser):
    fitter, fit = eraser
    h = with_part(fit.hypothesis, TableTilt, np.zeros(2))
    steep = np.concatenate([fit.point.z, [1.4, 0.0]])  # the object slides off the table
    assert fitter.points([h], [steep], [fitter.at_rest()]) == [None]
