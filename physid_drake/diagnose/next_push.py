"""The push that would distinguish rival models best."""

from __future__ import annotations

import dataclasses as dc
import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.cell import HandPath, Start
from physid_drake.cell.solid import solid_of
from physid_drake.diagnose.exported import hand_frame
from physid_drake.diagnose.values import NextPush
from physid_drake.inference.rollouts import Ask, Physics, Rollouts
from physid_drake.model import turned
from physid_drake.pushes.case import Case
from physid_drake.pushes.frame_checks import reach_of
from physid_drake.pushes.problem import PushProblem
from physid_drake.pushes.rollouts import RolloutPool

Array = NDArray[np.float64]

DIRECTIONS = 8
SPEEDS = (0.1, 0.4)  # m/s
OFFSETS = (-0.3, 0.3)  # of the object's half width
TRAVEL = 0.12  # m of the hand after the touch
RUN_UP, RAMP, BRAKE = 0.02, 0.05, 0.05  # m, s, s
AFTER = 1.0  # s
LONGEST_TIME_STEP = 2e-3  # s, for hands as fast as these, which a recording's may not be
REPEATS = 0.02  # relative standard deviation of the motion when a push is repeated


def next_push(case: Case, models: Sequence[Physics]) -> NextPush | None:
    """The push whose end distinguishes the models best, out of a grid of directions, speeds and contact offsets.

    Args:
        case: the recording, made ready.
        models: the rivals.

    Returns:
        The push and the probability that its end shows which model is right; None without rivals, without a hand, or
        where
        in every push a model diverges or the object may leave the table.
    """
    if len(models) < 2 or case.recording.hand is None:
        return None
    pushes = [_problem(case, *choice) for choice in _choices()]
    nuisance = case.nuisances[0]
    rest = np.zeros(len(nuisance.names))
    twin = Rollouts(brisk_pool(case), pushes, [nuisance] * len(pushes))
    asks = [Ask(k, model, rest) for model in models for k in range(len(pushes))]
    found = twin.predictions(asks)
    left = [k for k, one in enumerate(found) if one is None]
    for k, one in zip(left, twin.in_cell(twin.pool).predictions([asks[k] for k in left]), strict=True):
        found[k] = one
    ends = [None if one is None else one.poses[-1] for one in found]
    chances = [_chance(case, ends[k :: len(pushes)], pushes[k]) for k in range(len(pushes))]
    best = int(np.argmax(chances))
    if chances[best] == -math.inf:
        return None
    direction, speed, offset = _choices()[best]
    return NextPush(
        direction_deg=math.degrees(direction), speed_mps=speed, contact_offset_m=offset * 0.5 * _width(case),
        start_x_m=pushes[best].start.pose[0], start_y_m=pushes[best].start.pose[1],
        start_yaw_deg=math.degrees(pushes[best].start.pose[2]),
        settles_with_probability=max(chances[best], 1.0 / len(models)),  # a guess
    )  # fmt: skip


def brisk_pool(case: Case) -> RolloutPool:
    """A pool with the case's cell, with time steps that are short enough for a fast hand."""
    spec = case.pool.spec
    share = min(1.0, LONGEST_TIME_STEP / spec.config.solver.time_step_s)
    config = dc.replace(spec.config, solver=spec.config.solver.scaled(share))
    return case.pool.of(dc.replace(spec, config=config))


def _choices() -> list[tuple[float, float, float]]:
    directions = [2.0 * math.pi * k / DIRECTIONS for k in range(DIRECTIONS)]
    return list(itertools.product(directions, SPEEDS, OFFSETS))


def _width(case: Case) -> float:
    return float(case.around.size.min())


def _problem(case: Case, direction: float, speed: float, offset: float) -> PushProblem:
    """A push of the object in the middle of the region, its axes along the table's."""
    middle = 0.5 * (case.around.region[0] + case.around.region[1])
    ahead = np.array([math.cos(direction), math.sin(direction)])
    aside = np.array([-ahead[1], ahead[0]])
    assert case.recording.hand is not None
    outline = solid_of(case.recording.object.shape).outline
    radius = case.recording.hand.radius
    start = middle + 0.5 * offset * _width(case) * aside
    reach = 0.0
    # Step back until the tip is clear of the outline.
    while outline.nearest(*(start - middle - reach * ahead).tolist())[0] < radius + RUN_UP:
        reach += 2e-3
    ramp, brake = min(RAMP, RUN_UP / speed), BRAKE
    cruise = (RUN_UP + TRAVEL) / speed
    times = np.cumsum([0.05, ramp, cruise, brake])
    path = HandPath(times=times, velocities=np.outer([0.0, speed, speed, 0.0], ahead), start=start - reach * ahead)
    end = float(times[-1]) + AFTER
    hand_axes, hand_turns = hand_frame(case.problems)
    axes = turned(direction) @ np.array(hand_axes) if hand_turns else np.array(hand_axes)
    return dc.replace(
        case.problems[0], name="next", order=case.pushes, pace=1.0, begin=0.0, end=end, hand_axes=axes,
        start=Start(pose=(float(middle[0]), float(middle[1]), 0.0)), path=path, times=np.array([end]),
        poses=np.zeros((1, 3)), force_times=np.zeros(0), forces=np.zeros((0, 2)), force_std=np.zeros(0),
    )  # fmt: skip


def _on_table(case: Case, end: Array) -> bool:
    """Whether an object at a pose (3,) stands on the table as a whole, however it is turned."""
    reach = reach_of(case.recording)
    centre, size = np.array(case.recording.table.centre), np.array(case.recording.table.size)
    return bool((np.abs(end[:2] - centre) + reach < 0.5 * size).all())


def _chance(case: Case, ends: Sequence[Array | None], problem: PushProblem) -> float:
    """Probability that the end pose names the right one of the models, for the one that is hardest to tell.

    At least so large: the chances to take it for each of the others add up at most (Boole), which is exact for two,
    and below zero where nothing tells. Minus infinity for a push in which a model diverges or lets the object come
    near an edge of the table.
    """
    if any(e is None or not _on_table(case, e) for e in ends):
        return -math.inf
    known = np.array([e for e in ends if e is not None])
    return min(_told(case, known[k], np.delete(known, k, axis=0), problem) for k in range(len(known)))


def _told(case: Case, end: Array, others: Array, problem: PushProblem) -> float:
    """At least the probability that a push which ends at a pose (3,) is not taken for one of the others (n, 3)."""
    moved = np.abs(end - np.array(problem.start.pose))
    reach = float(np.hypot(moved[0], moved[1]))
    std = np.hypot(case.noise.sigmas, REPEATS * np.array([reach, reach, max(moved[2], reach / 0.05)]))
    apart = np.linalg.norm((others - end) / std, axis=1)
    return 1.0 - float(stats.norm.sf(0.5 * apart).sum())
