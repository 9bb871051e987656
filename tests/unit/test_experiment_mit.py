"""The published pushes beside the published predictions; skipped where the files are not there."""

import os
from pathlib import Path

import numpy as np
import pytest

from physid_drake.validation.experiments.mit_pushes import MAIN, MODELS, PublishedPushes

FOLDER = (
    Path(os.environ.get("PHYSID_SHARED_DATA", Path(__file__).parents[2] / "../shared/data")) / "mit_push_endpoints"
)

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no published end points in {FOLDER}")


@pytest.fixture(scope="module")
def table():
    return PublishedPushes(FOLDER, MAIN, 12, 0)


def sizes(errors):
    return np.hypot(*errors[:, :2].T)


def test_published_predictions_stand_beside_their_own_pushes(table):
    moved = np.array([p.poses[-1] - p.start.pose for p in table.problems])
    for model in MODELS:
        # A prediction of another row would be off by at least as much as the object moves.
        assert sizes(table.published[model]).mean() < 0.4 * sizes(moved).mean()
        assert np.abs(table.published[model][:, 2]).max() < np.pi


def test_the_cell_predicts_published_pushes_and_the_squares_of_the_roots_are_the_sizes(table):
    problems = table.problems[:4]
    errors = table.errors(problems, {"hand_friction": 0.2})
    moved = np.array([p.poses[-1] - p.start.pose for p in problems])
    assert sizes(errors).mean() < 0.3 * sizes(moved).mean()
    weighed = errors * [1.0, 1.0, np.sqrt((0.09**2 + 0.09**2) / 12.0)]
    expected = np.linalg.norm(weighed, axis=1)
    assert (table.roots(errors) ** 2).reshape(-1, 3).sum(axis=1) == pytest.approx(expected, rel=1e-6)
    assert table.misfit(table.roots(errors)) == pytest.approx(np.log(expected.mean()), rel=1e-6)


def test_an_offset_of_the_rod_changes_where_a_push_ends(table):
    problems = table.problems[:1]
    here = table.errors(problems, {"hand_friction": 0.2})
    there = table.errors(problems, {"hand_friction": 0.2, "ends": 0.0, "offset_x": 2e-3, "offset_y": 2e-3})
    assert 2e-4 < np.linalg.norm((there - here)[:, :2]) < 2e-2
