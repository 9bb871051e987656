"""What is put on Meshcat's stage."""

import socket
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.diagnose.localise import MissingWrench
from physid_drake.errors import ConfigError
from physid_drake.recording import read_recording
from physid_drake.report.stage import Stage, _listening, served
from physid_drake.resources import shipped
from physid_drake.run_diagnose import unit_force_of


@pytest.fixture(scope="module")
def stage():
    return Stage(read_recording(shipped("recordings") / "eraser_reference"))


def missing(along, across, std):
    return MissingWrench(
        push=0, start=0.1, end=0.2, wrench=np.array([along, across, 0.0]), std=np.full(3, std), phase="contact",
        speed=0.1, heading=0.5, yaw=0.0, place=np.array([0.05, -0.02]), spin=0.0, columns=np.zeros((0, 3)),
    )  # fmt: skip


def test_every_missing_wrench_is_an_arrow(stage):
    stage.show_missing([missing(0.2, 0.0, 0.01), missing(0.0, -0.1, 0.5)], unit_force=0.1)
    paths = [f"missing/{k}/{part}" for k in (0, 1) for part in ("shaft", "head")]
    assert all(stage.meshcat.HasPath(path) for path in paths)
    stage.show_missing([missing(0.2, 0.0, 0.01)], unit_force=0.1)
    assert stage.meshcat.HasPath(paths[0]) and not stage.meshcat.HasPath(paths[2])


@pytest.mark.parametrize(("forces", "unit"), [((0.2,), 0.1), ((0.2, 6.0), 2.0), ((), 0.1)])
def test_the_largest_force_that_is_surely_missing_sets_the_length_of_arrows(forces, unit):
    wrenches = [*(missing(force, 0.0, 0.01) for force in forces), missing(30.0, 0.0, 50.0)]
    around = SimpleNamespace(friction=0.25, weight=4.0)
    evidence = SimpleNamespace(case=SimpleNamespace(around=around), wrenches=wrenches)
    assert unit_force_of(evidence) == pytest.approx(unit)


def test_a_wrench_stands_out_beyond_two_standard_deviations():
    assert missing(0.25, 0.0, 0.1).stands_out and missing(0.0, -0.25, 0.1).stands_out
    assert not missing(0.19, 0.19, 0.1).stands_out


def test_nobody_can_connect_to_a_stage_without_a_view(stage):
    assert _listening() == set()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", stage.meshcat.port()), timeout=5.0)
    assert len(stage.meshcat.StaticHtml()) > 100_000


def test_a_view_listens_on_this_machine_alone():
    meshcat = served()
    with socket.create_connection(("127.0.0.1", meshcat.port()), timeout=5.0):
        pass
    with pytest.raises(ConnectionRefusedError):  # 127.0.0.2 is another address of the same machine
        socket.create_connection(("127.0.0.2", meshcat.port()), timeout=5.0)
    with pytest.raises(ConfigError, match="--host"):
        served("203.0.113.7")


def test_a_stage_that_another_thread_collects_does_not_end_the_process():
    code = """
import gc, threading
from physid_drake.recording import read_recording
from physid_drake.errors import ConfigError
from physid_drake.report.stage import Stage, _listening, served
from physid_drake.resources import shipped
Stage(read_recording(shipped("recordings") / "eraser_reference"))
thread = threading.Thread(target=gc.collect)
thread.start()
thread.join()
"""
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
