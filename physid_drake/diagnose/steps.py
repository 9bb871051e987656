"""Steps of differences: the states at which rollouts are made for the derivatives at a state."""

from __future__ import annotations

import dataclasses as dc
import math

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.model import State
from physid_drake.pushes.case import Case
from physid_drake.pushes.misfit import difference

Array = NDArray[np.float64]

THETA_STEP = 0.006  # of the unit cube
OWN_STEP = 0.5  # of the prior standard deviation
SLOPE = 1e-6  # of the unit cube: a step for the slope of a parameter's scale


@dc.dataclass(frozen=True, kw_only=True)
class Step:
    """A state with a step of one unknown taken."""

    size: float
    state: State

    def derivative(self, before: Array, after: Array) -> Array:
        """From features (m,) before and after the step."""
        return difference(before, after) / self.size


def theta_steps(case: Case, state: State) -> list[Step]:
    """One for each parameter.

    Forces go with the mass: where nothing but their ratio moves the object there is then no difference at all, to
    rounding, instead of two that cancel but for the error of differences. ``with_theta`` has what went with it.
    """
    steps = []
    for j, value in enumerate(state.u):
        size = THETA_STEP if value < 0.5 else -THETA_STEP
        steps.append(Step(size=size, state=_at_theta(case, state, state.u + size * np.eye(len(state.u))[j])))
    return steps


def with_theta(case: Case, state: State) -> Array:
    """How the effects' free coordinates go with theta in ``theta_steps``, (e, d)."""
    here = math.log(_mass(case, state.u))
    slopes = [(math.log(_mass(case, state.u + step)) - here) / SLOPE for step in SLOPE * np.eye(len(state.u))]
    return np.outer(np.concatenate([np.zeros(0), *(e.with_mass(case) for e in state.effects)]), slopes)


def effect_steps(case: Case, state: State) -> list[Step]:
    """One for each free coordinate of each effect."""
    steps = []
    for k, e in enumerate(state.effects):
        chart = e.chart(case)
        for j in e.free:
            size = chart[j].step if e.point[j] + chart[j].step <= chart[j].upper else -chart[j].step
            moved = dc.replace(e, point=e.point + size * np.eye(len(e.point))[j])
            effects = (*state.effects[:k], moved, *state.effects[k + 1 :])
            steps.append(Step(size=size, state=dc.replace(state, effects=effects)))
    return steps


def own_steps(state: State, i: int) -> list[Step]:
    """One for each unknown of push i."""
    steps = []
    for j, value in enumerate(state.own[i]):
        size = OWN_STEP if value <= 0.0 else -OWN_STEP
        values = state.own[i] + size * np.eye(len(state.own[i]))[j]
        own = (*state.own[:i], values, *state.own[i + 1 :])
        steps.append(Step(size=size, state=dc.replace(state, own=own)))
    return steps


def _at_theta(case: Case, state: State, u: Array) -> State:
    """A state at another theta, its forces in proportion to the mass."""
    ratio = _mass(case, u) / _mass(case, state.u)
    return dc.replace(state, u=u, effects=tuple(e.heavier(case, ratio) for e in state.effects))


def _mass(case: Case, u: Array) -> float:
    """At a point (d,) of the unit cube; one kilogram where it is not among the unknowns."""
    space = case.thetas.space
    return float(space.from_unit(u)[space.names.index("mass")]) if "mass" in space.names else 1.0
