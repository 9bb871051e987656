"""Windows in which a missing wrench is looked for."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose.localise import STEP, WINDOWS, _windows

TIMES = np.linspace(0.0, 1.0, 15)


def spells_of(way, noise):
    """Windows of a push that goes so far [m] along x in a second, the last pose at rest."""
    poses = np.column_stack([np.append(way * TIMES[:-1] / TIMES[-2], way), np.zeros(15), 0.5 * TIMES])
    features = SimpleNamespace(middles=TIMES, recorded=poses, poses=lambda recorded: recorded)
    return _windows(SimpleNamespace(features=[features], noise=SimpleNamespace(position=noise)), 0)


@pytest.mark.parametrize(("noise", "count"), [(1e-4, WINDOWS), (1.1e-3, 3), (3e-3, 1), (5e-3, 0)])
def test_a_loud_tracker_asks_for_longer_windows(noise, count):
    spells = spells_of(way=0.0135, noise=noise)
    assert len(spells) == count
    assert all(s.speed * (s.end - s.start) >= STEP * noise for s in spells)


def test_a_window_knows_its_motion():
    for spell in spells_of(way=0.06, noise=1e-4):
        assert spell.speed == pytest.approx(0.06 / TIMES[-2], rel=1e-9)
        assert spell.heading == pytest.approx(0.0, abs=1e-12)
        assert spell.spin == pytest.approx(0.5, rel=1e-9)
