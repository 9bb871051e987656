"""What the twin predicts of recorded pushes, as vectors in units of their noise: many points in one call."""

from __future__ import annotations

import dataclasses as dc
from collections import defaultdict
from collections.abc import Collection, Sequence
from copy import copy

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from physid_drake.cell import Outcome
from physid_drake.effects import Effect
from physid_drake.effects.pulse import Pulse
from physid_drake.effects.rollout import Geometry, Rollout, geometry_with, lateness_of
from physid_drake.inference.discrepancy import discrepancy, sensor_noise, way_of
from physid_drake.pushes.by_twin import say_that_it_compiles, stays, twin_for
from physid_drake.pushes.case import Case
from physid_drake.pushes.force_windows import offsets
from physid_drake.pushes.nuisance import PushSetting, apply_nuisance
from physid_drake.pushes.prediction import Prediction
from physid_drake.pushes.problem import PushProblem, turned_as_recorded
from physid_drake.pushes.rollouts import RolloutPool
from physid_drake.pushes.task import Task
from physid_drake.twin.twin import STEADY, Trace, Twin, TwinPush, Wander
from physid_drake.twin.with_effects import as_reported, push_with

Array = NDArray[np.float64]
Index = NDArray[np.intp]

TOGETHER = 2048  # rollouts in a call
MOST_SETTINGS = 4096  # of pushes that are kept
WANDER_STEP = 0.02  # of a friction, for differences
HATS = 7  # places on a push's way between which a friction is linear
ALIKE = 0.02  # m of way: over which a friction that wanders is the same


@dc.dataclass(frozen=True, eq=False)
class Physics:
    """What all pushes share: parameters theta (d,) and effects; null ones are left out."""

    theta: Array
    effects: tuple[Effect, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "effects", tuple(e for e in self.effects if not e.is_null))


@dc.dataclass(frozen=True, eq=False)
class Ask:
    """A rollout: a push with its own unknowns (k,), in units of their priors' standard deviations.

    ``path_error``, where it is not negative, is the one that its hand's path has; ``wander`` what frictions and
    forces do for a while.
    """

    push: int
    physics: Physics
    own: Array
    path_error: int = -1
    wander: Wander = STEADY


class Predictor:
    """Predicts a case's pushes.

    Attributes:
        case: whose.
        noise: per push (m, m), of its features in their units: the sensors', and what the simulator may be off by.
        whitening: per push (m, m), takes features to units of the noise.
        recorded: per push (m,), in units of the noise.
        count: of rollouts.
        by_cell: the pushes that the twin cannot roll out, whatever theta; the cell does.
    """

    def __init__(self, case: Case, by_cell: Collection[int] = ()) -> None:
        self.case, self.count, self.by_cell = case, 0, frozenset(by_cell)
        self.noise = [sensor_noise(f) + discrepancy(p, f) for f, p in zip(case.features, case.problems, strict=True)]
        self.with_directions([np.zeros((len(f.recorded), 0)) for f in case.features])
        self._settings: dict[tuple[int, int, bytes], PushSetting] = {}

    def judging(self, pool: RolloutPool) -> Predictor:
        """The same in another cell, of which a pool makes all rollouts."""
        other = copy(self)
        other.count = 0
        other.case = dc.replace(self.case, pool=pool)
        other.by_cell = frozenset(range(len(self.case.problems)))
        return other

    def with_directions(self, directions: Sequence[Array]) -> None:
        """Count N(0, 1) multiples of columns (m_i, j) of features, in their units, as noise."""
        self.whitening = [
            solve_triangular(np.linalg.cholesky(noise + more @ more.T), np.eye(len(noise)), lower=True)
            for noise, more in zip(self.noise, directions, strict=True)
        ]
        self.recorded = [w @ f.recorded for w, f in zip(self.whitening, self.case.features, strict=True)]

    def vectors(self, asks: Sequence[Ask]) -> list[Array | None]:
        """Features (m_i,) of each rollout, in units of the noise; None of one that the twin cannot make."""
        answers: list[Array | None] = [None] * len(asks)
        of_cell = [k for k, ask in enumerate(asks) if ask.push in self.by_cell]
        of_twin = [k for k, ask in enumerate(asks) if ask.push not in self.by_cell]
        for first in range(0, len(of_twin), TOGETHER):
            some = of_twin[first : first + TOGETHER]
            for k, answer in zip(some, self._some([asks[k] for k in some]), strict=True):
                answers[k] = answer
        for k, answer in zip(of_cell, self._in_cell([asks[k] for k in of_cell]), strict=True):
            answers[k] = answer
        self.count += len(asks)
        return answers

    def _in_cell(self, asks: Sequence[Ask]) -> list[Array | None]:
        """By the cell, which knows no frictions that wander, but forces."""
        tasks = [
            Task(
                problem=self._problem(ask), theta=ask.physics.theta, nuisance=self.case.nuisances[ask.push],
                values=ask.own * self.case.nuisances[ask.push].stds,
                effects=(*ask.physics.effects, *self._pulses(ask)),
            )
            for ask in asks
        ]  # fmt: skip
        found = self.case.pool.run(tasks) if tasks else []
        return [
            None if one is None or ask.wander.support or ask.wander.hand
            else np.asarray(self.whitening[ask.push] @ self.case.features[ask.push].of(one))
            for ask, one in zip(asks, found, strict=True)
        ]  # fmt: skip

    def _pulses(self, ask: Ask) -> tuple[Effect, ...]:
        wander, begin = ask.wander, self.case.problems[ask.push].begin
        if wander is STEADY:
            return ()
        return (
            Pulse(
                fx=wander.force[0], fy=wander.force[1], torque=wander.torque, middle=wander.middle - begin,
                width=wander.width,
            ),
        )  # fmt: skip

    def _problem(self, ask: Ask) -> PushProblem:
        problem = self.case.problems[ask.push]
        if ask.path_error < 0:
            return problem
        return dc.replace(problem, path=problem.path_errors[ask.path_error].path)

    def path_errors(self, owns: Sequence[Array], physics: Physics) -> list[Array]:
        """Columns (m_i, e) of features, in their units: what each error that a hand's path may have changes."""
        columns = []
        for i, problem in enumerate(self.case.problems):
            asks = [Ask(i, physics, owns[i], path_error=k) for k in range(-1, len(problem.path_errors))]
            sizes = np.array([error.stds for error in problem.path_errors])
            columns.append(np.linalg.inv(self.whitening[i]) @ self._differences(asks) / sizes)
        return columns

    def wanders(self, owns: Sequence[Array], physics: Physics) -> list[tuple[Array, Array]]:
        """What frictions change that wander on a push's way: columns (m_i, HATS), of table and tip.

        In units of the noise, for a friction that differs by all of itself. The columns are independent; frictions at
        neighbouring places are not.
        """
        made = []
        for i, problem in enumerate(self.case.problems):
            hats, root = wander_hats(problem)
            rest = Ask(i, physics, owns[i])
            for_table = [dc.replace(rest, wander=Wander(middle=t, width=w, support=WANDER_STEP)) for t, w in hats]
            at_tip = [dc.replace(rest, wander=Wander(middle=t, width=w, hand=WANDER_STEP)) for t, w in hats]
            columns = self._differences([rest, *for_table, *at_tip]) / WANDER_STEP
            made.append((columns[:, : len(hats)] @ root, columns[:, len(hats) :] @ root))
        return made

    def _differences(self, asks: Sequence[Ask]) -> Array:
        """How the rollouts after the first differ from it, as columns; zero where one cannot be made."""
        base, *moved = self.vectors(asks)
        none = np.zeros(len(self.recorded[asks[0].push]))
        found = [none if base is None or one is None else one - base for one in moved]
        return np.column_stack([np.zeros((len(none), 0)), *found])

    def _some(self, asks: Sequence[Ask]) -> list[Array | None]:
        """As many as go in one call: those of each geometry together."""
        say_that_it_compiles()
        answers: list[Array | None] = [None] * len(asks)
        plain = Geometry(shape=self.case.pool.spec.shape)
        twins: dict[int, Twin | None] = {}
        waiting: dict[int, list[tuple[int, TwinPush, Index | None]]] = defaultdict(list)
        for k, ask in enumerate(asks):
            name = id(ask.physics)
            if name not in twins:
                twins[name] = twin_for(self.case.pool.spec, geometry_with(ask.physics.effects, plain))
            twin = twins[name]
            made = None if twin is None else self._push(twin, plain, ask)
            if made is not None:
                waiting[id(twin)].append((k, *made))
        of = {id(twin): twin for twin in twins.values() if twin is not None}
        for name, asked in waiting.items():
            twin = of[name]
            traces = twin.rollouts([push for _, push, _ in asked], self.case.pool.jobs)
            for (k, _, where), trace in zip(asked, traces, strict=True):
                if trace.outcome is Outcome.COMPLETED and not trace.tips and stays(self.case.pool.spec, twin, trace):
                    answers[k] = self._vector(asks[k], trace, where)
        return answers

    def _setting(self, ask: Ask) -> PushSetting:
        key = ask.push, ask.path_error, ask.own.tobytes()
        if key not in self._settings:
            if len(self._settings) >= MOST_SETTINGS:
                self._settings.clear()
            nuisance = self.case.nuisances[ask.push]
            self._settings[key] = apply_nuisance(self._problem(ask), nuisance, ask.own * nuisance.stds)
        return self._settings[key]

    def _push(self, twin: Twin, plain: Geometry, ask: Ask) -> tuple[TwinPush, Index | None] | None:
        """The rollout to make, and where in its times those of poses and forces are; None where the twin cannot."""
        problem, setting, physics = self.case.problems[ask.push], self._setting(ask), ask.physics
        body = self.case.thetas.body(
            physics.theta, friction_scale=setting.friction_scale, restitution=setting.restitution
        )
        if body.static_ratio != 1.0:  # what sticks before it slips is the cell's
            return None
        push = Rollout(
            start=setting.start, path=setting.path, begin=problem.begin, end=problem.end,
            hand_height=problem.hand_height, order=problem.order, hand_axes=problem.hand_axes,
        )  # fmt: skip
        times, where = np.concatenate([[problem.begin], problem.times]), None
        if len(problem.force_times):
            # Forces are not late.
            windows = (problem.force_times[:, None] + offsets()).ravel() + lateness_of(physics.effects)
            times, where = np.unique(np.concatenate([times, windows]), return_inverse=True)
        made = push_with(twin, plain, body, push, physics.effects, times)
        if made is None:
            return None
        return (made if ask.wander is STEADY else dc.replace(made, wander=ask.wander)), where

    def _vector(self, ask: Ask, trace: Trace, where: Index | None) -> Array:
        problem, features = self.case.problems[ask.push], self.case.features[ask.push]
        count = 1 + len(problem.times)
        seen = trace if where is None else dc.replace(trace, poses=trace.poses[where[:count]])
        poses = as_reported(seen, ask.physics.effects).poses
        poses = turned_as_recorded(problem, poses[0, 2], poses[1:])
        forces = np.zeros((0, 2))
        if where is not None:
            forces = trace.forces[where[count:]].reshape(len(problem.force_times), -1, 2).mean(axis=1)
        vector: Array = self.whitening[ask.push] @ features.of(Prediction(poses=poses, forces=forces))
        return vector


def wander_hats(problem: PushProblem) -> tuple[list[tuple[float, float]], Array]:
    """When a push comes by places on its way [s], how long it is near them [s], and a root of their correlation."""
    times = np.concatenate([[problem.begin], problem.times])
    way = way_of(np.vstack([problem.start.pose, problem.poses]))
    first, last = np.interp(np.clip(problem.moving, times[0], times[-1]), times, way)
    places = np.linspace(first, last, HATS)
    at = np.interp(places, way, times)
    gaps = np.diff(at)
    widths = np.maximum(0.5 * (np.append(gaps, gaps[-1]) + np.insert(gaps, 0, gaps[0])), 1e-3)
    alike = np.exp(-np.abs(places[:, None] - places[None, :]) / ALIKE)
    root = np.linalg.cholesky(alike + 1e-9 * np.eye(HATS))
    return list(zip(at.tolist(), widths.tolist(), strict=True)), root
