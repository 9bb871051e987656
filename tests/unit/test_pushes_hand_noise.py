"""The noise of the hand's stream: white, slow, or in motion alone."""

from dataclasses import replace

import numpy as np
import pytest
from problems import with_pushes
from runs import shipped_pushes
from scipy.signal import lfilter

from physid_drake.cell import HandPath
from physid_drake.pushes.noise import noise_of
from physid_drake.recording import PoseStream, Sensors

STD, INTERVAL = 3e-4, 0.01  # m, s
TIMES = INTERVAL * np.arange(200)
PUSHES = 8


def told_of(memory=0.0, std=STD, speed=0.3, rough=0.0, stated=None):
    """What is told of the noise of hands that rest, go for half a second and rest; rougher on their way.

    Args:
        memory: correlation time [s].
        std: m.
        speed: m/s.
        rough: white noise in motion [m].
        stated: what the recording states [m].
    """
    velocities = speed * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 0.0]])
    path = HandPath(times=np.array([0.7, 0.75, 1.25, 1.3]), velocities=velocities, start=np.zeros(2))
    keeps = np.exp(-INTERVAL / memory) if memory else 0.0
    moves = (TIMES > 0.7) & (TIMES < 1.3)
    rng = np.random.default_rng(0)

    def with_hand(push):
        steps = rng.standard_normal((len(TIMES), 3))
        steps[1:] *= np.sqrt(1.0 - keeps**2)
        noise = std * lfilter([1.0], [1.0, -keeps], steps, axis=0)
        noise[moves] += rough * rng.standard_normal((moves.sum(), 3))
        places = np.column_stack([path.positions(TIMES), np.full(len(TIMES), 0.02)]) + noise
        turns = np.tile([1.0, 0.0, 0.0, 0.0], (len(TIMES), 1))
        return replace(push, hand=PoseStream(times=TIMES, positions=places, quaternions=turns))

    recording = with_pushes(shipped_pushes(PUSHES), with_hand)
    return noise_of(replace(recording, sensors=Sensors(hand_position_std=stated)))


@pytest.mark.parametrize("stated", [None, STD])
def test_a_slow_noise_is_seen_at_rest(stated):
    noise = told_of(memory=0.05, stated=stated)
    assert noise.hand == pytest.approx(STD, rel=0.2)
    assert noise.hand_memory == pytest.approx(0.05, rel=0.4)


@pytest.mark.parametrize("speed", [0.3, 0.004])  # m/s: the slower one looks at rest
def test_a_white_noise_stays_white(speed):
    noise = told_of(speed=speed)
    assert noise.hand_memory == 0.0
    assert noise.hand == pytest.approx(STD, rel=0.1)


def test_a_hand_that_is_noisier_in_motion_does_not_have_the_slow_noise_of_its_rests():
    assert told_of(memory=0.05, std=5e-5, rough=STD).hand_memory == 0.0


def test_a_stream_without_noise_has_none_that_is_slow():
    assert told_of(std=0.0).hand_memory == 0.0
