"""How a diagnosis' estimates vary together, from a fit made by hand."""

import dataclasses as dc
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from physid_drake.diagnose import estimates
from physid_drake.diagnose.decide import CONFIRMED
from physid_drake.diagnose.estimates import correlation_of, parameters_of, theta_of
from physid_drake.effects import Family, Surroundings, known_effects
from physid_drake.effects.body import Restitution, UnevenSupport
from physid_drake.effects.drag import QuadraticDrag
from physid_drake.effects.fields import TableTilt, Tether
from physid_drake.effects.friction import FrictionPatch
from physid_drake.inference.hypothesis import Hypothesis, Part
from physid_drake.inference.push import LinearPush
from physid_drake.inference.replicates import gain_of
from physid_drake.inference.scores import Column
from physid_drake.pushes.theta import CELL_ERROR
from physid_drake.space import Parameter, ParameterSpace

AROUND = Surroundings(
    mass=0.2, friction=0.3, size=np.array([0.12, 0.05]), height=0.03, region=np.array([[-0.5, -0.5], [0.5, 0.5]]),
    top_speed=0.5, pushes=10, has_hand=True, rolls=False,
)  # fmt: skip
FRICTION = Parameter(name="support_friction", unit="-", lower=0.05, upper=1.0, scale="log", prior_mean=0.3)
SPACE = ParameterSpace(parameters=(FRICTION,))


def fitted(*parts, covariance):
    """A fitter, and a fit with one unknown of theta, these effects, and a tolerance that is none of the estimates."""
    hypothesis = Hypothesis(space=SPACE, around=AROUND, parts=parts, tolerances=1)
    whole = np.eye(hypothesis.dimension)
    whole[:-1, :-1] = covariance
    z = np.concatenate([[0.5], *(np.array(p.point)[list(p.free)] for p in parts), [0.0]])
    fit = SimpleNamespace(hypothesis=hypothesis, point=SimpleNamespace(z=z), pushes=range(10))
    return SimpleNamespace(covariance=lambda fit: whole), fit


def point(kind, free):
    return Part(kind=kind, point=(0.0,) * len(kind.chart(AROUND)), free=free)


def test_theta_and_an_effect_whose_chart_is_its_parameters_vary_as_the_fit_says():
    stds = np.array([0.02, 0.003, 0.004])
    wanted = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, -0.3], [0.0, -0.3, 1.0]])
    names, found = correlation_of(*fitted(point(TableTilt, (0, 1)), covariance=wanted * np.outer(stds, stds)))
    assert names == ("theta.support_friction", "table_tilt.x", "table_tilt.y")
    np.testing.assert_allclose(found, wanted, atol=3.0 / np.sqrt(2000))
    assert found[0, 1] == pytest.approx(0.9, abs=0.015)


def test_no_interval_of_theta_is_narrower_than_the_cells_own_error():
    for spread, widths in ((1e-6, (0.005, 0.02)), (0.05, (0.1, 0.3))):
        fitter, fit = fitted(covariance=np.array([[spread**2]]))
        estimate = theta_of(fitter, fit, fit)["support_friction"]
        assert estimate.identifiable
        # At the middle of its range; a deviation is 1 %, or 0.05 of three times log(20).
        reach = np.log(estimate.ci90[1] / estimate.value)
        assert widths[0] < reach < widths[1]


@pytest.mark.parametrize("share", [0.02, 0.7, 1.1])
def test_an_effect_that_is_there_is_more_than_nothing_however_little_is_known_of_it(share):
    """Its logarithm is normal; ten pushes with two unknowns leave eight degrees of freedom."""
    drag = Part(kind=QuadraticDrag, point=(5.0,), free=(0,))
    told = parameters_of(*fitted(drag, covariance=np.diag([0.01, 5.0 * share]) ** 2), 0)["coefficient"]
    assert told.value == 5.0
    reach = np.hypot(share * stats.t.ppf(0.95, 8), CELL_ERROR * stats.norm.ppf(0.95))
    np.testing.assert_allclose(np.log(np.array(told.ci90) / 5.0), [-reach, reach], rtol=0.15)  # of 400 draws


def test_no_interval_of_an_effect_is_narrower_than_the_cells_own_error():
    chart = FrictionPatch.chart(AROUND)
    patch = Part(kind=FrictionPatch, point=(np.log(2.0), 0.1, -0.05, np.log(0.04)), free=(0, 1, 2, 3))
    told = parameters_of(*fitted(patch, covariance=1e-12 * np.eye(5)), 0)
    reach = CELL_ERROR * stats.norm.ppf(0.95)  # however few pushes
    assert [c.name for c in chart] == ["ratio", "x", "y", "radius"]
    strength, radius = (np.log(np.array(told[name].ci90) / told[name].value) for name in ("ratio", "radius"))
    np.testing.assert_allclose(strength, np.log(2.0) * reach * np.array([-1, 1]), rtol=0.15)
    np.testing.assert_allclose(radius, reach * np.array([-1, 1]), rtol=0.15)
    between = chart[1].std  # of two places that are looked at
    np.testing.assert_allclose(told["x"].ci90, 0.1 + between * reach * np.array([-1, 1]), rtol=0.15, atol=2e-4)


def test_a_drag_over_a_mass_that_nobody_weighed_varies_with_it():
    """Known to a factor of two at a deviation, both, and their ratio to a hundredth: no draw ends at no drag."""
    drag = Part(kind=QuadraticDrag, point=(5.0,), free=(0,))
    stds = np.array([0.1, 0.7 * 5.0])
    ratio = np.array([[1.0, 0.9999], [0.9999, 1.0]])
    _, found = correlation_of(*fitted(drag, covariance=ratio * np.outer(stds, stds)))
    assert found[0, 1] > 0.999  # 0.991 where the draws that end at nothing are tied


def test_what_does_not_vary_or_is_no_single_number_is_left_out():
    names, found = correlation_of(*fitted(point(TableTilt, (0,)), covariance=1e-4 * np.eye(2)))
    assert names == ("theta.support_friction", "table_tilt.x") and found.shape == (2, 2)
    support = point(UnevenSupport, (0,))
    names, found = correlation_of(*fitted(support, covariance=1e-4 * np.eye(2)))
    assert names == ("theta.support_friction",)
    np.testing.assert_allclose(found, 1.0)


def found_with(*columns, chance=None):
    """A search of twelve pushes of three numbers each, whose columns change all numbers alike."""
    pushes = [LinearPush(residual=np.zeros(3), shared=np.zeros((3, 2)), nuisance=np.zeros((3, 0)))] * 12
    hypothesis = Hypothesis(space=SPACE, around=AROUND, tolerances=1)
    plain = SimpleNamespace(hypothesis=hypothesis, pushes=pushes, scatter=1.0, noise_scale=1.0, tail=1e6)
    made = [
        Column(
            kind=kind, family=Family(point=(0.0,) * len(kind.chart(AROUND)), free=(j,)), index=j,
            coordinate=kind.chart(AROUND)[j], pushes=(np.full(3, change),) * 12,
        )
        for kind, j, change in columns
    ]  # fmt: skip
    fitter = SimpleNamespace(
        priors=lambda scatter: [np.zeros(0)] * 12, predictor=SimpleNamespace(whitening=[np.eye(3)] * 12),
        case=SimpleNamespace(around=AROUND, features=[SimpleNamespace(pose_numbers=3)] * 12),
    )  # fmt: skip
    chance = np.random.default_rng(0).exponential(size=300) if chance is None else chance
    return SimpleNamespace(
        fitter=fitter, baseline=plain, columns=made, by_chance={one.kind.name: chance for one in made}
    )


@pytest.mark.parametrize(("column", "shows"), [(20.0, True), (0.5, False)])
def test_what_would_not_show_at_its_strongest_is_not_among_what_would(column, shows):
    """A square of the restitution, up to 0.81: with so much change for each unit, it takes 0.04, or 1.5."""
    chance = np.random.default_rng(0).exponential(size=300)
    needed = gain_of(-np.log(CONFIRMED), chance) * 12.0 / 11.0
    search = found_with((Restitution, 0, column), chance=chance)
    found, motions = estimates.smallest(search), estimates.least_motions(search)
    assert [one.name for one in found] == (["restitution"] if shows else [])
    if shows:
        size = np.sqrt(2.0 * needed / (36.0 * column**2))
        assert found[0].value == pytest.approx(Restitution.at(np.array([size]), AROUND).coefficient, rel=1e-4)
        assert found[0].sigmas == motions["restitution"] == pytest.approx(size * column, rel=1e-4)
    else:
        assert motions == {"restitution": np.inf}


def test_the_smallest_tether_is_one_whose_stiffness_is_felt():
    """An even pull, which shows sooner, is that of any tether whose end is far enough away: of 1e-9 N/m as well."""
    search = found_with((Tether, 0, 20.0), (Tether, 1, 1000.0), (Tether, 2, 1000.0))
    (tether,) = estimates.smallest(search)
    assert tether.parameter == "stiffness" and tether.value == pytest.approx(tether.sigmas / 20.0)
    assert tether.value > 0.01
    # Both move the object as little where they show.
    assert estimates.least_motions(search)["tether"] == pytest.approx(tether.sigmas, rel=1e-6)


@pytest.mark.parametrize("kind", known_effects())
def test_no_smallest_size_is_a_bound(kind):
    """What is said of an amplitude grows with what it takes to see it, or nothing is said."""
    families = {j: family for family in kind.families(AROUND) if not family.shares for j in family.free}
    for j, family in families.items():
        step = kind.chart(AROUND)[j].step
        search = found_with((kind, j, 1.0))
        column = dc.replace(search.columns[0], family=family)
        small, large = (estimates._detectable(search, column, part * step) for part in (0.5, 1.0))
        assert (small is None) == (large is None)
        assert small is None or (small.value != large.value and small.sigmas < large.sigmas)
