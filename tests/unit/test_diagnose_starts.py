"""Where fits start."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose import starts
from physid_drake.diagnose.model import EffectPoint, State
from physid_drake.effects import Surroundings, effect_named

AROUND = Surroundings(
    mass=0.2, friction=0.3, size=np.array([0.12, 0.05]), height=0.03, region=np.array([[-0.5, -0.5], [0.5, 0.5]]),
    top_speed=0.5, pushes=10, has_hand=True, rolls=False,
)  # fmt: skip
DRAG, BOUNCE = effect_named("viscous_drag"), effect_named("restitution")


class Fitter:
    """Its pushes cost most far from one point of the last effect's chart."""

    def __init__(self, best):
        self.case, self.best = SimpleNamespace(around=AROUND), best

    def start(self, u, effects):
        return State(u=u, effects=tuple(effects), own=(np.zeros(2),), scatter=1.0)

    def seen_from(self, model, state):
        assert not state.own[0].any()
        return SimpleNamespace(cost_here=float(abs(state.effects[-1].point[0] - self.best)))


def model_with(*effects):
    return SimpleNamespace(state=State(u=np.array([0.4]), effects=effects, own=(np.ones(2),), scatter=3.0))


def point_of(kind, value):
    return EffectPoint(kind=kind, point=np.array([value]), free=(0,), origin=np.array([0.0]))


@pytest.mark.parametrize(
    ("fitted", "best", "start"),
    [(0.40, 0.49, 0.48), (0.40, 0.41, 0.40), (0.40, 0.10, 0.28), (0.80, 1.3, 0.9)],  # 0.9 is the chart's bound
)
def test_the_last_effect_is_tried_weaker_and_stronger(fitted, best, start):
    other = point_of(DRAG, 0.3)
    state = starts.of_other_strength(Fitter(best), model_with(other, point_of(BOUNCE, fitted)))
    assert state.effects[0] is other
    np.testing.assert_allclose(state.effects[1].point, [start])
    np.testing.assert_array_equal(state.u, [0.4])


def test_any_effect_of_a_model_is_tried_weaker_and_stronger():
    other, bounce = point_of(DRAG, 0.3), point_of(BOUNCE, 0.40)
    fitter = Fitter(0.0)
    fitter.seen_from = lambda model, state: SimpleNamespace(cost_here=abs(state.effects[0].point[0] - 0.49))
    state = starts.of_other_strength(fitter, model_with(bounce, other), 0)
    np.testing.assert_allclose(state.effects[0].point, [0.48])
    assert state.effects[1] is other


def test_a_weaker_patch_is_where_the_patch_is_and_as_large():
    kind = effect_named("friction_patch")
    names = [c.name for c in kind.chart(AROUND)]
    point, origin = np.full(len(names), 0.3), np.zeros(len(names))
    patch = EffectPoint(kind=kind, point=point, free=tuple(range(len(names))), origin=origin)
    moved = starts.of_other_strength(Fitter(0.0), model_with(patch)).effects[0].point
    assert [name for name, a, b in zip(names, moved, point, strict=True) if a != b] == ["ratio"]


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("friction_patch", ("x", "y", "radius")),
        ("stribeck_friction", ("speed",)),
        ("viscous_drag", ()),
        ("uneven_support", ()),
    ],
)
def test_another_shape_is_a_corner_of_the_prior_around_it(name, shape):
    kind = effect_named(name)
    chart = kind.chart(AROUND)
    middle = np.array(kind.families(AROUND)[0].point) + 0.1
    point = EffectPoint(kind=kind, point=middle, free=tuple(range(len(chart))), origin=np.zeros(len(chart)))
    fitter, model = Fitter(0.0), model_with(point_of(DRAG, 0.3), point)
    corners = starts.corners(fitter, model)
    assert len(corners) == len(set(corners)) == (2 ** len(shape) if shape else 0)
    for corner in corners:
        state = starts.of_other_shape(fitter, model, corner)
        assert not state.own[0].any()
        moved = state.effects[-1]
        ways = (moved.point - middle) / np.array([c.std for c in chart])
        assert [chart[j].name for j in np.flatnonzero(ways)] == list(shape)
        np.testing.assert_allclose(ways[ways != 0.0], starts.ASIDE * np.array(corner))
    swapped = model_with(point, point_of(DRAG, 0.3))
    for corner in starts.corners(fitter, swapped, 0):
        state, last = starts.of_other_shape(fitter, swapped, corner, 0), starts.of_other_shape(fitter, model, corner)
        np.testing.assert_array_equal(state.effects[0].point, last.effects[-1].point)
        assert state.effects[1] is swapped.state.effects[1]
        # What was unsure is unsure about the new place, and the amplitude about where it was.
        np.testing.assert_array_equal(moved.origin, np.where(ways != 0.0, moved.point, 0.0))


def scored(kind, family, coefficient, gain):
    signature = SimpleNamespace(family=family)
    return SimpleNamespace(
        kind=kind, signature=signature, kept=(0,), coefficients=np.array([coefficient]), gain=gain, others=()
    )  # fmt: skip


def test_a_patch_is_tried_elsewhere_with_the_other_sign_and_its_own_in_turn_and_no_place_twice():
    kind = effect_named("friction_patch")
    families = kind.families(AROUND)
    wide = next(k for k, family in enumerate(families) if family.shares)
    steps = [(0, 9.0, 100.0), (wide, 8.0, 90.0), (1, 7.0, 80.0), (2, -6.0, 70.0), (3, 5.0, 60.0), (4, -4.0, 50.0)]
    best, *others = (scored(kind, families[k], coefficient, gain) for k, coefficient, gain in steps)
    assert families[wide].point[1:3] == families[0].point[1:3]
    best.others = (*others, scored(kind, families[5], -1.0, 40.0))
    tried = starts.elsewhere(SimpleNamespace(around=AROUND), best)
    assert [one.gain for one in tried] == [70.0, 80.0, 50.0]


def test_an_effect_without_a_place_is_tried_nowhere_else():
    kind = effect_named("stribeck_friction")
    best, *others = (scored(kind, family, 1.0, 9.0) for family in kind.families(AROUND))
    best.others = tuple(others)
    assert len(others) > 1 and starts.elsewhere(SimpleNamespace(around=AROUND), best) == []


def test_the_corner_where_the_pushes_cost_least_comes_first(monkeypatch):
    kind = effect_named("friction_patch")
    names = [c.name for c in kind.chart(AROUND)]
    middle = np.array(kind.families(AROUND)[0].point)
    point = EffectPoint(kind=kind, point=middle, free=tuple(range(len(names))), origin=middle)
    fitter = Fitter(0.0)
    place = [names.index(name) for name in ("x", "y", "radius")]
    best = middle[place] + [0.2, -0.2, 0.3]

    def distance(model, state):
        return SimpleNamespace(cost_here=float(np.abs(state.effects[-1].point[place] - best).sum()))

    monkeypatch.setattr(fitter, "seen_from", distance)
    corners = starts.corners(fitter, model_with(point))
    assert (corners[0], corners[-1]) == ((1, -1, 1), (-1, 1, -1))
