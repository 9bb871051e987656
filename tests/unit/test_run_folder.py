"""A run's folder: only what a command wrote there is replaced or removed, and one run writes at a time."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from physid_drake.errors import ConfigError, OutputError
from physid_drake.run_folder import LOCK, MANIFEST, RunFolder, named_after, named_after_model
from physid_drake.whole_files import write_whole

RUN = "run_cell"
FILES = {"state": ("state.npz",), "results": ("result.json",)}


def opened(path, configuration="seed: 0", **files):
    """A run that ended at once."""
    with RunFolder.open(path, RUN, configuration, **(files or FILES)) as folder:
        return folder


@pytest.mark.parametrize(
    ("name", "folder"),
    [("sealed_01", "sealed_01"), ("../../away", "away"), ("/etc", "etc"), ("oak / eraser", "oak_eraser"),
     ("..", "recording"), ("v1.2-a", "v1.2-a"), ("Löffel", "Löffel"), ("a" * 5000, "a" * 100)],
)  # fmt: skip
def test_a_recordings_name_is_one_folder_where_the_command_runs(name, folder):
    assert named_after(name) == folder


def test_what_is_made_of_a_model_is_named_after_its_folder(tmp_path, monkeypatch):
    run = tmp_path / "oak / eraser"
    run.mkdir(parents=True)
    (run / "model.yaml").touch()
    (run / "mug.v2.yaml").touch()
    assert named_after_model(run) == named_after_model(run / "model.yaml") == "eraser"
    assert named_after_model(run / "mug.v2.yaml") == "mug.v2"
    monkeypatch.chdir(run)
    assert named_after_model(Path()) == named_after_model(Path("model.yaml")) == "eraser"


def test_results_of_another_configuration_are_refused_and_its_state_is_dropped(tmp_path):
    with RunFolder.open(tmp_path, RUN, "seed: 0", **FILES) as folder:
        folder.write("state.npz", "{}")
    opened(tmp_path)
    assert folder.holds("state.npz")
    opened(tmp_path, "seed: 7")
    assert {path.name for path in tmp_path.iterdir()} == {MANIFEST, "config.yaml"}
    folder.write("result.json", "{}")
    with pytest.raises(ConfigError, match=r"holds 'result\.json' of another recording, or of other settings"):
        opened(tmp_path, "seed: 8")
    assert folder.read("result.json") == "{}" and folder.read("config.yaml") == "seed: 7"


def test_what_a_person_keeps_in_a_runs_folder_stays(tmp_path):
    opened(tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    opened(tmp_path, "seed: 7")
    assert (tmp_path / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("name", ["result.json", "state.npz"])
def test_a_file_of_somebodys_own_in_the_place_of_a_result_is_refused_and_stays(tmp_path, name):
    opened(tmp_path)
    (tmp_path / name).write_text("mine")
    with pytest.raises(ConfigError, match="was not written by this command"):
        opened(tmp_path, "seed: 7")
    with RunFolder.open(tmp_path, RUN, "seed: 0") as folder, pytest.raises(ConfigError, match="was not written"):
        folder.write(name, "{}")
    folder.forget(name)
    assert (tmp_path / name).read_text() == "mine"


@pytest.mark.parametrize("name", ["config.yaml", "push_1.csv", ".hidden", "deep"])
def test_a_folder_that_is_not_empty_and_has_no_manifest_is_refused(tmp_path, name):
    (tmp_path / name).mkdir() if name == "deep" else (tmp_path / name).write_text("mine")
    for refused in (
        lambda: RunFolder.check(tmp_path, RUN),
        lambda: RunFolder.begin(tmp_path, RUN),
        lambda: opened(tmp_path),
    ):
        with pytest.raises(ConfigError, match="is not empty"):
            refused()
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_an_input_is_never_written_to(tmp_path):
    opened(tmp_path)
    (tmp_path.parent / f"{tmp_path.name}_link").symlink_to(tmp_path)
    for spelt in (tmp_path, tmp_path / "." / "x" / "..", tmp_path.parent / f"{tmp_path.name}_link"):
        with pytest.raises(ConfigError, match="read from"):
            RunFolder.check(spelt, RUN, inputs=[tmp_path])


def test_nothing_is_written_within_a_recording(tmp_path):
    with pytest.raises(ConfigError, match="read from"):
        RunFolder.check(tmp_path / "out" / "deep", RUN, recordings=[tmp_path])
    RunFolder.check(tmp_path / "out", RUN, inputs=[tmp_path])  # runs/x beside a CONFIG


def test_what_lies_where_a_part_is_written_is_not_followed(tmp_path):
    (tmp_path / "mine").write_text("mine")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / f".{MANIFEST}.part").symlink_to(tmp_path / "mine")
    with pytest.raises(ConfigError, match="is not empty"):
        opened(tmp_path / "out")
    (tmp_path / ".result.json.part").symlink_to(tmp_path / "mine")
    write_whole(tmp_path / "result.json", b"whole")
    assert (tmp_path / "mine").read_text() == "mine" and not (tmp_path / "result.json").is_symlink()


def test_a_folder_with_another_commands_results_is_refused(tmp_path):
    opened(tmp_path)
    RunFolder.check(tmp_path, RUN)
    with pytest.raises(ConfigError, match="holds what run_cell wrote"):
        RunFolder.check(tmp_path, "diagnose")


@pytest.mark.parametrize(
    "text", ["", "null", "[]", "{", '{"format": "x"}', '{"format": "physid-folder/1", "command": 3, "files": []}',
             '{"format": "physid-folder/1", "command": "run_cell", "files": [["a"]]}', "[" * 5000]
)  # fmt: skip
def test_a_manifest_that_cannot_be_read_says_of_nothing_that_it_may_be_replaced(tmp_path, text):
    (tmp_path / MANIFEST).write_text(text)
    with pytest.raises(ConfigError, match="nothing says what may be replaced"):
        opened(tmp_path)


def test_a_manifest_that_names_files_elsewhere_takes_none_of_them(tmp_path):
    (tmp_path / "mine").write_text("mine")
    content = {"format": "physid-folder/1", "command": RUN, "files": ["../mine", "/", str(tmp_path / "mine"), "/.."]}
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / MANIFEST).write_text(json.dumps(content))
    opened(tmp_path / "out", "seed: 1")
    assert (tmp_path / "mine").read_text() == "mine"


def test_a_result_that_is_a_link_is_replaced_and_not_what_it_points_to(tmp_path):
    (tmp_path / "mine").write_text("mine")
    with RunFolder.open(tmp_path / "out", RUN, "seed: 0", **FILES) as folder:
        folder.write("result.json", "{}")
        (tmp_path / "out" / "result.json").unlink()
        (tmp_path / "out" / "result.json").symlink_to(tmp_path / "mine")
        folder.write("result.json", "[]")
    assert (tmp_path / "mine").read_text() == "mine" and folder.read("result.json") == "[]"


def test_a_folder_that_cannot_be_made_is_refused_before_anything_is_computed(tmp_path):
    (tmp_path / "file").write_text("")
    long, loop = tmp_path / ("x" * 5000), tmp_path / "loop"
    loop.symlink_to(loop)
    for place in (tmp_path / "file", tmp_path / "file" / "deep" / "er", long, tmp_path / "a\0b", loop / "x"):
        with pytest.raises(OutputError, match="cannot be written"):
            RunFolder.check(place, "plan")
    RunFolder.check(tmp_path / "new" / "er", "plan")
    assert not (tmp_path / "new").exists()


def test_of_two_runs_into_one_folder_the_second_is_refused_and_changes_nothing(tmp_path):
    with RunFolder.open(tmp_path, RUN, "seed: 0", **FILES) as folder:
        folder.write("result.json", "{}")
        for other in (
            lambda: opened(tmp_path, "seed: 7"),
            lambda: RunFolder.claim(tmp_path, RUN, "seed: 7").__enter__(),
        ):
            with pytest.raises(ConfigError, match="another run writes to it"):
                other()
        assert folder.read("config.yaml") == "seed: 0" and folder.holds("result.json")
    assert not (tmp_path / LOCK).exists()
    opened(tmp_path)


def test_a_run_that_was_killed_leaves_a_folder_that_can_be_taken_up(tmp_path):
    for moment in ("os.kill(os.getpid(), 9)", "folder.write('result.json', '{}'); os.kill(os.getpid(), 9)"):
        script = (
            "import os; from pathlib import Path; from physid_drake.run_folder import RunFolder\n"
            f"with RunFolder.open(Path({str(tmp_path / 'out')!r}), 'run_cell', 'seed: 0', results=('result.json',))"
            f" as folder: {moment}"
        )
        assert subprocess.run([sys.executable, "-c", script], check=False).returncode == -9
        assert opened(tmp_path / "out").holds("result.json") == ("result" in moment)


def test_a_run_that_was_killed_before_its_manifest_leaves_a_folder_that_can_be_taken_up(tmp_path):
    for name in (LOCK, f".{MANIFEST}.x1y2.part"):
        (tmp_path / name).touch()
    opened(tmp_path)


def test_a_run_with_other_settings_is_refused_where_results_took_hours(tmp_path):
    with RunFolder.claim(tmp_path, "prove", '{"seed": 0}'):
        pass
    with RunFolder.claim(tmp_path, "prove", '{"seed": 0}'):
        pass
    with (
        pytest.raises(ConfigError, match="holds another run"),
        RunFolder.claim(tmp_path, "prove", '{"seed": 1}'),
    ):
        pass


def test_what_lies_in_a_folder_that_was_made_may_be_replaced(tmp_path):
    folder = RunFolder.begin(tmp_path, "experiment")
    folder.own("repetitions/")
    for text in ("1", "2"):
        folder.write("repetitions/000.json", text)
    assert folder.read("repetitions/000.json") == "2"
    (tmp_path / "mine").mkdir()
    with pytest.raises(ConfigError, match="was not written"):
        folder.own("mine/")


def test_a_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    write_whole(tmp_path / "result.json", b"whole")

    def full(self, content):
        self.open("wb").write(content[:2])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OutputError, match="No space left on device"):
        write_whole(tmp_path / "result.json", b"other")
    assert [path.name for path in tmp_path.iterdir()] == ["result.json"]
    assert (tmp_path / "result.json").read_text() == "whole"


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_the_right_to_write_is_refused(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="cannot be written"):
        RunFolder.check(tmp_path / "out", RUN)
