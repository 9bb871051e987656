"""What a recording says about itself: how far and fast each push went, how noisy the sensors are at rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from physid_drake.recording.clocks import samples_within
from physid_drake.recording.rests import SHORTEST_REST, TO_STD, rests_of
from physid_drake.recording.screening import find_gaps
from physid_drake.recording.values import Array, PoseStream, Push, Recording

NOT_ODD = 0.99  # of a rounded stream's deviations: the others are outliers
TIED = 0.05  # of the deviations, as large as their median: the stream is rounded to a good part of its noise


@dataclass(frozen=True, kw_only=True)
class NoiseEstimate:
    """Robust standard deviations at rest, pooled; None where there was no rest to look at.

    Attributes:
        object_position_std: of the object's x and y each, in m.
        object_rotation_std: of its yaw, in rad.
        hand_position_std: of the hand's x and y each, in m.
        force_std: of the force's x and y each, in N.
        position_autocorrelation: from one position sample to the next, -1 to 1; near 0 is white.
        rotation_autocorrelation: the same for the yaw.
        samples: object samples at rest that went into it.
    """

    object_position_std: float | None
    object_rotation_std: float | None
    hand_position_std: float | None
    force_std: float | None
    position_autocorrelation: float | None
    rotation_autocorrelation: float | None
    samples: int


@dataclass(frozen=True, kw_only=True)
class PushSummary:
    """One push in numbers.

    Attributes:
        name: of the push.
        duration: in s, over all streams.
        hand_speed: the hand's largest over a tenth of a second, in m/s; None without a hand.
        object_speed: the object's, likewise; None where only its end points are known.
        displacement: of the object from first to last pose, in m, in the plane.
        turn: of the object from first to last pose, in rad; a full turn counts where the stream shows it.
        gaps: number of gaps in all streams.
        position_noise: at rest, in m; None without rest.
        rotation_noise: at rest, in rad; None without rest.
        samples: poses of the object.
        warnings: number of warnings.
    """

    name: str
    duration: float
    hand_speed: float | None
    object_speed: float | None
    displacement: float
    turn: float
    gaps: int
    position_noise: float | None
    rotation_noise: float | None
    samples: int
    warnings: int


def summarise(push: Push) -> PushSummary:
    """Duration, speeds, displacement, gaps and noise of one push."""
    planar = push.object.planar
    streams = [push.object.times, *(s.times for s in (push.hand, push.force) if s is not None)]
    noise = _noise_of([push])
    return PushSummary(
        name=push.name,
        duration=push.duration,
        hand_speed=None if push.hand is None else _largest_speed(push.hand),
        object_speed=None if push.endpoint_only else _largest_speed(push.object),
        displacement=float(np.hypot(*(planar[-1, :2] - planar[0, :2]))),
        turn=float(planar[-1, 2] - planar[0, 2]),
        gaps=sum(len(find_gaps(times)) for times in streams),
        position_noise=noise.object_position_std,
        rotation_noise=noise.object_rotation_std,
        samples=len(push.object),
        warnings=len(push.warnings),
    )


def rest_segments(push: Push) -> list[slice]:
    """Slices of the object's samples in which it does not move, each of at least ten samples."""
    return rests_of(push.object)


def motion_span(push: Push) -> tuple[float, float]:
    """From when to when the object moves [s], between its first rest and its last; infinite where none is seen."""
    rests, times = [] if push.endpoint_only else rest_segments(push), push.object.times
    begin = float(times[rests[0].stop - 1]) if rests and rests[0].start == 0 else -math.inf
    end = float(times[rests[-1].start]) if rests and rests[-1].stop == len(times) else math.inf
    return (begin, end) if begin < end else (-math.inf, math.inf)


def estimate_noise(recording: Recording) -> NoiseEstimate:
    """The sensors' noise and its correlation from sample to sample, pooled over the rests of all pushes."""
    return _noise_of(recording.pushes)


def _noise_of(pushes: Sequence[Push]) -> NoiseEstimate:
    still = [push.object.planar[rest] for push in pushes for rest in rest_segments(push)]
    position = [column - np.median(column) for rest in still for column in rest[:, :2].T]
    yaw = [rest[:, 2] - np.median(rest[:, 2]) for rest in still]
    hands = [push.hand for push in pushes if push.hand is not None]
    hand = [
        column - np.median(column)
        for stream in hands
        for rest in rests_of(stream)
        for column in stream.positions[rest, :2].T
    ]
    return NoiseEstimate(
        object_position_std=_robust_std(position),
        object_rotation_std=_robust_std(yaw),
        hand_position_std=_robust_std(hand),
        force_std=_robust_std([piece for push in pushes for piece in _quiet_forces(push)]),
        position_autocorrelation=_autocorrelation(position),
        rotation_autocorrelation=_autocorrelation(yaw),
        samples=sum(len(rest) for rest in still),
    )


def _quiet_forces(push: Push) -> list[Array]:
    """Forces before the object first moves and before they build up: residuals of x and y, in N."""
    rests = rest_segments(push)
    if push.force is None or not rests or rests[0].start != 0:
        return []
    before = push.force.times < push.object.times[rests[0].stop - 1]
    forces = push.force.forces[before, :2]
    # The hand already leans on the object in the later half of its rest.
    forces = forces[: len(forces) // 2]
    if len(forces) < SHORTEST_REST:
        return []
    return [column - np.median(column) for column in forces.T]


def _largest_speed(stream: PoseStream) -> float | None:
    if len(stream) < 2:
        return None
    # Speeds over less than a tenth of a second would be mostly the tracker's noise.
    interval = float(np.median(np.diff(stream.times)))
    stride = min(max(1, samples_within(0.1, interval, len(stream))), len(stream) - 1)
    spans = stream.times[stride:] - stream.times[:-stride]
    travel = np.linalg.norm(stream.positions[stride:] - stream.positions[:-stride], axis=1)
    return float(np.max(travel / spans))


def _robust_std(residuals: Sequence[Array]) -> float | None:
    if not residuals:
        return None
    sizes = np.abs(np.concatenate(residuals))
    middle = float(np.median(sizes))
    if float(np.mean(np.abs(sizes - middle) < 1e-9)) < TIED:
        return TO_STD * middle
    # Medians of a rounded stream are a whole number of its steps, or none; its mean square is not.
    return float(np.sqrt(np.mean(np.minimum(sizes, np.quantile(sizes, NOT_ODD)) ** 2)))


def _autocorrelation(residuals: Sequence[Array]) -> float | None:
    power = sum(float((r * r).sum()) for r in residuals)
    if power <= 0.0:
        return None
    return sum(float((r[1:] * r[:-1]).sum()) for r in residuals) / power
