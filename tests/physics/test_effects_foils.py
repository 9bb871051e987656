"""Laws beside the catalogue against closed forms. Measured errors stand beside the tolerances."""

import math

import pytest
from motions import MU, G, end, slide
from scipy.integrate import quad
from scipy.optimize import brentq

from physid_drake.effects.foils import FrictionByDistance


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
