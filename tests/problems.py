"""Recordings changed push by push, as the identification sees them."""

from dataclasses import replace

from physid_drake.pushes.noise import Noise
from physid_drake.pushes.problem import problems_of
from physid_drake.recording import PoseStream

QUIET = Noise(
    position=3e-4,
    rotation=3e-3,
    hand=5e-5,
    force=0.02,
    position_correlation=0.0,
    rotation_correlation=0.0,
    source={},
)


def with_pushes(recording, change):
    return replace(recording, pushes=tuple(change(push) for push in recording.pushes))


def first(recording, noise=QUIET, height=0.03):
    return problems_of(recording, noise, height)[0]


def ends(push):
    """The push with its first and last pose only."""
    s, rows = push.object, [0, len(push.object) - 1]
    stream = PoseStream(times=s.times[rows], positions=s.positions[rows], quaternions=s.quaternions[rows])
    return replace(push, object=stream)
