"""What the belief says of a push: draws of estimates, of a friction, of a start."""

import math
from dataclasses import replace

import numpy as np
import pytest
from plans import GOAL, MODEL, START, TILTED, made
from scipy import stats

from physid_drake.effects.body import Restitution
from physid_drake.effects.drag import QuadraticDrag
from physid_drake.effects.fields import Tether
from physid_drake.effects.friction import StribeckFriction
from physid_drake.effects.liquid import Sloshing
from physid_drake.errors import ConfigError
from physid_drake.model import Correlation
from physid_drake.plan import DistanceToGoal, Situation
from physid_drake.plan.draws import draws_of
from physid_drake.plan.pipeline import spread_of
from physid_drake.policies import PlannedPush


def drawn_from(model, count=64, **more):
    situation = Situation(start=START, start_std=more.pop("start_std", (0.0, 0.0, 0.0)))
    return draws_of(model, situation, count, np.random.default_rng(0), **more)


def models_from(model, count=64, **more):
    return [draw.model for draw in drawn_from(model, count, **more)]


def test_draws_follow_the_intervals_and_the_scatter():
    drawn = models_from(TILTED)
    friction = np.array([float(m.body.support_friction[0]) for m in drawn])
    assert np.median(friction) == pytest.approx(0.27, rel=0.01)
    assert 0.8 < np.mean((friction > 0.25) & (friction < 0.29)) < 0.97
    tilts = np.array([m.effects[0].x for m in drawn])
    assert tilts.std() == pytest.approx(0.02 / 3.29, rel=0.15) and abs(np.corrcoef(friction, tilts)[0, 1]) < 0.2
    scattered = models_from(replace(MODEL, intervals={}), friction_scatter=0.1)
    assert np.std([float(m.body.support_friction[0]) for m in scattered]) == pytest.approx(0.027, rel=0.15)
    assert all(m.body.hand_friction == MODEL.body.hand_friction for m in scattered)


def tied(rho):
    """Friction and tilt, of which pushes along the slope tell the difference only, as rho says."""
    names = ("theta.support_friction", "table_tilt.x")
    return replace(TILTED, correlation=Correlation(names=names, matrix=((1.0, rho), (rho, 1.0))))


def test_draws_vary_together_as_the_model_says_and_keep_their_intervals():
    alone, together = models_from(tied(0.0), 256), models_from(tied(0.95), 256)

    def values(models):
        rows = [(np.log(m.body.support_friction[0]), np.log(m.body.hand_friction), m.effects[0].x) for m in models]
        return np.array(rows).T

    correlations = np.corrcoef(values(together))
    assert correlations[0, 2] == pytest.approx(0.95, abs=0.02)
    assert abs(correlations[0, 1]) < 0.1 and abs(correlations[1, 2]) < 0.1
    np.testing.assert_allclose(values(together).std(axis=1), values(alone).std(axis=1), rtol=0.08)
    assert abs(np.corrcoef(values(alone))[0, 2]) < 0.1


def test_a_drag_over_a_mass_that_nobody_weighed_stays_what_the_pushes_told():
    """Both are unsure by a factor of four, in their logarithms, and go together."""
    names = ("theta.mass", "quadratic_drag.coefficient")
    intervals = {names[0]: [0.25 * MODEL.body.mass, 4.0 * MODEL.body.mass], names[1]: [1.6, 26.0]}
    unweighed = replace(
        MODEL, effects=(QuadraticDrag(coefficient=6.5),), intervals=intervals,
        correlation=Correlation(names=names, matrix=((1.0, 1.0), (1.0, 1.0))),
    )  # fmt: skip
    drawn = models_from(unweighed)
    drags, masses = (np.array(v) for v in zip(*((m.effects[0].coefficient, m.body.mass) for m in drawn), strict=True))
    assert np.ptp(np.log(masses)) > np.log(16.0)
    np.testing.assert_allclose(drags / masses, 6.5 / MODEL.body.mass, rtol=0.03)


@pytest.mark.parametrize(
    ("value", "interval"), [(0.9, (0.0245, 0.978)), (0.3, (0.0245, 0.978)), (0.0245, (0.05, 0.2))]
)
def test_draws_have_their_interval_wherever_in_it_or_beside_it_the_value_is(value, interval):
    """What pushes do not tell has the prior's interval about whatever value the fit ended at."""
    model = replace(
        MODEL, body=replace(MODEL.body, hand_friction=value), intervals={"theta.hand_friction": list(interval)}
    )
    drawn = np.array([m.body.hand_friction for m in models_from(model, 1024)])
    np.testing.assert_allclose(np.quantile(drawn, [0.05, 0.95]), interval, rtol=0.05)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_draws_of_a_spring_keep_the_pull_that_pushes_told_on_either_side(side):
    """Of a far anchor only stiffness times place is told: both are unsure by a factor of two, and go oppositely."""
    names = ("tether.stiffness", "tether.x")
    ends = sorted([side * 0.15, side * 0.6])
    sprung = replace(
        MODEL, effects=(Tether(stiffness=1.0, x=side * 0.3),), intervals={names[0]: [0.5, 2.0], names[1]: ends},
        correlation=Correlation(names=names, matrix=((1.0, -side), (-side, 1.0))),
    )  # fmt: skip
    pulls = np.array([m.effects[0].stiffness * m.effects[0].x for m in models_from(sprung)])
    np.testing.assert_allclose(pulls, side * 0.3, rtol=0.02)


def test_a_draw_of_an_object_that_cannot_be_is_one_that_diverged():
    unsure = replace(MODEL, intervals={"theta.com_x": [-0.1, 0.1]})
    push = (PlannedPush(direction=0.0, speed=0.3, travel=0.1),)
    draws = drawn_from(unsure, 8)
    spread = spread_of(draws, push, DistanceToGoal(goal=GOAL), model=unsure, situation=Situation(start=START))
    impossible = sum(abs(draw.model.body.p_BBcm[0]) > 0.5 * MODEL.shape.size[0] for draw in draws)
    assert 0 < impossible < 8 and spread.diverged >= impossible


@pytest.mark.parametrize(
    ("effect", "name", "interval"),
    [
        (Sloshing(fraction=0.9), "fraction", [0.6, 1.2]),  # more of it than there is
        (
            Sloshing(fraction=0.3, frequency=40.0),
            "frequency",
            [10.0, 40.0],
        ),  # ended at its bound, far from the middle
        (StribeckFriction(excess=0.5, speed=0.95), "speed", [0.2, 1.0]),
        (Restitution(coefficient=0.9), "coefficient", [0.7, 1.0]),
    ],
)
def test_draws_of_an_effect_are_of_what_it_can_be(effect, name, interval):
    model = replace(MODEL, effects=(effect,), intervals={f"{effect.name}.{name}": interval})
    drawn = np.array([getattr(m.effects[0], name) for m in models_from(model, 512)])
    allowed = effect.ranges()[name]
    assert all(map(allowed.holds, drawn)) and np.ptp(drawn) > 0.5 * np.ptp(interval)


def test_friction_and_tilt_that_are_known_together_spread_the_end_less_than_each_alone():
    """Coulomb on a slope: a slide of v^2 / (2 g (mu - tilt)), so that only the difference's error counts."""
    push = (PlannedPush(direction=0.0, speed=0.6, travel=0.1),)
    cost = DistanceToGoal(goal=(0.45, 0.0))  # beyond all ends, so that it is linear in them
    spreads = []
    for rho in (0.0, 0.95):
        model = tied(rho)
        unsure = replace(model, intervals={k: v for k, v in model.intervals.items() if "hand" not in k})
        draws = drawn_from(unsure, 32)
        spreads.append(spread_of(draws, push, cost, model=model, situation=Situation(start=START)))
    friction, tilt = 0.04 / 3.29, 0.02 / 3.29
    slide = 0.6**2 / (2.0 * 9.81 * (0.27 - 0.04))
    for spread, rho in zip(spreads, (0.0, 0.95), strict=True):
        difference = math.sqrt(friction**2 + tilt**2 - 2.0 * rho * friction * tilt)
        assert np.std(spread.costs) == pytest.approx(slide * difference / (0.27 - 0.04), rel=0.15)
    low, high = (s.band[1] - s.band[0] for s in reversed(spreads))
    assert low < 0.7 * high


def test_a_scatter_that_few_pushes_told_is_students():
    plain = replace(MODEL, intervals={})
    known, told = (
        np.array([float(m.body.support_friction[0]) / 0.27 - 1.0 for m in models_from(plain, 512, **more)])
        for more in ({"friction_scatter": 0.02}, {"friction_scatter": 0.02, "scatter_freedom": 5.0})
    )
    for drawn, law in ((known, stats.norm), (told, stats.t(5.0))):
        np.testing.assert_allclose(np.quantile(drawn, [0.05, 0.25, 0.75, 0.95]),
                                   0.02 * law.ppf([0.05, 0.25, 0.75, 0.95]), rtol=0.05)  # fmt: skip


def test_the_hand_aims_at_where_the_object_is_seen_not_at_where_it_stands():
    plain, std = replace(MODEL, intervals={}), (0.0, 2e-3, 0.0)
    draws = drawn_from(plain, 16, start_std=std)
    starts = np.array([d.situation.start for d in draws])
    assert starts[:, 1].std() == pytest.approx(2e-3, rel=0.2) and not starts[:, [0, 2]].any()
    situation = Situation(start=START, start_std=std)
    push = (PlannedPush(direction=0.0, speed=0.3, travel=0.05),)
    spread = spread_of(draws, push, DistanceToGoal(goal=GOAL), model=plain, situation=situation)
    # Hit off its middle, the object turns away from the hand: to the left where the hand passes it on the right.
    assert np.corrcoef(starts[:, 1], spread.ends[:, 2])[0, 1] > 0.9
    assert made(plain, situation=situation, draws=4, budget=1, sweep=0).spread is not None


@pytest.mark.parametrize("interval", [3.0, [0.1], ["a", "b"], [0.3, 0.2], [0.1, math.nan], []])
def test_an_interval_that_is_none_is_refused(interval):
    with pytest.raises(ConfigError, match="support_friction"):
        models_from(replace(MODEL, intervals={"theta.support_friction": interval}), 4)


def test_an_interval_of_nothing_is_refused():
    with pytest.raises(ConfigError, match="colour"):
        models_from(replace(MODEL, intervals={"theta.colour": [0.1, 0.2]}), 4)
