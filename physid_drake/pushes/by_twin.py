"""What the compiled twin predicts of recorded pushes, all tasks in a few calls; what it cannot say, the cell does."""

from __future__ import annotations

import math
import sys
from collections import OrderedDict, defaultdict
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import Outcome
from physid_drake.cell.solid import solid_of
from physid_drake.cell.support import FrictionGrid
from physid_drake.effects.rollout import Geometry, Rollout, geometry_with, lateness_of
from physid_drake.errors import CellError
from physid_drake.pushes.force_windows import offsets
from physid_drake.pushes.nuisance import apply_nuisance
from physid_drake.pushes.prediction import Prediction
from physid_drake.pushes.problem import CellSpec, turned_as_recorded
from physid_drake.pushes.task import Task
from physid_drake.pushes.theta import ThetaMap
from physid_drake.twin.compiled import is_compiled
from physid_drake.twin.twin import Trace, Twin, TwinPush
from physid_drake.twin.with_effects import as_reported, push_with

Array = NDArray[np.float64]

MOST_TWINS = 24  # kept by a process: effects of shape and pressure have their own

_twins: OrderedDict[str, Twin] = OrderedDict()


def predicted_by_twin(spec: CellSpec, thetas: ThetaMap, tasks: Sequence[Task]) -> list[Prediction | None]:
    """Predictions in the order of the tasks; None where the cell has to be asked.

    That is where a law is not of the vocabulary, where the object rolls, tips or comes to the table's edge, and where
    the integration diverges.
    """
    say_that_it_compiles()
    answers: list[Prediction | None] = [None] * len(tasks)
    twins: dict[int, Twin] = {}
    waiting: dict[int, list[tuple[int, TwinPush]]] = defaultdict(list)
    for k, task in enumerate(tasks):
        twin = twin_for(spec, geometry_with(task.effects, Geometry(shape=spec.shape)))
        push = None if twin is None else _asked(twin, spec, thetas, task)
        if twin is not None and push is not None:
            twins[id(twin)] = twin
            waiting[id(twin)].append((k, push))
    for key, asked in waiting.items():
        twin = twins[key]
        for (k, push), trace in zip(asked, twin.rollouts([push for _, push in asked]), strict=True):
            if trace.outcome is Outcome.COMPLETED and not trace.tips and stays(spec, twin, trace):
                answers[k] = _prediction(tasks[k], push, trace)
    return answers


@cache
def say_that_it_compiles() -> None:
    """On standard error, once, where no earlier process left its machine code."""
    if not is_compiled():
        print("compiling the twin for this machine, once: some twenty seconds", file=sys.stderr, flush=True)


def _asked(twin: Twin, spec: CellSpec, thetas: ThetaMap, task: Task) -> TwinPush | None:
    """The rollout to make; None where the twin cannot."""
    problem, setting = task.problem, apply_nuisance(task.problem, task.nuisance, task.values)
    body = thetas.body(task.theta, friction_scale=setting.friction_scale, restitution=setting.restitution)
    if body.static_ratio != 1.0:  # what sticks before it slips is the cell's
        return None
    push = Rollout(
        start=setting.start, path=setting.path, begin=problem.begin, end=problem.end,
        hand_height=problem.hand_height, order=problem.order, hand_axes=problem.hand_axes,
    )  # fmt: skip
    asked = push_with(twin, Geometry(shape=spec.shape), body, push, task.effects, _times(task))
    # In their order, each once: they are put back where they belong afterwards.
    return None if asked is None else replace(asked, times=np.unique(asked.times))


def _times(task: Task) -> Array:
    """When the tracker is asked [s]: as the push begins, at the recorded times, and about the middles of windows."""
    late = lateness_of(task.effects)
    windows = (task.problem.force_times[:, None] + offsets()).ravel() + late  # forces are not late
    return np.concatenate([[task.problem.begin], task.problem.times, windows])


def _prediction(task: Task, push: TwinPush, trace: Trace) -> Prediction:
    problem = task.problem
    where = np.searchsorted(push.times, _times(task) - lateness_of(task.effects))
    poses = as_reported(trace, task.effects).poses[where[: 1 + len(problem.times)]]
    forces = trace.forces[where[1 + len(problem.times) :]]
    means = forces.reshape(len(problem.force_times), -1, 2).mean(axis=1) if len(forces) else np.zeros((0, 2))
    return Prediction(poses=turned_as_recorded(problem, poses[0, 2], poses[1:]), forces=means)


def stays(spec: CellSpec, twin: Twin, trace: Trace) -> bool:
    """Whether all of the object was on the table all the while."""
    low, high = np.array(spec.table)
    x0, y0, x1, y1 = twin.solid.underside.extent()
    reach = math.hypot(max(abs(x0), abs(x1)), max(abs(y0), abs(y1)))
    least, most = trace.poses[:, :2].min(axis=0) - reach, trace.poses[:, :2].max(axis=0) + reach
    return bool((least >= low).all() and (most <= high).all())


def twin_for(spec: CellSpec, geometry: Geometry) -> Twin | None:
    """This process's twin for a geometry, built at the first call; None of what rolls."""
    key = repr((geometry, spec.hand_radius, spec.config.friction_cells))
    if key not in _twins:
        try:
            _twins[key] = Twin(
                solid=solid_of(geometry.shape), hand_radius=spec.hand_radius, pressure=geometry.pressure,
                gravity=geometry.gravity,
                grid=FrictionGrid(nx=spec.config.friction_cells[0], ny=spec.config.friction_cells[1]),
            )  # fmt: skip
        except CellError:
            return None
        if len(_twins) > MOST_TWINS:
            _twins.popitem(last=False)
    _twins.move_to_end(key)
    return _twins[key]
