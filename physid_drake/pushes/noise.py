"""How noisy a recording's sensors are: what they state, what is seen at rest, else an assumption."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.hand_fit import stream_std
from physid_drake.recording import NoiseEstimate, Recording, estimate_noise
from physid_drake.recording.rest_noise import SILENT, seen_noise
from physid_drake.recording.rests import rests_of
from physid_drake.recording.rounding import rounding_std

Array = NDArray[np.float64]

DEFAULT_POSITION_STD = 5e-4  # m, where neither stated nor seen
DEFAULT_ROTATION_STD = 5e-3  # rad
DEFAULT_HAND_STD = 1e-4  # m
DEFAULT_FORCE_STD = 0.05  # N
LARGEST_CORRELATION = 0.98
SLOW_NOISE = 1.5  # samples: a hand's noise that remembers less is white, as one of robots' joints nearly is
CLEAR = 0.3  # of the logarithm of its variance: noise that is known so well may be slow
ROUGHER = 1.3  # times the third differences of the noise at rest
SLOW_HAND = 0.06  # s between samples: of slower streams, differences show a hand's ramps and not its noise
DISPROVED = 2.0  # times what is stated of hand or force: noise that is seen to be louder is believed
# A simulation without noise, or a tracker that is quiet at rest: below these the cell's own error is what differs.
FINEST_POSITION = 1e-5  # m
FINEST_ROTATION = 1e-4  # rad
FINEST_HAND = 1e-6  # m
FINEST_FORCE = 1e-3  # N


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Noise of one sample: standard deviations and correlation from sample to sample.

    Attributes:
        position: of the object's x and y [m].
        rotation: of its yaw [rad].
        hand: of the hand's x and y [m].
        hand_memory: correlation time of that [s]; 0 is white.
        force: of a force component [N].
        position_correlation, rotation_correlation: of either noise between neighbouring samples [-].
        source: where each figure comes from: ``stated``, ``seen`` or ``assumed``.
    """

    position: float
    rotation: float
    hand: float
    force: float
    position_correlation: float
    rotation_correlation: float
    source: dict[str, str]
    hand_memory: float = 0.0

    @property
    def sigmas(self) -> Array:
        """Standard deviations (3,) of x, y, yaw [m, m, rad]."""
        return np.array([self.position, self.position, self.rotation])

    @property
    def correlations(self) -> Array:
        """From sample to sample (3,), of x, y, yaw [-]."""
        return np.array([self.position_correlation, self.position_correlation, self.rotation_correlation])

    def mean_std(self, samples: float) -> Array:
        """Standard deviations (3,) of a mean over so many samples of a rest [m, m, rad]."""
        independent = np.maximum(1.0, samples * (1.0 - self.correlations) / (1.0 + self.correlations))
        return np.asarray(self.sigmas / np.sqrt(independent))


def finest_position(recording: Recording) -> float:
    """The least noise of the object's x and y [m]: what their rounding is like."""
    return max(FINEST_POSITION, rounding_std([push.object.planar[:, :2] for push in recording.pushes]))


def finest_rotation(recording: Recording) -> float:
    """The least noise of the object's yaw [rad], likewise."""
    return max(FINEST_ROTATION, rounding_std([push.object.planar[:, 2:] for push in recording.pushes]))


def noise_of(recording: Recording) -> Noise:
    """The recording's noise: what its sensors state, else what is seen at rest, else an assumption."""
    seen: NoiseEstimate = estimate_noise(recording)
    stated = recording.sensors
    hand_std, hand_memory = hand_noise(recording)
    often = _hand_interval(recording) < SLOW_HAND
    source: dict[str, str] = {}

    def choose(name: str, said: float | None, estimate: float | None, assumed: float, finest: float) -> float:
        # The object's is judged by a diagnosis, which knows how slow its noise is.
        disproved = (
            (name == "force" or (name == "hand" and often))
            and estimate is not None
            and estimate > DISPROVED * max(said or 0.0, finest)
        )
        if said is not None and not disproved:
            source[name] = "stated"
            return max(said, finest)
        if estimate is not None and estimate > SILENT * finest:
            source[name] = "seen"
            return max(estimate, finest)
        source[name] = "assumed"
        return max(assumed, finest)

    place = stated.object_position_std, seen.object_position_std
    turn = stated.object_rotation_std, seen.object_rotation_std
    return Noise(
        position=choose("position", *place, DEFAULT_POSITION_STD, finest_position(recording)),
        rotation=choose("rotation", *turn, DEFAULT_ROTATION_STD, finest_rotation(recording)),
        hand=choose("hand", stated.hand_position_std, hand_std, DEFAULT_HAND_STD, FINEST_HAND),
        force=choose("force", stated.force_std, seen.force_std, DEFAULT_FORCE_STD, FINEST_FORCE),
        position_correlation=_correlation(seen.position_autocorrelation, seen.rotation_autocorrelation),
        rotation_correlation=_correlation(seen.rotation_autocorrelation, seen.position_autocorrelation),
        hand_memory=hand_memory,
        source=source,
    )


def _correlation(own: float | None, other: float | None) -> float:
    """What the rests tell of one noise, or of the other: it is the same tracker's filter."""
    seen = other if own is None else own
    return 0.0 if seen is None else float(np.clip(seen, 0.0, LARGEST_CORRELATION))


def _hand_interval(recording: Recording) -> float:
    """Between two samples of the hand, the median [s]; 0 where it has none."""
    gaps = [np.diff(push.hand.times) for push in recording.pushes if push.hand is not None]
    return float(np.median(np.concatenate(gaps))) if gaps else 0.0


def hand_noise(recording: Recording) -> tuple[float | None, float]:
    """Standard deviation [m] and correlation time [s] of the hand's noise.

    Taken for white, as it shows where a hand creeps so slowly that it looks at rest, unless rests clearly tell more.
    """
    hands = [push.hand for push in recording.pushes if push.hand is not None and len(push.hand) > 6]
    if not hands:
        return None, 0.0
    white = float(np.median([stream_std(hand.times, hand.positions[:, :2]) for hand in hands]))
    white = max(white, rounding_std([hand.positions[:, :2] for hand in hands]))
    rests = [(hand.times[r], hand.positions[r, k]) for hand in hands for r in rests_of(hand) for k in (0, 1)]
    seen = seen_noise(rests, FINEST_HAND)
    interval = float(np.median(np.concatenate([np.diff(hand.times) for hand in hands])))
    if seen is None or seen.doubt > CLEAR or seen.correlation_time < SLOW_NOISE * interval:
        return white, 0.0
    # What such noise makes of third differences: a hand that moves may be noisier than one that rests.
    kept = math.exp(-interval / seen.correlation_time)
    rough = seen.std * math.sqrt(max(0.0, 1.0 - 1.5 * kept + 0.6 * kept**2 - 0.1 * kept**3))
    return (seen.std, seen.correlation_time) if white < ROUGHER * rough else (white, 0.0)
