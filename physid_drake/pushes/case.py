"""A recording made ready for a diagnosis: its pushes, their features, the rollouts, what sets the effects' scales."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from physid_drake.cell import CellConfig
from physid_drake.cell.solid import Solid, solid_of
from physid_drake.effects import Surroundings
from physid_drake.errors import RecordingError
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.features import PushFeatures, features_of
from physid_drake.pushes.force_windows import WINDOW
from physid_drake.pushes.frame_checks import unseen_motion
from physid_drake.pushes.noise import Noise
from physid_drake.pushes.nuisance import Nuisance, nuisance_of
from physid_drake.pushes.problem import PushProblem, problems_of, spec_of
from physid_drake.pushes.push_checks import check_motion, refuse
from physid_drake.pushes.push_warnings import doubts
from physid_drake.pushes.rollouts import RolloutPool
from physid_drake.pushes.theta import ThetaMap, friction_names, theta_map
from physid_drake.pushes.tied_cells import tied_cells
from physid_drake.pushes.tracker_noise import ForceNoise, TrackerNoise, tracker_noise
from physid_drake.recording import ObjectModel, Recording, thinned

T = TypeVar("T")

# Of the hand between two time steps [m]. Measured on forty drawn pushes against time steps of half a millisecond:
# 0.02 mm and 0.5 mrad for slow pushes, as much as one millisecond costs for fast ones.
TRAVEL_PER_TIME_STEP = 2.5e-4
PACES = (1.0, 1.5, 2.0, 3.0, 4.0)
SLOW = 0.03  # m/s: a hand that is never faster
LONGEST_TIME_STEP = (
    2e-2  # s, for slow hands: within 0.08 mm and 0.6 mrad of time steps of 1 ms (benchmarks/slow_pushes.py)
)
MOST_SLIDE_TIME_STEP = 0.05  # s
MOST_PUSHES = 24  # more take longer and tell little more
UNIT_SCATTER = 0.025  # of friction, push to push: the columns' unit and the median of its prior
WHY_LOST = "with any parameters: the solver diverges, or no object stands like this"
# A rollout's own error acts like a start that is known no better than this [m, m, rad].
START_FLOOR = np.array([3e-5, 3e-5, 3e-4])


@dc.dataclass(frozen=True, kw_only=True)
class Case:
    """What a diagnosis works on.

    Attributes:
        recording: the pushes.
        noise: of the tracker.
        sensors: of hand and force.
        problems: one per push.
        nuisances: each push's nuisance parameters.
        features: what is compared, one per push.
        thetas: the parameter space.
        pool: makes the rollouts.
        around: the effects' scales.
        config: of the cell.
        pushes: of the whole recording.
        lost: names of pushes that the cell cannot simulate, which are none of the others.
    """

    recording: Recording
    noise: TrackerNoise
    sensors: Noise
    problems: tuple[PushProblem, ...]
    nuisances: tuple[Nuisance, ...]
    features: tuple[PushFeatures, ...]
    thetas: ThetaMap
    pool: RolloutPool
    around: Surroundings
    config: CellConfig
    pushes: int = 0
    lost: tuple[str, ...] = ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know of how the recording was taken."""
        some = len(self.problems) + len(self.lost)
        thinned = f"{some} of the {self.pushes} pushes were used, evenly spaced (diagnose --pushes N for more)"
        unseen = unseen_motion(self.recording, self.noise.position)
        few = (thinned,) if some < self.pushes else ()
        gone = f"skipped: {', '.join(self.lost)}, which the cell cannot simulate {WHY_LOST}"
        lost = (gone,) if self.lost else ()
        said = (*doubts(self.recording), *self.noise.warnings, *unseen, *self._unused_forces())
        read = (f"{push.name}: {warning.rstrip('.')}" for push in self.recording.pushes for warning in push.warnings)
        return (*few, *lost, *said, *read)

    def _unused_forces(self) -> tuple[str, ...]:
        """That forces were recorded of which nothing could be compared."""
        recorded = any(push.force is not None for push in self.recording.pushes)
        if not recorded or any(len(problem.force_times) for problem in self.problems):
            return ()
        return (
            f"none of the recorded forces could be used: it takes two samples in {WINDOW:g} s, while the hand"
            " pushes and after it has surely touched",
        )

    def without(self, lost: Sequence[int]) -> Case:
        """The case without pushes that the cell cannot simulate.

        Raises:
            RecordingError: if there are no others.
        """
        kept = [i for i in range(len(self.problems)) if i not in lost]
        if not kept:
            raise RecordingError(
                f"recording '{self.recording.name}': the cell cannot simulate a single push {WHY_LOST}."
            )

        def some(of: Sequence[T]) -> tuple[T, ...]:
            return tuple(of[i] for i in kept)

        return dc.replace(
            self, recording=self.recording.subset(kept), problems=some(self.problems),
            nuisances=some(self.nuisances), features=some(self.features),
            lost=(*self.lost, *(self.problems[i].name for i in lost)),
        )  # fmt: skip

    def louder(self, factor: float, forces: ForceNoise) -> Case:
        """The case with so many times the noise of the poses, and another noise of the forces."""
        noise = self.noise.louder(factor, forces)
        features = tuple(
            features_of(push, problem, noise)
            for push, problem in zip(self.recording.pushes, self.problems, strict=True)
        )
        return dc.replace(self, noise=noise, features=features)


def case_of(
    recording: Recording, config: CellConfig, theta: ThetaConfig, *, jobs: int = 0, most: int = MOST_PUSHES
) -> Case:
    """Prepare a recording.

    Args:
        recording: the pushes.
        config: of the cell.
        theta: the baseline model's unknowns.
        jobs: processes; 0 takes the machine's cores.
        most: pushes to look at; of more, so many are taken at equal distances.

    Raises:
        RecordingError: if the object never moves, there is no push, or one cannot be compared with a simulation.
    """
    if not recording.pushes:
        raise RecordingError(f"recording '{recording.name}': there is no push to diagnose; record at least three.")
    refuse(recording)
    recording = thinned(recording)
    noise, sensors = tracker_noise(recording)
    orders = np.unique(
        np.linspace(0, len(recording.pushes) - 1, min(most, len(recording.pushes))).round().astype(int)
    )
    count = len(recording.pushes)
    recording = recording.subset(orders.tolist())
    check_motion(recording, noise)
    solid = solid_of(recording.object.shape)
    problems = tuple(
        dc.replace(_paced(_floored(p), config), order=int(order))
        for p, order in zip(problems_of(recording, sensors, solid.height), orders, strict=True)
    )
    thetas = theta_space(recording.object, solid, config, theta)
    pushes = recording.pushes
    return Case(
        recording=recording,
        noise=noise,
        sensors=sensors,
        problems=problems,
        nuisances=tuple(nuisance_of(p, UNIT_SCATTER) for p in problems),
        features=tuple(features_of(push, p, noise) for push, p in zip(pushes, problems, strict=True)),
        thetas=thetas,
        pool=RolloutPool(spec_of(recording, config), thetas, jobs=jobs),
        around=_surroundings(recording, problems, thetas),
        config=config,
        pushes=count,
    )


def theta_space(model: ObjectModel, solid: Solid, config: CellConfig, theta: ThetaConfig) -> ThetaMap:
    """What is unknown of an object, with a prior that ties neighbouring friction cells."""
    grid = (config.friction_cells[0], config.friction_cells[1])
    return tied_cells(theta_map(model, solid, grid, theta, config.default_density_kgpm3), solid.outline, theta)


def cell_config(recording: Recording, *, contact: str = "point", time_step: float | None = None) -> CellConfig:
    """The cell in which a recording is diagnosed.

    Args:
        recording: whose hand may be slow: then time steps are longer than 1 ms.
        contact: ``point`` or ``hydroelastic``.
        time_step: time step with the hand [s]; None chooses it.
    """
    config = CellConfig()
    config.contact.model = contact
    config.solver.time_step_s = time_step or _time_step(recording)
    config.solver.slide_time_step_s = max(config.solver.slide_time_step_s, config.solver.time_step_s)
    if time_step is not None:
        config.solver.slide_time_step_s = min(MOST_SLIDE_TIME_STEP, 2.0 * time_step)
    return config


def _time_step(recording: Recording) -> float:
    """1 ms; of slow hands as long as the fastest takes for a tenth of a millimetre, up to ``LONGEST_TICK``."""
    fastest = 0.0
    for push in recording.pushes:
        if push.hand is None or len(push.hand) < 3:
            return 1e-3
        steps = np.linalg.norm(np.diff(push.hand.positions[:, :2], axis=0), axis=1)
        fastest = max(fastest, float(np.quantile(steps / np.diff(push.hand.times), 0.95)))
    return float(np.clip(1e-4 / max(fastest, 1e-6), 1e-3, LONGEST_TIME_STEP)) if fastest < SLOW else 1e-3


def _floored(problem: PushProblem) -> PushProblem:
    std = problem.start_std.copy()
    std[:3] = np.hypot(std[:3], START_FLOOR)
    return dc.replace(problem, start_std=std)


def _paced(problem: PushProblem, config: CellConfig) -> PushProblem:
    if problem.path is None:
        return problem
    speed = float(np.linalg.norm(problem.path.velocities, axis=1).max())
    longest = TRAVEL_PER_TIME_STEP / max(speed, 1e-6) / config.solver.time_step_s
    limit = PACES[-1] * 1e-3 / config.solver.time_step_s
    return dc.replace(problem, pace=max(p for p in PACES if p <= max(1.0, min(longest, limit))))


def _surroundings(recording: Recording, problems: Sequence[PushProblem], thetas: ThetaMap) -> Surroundings:
    places = np.concatenate([np.vstack([np.array(p.start.pose[:2]), p.poses[:, :2]]) for p in problems])
    solid = solid_of(recording.object.shape)
    x0, y0, x1, y1 = solid.underside.extent()
    return Surroundings(
        mass=thetas.nominal["mass"],
        friction=float(np.median([thetas.nominal[name] for name in friction_names(thetas.cells)])),
        size=np.array([x1 - x0, y1 - y0]),
        height=solid.height,
        region=np.array([places.min(axis=0), places.max(axis=0)]),
        top_speed=max(0.02, float(np.median([_top_speed(p) for p in problems])) * 1.5),
        pushes=max(p.order for p in problems) + 1,
        has_hand=recording.hand is not None,
        rolls=solid.rolling_radius is not None,
    )


def _top_speed(problem: PushProblem) -> float:
    """About the largest speed of a push [m/s]; the hand's where the object's path was not recorded."""
    if len(problem.times) >= 8:
        span = max(2, len(problem.times) // 20)
        steps = np.linalg.norm(problem.poses[span:, :2] - problem.poses[:-span, :2], axis=1)
        return float((steps / (problem.times[span:] - problem.times[:-span])).max())
    if problem.path is not None:
        return float(np.linalg.norm(problem.path.velocities, axis=1).max())
    return 0.1
