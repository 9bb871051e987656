"""Where on the table a patch or a magnet is looked for."""

import numpy as np
import pytest

from physid_drake.effects import Surroundings
from physid_drake.effects.places import CLOSE, FEWEST, MOST, close_grid_of_places, grid_of_places


def around(size, region):
    return Surroundings(
        mass=0.3, friction=0.3, size=np.array(size), height=0.05, region=np.array(region), top_speed=0.5, pushes=10,
        has_hand=True, rolls=False,
    )  # fmt: skip


@pytest.mark.parametrize("region", [[[-0.2, -0.1], [0.1, 0.2]], [[0.0, 0.0], [0.02, 0.3]]])
def test_a_grid_covers_where_the_object_was(region):
    here = around((0.1, 0.08), region)
    for places, _ in (grid_of_places(here), close_grid_of_places(here)):
        for k, (low, high) in enumerate(zip(*region, strict=True)):
            along = np.unique(places[:, k])
            half = 0.5 * (along[1] - along[0])
            assert along[0] - half <= low
            assert along[-1] + half >= high


def test_places_for_a_patch_are_as_close_as_the_object_is_wide():
    small, large = (around((s, s), [[-0.2, -0.15], [0.2, 0.15]]) for s in (0.12, 0.4))
    places, spacing = close_grid_of_places(small)
    assert spacing < 1.3 * CLOSE * small.radius
    assert len(places) > len(grid_of_places(small)[0])
    assert len(close_grid_of_places(large)[0]) == FEWEST**2


def test_there_are_never_many_places():
    tiny = around((0.02, 0.02), [[-1.0, -1.0], [1.0, 1.0]])
    assert len(close_grid_of_places(tiny)[0]) == MOST


@pytest.mark.parametrize("along", [0, 1])
def test_a_lane_has_places_all_along_it(along):
    high = np.array([0.12, 0.12])
    high[along] = 0.8
    lane = around((0.1, 0.08), [[0.0, 0.0], high])
    places, _ = close_grid_of_places(lane)
    assert len(places) <= MOST
    assert np.diff(np.unique(places[:, along])).max() < 1.3 * CLOSE * lane.radius  # with six it was 2.6 times
