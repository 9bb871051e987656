"""What all foreign logs share: a recording as one take, and the head of a map."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from physid_drake.recording import PoseStream, Recording

DESCRIPTION = """\
format: physid-map/1
recording:
  name: {name}
  object: {{shape: cylinder, radius_m: 0.0356, length_m: 0.0459, axis: z, mass_kg: 0.90393}}
  table: {{size_m: [1.6, 1.4], centre_m: [0.0, 0.0]}}
"""
HAND = "  hand: {tip: sphere, radius_m: 0.0112, stream: measured}\n"
EPOCH = 1.75e9
"""s: some day."""
_MEAN = 20
"""Samples at a push's ends, at which the object rests."""


def rotations(stream: PoseStream) -> Rotation:
    return Rotation.from_quat(np.roll(stream.quaternions, -1, axis=1))


def at(times: np.ndarray, known: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Columns of ``values`` (n, k) at other times, between the known ones."""
    return np.column_stack([np.interp(times, known, column) for column in values.T])


def take(recording: Recording, rate: float = 120.0, rest: float = 0.8) -> tuple[np.ndarray, PoseStream, PoseStream]:
    """One log of all pushes: rests before and after each, and the object carried to where the next begins.

    The rests have the recording's own noise.
    """
    noise = _Noise(recording)
    body_places, hand_places, turns = [], [], []
    held = int(rest * rate)
    for push in recording.pushes:
        assert push.hand is not None
        times = np.arange(push.start_time, push.end_time, 1.0 / rate)
        body = at(times, push.object.times, push.object.positions)
        hand = at(times, push.hand.times, push.hand.positions)
        turn = at(times, push.object.times, push.object.quaternions)
        first, last = (
            np.hstack([one.mean(axis=0) for one in (push.object.positions[part], push.object.quaternions[part])])
            for part in (slice(_MEAN), slice(-_MEAN, None))
        )
        if body_places:
            carried = np.linspace(0.0, 1.0, int(rate))[:, None]
            way = body_places[-1].mean(axis=0) * (1.0 - carried) + first[:3] * carried
            way[:, 2] += 0.1 * np.sin(np.pi * carried[:, 0])
            body_places.append(way)
            turns.append(turns[-1][-1] * (1.0 - carried) + turn[0] * carried)
            hand_places.append(hand_places[-1][-1] * (1.0 - carried) + hand[0] * carried + [0.0, 0.0, 0.3])
        body_places += [noise.places(first[:3], held), body, noise.places(last[:3], held)]
        turns += [noise.turns(first[3:], held), turn, noise.turns(last[3:], held)]
        hand_places += [np.repeat(hand[:1], held, axis=0), hand, np.repeat(hand[-1:], held, axis=0)]
    quaternions = np.vstack(turns)
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    times = np.arange(len(quaternions)) / rate
    body_stream = PoseStream(times=times, positions=np.vstack(body_places), quaternions=quaternions)
    identity = np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1))
    return times, body_stream, PoseStream(times=times, positions=np.vstack(hand_places), quaternions=identity)


def assert_rests_agree(one: PoseStream, other: PoseStream) -> None:
    """Where a push begins and ends, both are alike but for the noise of the trackers' mean."""
    for part in (slice(_MEAN), slice(-_MEAN, None)):
        off = np.abs(one.planar[part].mean(axis=0) - other.planar[part].mean(axis=0))
        assert off[:2].max() < 1.5e-3, off
        if other.rotation != "none":
            assert off[2] < 0.015, off


class _Noise:
    """Of the recording's tracker, while the object rests."""

    def __init__(self, recording: Recording) -> None:
        self.rng = np.random.default_rng(0)
        sensors = recording.sensors
        self.place = sensors.object_position_std or 1e-4
        self.angle = sensors.object_rotation_std or 1e-3

    def places(self, place: np.ndarray, count: int) -> np.ndarray:
        return place + self.place * self.rng.normal(size=(count, 3))

    def turns(self, quaternion: np.ndarray, count: int) -> np.ndarray:
        small = Rotation.from_rotvec(self.angle * self.rng.normal(size=(count, 3)))
        turned = (small * Rotation.from_quat(np.roll(quaternion, -1))).as_quat()
        # Of the two signs, the neighbours': those between are interpolated.
        turned *= np.sign(turned @ np.roll(quaternion, -1))[:, None]
        return np.roll(turned, 1, axis=1)
