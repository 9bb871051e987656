"""What is compared of a push, and the noise that it is said to have."""

from types import SimpleNamespace

import numpy as np
import pytest
from runs import shipped_pushes

from physid_drake.cell import CellConfig
from physid_drake.cell.hand_path import HandPath
from physid_drake.pushes.case import case_of
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.features import FORCE_MEMORY, WINDOWS, PushFeatures, _averaging, _way
from physid_drake.pushes.tracker_noise import ForceNoise
from physid_drake.recording import PoseStream, Push

FORCE = 3.0  # N
SCATTER = 0.05
OFFSET = 0.1


def pushed(way):
    """As much of a push as the noise of its forces needs: three windows."""
    nothing = np.zeros(0)
    return PushFeatures(
        averaging=nothing, middles=nothing, sigmas=np.ones(3), recorded=nothing, noise=nothing,
        force_std=np.array([0.1, 0.2, 0.1]), force_way=np.array(way), force_size=FORCE,
    )  # fmt: skip


def test_a_force_wanders_with_the_hands_way():
    noise = pushed([0.0, FORCE_MEMORY, 5.0 * FORCE_MEMORY]).force_noise(ForceNoise(scatter=SCATTER))
    wandering = (SCATTER * FORCE) ** 2
    assert noise[0, 0] == pytest.approx(1.0 + wandering / 0.1**2)
    assert noise[0, 1] == pytest.approx(wandering * np.exp(-1.0) / (0.1 * 0.2))
    assert noise[0, 2] == pytest.approx(wandering * np.exp(-5.0) / 0.1**2)


def test_the_way_is_the_hands_whether_it_takes_long_or_not():
    for speed in (0.01, 0.1):
        path = HandPath(times=np.array([0.0, 9.0]), velocities=np.full((2, 2), [speed, 0.0]), start=np.zeros(2))
        way = _way(SimpleNamespace(path=path, force_times=np.array([1.0, 2.0, 6.0])))
        np.testing.assert_allclose(way, speed * np.array([0.0, 1.0, 5.0]))
    assert _way(SimpleNamespace(path=None, force_times=np.zeros(0))).shape == (0,)


def test_a_force_that_is_off_is_off_over_the_whole_push():
    far = pushed([0.0, 100.0 * FORCE_MEMORY, 200.0 * FORCE_MEMORY])
    noise = far.force_noise(ForceNoise(scatter=0.0, offset=OFFSET))
    assert noise[0, 2] == pytest.approx((OFFSET * FORCE) ** 2 / 0.1**2)
    assert noise[0, 0] == pytest.approx(1.0 + noise[0, 2])


@pytest.mark.parametrize("left_out", [0, 1])
@pytest.mark.parametrize("count", [4, 5, 9, 40, 41, 200])
def test_the_last_sample_of_a_stream_that_ends_in_motion_counts(count, left_out):
    """A slide without a hand: no rest at either end, and its first sample is where it starts from."""
    times = 0.01 * np.arange(count)
    places = np.column_stack([times * (1.0 + times), 0.0 * times, 0.0 * times])
    stream = PoseStream(times=times, positions=places, quaternions=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)))
    push = Push(name="slide", object=stream, hand=None, force=None)
    averaging = _averaging(push, SimpleNamespace(times=times[left_out:], path=None))
    assert (averaging[-1] > 0.0).sum() > 1 or count < 10  # no rest of a single sample
    np.testing.assert_allclose(averaging.sum(axis=1), 1.0)
    assert (averaging[:, -1] > 0.0).sum() == 1
    assert (averaging > 0.0).any(axis=0).all()


def test_windows_of_a_push_that_is_not_compared_to_its_end_lie_in_its_motion():
    times = 0.01 * np.arange(160)
    way = 0.2 * np.clip(times - 0.4, 0.0, 0.8)
    stream = PoseStream(
        times=times, positions=np.column_stack([way, 0.0 * way, 0.0 * way]), quaternions=np.eye(4)[[0] * 160]
    )
    push = Push(name="cut", object=stream, hand=stream, force=None)
    averaging = _averaging(push, SimpleNamespace(times=times[39:80], path=object()))
    whole = _averaging(push, SimpleNamespace(times=times[39:], path=object()))
    assert len(averaging) == WINDOWS and len(whole) == WINDOWS + 1
    assert (averaging > 0.0).sum(axis=1) == pytest.approx(np.full(WINDOWS, 41 / WINDOWS), abs=1.0)
    assert (whole[-1, -20:] > 0.0).all() and not whole[-1, :80].any()


@pytest.fixture(scope="module")
def case():
    config = CellConfig()
    config.contact.model = "point"
    return case_of(shipped_pushes(3), config, ThetaConfig(), jobs=1)


def test_a_louder_case_has_larger_deviations(case):
    louder = case.louder(2.0, ForceNoise())
    for before, after in zip(case.features, louder.features, strict=True):
        np.testing.assert_allclose(after.sigmas, 2.0 * before.sigmas)
        np.testing.assert_allclose(2.0 * after.recorded, before.recorded)


def test_pushes_that_are_not_looked_at_are_said(case):
    assert case.warnings == case.noise.warnings
    some = case_of(shipped_pushes(5), case.config, ThetaConfig(), jobs=1, most=2)
    assert [problem.order for problem in some.problems] == [0, 4]
    assert some.warnings[0].startswith("2 of the 5 pushes were used")
