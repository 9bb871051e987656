"""What is compared of a push, and the noise that it is said to have."""

from types import SimpleNamespace

import numpy as np
import pytest
from runs import shipped_pushes

from physid_drake.cell import CellConfig
from physid_drake.cell.hand_path import HandPath
from physid_drake.diagnose import case_of
from physid_drake.diagnose.features import FORCE_MEMORY, _force_noise
from physid_drake.identify.config import ThetaConfig

FORCE = 3.0  # N
SCATTER = 0.05


def pushed(speed):
    """As much of a push as the noise of its forces needs: the hand at a steady speed, windows at 1, 2 and 6 s."""
    return SimpleNamespace(
        path=HandPath(times=np.array([0.0, 9.0]), velocities=np.full((2, 2), [speed, 0.0]), start=np.zeros(2)),
        force_times=np.array([1.0, 2.0, 6.0]),
        force_std=np.array([0.1, 0.2, 0.1]),
        forces=np.tile([0.6 * FORCE, 0.8 * FORCE], (3, 1)),
    )


def test_a_force_wanders_with_the_hands_way_and_not_with_time():
    noise = _force_noise(pushed(FORCE_MEMORY), SCATTER)  # a memory's length in a second
    wandering = (SCATTER * FORCE) ** 2
    assert noise[0, 0] == pytest.approx(1.0 + wandering / 0.1**2)
    assert noise[0, 1] == pytest.approx(wandering * np.exp(-1.0) / (0.1 * 0.2))
    assert noise[0, 2] == pytest.approx(wandering * np.exp(-5.0) / 0.1**2)
    half = _force_noise(pushed(0.5 * FORCE_MEMORY), SCATTER)
    assert half[0, 1] == pytest.approx(noise[0, 1] * np.exp(0.5))
    np.testing.assert_array_equal(noise[:3, 3:], 0.0)  # x and y by themselves
    np.testing.assert_array_equal(noise[:3, :3], noise[3:, 3:])


@pytest.fixture(scope="module")
def case():
    config = CellConfig()
    config.contact.model = "point"
    return case_of(shipped_pushes(3), config, ThetaConfig(), jobs=1)


def test_a_louder_case_has_larger_deviations_and_those_of_an_odd_push_are_larger_still(case):
    louder = case.louder(2.0, 1.0, odd=(1.0, 5.0, 1.0))
    for times, before, after in zip((2.0, 10.0, 2.0), case.features, louder.features, strict=True):
        np.testing.assert_allclose(after.sigmas, times * before.sigmas)
        np.testing.assert_allclose(times * after.recorded, before.recorded)
    assert louder.odd == (1.0, 5.0, 1.0)
    assert louder.noise.warnings[-1].endswith(f"{case.problems[1].name} (5.0)")


def test_a_push_is_odd_until_it_is_said_to_be_like_the_others(case):
    again = case.louder(1.0, 1.0, odd=(1.0, 5.0, 1.0)).louder(1.0, 1.0)
    assert again.odd == (1.0, 1.0, 1.0)
    np.testing.assert_allclose(again.features[1].sigmas, case.features[1].sigmas)
    assert not any("stand out" in warning for warning in again.noise.warnings)
