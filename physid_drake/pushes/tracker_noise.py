"""The tracker's noise from rest: standard deviation and correlation in time, with the mean of each rest unknown."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.pushes.noise import Noise, finest_position, finest_rotation, noise_of
from physid_drake.pushes.stated import MANY_TIMES
from physid_drake.recording import Push, Recording, rest_segments
from physid_drake.recording.rest_noise import SeenNoise, apart, seen_noise, usual_interval

Array = NDArray[np.float64]

FORCE_SCATTER = 0.03
UNKNOWN = "neither stated nor seen at rest"
UNUSUAL = 3.0  # times the median scatter of rests: one of more is none
SMALLEST = 1e-18  # m^2
CHANCE = 0.05  # of pushes that agree on a jitter there is not; fewer than five cannot agree as surely
# Seen over stated: beyond it the stated figure is not believed. Of 294 figures of sealed worlds, whose noise is
# as stated, rests show 0.88 to 1.07 times that (a script that is not kept); the value was chosen looking at them. If
# nothing else gives, 1.2 times as much costs 1.45 per degree of freedom.
CONTRADICTS = 1.15
SURELY = 3.0  # standard deviations of the logarithm of the variance seen
FAR_QUIETER = 1.5  # stated over seen
SAID = 1.5  # times as many: by then the recording's doubts say so


@dc.dataclass(frozen=True, kw_only=True)
class ForceNoise:
    """What the hand's recorded force differs by from that of a rigid body, beside white noise.

    Attributes:
        scatter: by how much of itself it wanders on its way [-].
        offset: by how much of itself it may be off over a whole push, along and across [-].
    """

    scatter: float = FORCE_SCATTER
    offset: float = 0.0


@dc.dataclass(frozen=True, kw_only=True)
class TrackerNoise:
    """Noise of the object's stream.

    Attributes:
        position, rotation: standard deviations [m, rad].
        correlation_time: of first-order autoregressive noise, position and rotation (2,) [s]; 0 is white.
        jitter: standard deviation of the time stamps [s], as far as moving samples show more noise than resting ones.
        stated: whether the recording states the standard deviations, and they are believed.
        known: whether they were stated or seen; if not, what the baseline model leaves has to serve.
        doubt: standard deviation of the logarithm of the variance [-], 0 where it is stated.
        forces: of the hand's force.
        warnings: what was found to contradict the recording.
    """

    position: float
    rotation: float
    correlation_time: tuple[float, float]
    jitter: float
    stated: bool
    known: bool = True
    doubt: float = 0.0
    forces: ForceNoise = ForceNoise()
    warnings: tuple[str, ...] = ()

    @property
    def sigmas(self) -> Array:
        """Standard deviations (3,) of x, y, yaw [m, m, rad]."""
        return np.array([self.position, self.position, self.rotation])

    def louder(self, factor: float, forces: ForceNoise | None = None) -> TrackerNoise:
        """The same noise, ``factor`` times as large, and perhaps another one of the forces; it says so."""
        position, rotation = factor * self.position, factor * self.rotation
        said = (
            f"{UNKNOWN}: the object's noise is taken to be as large as the errors of the baseline model,"
            f" {1e3 * position:.2g} mm and {math.degrees(rotation):.2g} deg"
        )
        return dc.replace(
            self, position=position, rotation=rotation, forces=forces or self.forces,
            warnings=(*(w for w in self.warnings if not w.startswith(UNKNOWN)), said),
        )  # fmt: skip

    def correlation(self, times: Array, dof: int) -> Array:
        """Correlation matrix (n, n) of the noise of x, y (dof 0, 1) or yaw (dof 2) at times (n,)."""
        constant = self.correlation_time[0 if dof < 2 else 1]
        if constant <= 0.0:
            return np.eye(len(times))
        spread = apart(times, usual_interval(times)) if len(times) > 2 else times
        gaps = np.abs(spread[:, None] - spread[None, :])
        matrix: Array = np.exp(-gaps / constant)
        return matrix


def tracker_noise(recording: Recording) -> tuple[TrackerNoise, Noise]:
    """The object's noise as seen at rest and stated, and the identification's view of all sensors.

    Restricted likelihood of a first-order autoregressive process, so that a short rest, whose mean takes a part of a
    slow noise away, does not make the noise look smaller.
    """
    plain = noise_of(recording)
    pieces = _usual(
        [(push.object.times[r], push.object.planar[r]) for push in recording.pushes for r in rest_segments(push)]
    )
    seen_xy = seen_noise([(t, p[:, k]) for t, p in pieces for k in (0, 1)], finest_position(recording))
    seen_yaw = seen_noise([(t, p[:, 2]) for t, p in pieces], finest_rotation(recording))
    warnings: list[str] = []
    position = _chosen("position", plain.position, plain.source["position"], seen_xy, warnings)
    rotation = _chosen("rotation", plain.rotation, plain.source["rotation"], seen_yaw, warnings)
    tau_xy, tau_yaw = position.correlation_time, rotation.correlation_time
    if seen_yaw is None:  # too little rest for one stream, enough for two: it is the same tracker's filter
        tau_yaw = tau_xy
    elif seen_xy is None:  # or nothing moves but the yaw
        tau_xy = tau_yaw
    unturned = all(push.object.rotation == "none" for push in recording.pushes)
    believed = not warnings
    warnings += _quieter("position", plain, seen_xy, "mm", 1e3)
    warnings += _quieter("rotation", plain, seen_yaw, "deg", math.degrees(1.0))
    warnings += _of_hand_and_force(recording, plain)
    noise = TrackerNoise(
        position=position.std,
        rotation=rotation.std,
        correlation_time=(tau_xy, tau_yaw),
        jitter=_jitter(recording.pushes),
        stated=plain.source["position"] == "stated" and believed,
        known=_known(plain, "position", seen_xy) and (unturned or _known(plain, "rotation", seen_yaw)),
        doubt=math.hypot(2.0 * position.doubt, rotation.doubt) / 3.0,  # two of three degrees of freedom are places
        warnings=tuple(warnings),
    )
    return noise, dc.replace(plain, position=position.std, rotation=rotation.std)


def _usual(pieces: Sequence[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    """The rests (times, poses) that scatter about as the others do: what hardly moves may pass for a rest."""
    if not pieces:
        return []
    spreads = np.array([poses.std(axis=0) for _, poses in pieces])
    usual = (spreads <= UNUSUAL * np.median(spreads, axis=0)).all(axis=1)
    return [piece for piece, kept in zip(pieces, usual, strict=True) if kept]


def _known(plain: Noise, what: str, seen: SeenNoise | None) -> bool:
    # A figure of samples too few to tell how well they tell it is no more than a first guess.
    return seen is not None or plain.source[what] == "stated"


def _of_hand_and_force(recording: Recording, plain: Noise) -> list[str]:
    """What contradicts the stated noise of hand and force."""
    said = (("hand's", "hand", recording.sensors.hand_position_std, plain.hand, "mm", 1e3),
            ("force's", "force", recording.sensors.force_std, plain.force, "N", 1.0))  # fmt: skip
    return [
        f"the {whose} noise is {scale * seen:.2g} {unit}, {_beside(seen, stated)}"
        for whose, name, stated, seen, unit, scale in said
        if stated is not None and plain.source[name] == "seen"
    ]


def _beside(seen: float, stated: float) -> str:
    if stated == 0.0:
        return "where the recording states none"
    return f"{seen / stated:.1f} times what the recording states"


def _chosen(what: str, value: float, source: str, seen: SeenNoise | None, warnings: list[str]) -> SeenNoise:
    """The stated noise, or the one seen at rest if none is stated or the rests contradict it."""
    if seen is None:
        return SeenNoise(std=value, correlation_time=0.0, doubt=0.0)
    if source != "stated":
        return seen
    if seen.std > CONTRADICTS * value and 2.0 * math.log(seen.std / value) > SURELY * seen.doubt:
        warnings.append(
            f"the {what} noise at rest is {seen.std:.3g}, {seen.std / value:.1f} times what the recording states"
        )
        return seen
    return SeenNoise(std=value, correlation_time=seen.correlation_time, doubt=0.0)


def _quieter(what: str, plain: Noise, seen: SeenNoise | None, unit: str, scale: float) -> list[str]:
    """That rests are far quieter than stated: believed all the same, since many trackers are quieter at rest."""
    stated = getattr(plain, what)
    if seen is None or plain.source[what] != "stated" or FAR_QUIETER * seen.std > stated:
        return []
    if 2.0 * math.log(stated / seen.std) < SURELY * seen.doubt or stated > SAID * MANY_TIMES * seen.std:
        return []
    return [
        f"the {what} noise at rest is {scale * seen.std:.2g} {unit}, far less than the {scale * stated:.2g} {unit}"
        " that the recording states; effects smaller than the stated noise cannot be detected"
    ]


def _jitter(pushes: Sequence[Push]) -> float:
    """Noise of moving samples beyond that of resting ones, over their speed [s].

    Whether samples are taken early and late or stamped so, a path through them is as rough as white noise of speed
    times jitter makes it, along the motion only.
    """
    squares, rougher = [], []  # of the jitter, and by how much pushes are rougher in motion
    for push in pushes:
        times, planar = push.object.times, push.object.planar[:, :2]
        rests = rest_segments(push)
        if len(times) < 30 or not rests:
            continue
        rough = _roughness(times, planar)
        still = np.zeros(len(times), dtype=bool)
        for rest in rests:
            still[rest] = True
        resting, moving = still[:-3] & still[3:], ~still[:-3] & ~still[3:]
        way = planar[3:] - planar[:-3]
        length = np.linalg.norm(way, axis=1)
        speed = length / (times[3:] - times[:-3])
        fast = moving & (speed > 0.05)
        if resting.sum() < 8 or fast.sum() < 8:
            continue
        along = (rough[fast] * way[fast]).sum(axis=1) / length[fast]
        # Medians, since a touch and a brake are sharp too.
        in_motion, at_rest = float(np.median(along**2)), float(np.median(rough[resting] ** 2))
        squares.append((in_motion - at_rest) / float(stats.chi2.median(1)) / float(np.median(speed[fast])) ** 2)
        rougher.append(math.log(max(in_motion, SMALLEST) / max(at_rest, SMALLEST)))
    # A median of few samples is unsure; jitter is what the pushes agree on.
    seen = (
        len(squares) >= 5 and any(rougher) and float(stats.wilcoxon(rougher, alternative="greater").pvalue) < CHANCE
    )
    return math.sqrt(max(0.0, float(np.median(squares)))) if seen else 0.0


def _roughness(times: Array, values: Array) -> Array:
    """What no parabola through four neighbours (n, k) follows, (n - 3, k), as large as one of them is noisy.

    Their third divided difference by the stamps, so that gaps are none, with weights whose squares add up to one.
    """
    count = len(times) - 3
    stamps = np.column_stack([times[k : k + count] for k in range(4)])
    apart = stamps[:, :, None] - stamps[:, None, :] + np.eye(4)
    weights = 1.0 / apart.prod(axis=2)
    weights /= np.linalg.norm(weights, axis=1)[:, None]
    return sum((weights[:, [k]] * values[k : k + count] for k in range(4)), np.zeros((count, values.shape[1])))
