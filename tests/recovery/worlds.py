"""Recordings with a known truth, made with the planar reference and never with the cell that is fitted to them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from reference.planar import PlanarObject, simulate_planar
from reference.scenes import PlanarPush, Theta, draw_push, simulate
from twin import shape_of

from physid_drake.recording import (
    ForceStream,
    Hand,
    ObjectModel,
    PoseStream,
    Push,
    Recording,
    Sensors,
    Table,
)

POSITION_STD, ROTATION_STD, HAND_STD, FORCE_STD = 3e-4, 3e-3, 5e-5, 0.02
# Of the reference: 2e-5 s and 600 points move no pose of these pushes by more than 0.03 mm and 0.3 mrad.
TIME_STEP, POINTS = 1e-4, 150


def pushes_of(body: PlanarObject, count: int, seed: int, **fixed: object) -> list[PlanarPush]:
    rng = np.random.default_rng(seed)
    return [draw_push(rng, body, tip_radius=0.010, **fixed) for _ in range(count)]


def recorded(
    body: PlanarObject,
    theta: Theta,
    pushes: list[PlanarPush],
    seed: int,
    *,
    friction_changes: Sequence[float] = (),
    forces: bool = False,
    friction_of_points: np.ndarray | None = None,
    pull: tuple[float, float] = (0.0, 0.0),
) -> Recording:
    """Pushes at 100 Hz with white noise; the recording does not say the mass.

    Args:
        body: What is pushed.
        theta: What is true of it.
        pushes: The pushes.
        seed: Of the noise.
        friction_changes: Friction of each push with the table over theta's, less 1.
        forces: Whether the hand's force is recorded.
        friction_of_points: One coefficient per point of `body.support(POINTS)`.
        pull: A constant force in W, N: the table is not level.
    """
    rng = np.random.default_rng(seed)
    made = []
    for number, push in enumerate(pushes):
        friction = theta.support_friction * (1.0 + (friction_changes[number] if len(friction_changes) else 0.0))
        motion = simulate(
            body, replace(theta, support_friction=friction), push, np.arange(0.0, push.path.times[-1] + 0.6, 0.01),
            time_step=TIME_STEP, support_points=POINTS, friction_of_points=friction_of_points, force=pull,
        )  # fmt: skip
        hand = push.path.position(motion.times) + HAND_STD * rng.standard_normal((len(motion.times), 2))
        force = None
        if forces:
            force = np.zeros((len(motion.times), 3))
            force[:, :2] = motion.forces + FORCE_STD * rng.standard_normal(motion.forces.shape)
        made.append(
            Push(
                name=f"pushes/{number:03d}.csv",
                object=_stream(motion.times, motion.poses, body.height / 2, rng),
                hand=_still(motion.times, np.column_stack([hand, np.full(len(hand), push.tip_height)])),
                force=None if force is None else ForceStream(times=motion.times, forces=force),
            )
        )
    return _recording(body, made, Hand(tip="sphere", radius=pushes[0].tip_radius))


def slides(
    body: PlanarObject, theta: Theta, velocities: np.ndarray, seed: int, *, pull: tuple[float, float] = (0.0, 0.0)
) -> Recording:
    """Free slides with start velocities (k, 3) and no hand; a constant force in W, N."""
    rng, made = np.random.default_rng(seed), []
    for number, velocity in enumerate(velocities):
        times = np.arange(0.0, 1.0, 0.01)
        motion = simulate_planar(
            theta.applied_to(body), theta.support_friction, times, velocity=tuple(velocity), force=pull,
            support=body.support(POINTS), time_step=TIME_STEP,
        )  # fmt: skip
        keep = times <= motion.rest_time + 0.2
        stream = _stream(times[keep], motion.poses[keep], body.height / 2, rng)
        made.append(Push(name=f"pushes/{number:03d}.csv", object=stream, hand=None, force=None))
    return _recording(body, made, None)


def endpoints(recording: Recording) -> Recording:
    """The same pushes of which only the object's first and last pose are known."""
    pushes = []
    for push in recording.pushes:
        ends = [0, len(push.object) - 1]
        stream = push.object
        kept = PoseStream(
            times=stream.times[ends], positions=stream.positions[ends], quaternions=stream.quaternions[ends]
        )
        pushes.append(replace(push, object=kept))
    return replace(recording, pushes=tuple(pushes))


def _recording(body: PlanarObject, pushes: list[Push], hand: Hand | None) -> Recording:
    sensors = Sensors(
        object_position_std=POSITION_STD,
        object_rotation_std=ROTATION_STD,
        hand_position_std=None if hand is None else HAND_STD,
        force_std=FORCE_STD if pushes[0].force is not None else None,
    )
    return Recording(
        name=body.name, description="", object=ObjectModel(shape=shape_of(body)), table=Table(size=(4.0, 4.0)),
        hand=hand, sensors=sensors, pushes=tuple(pushes),
    )  # fmt: skip


def _stream(times: np.ndarray, poses: np.ndarray, z: float, rng: np.random.Generator) -> PoseStream:
    place = poses[:, :2] + POSITION_STD * rng.standard_normal((len(poses), 2))
    half = 0.5 * (poses[:, 2] + ROTATION_STD * rng.standard_normal(len(poses)))
    zeros = np.zeros(len(poses))
    return PoseStream(
        times=times,
        positions=np.column_stack([place, np.full(len(poses), z)]),
        quaternions=np.column_stack([np.cos(half), zeros, zeros, np.sin(half)]),
    )


def _still(times: np.ndarray, positions: np.ndarray) -> PoseStream:
    return PoseStream(times=times, positions=positions, quaternions=np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1)))
