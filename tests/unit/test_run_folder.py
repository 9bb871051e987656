"""A run's folder."""

import pytest

from physid_drake.errors import ConfigError, OutputError
from physid_drake.run_folder import RunFolder, command_of, named_after


@pytest.mark.parametrize(
    ("name", "folder"),
    [("sealed_01", "sealed_01"), ("../../away", "away"), ("/etc", "etc"), ("oak / eraser", "oak_eraser"),
     ("..", "recording"), ("v1.2-a", "v1.2-a"), ("Löffel", "Löffel")],
)  # fmt: skip
def test_a_recordings_name_is_one_folder_where_the_command_runs(name, folder):
    assert named_after(name) == folder


def test_the_files_of_a_run_with_another_configuration_are_dropped(tmp_path):
    files = {"state": ("state.npz",), "results": ("result.json",)}
    folder = RunFolder.open(tmp_path, "seed: 0", **files)
    for name in ("result.json", "state.npz"):
        folder.write(name, "{}")
    RunFolder.open(tmp_path, "seed: 0", **files)
    assert (tmp_path / "result.json").exists() and (tmp_path / "state.npz").exists()
    RunFolder.open(tmp_path, "seed: 7", **files)
    assert not (tmp_path / "result.json").exists() and not (tmp_path / "state.npz").exists()


def test_a_state_of_which_nothing_says_whose_it_is_is_dropped(tmp_path):
    for name in ("result.json", "state.npz"):
        (tmp_path / name).write_text("")
    RunFolder.open(tmp_path, "seed: 0", state=("state.npz",), results=("result.json",))
    assert (tmp_path / "result.json").exists() and not (tmp_path / "state.npz").exists()


@pytest.mark.parametrize(
    ("name", "text", "command"),
    [
        ("config.yaml", "x: {}", "run_cell"), ("settings.json", '{"command": "plan"}', "plan"),
        ("settings.json", "{}", None), ("settings.json", "[", None),
    ],
)  # fmt: skip
def test_a_folder_with_another_commands_results_is_refused(tmp_path, name, text, command):
    (tmp_path / name).write_text(text)
    assert command_of(tmp_path) == command
    if command is None:
        return RunFolder.check(tmp_path, "diagnose")
    RunFolder.check(tmp_path, command)
    with pytest.raises(ConfigError, match=f"holds what {command} wrote"):
        RunFolder.check(tmp_path, "diagnose")


def test_a_folder_that_cannot_be_made_is_refused_before_anything_is_computed(tmp_path):
    (tmp_path / "file").write_text("")
    for place in (tmp_path / "file", tmp_path / "file" / "deep" / "er"):
        with pytest.raises(OutputError, match="cannot be written"):
            RunFolder.check(place, "plan")
    RunFolder.check(tmp_path / "new" / "er", "plan")
    assert not (tmp_path / "new").exists()
