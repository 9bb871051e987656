"""A run's folder."""

import pytest

from physid_drake.errors import OutputError
from physid_drake.run_folder import RunFolder, named_after


@pytest.mark.parametrize(
    ("name", "folder"),
    [("sealed_01", "sealed_01"), ("../../away", "away"), ("/etc", "etc"), ("oak / eraser", "oak_eraser"),
     ("..", "recording"), ("v1.2-a", "v1.2-a"), ("Löffel", "Löffel")],
)  # fmt: skip
def test_a_recordings_name_is_one_folder_where_the_command_runs(name, folder):
    assert named_after(name) == folder


def test_the_files_of_a_run_with_another_configuration_are_dropped(tmp_path):
    folder = RunFolder.open(tmp_path, "seed: 0", files=("result.json",))
    folder.write("result.json", "{}")
    assert RunFolder.open(tmp_path, "seed: 0", files=("result.json",)) and (tmp_path / "result.json").exists()
    RunFolder.open(tmp_path, "seed: 7", files=("result.json",))
    assert not (tmp_path / "result.json").exists()


def test_a_folder_that_cannot_be_made_is_refused_before_anything_is_computed(tmp_path):
    (tmp_path / "file").write_text("")
    for place in (tmp_path / "file", tmp_path / "file" / "deep" / "er"):
        with pytest.raises(OutputError, match="cannot be written"):
            RunFolder.check(place)
    RunFolder.check(tmp_path / "new" / "er")
    assert not (tmp_path / "new").exists()
