"""Where a missing wrench lives: every look has its words, and a planted one is found."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose.localise import MissingWrench, _direction, _looks, locate

PUSHES, WINDOWS = 10, 4


def case():
    return SimpleNamespace(problems=[SimpleNamespace(name=f"pushes/{k:03d}.csv", order=k) for k in range(PUSHES)])


def wrenches(planted, seed=0):
    """Windows with unit noise and a force (2,) in W that ``planted`` gives for push, heading, yaw and speed."""
    rng, made = np.random.default_rng(seed), []
    for push in range(PUSHES):
        heading, yaw = rng.uniform(-np.pi, np.pi, size=2)
        for k in range(WINDOWS):
            speed = rng.uniform(0.05, 0.5)
            fx, fy = planted(push, heading, yaw, speed)
            c, s = np.cos(heading), np.sin(heading)
            local = np.array([c * fx + s * fy, c * fy - s * fx, 0.0]) + 0.02 * rng.standard_normal(3)
            made.append(
                MissingWrench(
                    push=push, start=0.1 * k, end=0.1 * (k + 1), wrench=local, std=np.full(3, 0.02),
                    phase="contact" if k < 2 else "free_slide", speed=speed, heading=heading, yaw=yaw,
                    place=np.zeros(2),
                )
            )  # fmt: skip
    return made


PLANTED = {
    "world": lambda push, heading, yaw, speed: (0.0, 0.3),
    "object": lambda push, heading, yaw, speed: (0.3 * np.cos(yaw), 0.3 * np.sin(yaw)),
    "object_velocity": lambda push, heading, yaw, speed: (-0.3 * np.cos(heading), -0.3 * np.sin(heading)),
}


@pytest.mark.parametrize("frame", PLANTED)
def test_the_frame_of_a_planted_force_is_found(frame):
    found = locate(case(), wrenches(PLANTED[frame]), np.random.default_rng(0))
    assert found.frame == frame
    assert "in no one direction" not in found.statement


def test_noise_lives_nowhere():
    told = [
        locate(case(), wrenches(lambda *push: (0.0, 0.0), seed), np.random.default_rng(0)).frame for seed in range(20)
    ]
    assert told.count("none") >= 16


def test_every_look_has_words():
    for look in _looks(case(), wrenches(PLANTED["world"])):
        frame, words = _direction(look)
        assert frame in ("world", "object", "object_velocity", "push_order")
        assert words
