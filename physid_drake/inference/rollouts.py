"""Rollouts of recorded pushes, many in one call: by the twin, and by the Drake cell where the twin cannot."""

from __future__ import annotations

import dataclasses as dc
from collections import defaultdict
from collections.abc import Collection, Sequence
from copy import copy

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import Outcome
from physid_drake.effects import Effect
from physid_drake.effects.pulse import Pulse
from physid_drake.effects.rollout import Geometry, Rollout, geometry_with, lateness_of
from physid_drake.pushes.by_twin import say_that_it_compiles, stays, twin_for
from physid_drake.pushes.force_windows import offsets
from physid_drake.pushes.nuisance import Nuisance, PushSetting, apply_nuisance
from physid_drake.pushes.prediction import Prediction
from physid_drake.pushes.problem import PushProblem, turned_as_recorded
from physid_drake.pushes.rollouts import RolloutPool
from physid_drake.pushes.task import Task
from physid_drake.twin.twin import STEADY, Trace, Twin, TwinPush, Wander
from physid_drake.twin.with_effects import as_reported, knows, push_with

Array = NDArray[np.float64]
Index = NDArray[np.intp]

TOGETHER = 2048  # rollouts in a call
MOST_SETTINGS = 4096  # of pushes that are kept


@dc.dataclass(frozen=True, eq=False)
class Physics:
    """What all pushes share: parameters theta (d,), each in its unit, and effects, without those that are null."""

    theta: Array
    effects: tuple[Effect, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "effects", tuple(e for e in self.effects if not e.is_null))


@dc.dataclass(frozen=True, eq=False)
class Ask:
    """A rollout to make.

    Attributes:
        push: index of the push.
        physics: theta and effects.
        nuisance: (k,) the push's nuisance parameters, in units of their priors' standard deviations.
        path_error: index of the error that the hand's path has; -1 for the path as it was fitted.
        wander: how frictions or forces differ for a short time.
    """

    push: int
    physics: Physics
    nuisance: Array
    path_error: int = -1
    wander: Wander = STEADY


class Rollouts:
    """Rolls out a recording's pushes.

    Attributes:
        count: number of rollouts that were made.
        by_cell: indices of the pushes that the twin cannot roll out at any theta; the cell rolls them out.
    """

    def __init__(
        self,
        pool: RolloutPool,
        problems: Sequence[PushProblem],
        nuisances: Sequence[Nuisance],
        by_cell: Collection[int] = (),
    ) -> None:
        self.pool, self.problems, self.nuisances = pool, problems, nuisances
        self.count, self.by_cell = 0, frozenset(by_cell)
        self._settings: dict[tuple[int, int, bytes], PushSetting] = {}

    def in_cell(self, pool: RolloutPool) -> Rollouts:
        """A copy that makes all rollouts in the cell of a pool, and counts from zero."""
        other = copy(self)
        other.count, other.pool = 0, pool
        other.by_cell = frozenset(range(len(self.problems)))
        return other

    def predictions(self, asks: Sequence[Ask]) -> list[Prediction | None]:
        """What each rollout predicts; None where it cannot be made, as of an object that tips or leaves the table."""
        answers: list[Prediction | None] = [None] * len(asks)
        foreign = {id(p) for p in {id(ask.physics): ask.physics for ask in asks}.values() if not knows(p.effects)}
        of_cell = [k for k, ask in enumerate(asks) if ask.push in self.by_cell or id(ask.physics) in foreign]
        of_twin = sorted(set(range(len(asks))) - set(of_cell))
        for first in range(0, len(of_twin), TOGETHER):
            some = of_twin[first : first + TOGETHER]
            for k, answer in zip(some, self._by_twin([asks[k] for k in some]), strict=True):
                answers[k] = answer
        for k, answer in zip(of_cell, self._in_cell([asks[k] for k in of_cell]), strict=True):
            answers[k] = answer
        self.count += len(asks)
        return answers

    def _in_cell(self, asks: Sequence[Ask]) -> list[Prediction | None]:
        """By the cell, which knows no frictions that wander, but forces."""
        tasks = [
            Task(
                problem=self._problem(ask), theta=ask.physics.theta, nuisance=self.nuisances[ask.push],
                values=ask.nuisance * self.nuisances[ask.push].stds,
                effects=(*ask.physics.effects, *self._pulses(ask)),
            )
            for ask in asks
        ]  # fmt: skip
        found = self.pool.run(tasks) if tasks else []
        return [
            None if ask.wander.support or ask.wander.hand else one for ask, one in zip(asks, found, strict=True)
        ]  # fmt: skip

    def _pulses(self, ask: Ask) -> tuple[Effect, ...]:
        wander, begin = ask.wander, self.problems[ask.push].begin
        if wander is STEADY:
            return ()
        return (
            Pulse(
                fx=wander.force[0], fy=wander.force[1], torque=wander.torque, middle=wander.middle - begin,
                width=wander.width,
            ),
        )  # fmt: skip

    def _problem(self, ask: Ask) -> PushProblem:
        problem = self.problems[ask.push]
        if ask.path_error < 0:
            return problem
        return dc.replace(problem, path=problem.path_errors[ask.path_error].path)

    def _by_twin(self, asks: Sequence[Ask]) -> list[Prediction | None]:
        """As many as go in one call: those of each geometry together."""
        say_that_it_compiles()
        answers: list[Prediction | None] = [None] * len(asks)
        plain, spec = Geometry(shape=self.pool.spec.shape), self.pool.spec
        twins: dict[int, Twin | None] = {}
        waiting: dict[int, list[tuple[int, TwinPush, Index | None]]] = defaultdict(list)
        for k, ask in enumerate(asks):
            name = id(ask.physics)
            if name not in twins:
                twins[name] = twin_for(spec, geometry_with(ask.physics.effects, plain))
            twin = twins[name]
            made = None if twin is None else self._push(twin, plain, ask)
            if made is not None:
                waiting[id(twin)].append((k, *made))
        of = {id(twin): twin for twin in twins.values() if twin is not None}
        for name, asked in waiting.items():
            twin = of[name]
            traces = twin.rollouts([push for _, push, _ in asked], self.pool.jobs)
            for (k, _, where), trace in zip(asked, traces, strict=True):
                if trace.outcome is Outcome.COMPLETED and not trace.tips and stays(spec, twin, trace):
                    answers[k] = self._prediction(asks[k], trace, where)
        return answers

    def _setting(self, ask: Ask) -> PushSetting:
        key = ask.push, ask.path_error, ask.nuisance.tobytes()
        if key not in self._settings:
            if len(self._settings) >= MOST_SETTINGS:
                self._settings.clear()
            nuisance = self.nuisances[ask.push]
            self._settings[key] = apply_nuisance(self._problem(ask), nuisance, ask.nuisance * nuisance.stds)
        return self._settings[key]

    def _push(self, twin: Twin, plain: Geometry, ask: Ask) -> tuple[TwinPush, Index | None] | None:
        """The rollout to make, and where in its times those of poses and forces are; None where the twin cannot."""
        problem, setting, physics = self.problems[ask.push], self._setting(ask), ask.physics
        body = self.pool.thetas.body(
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

    def _prediction(self, ask: Ask, trace: Trace, where: Index | None) -> Prediction:
        problem = self.problems[ask.push]
        count = 1 + len(problem.times)
        seen = trace if where is None else dc.replace(trace, poses=trace.poses[where[:count]])
        poses = as_reported(seen, ask.physics.effects).poses
        poses = turned_as_recorded(problem, poses[0, 2], poses[1:])
        forces = np.zeros((0, 2))
        if where is not None:
            forces = trace.forces[where[count:]].reshape(len(problem.force_times), -1, 2).mean(axis=1)
        return Prediction(poses=poses, forces=forces)
