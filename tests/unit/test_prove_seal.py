"""The seal on the truth, and the blindfold."""

import json
import shutil
import stat
import subprocess
import sys

import pytest

from physid_drake.errors import ProofError
from physid_drake.prove.diagnosing import diagnose_command
from physid_drake.prove.seal import RECORDING, check_seal, files_digest, seal_of, shut, unlock, write_seal
from physid_drake.resources import shipped


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "sealed").mkdir()
    for name in ("aa", "bb"):
        (tmp_path / "sealed" / f"{name}.json").write_text(json.dumps({"id": name}))
    return tmp_path


def test_a_truth_that_changed_after_it_was_sealed_is_refused(folder):
    written = write_seal(folder, ["aa", "bb"])
    check_seal(folder, written)
    (folder / "sealed" / "bb.json").write_text("{}")
    with pytest.raises(ProofError, match=r"^the seal is broken: .* nothing is scored\.$"):
        check_seal(folder, written)
    # The hash that is written down cannot be made to fit either.
    with pytest.raises(ProofError, match=r"bb\.json' has changed since it was sealed"):
        write_seal(folder, ["aa", "bb"])
    assert (folder / "seal.sha256").read_text() == f"{written}\n"


def test_a_recording_that_changed_after_it_was_sealed_is_refused(folder):
    push = folder / "recordings" / "aa" / "pushes" / "001.csv"
    push.parent.mkdir(parents=True)
    push.write_text("time_s\n0\n")
    truth = {"id": "aa", RECORDING: files_digest(folder / "recordings" / "aa")}
    (folder / "sealed" / "aa.json").write_text(json.dumps(truth))
    written = write_seal(folder, ["aa", "bb"])
    check_seal(folder, written)
    push.write_text("time_s\n1\n")
    with pytest.raises(ProofError, match=r"recordings/aa' is not the recording that was sealed"):
        check_seal(folder, written)
    push.rename(push.with_name("002.csv"))
    with pytest.raises(ProofError, match="not the recording that was sealed"):
        check_seal(folder, written)


def test_a_truth_that_is_missing_is_named(folder):
    with pytest.raises(ProofError, match=r"cc\.json': cannot be read"):
        seal_of(folder / "sealed", ["aa", "cc"])


def test_a_seal_grows_with_its_worlds(folder):
    one = write_seal(folder, ["aa"])
    both = write_seal(folder, ["aa", "bb"])
    assert one != both
    assert write_seal(folder, ["bb", "aa"]) == both
    assert (
        subprocess.run(["sha256sum", "-c", "seal.txt"], cwd=folder, capture_output=True, check=False).returncode == 0
    )


def test_a_seal_of_more_worlds_holds_for_fewer(folder):
    both = write_seal(folder, ["aa", "bb"])
    assert write_seal(folder, ["aa"]) == both == (folder / "seal.sha256").read_text().strip()
    check_seal(folder, both)


def test_a_folder_with_a_colon_is_hidden_too(tmp_path):
    (tmp_path / "a:b").mkdir()
    (tmp_path / "a:b" / "truth.json").write_text("{}")
    words = diagnose_command(tmp_path / "a:b" / "truth.json", tmp_path / "out", tmp_path / "a:b", tmp_path / "other")
    words = (*words[:4], "inspect", str(tmp_path / "a:b"))
    said = subprocess.run(words, capture_output=True, text=True, check=False)
    assert said.returncode == 1 and ("is sealed" in said.stderr or "missing file" in said.stderr)


def test_a_shut_folder_opens_again_whatever_ends_the_block(folder):
    sealed = folder / "sealed"
    before = stat.S_IMODE(sealed.stat().st_mode)
    with pytest.raises(KeyboardInterrupt), shut(sealed):
        assert stat.S_IMODE(sealed.stat().st_mode) == 0
        raise KeyboardInterrupt
    assert stat.S_IMODE(sealed.stat().st_mode) == before
    sealed.chmod(0)
    unlock(sealed)  # as after a run that was killed
    assert (sealed / "aa.json").read_text()


LOOKS = """
import os, pathlib, sys
from physid_drake.prove.blindfold import blind_to
sealed = pathlib.Path(sys.argv[1])
blind_to(str(sealed))
looks = [lambda: open(sealed / "aa.json"), lambda: os.listdir(sealed), lambda: list(os.scandir(sealed)),
         lambda: (sealed / "aa.json").read_text(), lambda: list(sealed.glob("*")),
         lambda: open(os.path.join(sealed, "..", "sealed", "aa.json")), lambda: open(sealed.parent / "link")]
for look in looks:
    try:
        look()
    except PermissionError:
        print("refused")
print(len(looks), open(sealed.parent / "beside").read())
"""


def test_the_blindfold_refuses_every_look_and_nothing_else(folder):
    (folder / "beside").write_text("seen")
    (folder / "link").symlink_to(folder / "sealed" / "aa.json")
    said = subprocess.run(
        [sys.executable, "-c", LOOKS, str(folder / "sealed")], capture_output=True, text=True, check=True
    )
    assert said.stdout.split() == [*["refused"] * 7, "7", "seen"]


@pytest.mark.slow
def test_a_command_under_the_blindfold_works_and_cannot_read_what_is_sealed(folder):
    shutil.copytree(shipped("recordings") / "eraser_reference", folder / "open")
    shutil.copytree(folder / "open", folder / "sealed" / "hidden")

    def inspect(recording):
        words = [
            sys.executable,
            "-m",
            "physid_drake.prove.blindfold",
            json.dumps([str(folder / "sealed")]),
            "inspect",
            str(recording),
        ]
        return subprocess.run(words, capture_output=True, text=True, check=False)

    assert inspect(folder / "open").returncode == 0
    refused = inspect(folder / "sealed" / "hidden")
    assert refused.returncode == 1
    assert "is sealed" in refused.stderr


AUDIT = """
import os, sys
seen = []
looks = ("open", "os.listdir", "os.scandir", "glob.glob", "os.chdir")
def note(event, arguments):
    if event in looks and isinstance(arguments[0], (str, bytes, os.PathLike)):
        seen.append(os.path.realpath(os.fsdecode(arguments[0])))
sys.addaudithook(note)
from pathlib import Path
from physid_drake.diagnose import case_of, cell_config
from physid_drake.identify.config import ThetaConfig
from physid_drake.recording import read_recording
recording = read_recording(Path(sys.argv[1]))
case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=1)
for path in seen:
    print(path)
"""


def test_what_a_diagnosis_is_made_from_is_the_recording_alone(folder):
    """Everything that is read to make a case; what follows works on it in memory."""
    recording = folder / "recordings" / "aa"
    shutil.copytree(shipped("recordings") / "eraser_reference", recording)
    said = subprocess.run([sys.executable, "-c", AUDIT, str(recording)], capture_output=True, text=True, check=True)
    within = [line for line in said.stdout.splitlines() if line.startswith(str(folder.resolve()))]
    assert within
    assert all(line.startswith(str(recording.resolve())) for line in within)
