"""A recorded push as the fit sees it: what is simulated, what it is compared with, how well its start is known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import CellConfig, HandPath, Start
from physid_drake.cell.hand_fit import fit_uncertain_paths
from physid_drake.cell.hand_path import PathError
from physid_drake.cell.solid import solid_of
from physid_drake.pushes.force_windows import force_windows
from physid_drake.pushes.frame_checks import FEWEST_FREE, check_clocks, checks_of, hand_seen_until, push_checks_of
from physid_drake.pushes.hand_stream import beside_object, touching_radius, vertical_reach, while_pushing
from physid_drake.pushes.noise import Noise
from physid_drake.recording import Cylinder as CylinderShape
from physid_drake.recording import (
    PoseStream,
    Push,
    Recording,
    Shape,
    motion_span,
    rest_segments,
)

Array = NDArray[np.float64]

STANDING = 0.3  # area that the x and y axes of the tip span in the plane: less, and the tip lies
FEWEST_SEEN = 4  # poses that must be left to compare
UNSURE = 3.0  # times the standard deviation of a free motion's start: the samples that tell it are compared, too
NOTABLE_ERROR = 0.05  # of the tracker's deviation: what less of the hand does to the object is not seen
UNMEASURED = (
    0.3,
    3.0,
)  # rad, rad/s: standard deviations of a yaw that was not measured as a push begins, and its rate
FIRST_SIGMAS = 4.0  # of the tracker: motion that is surely none of its noise


@dataclass(frozen=True, kw_only=True)
class PushProblem:
    """One push, ready to be simulated and compared.

    Attributes:
        name: the push's.
        order: its number in the recording, from 0.
        begin, end: times [s].
        start: state at ``begin``.
        start_std: (3,) of the start pose [m, m, rad]; (6,) with the velocity where nothing pushes.
        path: the hand's; None without a hand.
        path_errors: independent ones, which the noise of the hand's stream may have caused; without what is too small
            to be seen.
        hand_height: of the contact above the table [m].
        hand_axes: (2, 2) the axes of P, as columns, along x and y of W; their mean over the push.
        times: (n,) of the compared poses [s].
        poses: (n, 3) recorded x, y, yaw.
        force_times: (k,) middles of the force windows [s].
        forces: (k, 2) recorded mean forces on the object, x and y of W [N].
        force_std: (k,) of each [N].
        moving: from when to when the object moves [s], as far as it is seen.
        pace: time steps longer than the cell's by this factor will do: the hand is slow.
        tip_height: of P above the table, as recorded [m]; None without a hand. Of an upright tip, which may be longer
            than the object is high, it is not the contact's.
    """

    name: str
    order: int
    begin: float
    end: float
    start: Start
    start_std: Array
    path: HandPath | None
    hand_height: float
    times: Array
    poses: Array
    force_times: Array
    forces: Array
    force_std: Array
    hand_axes: Array = field(default_factory=lambda: np.eye(2))
    moving: tuple[float, float] = (-math.inf, math.inf)
    pace: float = 1.0
    tip_height: float | None = None
    path_errors: tuple[PathError, ...] = ()


@dataclass(frozen=True, kw_only=True)
class CellSpec:
    """What a worker needs to build the cell."""

    shape: Shape
    hand_radius: float | None
    config: CellConfig
    table: tuple[tuple[float, float], tuple[float, float]]


def spec_of(recording: Recording, config: CellConfig) -> CellSpec:
    """The cell of a recording."""
    height = solid_of(recording.object.shape).height
    return CellSpec(
        shape=recording.object.shape,
        hand_radius=None if recording.hand is None else touching_radius(recording, height),
        config=config,
        table=recording.table.corners,
    )


def problems_of(recording: Recording, noise: Noise, height: float) -> tuple[PushProblem, ...]:
    """All pushes of a recording.

    Args:
        recording: the recording.
        noise: its noise.
        height: of the object [m].

    Raises:
        RecordingError: if the hand passes above the object, never comes near it or is far inside it, or if an object
            stands beside the table, tips, has an impossible mass, or cannot be compared.
    """
    checks = list(checks_of(recording))
    for push in recording.pushes:
        checks += [partial(check_clocks, push), *push_checks_of(recording, push)]
    for check in checks:
        check()
    hands = {k: beside_object(recording, push, height, noise.position) for k, push in enumerate(recording.pushes)}
    hands = {k: hand and while_pushing(recording.pushes[k], hand) for k, hand in hands.items()}
    moving = {k: hand for k, hand in hands.items() if hand is not None}
    streams = [(hand.times, hand.positions[:, :2]) for hand in moving.values()]
    fitted = fit_uncertain_paths(
        streams, noise.hand, least=NOTABLE_ERROR * noise.position, memory=noise.hand_memory
    )  # fmt: skip
    paths = dict(zip(moving, fitted, strict=True))
    return tuple(_problem(recording, k, hands[k], paths.get(k, (None, ())), noise, height) for k in hands)


def _problem(
    recording: Recording,
    order: int,
    hand: PoseStream | None,
    fitted: tuple[HandPath | None, tuple[PathError, ...]],
    noise: Noise,
    height: float,
) -> PushProblem:
    push = recording.pushes[order]
    begin = float(push.object.times[0])
    path = None if fitted[0] is None else fitted[0].with_run_up(begin)
    path_errors = tuple(replace(error, path=error.path.with_run_up(begin)) for error in fitted[1])
    planar = push.object.planar
    start, start_std, first = _start_of(push, planar, noise, free=path is None)
    if push.object.rotation == "none":
        start_std[2::3] = UNMEASURED[: len(start_std) // 3]
    forces = force_windows(push, path, noise.force, float(start_std[0]))
    until = hand_seen_until(recording, push)
    if np.count_nonzero(push.object.times[first:] <= until) < FEWEST_SEEN:
        until = math.inf
    seen, felt = slice(first, int(np.searchsorted(push.object.times, until, side="right"))), forces.middles <= until
    problem = PushProblem(
        name=push.name,
        order=order,
        begin=begin,
        end=min(push.end_time, until),
        start=start,
        start_std=start_std,
        path=path,
        path_errors=path_errors,
        hand_height=_contact_height(recording, hand, height),
        hand_axes=np.eye(2) if hand is None else _plane_axes(hand.quaternions),
        times=push.object.times[seen].copy(),
        poses=planar[seen].copy(),
        force_times=forces.middles[felt],
        forces=forces.means[felt],
        force_std=forces.stds[felt],
        tip_height=None if hand is None else float(np.median(hand.positions[:, 2])),
    )
    return replace(problem, moving=(first_motion(problem, noise.position), motion_span(push)[1]))


def turned_as_recorded(problem: PushProblem, first: float, poses: Array) -> Array:
    """Poses (n, 3) with the yaw by as many turns as the recording's, which may have been unwrapped from another turn.

    Args:
        problem: the push.
        first: yaw at its begin [rad].
        poses: at its times.
    """
    turned = poses.copy()
    turned[:, 2] += 2.0 * np.pi * np.round((problem.start.pose[2] - first) / (2.0 * np.pi))
    if len(poses) == 1:  # nothing was recorded on the way to it: by how many turns nobody saw
        turned[:, 2] += 2.0 * np.pi * np.round((problem.poses[:, 2] - turned[:, 2]) / (2.0 * np.pi))
    return turned


def first_motion(problem: PushProblem, sigma: float) -> float:
    """Roughly when the object starts to move [s]; noise, whose standard deviation is sigma [m], is no motion."""
    if len(problem.times) < 3:
        return problem.begin
    moved = np.linalg.norm(problem.poses[:, :2] - np.array(problem.start.pose[:2]), axis=1)
    beyond = np.flatnonzero(moved > max(0.05 * float(moved.max(initial=0.0)), FIRST_SIGMAS * sigma))
    return float(problem.times[max(0, beyond[0] - 1)]) if len(beyond) else problem.begin


def push_speed(problem: PushProblem) -> float:
    """Largest speed of the hand once the object moves [m/s], of the object where there is no hand."""
    if problem.path is not None:
        return problem.path.top_speed(problem.moving[0])
    return float(np.hypot(*problem.start.velocity[:2]))


@dataclass(frozen=True, kw_only=True)
class HandUse:
    """How recorded pushes used the hand; None where nobody knows, or without one.

    Attributes:
        tip_height: of P above the table, the median over pushes [m].
        contact_height: of where the tip touched the object, likewise [m].
        top_speed: the fastest push's [m/s].
    """

    tip_height: float | None = None
    contact_height: float | None = None
    top_speed: float | None = None

    @classmethod
    def of(cls, problems: Sequence[PushProblem]) -> HandUse:
        """Of the pushes that have a hand."""
        pushed = [(p.tip_height, p.hand_height, push_speed(p)) for p in problems if p.tip_height is not None]
        if not pushed:
            return cls()
        tip, contact, _ = np.median(pushed, axis=0).tolist()
        return cls(tip_height=tip, contact_height=contact, top_speed=max(speed for _, _, speed in pushed))


UNKNOWN_HAND = HandUse()


def _start_of(push: Push, planar: Array, noise: Noise, *, free: bool) -> tuple[Start, Array, int]:
    """Start pose from the rest before the motion, or pose and velocity of a free motion from its first samples.

    Its standard deviations, and the first sample to be compared: what gave the start would count twice. The first
    samples of a free motion are compared all the same, since they are its fastest, and of a short one nearly all; the
    start is said to be less sure than they tell it, so that they count hardly more than once.
    """
    if free:
        return *_moving_start(push, planar, noise), 0
    rests = rest_segments(push)
    if rests and rests[0].start == 0:
        still = planar[rests[0]]
        # Its last sample is compared, too: the motion begins there.
        return (
            Start(pose=triple(still.mean(axis=0))),
            noise.mean_std(len(still)).copy(),
            min(len(still), len(planar)) - 1,
        )
    return Start(pose=triple(planar[0])), noise.sigmas.copy(), 1


def _moving_start(push: Push, planar: Array, noise: Noise) -> tuple[Start, Array]:
    """Start, and ``UNSURE`` times its standard deviations."""
    times, sigmas = push.object.times, noise.sigmas
    n = int(min(len(times), max(FEWEST_FREE, np.searchsorted(times, times[0] + 0.08))))
    t = times[:n] - times[0]
    design = np.column_stack([np.ones(n), t, 0.5 * t**2])
    coefficients, *_ = np.linalg.lstsq(design, planar[:n], rcond=None)
    apart = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    fit = np.linalg.pinv(design)[:2]
    # Of place and velocity (2, 3), by the noise's correlation from sample to sample.
    spread = np.sqrt([np.diag(fit @ rho**apart @ fit.T) for rho in noise.correlations]).T
    std = UNSURE * (spread * sigmas).ravel()
    return Start(pose=triple(coefficients[0]), velocity=triple(coefficients[1])), std


def triple(values: Array) -> tuple[float, float, float]:
    """Three numbers of an array (3,), such as a pose."""
    return float(values[0]), float(values[1]), float(values[2])


def _contact_height(recording: Recording, hand: PoseStream | None, height: float) -> float:
    """Middle of the heights that tip and object share: there a sphere is an upright tip without ambiguity."""
    if recording.hand is None or hand is None:
        return 0.5 * height
    shape = recording.object.shape
    if isinstance(shape, CylinderShape) and shape.axis == "y":
        return shape.radius
    centre, reach = float(np.median(hand.positions[:, 2])), vertical_reach(recording.hand)
    return 0.5 * float(np.clip(centre - reach, 0.0, height) + np.clip(centre + reach, 0.0, height))


def _plane_axes(quaternions: Array) -> Array:
    """Axes of P (2, 2), as columns, along x and y of W: the mean over quaternions (n, 4)."""
    w, x, y, z = quaternions.T
    along_x = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z)]
    along_y = [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z)]
    axes: Array = np.array([along_x, along_y]).mean(axis=2)
    # A tool that lies has an axis without a direction in the plane: its offset is said along W.
    return axes if abs(np.linalg.det(axes)) > STANDING else np.eye(2)
