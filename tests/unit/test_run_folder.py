"""A run's folder."""

import pytest

from physid_drake.run_folder import named_after


@pytest.mark.parametrize(
    ("name", "folder"),
    [("sealed_01", "sealed_01"), ("../../away", "away"), ("/etc", "etc"), ("oak / eraser", "oak_eraser"),
     ("..", "recording"), ("v1.2-a", "v1.2-a"), ("Löffel", "Löffel")],
)  # fmt: skip
def test_a_recordings_name_is_one_folder_where_the_command_runs(name, folder):
    assert named_after(name) == folder
