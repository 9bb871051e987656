"""The project's own Cell as an engine of the benchmark, and the work that a worker process does."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np

from peers.push import DURATION, FRICTION, MASS, PUSHES, SIZE, TIP_HEIGHT, TIP_RADIUS, Array, Push
from physid_drake.cell import Body, Cell, CellConfig, HandPath, Motion, Outcome, Start
from physid_drake.recording import Box


@dataclass(frozen=True, kw_only=True)
class Setting:
    """How the Cell is set: contact model, and its two time steps [s] (hand near, free slide)."""

    model: str
    near: float = 1e-3
    slide: float = 2e-3
    rebuilt: bool = False

    def cell(self) -> Cell:
        """A new Cell."""
        config = CellConfig()
        config.contact.model = self.model
        config.solver.time_step_s, config.solver.slide_time_step_s = self.near, self.slide
        return Cell(Box(size=SIZE), hand_radius=TIP_RADIUS, config=config)


class CellEngine:
    """Rollouts of one Cell, built once, or again for every push."""

    def __init__(self, setting: Setting) -> None:
        self._setting = setting
        self.cell = setting.cell()

    def motion(self, push: Push) -> Motion:
        """The whole motion; writes the parameters into the Context first, as a search does."""
        if self._setting.rebuilt:
            self.cell = self._setting.cell()
        return self.cell.rollout(
            Body(
                mass=MASS, p_BBcm=np.zeros(2), inertia_ratio=1.0, hand_friction=FRICTION,
                support_friction=np.array([FRICTION]),
            ),
            start=Start(pose=(0.0, 0.0, 0.0)),
            path=HandPath(times=push.times, velocities=push.velocities, start=push.start),
            begin=0.0, end=DURATION, hand_height=TIP_HEIGHT,
        )  # fmt: skip

    def rollout(self, push: Push) -> Array:
        """End pose (3,) [m, rad].

        Raises:
            FloatingPointError: if the rollout diverged.
        """
        motion = self.motion(push)
        if motion.outcome is not Outcome.COMPLETED:
            raise FloatingPointError(f"push {push.name!r} of {self._setting} {motion.outcome.value}")
        return np.asarray(motion.planar_at(np.array([DURATION]))[0])

    def skipped(self, push: Push) -> float:
        """Time [s] of a push that the Cell jumped over because nothing moved."""
        spans = np.diff(self.motion(push).times)
        return float(spans[spans > 1.5 * max(self._setting.near, self._setting.slide)].sum())


@cache
def engine_of(setting: Setting) -> CellEngine:
    """This process's engine for a setting, built at the first call."""
    return CellEngine(setting)


def all_pushes(setting: Setting) -> float:
    """Simulate each push once in this process; returns the CPU time [s]."""
    engine = engine_of(setting)
    begin = time.process_time()
    for push in PUSHES:
        engine.rollout(push)
    return time.process_time() - begin


@dataclass
class Watch:
    """Adds up the time spent in calls that it wraps."""

    seconds: dict[str, float] = field(default_factory=dict)

    def wrap(self, label: str, call: Callable[..., Any]) -> Callable[..., Any]:
        """The same call, timed."""

        def timed(*args: Any) -> Any:
            begin = time.perf_counter()
            result = call(*args)
            self.seconds[label] = self.seconds.get(label, 0.0) + time.perf_counter() - begin
            return result

        return timed


class _Watched:
    """Stands for a Drake object, with some of its methods timed."""

    def __init__(self, inner: Any, watch: Watch, labels: dict[str, str]) -> None:
        self._inner = inner
        for method, label in labels.items():
            setattr(self, method, watch.wrap(label, getattr(inner, method)))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)


def watched(setting: Setting) -> tuple[CellEngine, Watch]:
    """An engine whose calls of Drake are timed: steps, the exchange of the state, and writing theta."""
    engine, watch = CellEngine(setting), Watch()
    cell: Any = engine.cell
    stepper = cell._stepper
    exchange = dict.fromkeys(("SetPositionsAndVelocities", "GetPositionsAndVelocities"), "state")
    stepper._simulator = _Watched(stepper._simulator, watch, {"AdvanceTo": "advance", "Initialize": "state"})
    stepper._state._plant = _Watched(stepper._state._plant, watch, exchange)
    cell.set_body = watch.wrap("theta", cell.set_body)
    return engine, watch
