"""Predicts what planned pushes do: the object's trajectory, and how it ends."""

from __future__ import annotations

import dataclasses as dc
import enum
import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import HandPath, Motion, Outcome, SolverConfig, Start
from physid_drake.cell.solid import Solid, solid_of
from physid_drake.effects import PushFacts
from physid_drake.effects.rollout import Geometry, Rollout, aimed, geometry_with, roll, tracked, true_pose
from physid_drake.errors import ConfigError, ParameterError
from physid_drake.model import Model
from physid_drake.policies import PlannedPush
from physid_drake.pushes.problem import CellSpec
from physid_drake.pushes.rollouts import cell_of
from physid_drake.recording import Shape

Array = NDArray[np.float64]
Pose = tuple[float, float, float]

HORIZON = 4.0  # s after the hand has stopped
MOST_SAMPLES = 200
TOPPLED = math.cos(math.radians(30.0))
STILL = 2e-3  # m/s, of any point
LONGEST_STEP = 2.5e-4  # m of the hand in one time step, within the bounds below
SHORTEST_TIME_STEP, LONGEST_TIME_STEP = 2e-3, 4e-3  # s, unless the model's own time step is shorter, or longer


class Ending(enum.Enum):
    """How a trajectory ended."""

    AT_REST = "at rest"
    MOVING = "still moving"
    FELL = "fell off the table"
    TOPPLED = "toppled"
    DIVERGED = "diverged"


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory:
    """The predicted motion of an object, as the recording's tracker would report it.

    Attributes:
        times: (n,) from the start of the first push [s]; later pushes follow on.
        poses: (n, 3) x, y [m], yaw [rad].
        paths: of the hand, one for each push, each from its own time 0.
        ending: how it ends.
    """

    times: Array
    poses: Array
    paths: tuple[HandPath, ...]
    ending: Ending

    @property
    def end(self) -> Array:
        """The last pose (3,), x, y [m], yaw [rad]."""
        return np.asarray(self.poses[-1])

    @property
    def lost(self) -> bool:
        """Whether the object fell off the table or toppled."""
        return self.ending in (Ending.FELL, Ending.TOPPLED)


@dc.dataclass(frozen=True, kw_only=True)
class Situation:
    """Where a push begins.

    Attributes:
        start: of the object, as the tracker reports it, x, y [m], yaw [rad].
        order: number of the push since the recording began, for effects that depend on it.
        hand_height: of the tip's contact above the table [m]; None for the model's, or half the object's height.
        start_std: standard deviations of the object's pose about ``start`` [m, m, rad].
    """

    start: Pose
    order: int = 0
    hand_height: float | None = None
    start_std: Pose = (0.0, 0.0, 0.0)


@cache
def _solid(shape: Shape) -> Solid:
    return solid_of(shape)


def true_solid(model: Model) -> Solid:
    """The object's solid, with the effects of the model that change its size."""
    return _solid(geometry_with(model.effects, Geometry(shape=model.shape)).shape)


def contact_height_of(model: Model, situation: Situation) -> float:
    """Height of the tip's contact above the table [m]."""
    known = model.contact_height if situation.hand_height is None else situation.hand_height
    return 0.5 * true_solid(model).height if known is None else known


def tip_height_of(model: Model, situation: Situation) -> float:
    """Height of the tip's centre above the table, for a robot [m].

    Where the model does not know it, the height of the contact is taken, which is correct for a sphere.
    """
    return contact_height_of(model, situation) if model.tip_height is None else model.tip_height


def hand_radius_of(model: Model) -> float:
    """Radius of the tip [m].

    Raises:
        ConfigError: if the model has no hand.
    """
    if model.hand_radius is None:
        raise ConfigError(f"model '{model.recording}': has no hand, so that no push can be planned.")
    return model.hand_radius


def path_of(model: Model, push: PlannedPush, pose: Pose) -> HandPath:
    """The path to command for a planned push.

    The model's effects on tracker and hand are taken into account, so that the true tip meets the true object.

    Args:
        model: with its effects.
        push: the plan.
        pose: of the object, as the tracker reports it, x, y [m], yaw [rad].

    Raises:
        ConfigError: if the model has no hand, or the hand would miss the object.
    """
    path = push.path(true_pose(model.effects, pose), true_solid(model).outline, hand_radius_of(model))
    facts = PushFacts(order=0, mass=model.body.mass, polar=0.0, hand_axes=model.axes_on(path))
    return aimed(model.effects, path, facts)


def trajectory_of(
    model: Model,
    pushes: tuple[PlannedPush, ...],
    situation: Situation,
    *,
    path: HandPath | None = None,
    believed: Model | None = None,
    rate: float | None = None,
) -> Trajectory:
    """Simulate pushes, one after the other.

    Args:
        model: the object, with its effects.
        pushes: at least one; none is made after the object is lost or does not stop.
        situation: where the object starts.
        path: of the hand in the first push; None makes it from the push.
        believed: the model with which the hand's paths are made; None for ``model``.
        rate: of the samples that are returned [Hz]; None for ``MOST_SAMPLES`` of each push.

    Raises:
        ConfigError: if the model has no hand, or the hand would miss the object.
    """
    pose, clock = situation.start, 0.0
    times, poses, paths, ending = [], [], [], Ending.AT_REST
    for number, push in enumerate(pushes):
        paths.append(path_of(believed or model, push, pose) if number or path is None else path)
        try:
            motion = _roll(model, push, paths[-1], dc.replace(situation, start=pose, order=situation.order + number))
        except ParameterError:  # a sample may be an impossible object, or one that cannot stand
            times.append(np.array([clock]))
            poses.append(np.array([pose]))
            ending = Ending.DIVERGED
            break
        sampled = _sampled(float(motion.times[-1]), rate)
        seen = tracked(motion, sampled, model.effects)
        times.append(clock + sampled)
        poses.append(seen)
        ending = _ending(model, motion)
        clock += float(paths[-1].times[-1]) + HORIZON
        pose = (float(seen[-1, 0]), float(seen[-1, 1]), float(seen[-1, 2]))
        if ending is not Ending.AT_REST:
            break
    return Trajectory(
        times=np.concatenate(times), poses=np.concatenate(poses), paths=tuple(paths), ending=ending
    )  # fmt: skip


def _sampled(duration: float, rate: float | None) -> Array:
    if rate is None:
        return np.linspace(0.0, duration, MOST_SAMPLES)
    return np.arange(math.floor(duration * rate + 1e-9) + 1) / rate


def _roll(model: Model, push: PlannedPush, path: HandPath, situation: Situation) -> Motion:
    config = dc.replace(model.config, solver=_paced(model.config.solver, push.speed))
    spec = CellSpec(shape=model.shape, hand_radius=model.hand_radius, config=config, table=model.table)
    rollout = Rollout(
        start=Start(pose=situation.start), path=path, begin=0.0, end=float(path.times[-1]) + HORIZON,
        hand_height=contact_height_of(model, situation), order=situation.order, hand_axes=model.axes_on(path),
    )  # fmt: skip
    return roll(lambda g: cell_of(spec, g), Geometry(shape=model.shape), model.body, rollout, model.effects)


def _paced(solver: SolverConfig, speed: float) -> SolverConfig:
    """Time steps for a push's speed: in those of a model of slow pushes a fast hand would jump."""
    own = solver.time_step_s
    # In powers of two, so that few cells are built.
    wanted = own * 2.0 ** math.floor(math.log2(LONGEST_STEP / (speed * own)))
    time_step = min(max(wanted, min(own, SHORTEST_TIME_STEP)), max(own, LONGEST_TIME_STEP))
    return dc.replace(
        solver,
        time_step_s=time_step,
        slide_time_step_s=max(time_step, min(solver.slide_time_step_s, 2.0 * time_step)),
    )


def _ending(model: Model, motion: Motion) -> Ending:
    if motion.outcome is Outcome.DIVERGED:
        return Ending.DIVERGED
    if motion.outcome is Outcome.FELL:
        # Only the underside meets the table, so that what topples sinks into it.
        low, high = np.array(model.table)
        place = motion.poses[-1, 4:6]
        return Ending.TOPPLED if ((place >= low) & (place <= high)).all() else Ending.FELL
    w, x, y, z = motion.poses[-1, :4]
    solid = true_solid(model)
    rolls = solid.rolling_radius is not None
    # What stays upright, or level where the object rolls: B's z axis, or its y axis.
    upright = 1.0 - 2.0 * (x * x + y * y) if not rolls else math.sqrt(max(0.0, 1.0 - 4.0 * (y * z + w * x) ** 2))
    if upright < TOPPLED:
        return Ending.TOPPLED
    end = float(motion.times[-1])
    dx, dy, turn = np.abs(np.diff(motion.planar_at(np.array([end - 0.05, end])), axis=0))[0].tolist()
    x0, y0, x1, y1 = solid.outline.extent()
    rim = math.hypot(dx, dy) + turn * 0.5 * math.hypot(x1 - x0, y1 - y0)
    return Ending.MOVING if rim > 0.05 * STILL else Ending.AT_REST
