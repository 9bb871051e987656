"""What is played on the stage: recorded pushes with what the models make of them, and pushes that are planned."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose import Evidence
from physid_drake.diagnose.localise import MissingWrench
from physid_drake.effects.rollout import Geometry, geometry_with
from physid_drake.identify import Identification
from physid_drake.inference.fit import Fit
from physid_drake.plan import DistanceToGoal, Hindsight, Plan, Trajectory
from physid_drake.plan.trajectory import HORIZON, tip_height_of, true_solid
from physid_drake.pushes.case import Case
from physid_drake.pushes.rollouts import simulate
from physid_drake.pushes.task import Task
from physid_drake.recording import Hand, PoseStream, Push, Recording, planar_poses
from physid_drake.report.stage import BASELINE, CORRECTED, MOST_ARROW, RECORDED, Act, Setting, Track

Array = NDArray[np.float64]

SHOWN = 12  # pushes in the animation
AFTERWARDS = 0.6  # s that a planned push is shown for after the object has stopped


def setting_of(known: Identification, evidence: Evidence | None) -> Setting:
    """What stands on the stage after an identification, or a diagnosis."""
    case = known.case
    fits = _fits(known, evidence)
    shapes, undersides = {RECORDED: case.recording.object.shape}, {}
    for kind, fit in fits.items():
        effects = fit.hypothesis.effects(fit.point.z)
        geometry = geometry_with(effects, Geometry(shape=case.pool.spec.shape))
        shapes[kind] = geometry.shape
        nx, ny = case.pool.spec.config.friction_cells
        frictions = case.thetas.body(fit.hypothesis.theta(fit.point.z)).support_friction
        if geometry.pressure is not None:
            undersides[kind] = np.array(geometry.pressure.weights)
        elif nx * ny > 1:
            undersides[kind] = np.reshape(frictions, (nx, ny))
    return Setting(
        table=case.pool.spec.table, shapes=shapes, hand=case.recording.hand, undersides=undersides
    )  # fmt: skip


def setting_of_plan(plan: Plan) -> Setting:
    """What stands on the stage of a plan alone; the hand is this project's, whose tip is as large as the model's."""
    model = plan.model
    shape = geometry_with(model.effects, Geometry(shape=model.shape)).shape
    hand = None if model.hand_radius is None else Hand(tip="reflex_sf", radius=model.hand_radius)
    return Setting(table=model.table, shapes={_kind(plan): shape}, hand=hand)


def setting_of_recording(recording: Recording) -> Setting:
    """What stands on the stage before anything is known."""
    return Setting(
        table=recording.table.corners, shapes={RECORDED: recording.object.shape}, hand=recording.hand
    )  # fmt: skip


def first_act(recording: Recording) -> Act:
    """The first push as it was recorded."""
    return _act(recording.pushes[0], {}, ())


def acts_of(known: Identification, evidence: Evidence | None) -> list[Act]:
    """The first pushes as recorded and as the models predict them, with nothing of the pushes' own fitted."""
    case = known.case
    fits = _fits(known, evidence)
    wrenches = () if evidence is None else evidence.wrenches
    acts = []
    for i, push in enumerate(case.recording.pushes[: min(SHOWN, len(case.problems))]):
        motions = {kind: _predicted(case, fit, i) for kind, fit in fits.items()}
        acts.append(_act(push, motions, [w for w in wrenches if w.push == i]))
    return acts


def acts_of_plan(plan: Plan, hindsight: Hindsight | None = None) -> list[Act]:
    """The planned push; before it, where there is one, what the baseline's plan would have come to."""
    acts = []
    if hindsight is not None and hindsight.baseline is not None and hindsight.outcome is not None:
        bodies = {BASELINE: _track(plan, hindsight.baseline.predicted), CORRECTED: _track(plan, hindsight.outcome[0])}
        acts.append(_planned(hindsight.baseline, bodies, "baseline plan, simulated with the effect"))
    name = "planned push" + (
        f", with {' and '.join(e.name for e in plan.model.effects)}" if plan.model.effects else ""
    )
    acts.append(_planned(plan, {_kind(plan): _track(plan, plan.predicted)}, name))
    return acts


def unit_force_of(evidence: Evidence) -> float:
    """The force whose arrow has unit length [N]: a tenth of the friction, more where more is surely missing."""
    around, sure = evidence.case.around, [w for w in evidence.wrenches if w.stands_out]
    strongest = max((math.hypot(*w.wrench[:2]) for w in sure), default=0.0)
    return max(0.1 * around.friction * around.weight, strongest / MOST_ARROW)


def _fits(known: Identification, evidence: Evidence | None) -> dict[str, Fit]:
    """The models, by who says so: the baseline, and what leaves where that has effects."""
    if evidence is None or evidence.best is None:
        return {BASELINE: known.fit}
    return {BASELINE: evidence.baseline, CORRECTED: evidence.corrected}


def _predicted(case: Case, fit: Fit, i: int) -> Track:
    h, z, nuisance = fit.hypothesis, fit.point.z, case.nuisances[i]
    task = Task(
        problem=case.problems[i], theta=h.theta(z), nuisance=nuisance, values=np.zeros(len(nuisance.names)),
        effects=h.effects(z),
    )  # fmt: skip
    motion = simulate(case.pool.spec, case.thetas, task)
    return Track(times=motion.times, poses=motion.poses)


def _act(push: Push, motions: Mapping[str, Track], missing: Sequence[MissingWrench]) -> Act:
    return Act(
        name=push.name, begin=push.start_time, end=push.start_time + push.duration,
        bodies={RECORDED: _stream(push.object), **motions}, missing=missing,
        hand=None if push.hand is None else _upright(push.hand.times, push.hand.positions),
    )  # fmt: skip


def _stream(stream: PoseStream) -> Track:
    return Track(times=stream.times, poses=np.hstack([stream.quaternions, stream.positions]))


def _upright(times: Array, positions: Array) -> Track:
    """Of a hand, which hangs down."""
    return Track(times=times, poses=np.hstack([np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1)), positions]))


def _kind(plan: Plan) -> str:
    return CORRECTED if plan.model.effects else BASELINE


def _track(plan: Plan, trajectory: Trajectory) -> Track:
    return _stream(planar_poses(trajectory.times, trajectory.poses, 0.5 * true_solid(plan.model).height))


def _planned(plan: Plan, bodies: Mapping[str, Track], name: str) -> Act:
    """The hand along its planned paths, and the object where the models think that it goes."""
    height = tip_height_of(plan.model, plan.situation)
    clock, times, places = 0.0, [], []
    for path in plan.predicted.paths:
        own = np.linspace(0.0, float(path.times[-1]), 200)
        times.append(clock + own)
        places.append(path.positions(own))
        clock += float(path.times[-1]) + HORIZON
    hand = _upright(np.concatenate(times), np.column_stack([np.vstack(places), np.full(200 * len(times), height)]))
    goal = None
    if isinstance(plan.cost_function, DistanceToGoal):
        goal = (*plan.cost_function.goal, plan.tolerance)
    end = max(_stopped(track) for track in (*bodies.values(), hand)) + AFTERWARDS
    return Act(name=name, begin=0.0, end=end, bodies=bodies, hand=hand, goal=goal)


def _stopped(track: Track) -> float:
    """When it last moved [s]."""
    moving = np.flatnonzero(np.abs(np.diff(track.poses, axis=0)).max(axis=1) > 1e-6)
    return float(track.times[moving[-1] + 1]) if len(moving) else float(track.times[0])
