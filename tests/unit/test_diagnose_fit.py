"""Gauss-Newton on pushes: the rounds in which the pushes' unknowns are held, and those after."""

import numpy as np
import pytest
from runs import shipped_pushes

from physid_drake.cell import CellConfig
from physid_drake.diagnose import case_of
from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.plain import coarse
from physid_drake.identify.config import ThetaConfig


@pytest.fixture(scope="module")
def fitter():
    config = CellConfig()
    config.contact.model = "point"
    return Fitter(coarse(case_of(shipped_pushes(3), config, ThetaConfig(), jobs=1)))


def test_unknowns_are_released_although_holding_them_had_nothing_more_to_gain(fitter):
    theta = fitter.case.thetas.space.to_unit(np.array(fitter.case.thetas.space.nominal))
    held = fitter.fit(fitter.start(np.asarray(theta)), rounds=3, careful=3, renew=True)
    again = fitter.fit(fitter.start(held.state.u), rounds=5, careful=3, like=held)
    assert again.reduced_chi2 < held.reduced_chi2 * 1.01
    assert any(np.abs(own).max() > 0.01 for own in again.state.own)
