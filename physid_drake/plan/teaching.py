"""The most informative push: the expected information about theta of pushes that were not made yet."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import Start
from physid_drake.cell.solid import solid_of
from physid_drake.errors import ConfigError
from physid_drake.identify.baseline import baseline_hypothesis
from physid_drake.inference.fit import Fitter
from physid_drake.inference.predictions import Predictor
from physid_drake.inference.push import NO_TAIL, weighed
from physid_drake.policies import PlannedPush
from physid_drake.policies.planned_push import LEAD
from physid_drake.pushes.case import UNIT_SCATTER, Case
from physid_drake.pushes.features import features_of
from physid_drake.pushes.nuisance import nuisance_of
from physid_drake.pushes.problem import PushProblem, first_motion
from physid_drake.pushes.task import Task
from physid_drake.recording import Push, planar_poses

Array = NDArray[np.float64]
Pose = tuple[float, float, float]

RATE = 100.0  # Hz of the recording that is expected
AFTER = 1.0  # s recorded after the hand has stopped
SCATTER = 1.0  # of friction from push to push, in units of UNIT_SCATTER
NOISE_SCALE = 1.0  # times the noise: as where the cell explains the pushes


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Lesson:
    """The expected information of pushes.

    Attributes:
        best: index of the push with the largest gain.
        gains: (n,) expected decrease of the entropy of theta [nats]; 0 where the rollout diverges or the object
            falls.
        informations: (n, d, d) expected information matrix of each push, for theta in the unit cube.
        stds: (n, d) posterior standard deviations after each push, in the unit cube.
    """

    best: int
    gains: Array
    informations: Array
    stds: Array


def most_informative_push(
    pushes: Sequence[PlannedPush],
    *,
    case: Case,
    start: Pose,
    thetas: Array,
    information: Array | None = None,
) -> Lesson:
    """The planned push that is expected to be most informative about theta.

    A push's information matrix is that of a recording at 100 Hz with the recording's noise, its nuisance parameters
    marginalised as in the fit, with derivatives by differences of rollouts. The hand's path is taken as exact; with a
    noisy hand the information is smaller. The gain is half the increase of the log-determinant of the information,
    averaged over ``thetas``: the expected decrease of a Gaussian's entropy.

    Args:
        pushes: to choose from, for instance ``policy.pushes(settings)[0]`` of sampled settings.
        case: a recording with the same object, hand and sensors, made ready.
        start: of the object, x, y [m], yaw [rad].
        thetas: (d,) the estimate, or (k, d) posterior samples, each entry in its unit. Each takes 2 + d + number of
            nuisance parameters rollouts a push.
        information: (d, d) current information in the unit cube, such as ``OnlineBelief.information``; None is the
            prior's.

    Raises:
        ConfigError: if there is no push, the cell has no hand, or the hand would miss the object.

    Source: V. Fedorov, Theory of Optimal Experiments, 1972, for D-optimality; D. Lindley, Ann. Math. Stat. 27, 1956.
    """
    if not pushes:
        raise ConfigError("next push: at least one push is needed to choose from.")
    if case.pool.spec.hand_radius is None:
        raise ConfigError("next push: the cell has no hand.")
    known = baseline_hypothesis(case).precision if information is None else information
    points = np.atleast_2d(np.asarray(thetas, dtype=np.float64))
    problems = [_problem(f"next {k}", push, case, start) for k, push in enumerate(pushes)]
    gains, expected = np.zeros(len(pushes)), np.zeros((len(pushes), *known.shape))
    for theta in points:
        told = _informations(case, problems, theta)
        expected += told / len(points)
        gains += 0.5 * (np.linalg.slogdet(known + told)[1] - np.linalg.slogdet(known)[1]) / len(points)
    covariances = np.linalg.inv(known + expected)
    return Lesson(
        best=int(np.argmax(gains)), gains=gains, informations=expected,
        stds=np.sqrt(np.diagonal(covariances, axis1=1, axis2=2)),
    )  # fmt: skip


def _informations(case: Case, problems: Sequence[PushProblem], theta: Array) -> Array:
    """Information (n, d, d) of each push at theta (d,); zero where the rollout diverged or fell."""
    d = case.thetas.space.dimension
    told = np.zeros((len(problems), d, d))
    nuisances = [nuisance_of(problem, UNIT_SCATTER) for problem in problems]
    foreseen = case.pool.run([
        Task(problem=p, theta=theta, nuisance=n, values=np.zeros(len(n.names)))
        for p, n in zip(problems, nuisances, strict=True)
    ])  # fmt: skip
    # An object that is lost is not pushed again, and what follows its fall would be no measurement.
    kept = {k: p for k, p in enumerate(foreseen) if p is not None and not p.fell}
    if not kept:
        return told
    # What is predicted stands for what will be recorded: only the slopes count.
    recorded = [_foreseen(problems[k], p.poses, case) for k, p in kept.items()]
    pushes = [_push(problem, case) for problem in recorded]
    case = dc.replace(
        case, problems=tuple(recorded), nuisances=tuple(nuisances[k] for k in kept),
        features=tuple(features_of(p, q, case.noise) for p, q in zip(pushes, recorded, strict=True)),
    )  # fmt: skip
    fitter, h = Fitter(case, Predictor(case)), baseline_hypothesis(case)
    z = np.clip(case.thetas.space.to_unit(theta), *h.bounds)
    point = fitter.points([h], [z], [fitter.at_rest()])[0]
    if point is None:  # what the twin cannot say of one of them, the cell says of all
        fitter = Fitter(case, Predictor(case, range(len(recorded))))
        point = fitter.points([h], [z], [fitter.at_rest()])[0]
    assert point is not None
    pushed = fitter.started([h], [point], [None])[0].pushes
    for k, push, prior in zip(kept, pushed, fitter.priors(SCATTER), strict=True):
        told[k] = weighed(push.residual, push.shared, push.nuisance, prior, NOISE_SCALE, NO_TAIL).precision
    return told


def _foreseen(problem: PushProblem, poses: Array, case: Case) -> PushProblem:
    """The push as if it had been recorded; the rest before the touch tells nothing of the cell's own error."""
    problem = dc.replace(problem, poses=poses)
    return dc.replace(problem, moving=(first_motion(problem, case.noise.position), math.inf))


def _push(problem: PushProblem, case: Case) -> Push:
    height = 0.5 * solid_of(case.pool.spec.shape).height
    return Push(name=problem.name, object=planar_poses(problem.times, problem.poses, height), hand=None, force=None)


def _problem(name: str, push: PlannedPush, case: Case, start: Pose) -> PushProblem:
    """The push as its recording would be fitted; its poses are still to be foreseen."""
    spec = case.pool.spec
    assert spec.hand_radius is not None
    solid = solid_of(spec.shape)
    path = push.path(start, solid.outline, spec.hand_radius)
    times = np.arange(math.ceil((float(path.times[-1]) + AFTER) * RATE)) / RATE
    return PushProblem(
        name=name, order=0, begin=0.0, end=float(times[-1]), start=Start(pose=start),
        start_std=case.sensors.mean_std(LEAD * RATE), path=path,
        hand_height=0.5 * solid.height, times=times,
        poses=np.zeros((len(times), 3)), force_times=np.zeros(0), forces=np.zeros((0, 2)), force_std=np.zeros(0),
    )  # fmt: skip
