"""What every command shows in a terminal of 80 columns, read from the screen of a tmux session."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
from runs import QUICK, write_small

from physid_drake.cli import main
from physid_drake.effects import SHIPPED
from physid_drake.recording import read_recording, write_recording
from physid_drake.report.progress import JOB_STAGES as STAGES
from physid_drake.resources import shipped

TMUX = shutil.which("tmux")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(TMUX is None, reason="no tmux")]

ROOT = Path(__file__).parents[2]
COLUMNS, PATIENCE = 80, 300  # s
COMMANDS = ("inspect", "convert", "diagnose", "plan", "model", "run_cell", "prove", "experiment")


class Terminal:
    """A tmux session of 80 columns."""

    def __init__(self, folder):
        self._socket, self.folder = folder / "socket", folder
        self._call("-f", "/dev/null", "new-session", "-d", "-s", "t", "-x", str(COLUMNS), "-y", "50", "sh")
        self._call("set-option", "-g", "history-limit", "5000")

    def _call(self, *words):
        done = subprocess.run(
            [TMUX, "-S", str(self._socket), *words], check=True, capture_output=True, text=True,
            env=os.environ | {"PYTHONPATH": str(ROOT), "PS1": "$ ", "OMP_NUM_THREADS": "1", "TERM": "xterm-256color"},
        )  # fmt: skip
        return done.stdout

    def screen(self):
        return self._call("capture-pane", "-p", "-S", "-", "-t", "t")

    def start(self, *words):
        """Type a command of physid_drake."""
        self._call("send-keys", "-t", "t", f"clear; tmux -S {shlex.quote(str(self._socket))} clear-history", "Enter")
        time.sleep(0.5)
        command = shlex.join([sys.executable, "-m", "physid_drake", *words])
        script = self.folder / "command.sh"
        script.write_text(f"cd {shlex.quote(str(self.folder))}\n{command}\necho ENDED $?\n")
        self._call("send-keys", "-t", "t", f"sh {shlex.quote(str(script))}", "Enter")

    def seen(self, *words):
        """The screen when a command has ended, and all that was seen of its progress meanwhile."""
        self.start(*words)
        progress, since = set(), time.monotonic()
        while time.monotonic() - since < PATIENCE:
            shown = self.screen()
            progress |= {line.strip() for line in shown.splitlines() if " left" in line or "0:0" in line}
            if ended := re.search(r"^ENDED (\d+)$", shown, re.MULTILINE):
                return shown[: ended.start()], int(ended[1]), progress
            time.sleep(0.2)
        raise AssertionError(f"{words} did not end: {self.screen()[-2000:]}")

    def close(self):
        self._call("kill-server")


@pytest.fixture(scope="module")
def terminal(tmp_path_factory):
    session = Terminal(tmp_path_factory.mktemp("t"))
    yield session
    session.close()


def assert_nothing_is_cut(shown):
    assert max(len(line.rstrip()) for line in shown.splitlines()) <= COLUMNS
    assert "…" not in shown and "..." not in re.sub(r"\[.*?\.\.\.\]|\.\.\. *\]|PUSH \.\.\.|NAME \.\.\.", "", shown)
    assert "Traceback" not in shown


def test_help_lists_every_command_and_every_command_describes_itself(terminal, monkeypatch, capsys):
    shown, status, _ = terminal.seen("--help")
    assert status == 0 and all(re.search(rf"^ +{name}\b", shown, re.MULTILINE) for name in COMMANDS)
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    for name in COMMANDS:
        with pytest.raises(SystemExit, match="0"):
            main([name, "--help"])
        shown = capsys.readouterr().out
        assert max(map(len, shown.splitlines())) <= COLUMNS, name
        words = " ".join(shown.split())
        assert len(words.partition("options:")[0]) > 100, name
        if name == "diagnose":
            assert all(kind.name in shown for kind in SHIPPED)


def test_versions_are_said(terminal):
    shown, status, _ = terminal.seen("--version")
    assert status == 0 and re.search(r"physid_drake \d+\.\d+", shown) and "drake" in shown.lower()


def test_inspect_shows_its_numbers_whole(terminal):
    shown, status, _ = terminal.seen("inspect", "eraser_reference")
    assert status == 0
    assert_nothing_is_cut(shown)
    assert "noise at rest" in shown and "0.279 mm" in " ".join(shown.split())


def test_a_diagnosis_moves_one_line_and_says_which_file_to_open(terminal):
    write_recording(read_recording(shipped("recordings") / "sealed_01").subset(range(7)), terminal.folder / "seven")
    shown, status, progress = terminal.seen(
        "diagnose", "seven", "--out", "found", "--effects", "anisotropic_table", "table_tilt", "viscous_drag"
    )
    assert status == 0
    assert_nothing_is_cut(shown)
    words = " ".join(shown.split())
    assert "anisotropic_table" in shown and "explained" in shown
    assert words.rstrip().endswith("open found/index.html")
    assert any("left" in line for line in progress) and len(progress) > 5
    assert all(len(line) <= COLUMNS for line in progress)
    assert not any(line in shown for line in progress if "at most" in line)  # it is redrawn, and gone at the end


def test_a_plan_and_an_export_of_what_was_found(terminal):
    words = (
        "plan", "found", "--goal", "0.25", "0.2", "--policy", "push", "--budget", "24", "--draws", "4",
        "--out", "planned",
    )  # fmt: skip
    shown, status, _ = terminal.seen(*words)
    assert status == 0
    assert_nothing_is_cut(shown)
    assert "predicted end" in shown and " ".join(shown.split()).endswith("open planned/index.html")
    shown, status, _ = terminal.seen("model", "export", "found", "--out", "exported")
    assert status == 0 and "anisotropic_table: friction that is not one coefficient" in " ".join(shown.split())
    assert_nothing_is_cut(shown)


def test_the_main_job_moves_through_its_stages(terminal):
    write_small(terminal.folder / "small")
    words = [
        "run_cell",
        "--recording",
        "small",
        "--out",
        "job",
        "--set",
        json.dumps(QUICK),
        "--no-view",
        "--no-diagnosis",
    ]
    shown, status, progress = terminal.seen(*words)
    assert status == 0
    assert_nothing_is_cut(shown)
    assert " ".join(shown.split()).endswith("open job/index.html")
    assert {"parameter fit", "sweep"} <= {stage for stage in STAGES if any(stage in line for line in progress)}


def test_a_log_becomes_a_recording(terminal):
    rows = [f"{0.01 * k:.2f},{max(0.0, k - 40) * 0.5:.2f},0,0,{k * 0.5 - 90:.2f},0,20" for k in range(160)]
    (terminal.folder / "log.csv").write_text("\n".join(["t,x,y,yaw,tip x,tip y,tip z", *rows]) + "\n")
    shown, status, _ = terminal.seen("convert", "table", "log.csv", "--guess", "--map", "map.yaml")
    assert_nothing_is_cut(shown)
    assert status == 0 and "map.yaml" in shown


def test_a_proof_of_one_world(terminal):
    shown, status, _ = terminal.seen("prove", "--worlds", "1", "--kind", "none", "--seed", "7", "--out", "proof")
    assert status == 0, shown
    assert_nothing_is_cut(shown)
    assert "proof/index.html" in " ".join(shown.split())


def test_what_is_wrong_is_said_in_one_line_that_wraps(terminal):
    shown, status, _ = terminal.seen("diagnose", "no_such_recording")
    assert status == 1 and "error:" in shown and "Traceback" not in shown
