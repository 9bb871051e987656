"""The next push that teaches most: the expected information about theta of pushes that were not made yet."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import Start
from physid_drake.cell.solid import solid_of
from physid_drake.errors import ConfigError
from physid_drake.identify.linearise import linearised, prior_slope
from physid_drake.policies import PlannedPush
from physid_drake.policies.planned_push import LEAD
from physid_drake.pushes.noise import Noise
from physid_drake.pushes.nuisance import FIRST_SCATTER, nuisance_of
from physid_drake.pushes.problem import PushProblem, first_motion
from physid_drake.pushes.rollouts import RolloutPool
from physid_drake.pushes.task import Task

Array = NDArray[np.float64]
Pose = tuple[float, float, float]

RATE = 100.0  # Hz of the recording that is expected
AFTER = 1.0  # s recorded after the hand has stopped


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Lesson:
    """What pushes are expected to teach.

    Attributes:
        best: index of the push that teaches most.
        gains: (n,) expected information of each push about theta [nats]; 0 where its rollout diverged or fell
            off the table.
        informations: (n, d, d) expected information of each push, in the unit cube of theta.
        stds: (n, d) posterior standard deviations after each push, in the unit cube.
    """

    best: int
    gains: Array
    informations: Array
    stds: Array


def most_informative_push(
    pushes: Sequence[PlannedPush],
    *,
    pool: RolloutPool,
    noise: Noise,
    start: Pose,
    thetas: Array,
    information: Array | None = None,
    scatter: float = FIRST_SCATTER,
    inflation: float = 1.0,
    order: int = 0,
    hand_height: float | None = None,
) -> Lesson:
    """Of planned pushes, the one that is expected to teach most about theta.

    A push's information is that of a recording at 100 Hz with the stated noise, its own unknowns marginalised as in
    the fit: simulated Jacobians, no approximation of the mechanics. But the hand's path is taken for exact: a noisy
    hand teaches less than is expected. The gain is half the rise of the log-determinant of the Gaussian information,
    averaged over ``thetas``: what a Gaussian belief is expected to lose in entropy.

    Args:
        pushes: to choose from, for instance ``policy.pushes(settings)[0]`` of drawn settings.
        pool: of the cell that is believed in.
        noise: of the recording that is expected.
        start: of the object, x, y [m], yaw [rad].
        thetas: (d,) the estimate, or (k, d) draws from the belief, each entry in its unit; each costs
            2 + own unknowns + 2 d rollouts a push.
        information: (d, d) what is known, in the unit cube, such as ``OnlineBelief.information``; None is the prior.
        scatter: of friction from push to push [-].
        inflation: by which the noise was widened where the cell does not explain the pushes.
        order: number of the push in the recording.
        hand_height: of the tip's contact above the table [m]; None for half the object's height.

    Raises:
        ConfigError: if there is no push, the cell has no hand, or a push cannot be made.

    Source: V. Fedorov, Theory of Optimal Experiments, 1972 (D-optimality); D. Lindley, Ann. Math. Stat. 27, 1956.
    """
    if not pushes:
        raise ConfigError("next push: at least one push is needed to choose from.")
    if pool.spec.hand_radius is None:
        raise ConfigError("next push: the cell has no hand.")
    space = pool.thetas.space
    slope = prior_slope(space)
    known = slope.T @ slope if information is None else information
    points = np.atleast_2d(np.asarray(thetas, dtype=np.float64))
    problems = [_problem(push, pool, noise, start, order, hand_height) for push in pushes]
    gains, expected = np.zeros(len(pushes)), np.zeros((len(pushes), *known.shape))
    for theta in points:
        told = _informations(pool, problems, noise, theta, scatter) / inflation
        expected += told / len(points)
        gains += 0.5 * (np.linalg.slogdet(known + told)[1] - np.linalg.slogdet(known)[1]) / len(points)
    covariances = np.linalg.inv(known + expected)
    return Lesson(
        best=int(np.argmax(gains)), gains=gains, informations=expected,
        stds=np.sqrt(np.diagonal(covariances, axis1=1, axis2=2)),
    )  # fmt: skip


def _informations(
    pool: RolloutPool, problems: Sequence[PushProblem], noise: Noise, theta: Array, scatter: float
) -> Array:
    """Information (n, d, d) of each push at theta (d,); zero where the rollout diverged or fell."""
    nuisances = [nuisance_of(problem, scatter) for problem in problems]
    foreseen = pool.run(
        [
            Task(problem=p, theta=theta, nuisance=n, values=np.zeros(len(n.names)))
            for p, n in zip(problems, nuisances, strict=True)
        ]
    )
    # An object that is lost is not pushed again, and what follows its fall would be no measurement.
    kept = {k: p for k, p in enumerate(foreseen) if p is not None and not p.fell}
    # What is predicted stands for what will be recorded: only the slopes count.
    recorded = [_foreseen(problems[k], p.poses, noise) for k, p in kept.items()]
    space = pool.thetas.space
    told = np.zeros((len(problems), space.dimension, space.dimension))
    for k, term in zip(
        kept, linearised(pool, recorded, noise, np.asarray(space.to_unit(theta)), scatter), strict=True
    ):
        told[k] = term.information(scatter)
    return told


def _foreseen(problem: PushProblem, poses: Array, noise: Noise) -> PushProblem:
    """The push as if it had been recorded; the rest before the touch tells nothing of the cell's own error."""
    problem = dc.replace(problem, poses=poses)
    return dc.replace(problem, moving=(first_motion(problem, noise.position), math.inf))


def _problem(
    push: PlannedPush, pool: RolloutPool, noise: Noise, start: Pose, order: int, hand_height: float | None
) -> PushProblem:
    """The push as its recording would be fitted; its poses are still to be foreseen."""
    assert pool.spec.hand_radius is not None
    solid = solid_of(pool.spec.shape)
    path = push.path(start, solid.outline, pool.spec.hand_radius)
    times = np.arange(math.ceil((float(path.times[-1]) + AFTER) * RATE)) / RATE
    return PushProblem(
        name="next", order=order, begin=0.0, end=float(times[-1]), start=Start(pose=start),
        start_std=noise.mean_std(LEAD * RATE), path=path,
        hand_height=0.5 * solid.height if hand_height is None else hand_height, times=times,
        poses=np.zeros((len(times), 3)), force_times=np.zeros(0), forces=np.zeros((0, 2)), force_std=np.zeros(0),
    )  # fmt: skip
