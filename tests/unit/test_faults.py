"""Runs that are killed, that meet each other, or whose disk is full: nothing is lost, the same bytes come of it."""

import json
import os
import subprocess
import sys
import time

import pytest
from runs import QUICK, laid_over, write_small

from physid_drake.run_folder import LOCK, MANIFEST

# Runs a command that is killed after so many writes (0: never), with at most so many bytes in a file (0: any).
FAULTY = """
import os, resource, signal, sys

from physid_drake import run_folder
from physid_drake.belief import Belief
from physid_drake.pushes.kept_rollouts import KeptRollouts

writes, largest, *argv = sys.argv[1:]
left, most = int(writes), int(largest)

def killing(call):
    def made(*arguments, **words):
        global left
        result = call(*arguments, **words)
        left -= 1
        if left == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        return result
    return made

run_folder.write_whole = killing(run_folder.write_whole)
Belief.to_npz = killing(Belief.to_npz)
KeptRollouts.keep = killing(KeptRollouts.keep)
if most:
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
if argv[0] == "run_cell":
    from physid_drake.run_cell import main
    sys.exit(main(argv[1:]))
from physid_drake.cli import main
sys.exit(main(argv))
"""


def faulty(argv, *, writes=0, largest=0, **words):
    words = {"capture_output": True, "text": True, "timeout": 300, **words}
    return subprocess.run([sys.executable, "-c", FAULTY, str(writes), str(largest), *argv], check=False, **words)


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != LOCK}


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return write_small(tmp_path_factory.mktemp("recordings") / "small")


def run_cell(recording, out, *more):
    settings = json.dumps(laid_over(QUICK, {"plan": {"budget": 4, "draws": 2, "sweep": 0}}))
    words = ["--recording", str(recording), "--set", settings, "--no-view", "--no-diagnosis"]
    return ["run_cell", *words, "--out", str(out), *more]


def diagnose(recording, out):
    return ["diagnose", str(recording), "--effects", "viscous_drag", "--jobs", "1", "--time-step", "0.004",
            "--out", str(out)]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "moments"),
    [(run_cell, (1, 3, 5, 8)), (diagnose, (1, 4))],
    ids=["run_cell", "diagnose"],
)
def test_a_run_that_is_killed_again_and_again_ends_with_the_bytes_of_one_that_was_not(
    command, moments, recording, tmp_path
):
    whole, out = tmp_path / "whole", tmp_path / "out"
    assert faulty(command(recording, whole)).returncode == 0
    for writes in moments:
        assert faulty(command(recording, out), writes=writes).returncode == -9
        (out / "notes.txt").write_text("mine")
    assert faulty(command(recording, out)).returncode == 0
    ended = content(out)
    assert ended.pop("notes.txt") == b"mine"
    assert ended == content(whole)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "largest"), [(run_cell, 30_000), (diagnose, 50_000)], ids=["run_cell", "diagnose"]
)
def test_a_full_disk_is_one_line_and_leaves_no_scraps(command, largest, recording, tmp_path):
    out = tmp_path / "out"
    done = faulty(command(recording, out), largest=largest)
    errors = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    assert done.returncode == 1 and "Traceback" not in done.stderr
    page = {run_cell: "plan.png", diagnose: "diagnosis.html"}[command]  # the first that is too large
    assert len(errors) == 1 and f"{page}': cannot be written: File too large." in errors[0]
    assert not {f".{page}.part", page, LOCK} & {path.name for path in out.iterdir()}
    assert faulty(command(recording, out)).returncode == 0


@pytest.mark.slow
def test_a_cache_that_cannot_be_written_ends_no_run(recording, tmp_path):
    """A belief of some kilobytes is the first file that is too large; what it spares is time."""
    whole, out = tmp_path / "whole", tmp_path / "out"
    assert faulty(run_cell(recording, whole)).returncode == 0
    (largest,) = [len(value) for name, value in content(whole).items() if name == "config.yaml"]
    done = faulty(run_cell(recording, out), largest=largest)
    assert "warning: the search's state is not kept" in done.stderr
    assert done.returncode == 1 and "index.html" in done.stderr.splitlines()[-1]


@pytest.mark.slow
def test_of_two_runs_into_one_folder_one_writes_and_the_other_says_so(recording, tmp_path):
    out = tmp_path / "out"
    slow = json.dumps(laid_over(QUICK, {"search": {"integrator": "cell", "budget": 60}}))
    argv = ["run_cell", "--recording", str(recording), "--set", slow, "--no-view", "--no-diagnosis", "--no-plan"]
    argv += ["--out", str(out)]
    first = subprocess.Popen([sys.executable, "-c", FAULTY, "0", "0", *argv], stderr=subprocess.PIPE)
    deadline = time.monotonic() + 120.0
    while not (out / "config.yaml").exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    second = faulty([*argv, "--seed", "9"])
    assert second.returncode == 1
    assert second.stderr.splitlines()[-1].startswith(f"error: output folder '{out}': another run writes to it")
    assert first.wait(300) == 0, first.stderr.read()
    first.stderr.close()
    whole = tmp_path / "whole"
    assert faulty([*argv[:-1], str(whole)]).returncode == 0
    assert content(out) == content(whole)


def test_foreign_files_in_an_output_folder_stay(recording, tmp_path):
    """In a folder of somebody's own nothing is written; in a run's, what is beside its files stays."""
    own = tmp_path / "own"
    own.mkdir()
    for name in ("config.yaml", "model.yaml", "index.html", "push.csv", "push_1.csv", "plan.json", "settings.json"):
        (own / name).write_text(f"my {name}")
    before = content(own)
    for argv in (
        run_cell(recording, own),
        ["diagnose", str(recording), "--out", str(own)],
        ["plan", "--goal", "0.1", "0", "--model", str(own / "model.yaml"), "--out", str(own)],
        ["experiment", "push_speed", "--quick", "--out", str(own)],
        ["prove", "--worlds", "1", "--seed", "1", "--out", str(own)],
        ["convert", "cmu", str(own), str(own)],
    ):
        done = faulty(argv)
        assert done.returncode == 1 and done.stderr.count("error: ") == 1, (argv[0], done.stderr)
        assert content(own) == before, argv[0]
    assert MANIFEST not in before and os.listdir(tmp_path) == ["own"]  # noqa: PTH208
