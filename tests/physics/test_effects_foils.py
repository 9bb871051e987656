"""Laws beside the catalogue against closed forms. Measured errors stand beside the tolerances."""

import math

import numpy as np
import pytest
from motions import MU, G, end, slide
from scipy.integrate import quad
from scipy.optimize import brentq

from physid_drake.cell import HandPath
from physid_drake.effects import PushFacts
from physid_drake.effects.foils import FrictionByDistance, HandClock


@pytest.mark.parametrize("model", ["point", "hydroelastic"])
@pytest.mark.parametrize(("ratio", "length"), [(0.5, 0.02), (2.0, 0.05)])
def test_a_slide_whose_friction_changes_on_the_way_ends_where_its_energy_is_spent(ratio, length, model):
    def spent(stop):
        along, _ = quad(lambda s: ratio ** -math.expm1(-s / length), 0.0, stop)
        return MU * G * along - 0.5 * 0.5**2

    moved = end(slide(FrictionByDistance(ratio=ratio, length=length), model=model))[0]
    assert moved == pytest.approx(brentq(spent, 1e-3, 1.0), rel=3e-3)  # measured 1.3e-3


def test_the_distance_counts_anew_in_each_rollout():
    law = FrictionByDistance(ratio=0.5, length=0.02)
    assert end(slide(law)) == pytest.approx(end(slide(law)), abs=0.0)


@pytest.mark.parametrize("origin", [0.0, 1.7e9])
@pytest.mark.parametrize("rate", [-0.02, 0.01])
def test_a_hand_whose_clock_runs_fast_is_where_it_says_that_it_will_be(rate, origin):
    path = HandPath(
        times=origin + np.array([0.1, 0.2, 0.8, 0.9]),
        velocities=np.outer([0.0, 0.3, 0.3, 0.0], [0.8, 0.6]),
        start=np.array([0.1, -0.2]),
    )
    other = HandClock(rate=rate).hand(path, PushFacts(order=0, mass=1.0, polar=1e-3))
    since = np.linspace(0.0, 0.75, 31)  # since it sets out, by the tracker's clock
    there, said = other.positions(origin + 0.1 + since), path.positions(origin + 0.1 + (1.0 + rate) * since)
    np.testing.assert_allclose(there, said, atol=1e-6)  # measured 6e-8 with stamps of 1.7e9 s, 6e-17 otherwise
