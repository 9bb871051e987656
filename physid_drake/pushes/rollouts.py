"""Rollouts in parallel: each process builds the cell once and keeps it."""

from __future__ import annotations

import dataclasses as dc
import os
import signal
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Sequence
from multiprocessing import parent_process
from threading import current_thread, main_thread

import numpy as np
from joblib import Parallel, delayed
from joblib.externals.loky.process_executor import TerminatedWorkerError
from numpy.typing import NDArray

from physid_drake.cell import Cell, Motion, Outcome
from physid_drake.effects.rollout import Geometry, Rollout, roll, tracked
from physid_drake.errors import TippedError, WorkerError
from physid_drake.processes import ENDED, end_with_parent
from physid_drake.pushes.force_windows import offsets
from physid_drake.pushes.kept_rollouts import KeptRollouts, key_of
from physid_drake.pushes.nuisance import apply_nuisance
from physid_drake.pushes.prediction import Prediction
from physid_drake.pushes.problem import CellSpec, turned_as_recorded
from physid_drake.pushes.task import Task
from physid_drake.pushes.theta import ThetaMap

Array = NDArray[np.float64]

MOST_CELLS = 24  # kept by a process: effects of shape and pressure build their own

_cells: OrderedDict[str, Cell] = OrderedDict()


def cell_of(spec: CellSpec, geometry: Geometry | None = None) -> Cell:
    """This process's cell for a spec, built at the first call.

    Args:
        spec: the baseline model's.
        geometry: the shape and pressure, where effects change the spec's.
    """
    made = geometry or Geometry(shape=spec.shape)
    key = repr((spec, made))
    if key not in _cells:
        _cells[key] = Cell(
            made.shape, hand_radius=spec.hand_radius, config=spec.config, table=np.array(spec.table),
            pressure=made.pressure, gravity=made.gravity,
        )  # fmt: skip
        if len(_cells) > MOST_CELLS:
            _cells.popitem(last=False)
    _cells.move_to_end(key)
    return _cells[key]


def simulate(spec: CellSpec, thetas: ThetaMap, task: Task) -> Motion:
    """One rollout in this process."""
    spec = _paced(spec, task.problem.pace)
    setting = apply_nuisance(task.problem, task.nuisance, task.values)
    body = thetas.body(task.theta, friction_scale=setting.friction_scale, restitution=setting.restitution)
    push = Rollout(
        start=setting.start,
        path=setting.path,
        begin=task.problem.begin,
        end=task.problem.end,
        hand_height=task.problem.hand_height,
        hand_axes=task.problem.hand_axes,
        order=task.problem.order,
    )
    return roll(lambda geometry: cell_of(spec, geometry), Geometry(shape=spec.shape), body, push, task.effects)


def _paced(spec: CellSpec, pace: float) -> CellSpec:
    """The cell with longer time steps."""
    if pace == 1.0:
        return spec
    solver = spec.config.solver
    time_step = pace * solver.time_step_s
    longer = dc.replace(solver, time_step_s=time_step, slide_time_step_s=max(solver.slide_time_step_s, time_step))
    return dc.replace(spec, config=dc.replace(spec.config, solver=longer))


def predict(spec: CellSpec, thetas: ThetaMap, task: Task) -> Prediction | None:
    """What the rollout predicts at the recorded times; None if it diverged, or if the object could not stand."""
    try:
        motion = simulate(spec, thetas, task)
    except TippedError:  # a fit may try such a centre of mass, and has to learn that it is no good
        return None
    if motion.outcome is Outcome.DIVERGED:
        return None
    poses = tracked(motion, task.problem.times, task.effects)
    first = tracked(motion, np.array([task.problem.begin]), task.effects)[0, 2]
    poses = turned_as_recorded(task.problem, first, poses)
    forces = _window_forces(motion, task.problem.force_times)
    return Prediction(poses=poses, forces=forces, fell=motion.outcome is Outcome.FELL)


def _window_forces(motion: Motion, middles: Array) -> Array:
    """Mean forces (k, 2) over the windows about the middles."""
    if not len(middles):
        return np.zeros((0, 2))
    samples = motion.forces_at((middles[:, None] + offsets()).ravel())
    means: Array = samples[:, :2].reshape(len(middles), -1, 2).mean(axis=1)
    return means


def _predict_many(spec: CellSpec, thetas: ThetaMap, tasks: Sequence[Task]) -> list[Prediction | None]:
    # Ctrl-C goes to all processes of a terminal; the one that waits for these answers it, and ends them.
    if parent_process() is not None and current_thread() is main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    return [predict(spec, thetas, task) for task in tasks]


class RolloutPool:
    """Runs many tasks on all cores, in order, with the same bits as one core would give."""

    def __init__(
        self,
        spec: CellSpec,
        thetas: ThetaMap,
        jobs: int = 0,
        *,
        kept: KeptRollouts | None = None,
    ) -> None:
        """Prepare.

        Args:
            spec: the cell's.
            thetas: what theta means in it.
            jobs: processes; 0 takes the machine's cores.
            kept: rollouts that need not be made again, and where those that are made are kept; None keeps none.
        """
        self.spec, self.thetas, self.kept = spec, thetas, kept
        self.jobs = jobs or os.cpu_count() or 1
        self.count = 0
        self.diverged = 0

    def of(self, spec: CellSpec) -> RolloutPool:
        """A pool for another cell, which keeps its rollouts in the same place."""
        return RolloutPool(spec, self.thetas, self.jobs, kept=self.kept)

    def run(self, tasks: Sequence[Task], progress: Callable[[int], None] | None = None) -> list[Prediction | None]:
        """Predictions in the order of the tasks; ``time step`` is told how many more are done."""
        results = list(
            self._made(tasks, progress) if self.kept is None else self._recalled(tasks, self.kept, progress)
        )
        self.count += len(results)
        self.diverged += sum(result is None for result in results)
        return results

    def _made(self, tasks: Sequence[Task], progress: Callable[[int], None] | None) -> Iterable[Prediction | None]:
        for chunk in self._chunks(tasks):
            yield from chunk
            if progress is not None:
                progress(len(chunk))

    def _recalled(
        self, tasks: Sequence[Task], kept: KeptRollouts, progress: Callable[[int], None] | None
    ) -> Iterable[Prediction | None]:
        """Of the tasks, those that are not kept are made, each of them once."""
        cell = repr((self.spec, self.thetas))
        keys = [key_of(task, cell) for task in tasks]
        fresh = {key: task for key, task in zip(keys, tasks, strict=True) if key not in kept}
        missing, made = iter(fresh), dict[bytes, Prediction | None]()
        for chunk in self._chunks(list(fresh.values())):
            of_chunk = {next(missing): said for said in chunk}
            kept.keep(of_chunk)
            made |= of_chunk
            if progress is not None:
                progress(len(chunk))
        if progress is not None and len(tasks) > len(fresh):
            progress(len(tasks) - len(fresh))
        return (made[key] if key in made else kept[key] for key in keys)

    def _chunks(self, tasks: Sequence[Task]) -> Iterable[list[Prediction | None]]:
        if self.jobs == 1 or len(tasks) == 1:
            return ([predict(self.spec, self.thetas, task)] for task in tasks)
        size = max(1, min(8, len(tasks) // (2 * self.jobs)))
        return self._in_processes([tasks[k : k + size] for k in range(0, len(tasks), size)])

    def _in_processes(self, pieces: Sequence[Sequence[Task]]) -> Iterator[list[Prediction | None]]:
        """Each piece's predictions; a process that the system ends is replaced, once where nothing was done since."""
        left, lost = list(pieces), False
        while left:
            try:
                for chunk in Parallel(n_jobs=self.jobs, return_as="generator", initializer=end_with_parent)(
                    delayed(_predict_many)(self.spec, self.thetas, piece) for piece in left
                ):
                    left, lost = left[1:], False
                    yield chunk
            except TerminatedWorkerError as error:
                if lost:
                    raise WorkerError(ENDED) from error
                lost = True
