"""Whatever point of a chart: the effect there is the one that its coordinates say, and no two points are the same."""

import math

import numpy as np
import pytest
from drawn import generators
from hypothesis import given
from hypothesis import strategies as st
from pushed import AROUND

from physid_drake.effects import SHIPPED, Effect, Surroundings


@st.composite
def surroundings(draw, kind):
    """Recordings of all sizes, in which an effect can be."""
    rng = draw(generators())
    corners = np.sort(rng.uniform(-1.0, 1.0, (2, 2)), axis=0) + np.array([[0.0], [0.02]])
    rolls = not kind.applies(AROUND)
    return Surroundings(
        mass=10.0 ** rng.uniform(-2.0, 1.0), friction=rng.uniform(0.05, 1.0), size=rng.uniform(0.02, 0.4, 2),
        height=rng.uniform(0.01, 0.3), region=corners, top_speed=10.0 ** rng.uniform(-2.0, 0.5),
        pushes=int(rng.integers(1, 40)), has_hand=True, rolls=rolls,
    )  # fmt: skip


def points(kind, around):
    """Any points within the bounds of a chart; some steps away from the first family where there are none."""
    chart, family = kind.chart(around), kind.families(around)[0]

    def made(rng):
        at = np.array(family.point)
        low = np.array([max(c.lower, p - 100.0 * c.step) for c, p in zip(chart, at, strict=True)])
        high = np.array([min(c.upper, p + 100.0 * c.step) for c, p in zip(chart, at, strict=True)])
        return low + rng.uniform(size=len(at)) * (high - low)

    return st.builds(made, generators())


def of_ellipse(effect, around):
    del around
    size = math.log(effect.ratio)
    return size * math.cos(2.0 * effect.angle), size * math.sin(2.0 * effect.angle)


def of_tether(effect, around):
    middle = 0.5 * (around.region[0] + around.region[1])
    pull = effect.stiffness * (np.array([effect.x, effect.y]) - middle)
    return effect.stiffness, *pull.tolist(), effect.rest_length


def of_bias(effect, around):
    del around
    c, s = math.cos(effect.yaw), math.sin(effect.yaw)
    return c * effect.x + s * effect.y, c * effect.y - s * effect.x, effect.yaw


# Where coordinates are not the parameters, or their logarithms: these again, by the formula of the effect's chart.
BACK = {
    "anisotropic_table": of_ellipse,
    "anisotropic_object": of_ellipse,
    "tether": of_tether,
    "tracker_bias": of_bias,
    "restitution": lambda effect, _: (effect.coefficient**2,),
}


def coordinates(effect, around):
    """The chart point of an effect."""
    if type(effect).name in BACK:
        return np.array(BACK[effect.name](effect, around))
    values = [(c, getattr(effect, c.name)) for c in effect.chart(around)]
    return np.array([math.log(value) if c.log else value for c, value in values])


@pytest.mark.parametrize("kind", [k for k in SHIPPED if k.name != "uneven_support"], ids=lambda kind: kind.name)
@given(data=st.data())
def test_from_coordinates_to_parameters_and_back_is_the_same_point(kind, data):
    around = data.draw(surroundings(kind))
    point = data.draw(points(kind, around))
    effect = kind.at(point, around)
    assert coordinates(effect, around) == pytest.approx(point, rel=1e-9, abs=1e-9 * np.abs(point).max())
    for name, values in kind.ranges().items():
        assert values.holds(getattr(effect, name)), name


@given(generators())
def test_the_weights_of_an_uneven_support_are_those_of_its_moments_and_their_mean_is_one(rng):
    """log w = a x^2 + b y^2 + c x y + d_ij but for a constant, on a grid from -1 to 1."""
    (kind,) = (k for k in SHIPPED if k.name == "uneven_support")
    point = rng.uniform(-2.0, 2.0, 12)
    weights = np.array(kind.at(point, AROUND).weights)
    x, y = np.array([-1.0, 0.0, 1.0])[:, None], np.array([-1.0, 0.0, 1.0])[None]
    log = point[0] * x**2 + point[1] * y**2 + point[2] * x * y + point[3:].reshape(3, 3)
    assert np.ptp(np.log(weights) - log) < 1e-12 and weights.mean() == pytest.approx(1.0)


TRACKERS = [kind for kind in SHIPPED if kind.true_pose is not Effect.true_pose or kind.tracked is not Effect.tracked]


@pytest.mark.parametrize("kind", TRACKERS, ids=lambda kind: kind.name)
@given(data=st.data())
def test_a_tracked_pose_is_the_objects_again_once_the_tracker_is_undone(kind, data):
    around = data.draw(surroundings(kind))
    effect = kind.at(data.draw(points(kind, around)), around)
    pose = data.draw(generators()).uniform(-2.0, 2.0, (1, 3))
    (tracked,) = effect.tracked(pose)
    assert np.array(effect.true_pose(tuple(tracked.tolist()))) == pytest.approx(pose[0], abs=1e-12)
