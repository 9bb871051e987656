"""Diagnoses on a Dask cluster of this machine: the same bytes, and a worker that dies costs none."""

import json
import os
import signal
import sys
import time

import pytest

from physid_drake.errors import ProofError
from physid_drake.validation.sealing.cluster import Cluster
from physid_drake.validation.sealing.diagnosing import Task, attempt_of, diagnose_all

distributed = pytest.importorskip("distributed")
pytestmark = pytest.mark.slow

# Instead of a diagnosis: says what it was given, after a while.
CODE = """
import json, os, pathlib, sys, time
given, out = pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[4])
time.sleep(float((given / "recording.yaml").read_text()))
out.mkdir(parents=True, exist_ok=True)
files = sorted(str(f.relative_to(given)) for f in given.rglob("*") if f.is_file())
said = {"verdict": "consistent", "read": files, "threads": os.environ["OMP_NUM_THREADS"]}
(out / "diagnosis.json").write_text(json.dumps(said))
print("done")
"""


def tasks_in(folder, seconds, count=4):
    tasks = []
    for k in range(count):
        recording = folder / "recordings" / f"{k}"
        (recording / "pushes").mkdir(parents=True, exist_ok=True)
        (recording / "recording.yaml").write_text(f"{seconds}")
        (recording / "pushes" / f"{k}.csv").write_text("1,2\n")
        out = folder / "diagnoses" / f"{k}"
        words = (sys.executable, "-c", CODE, "diagnose", str(recording), "--out", str(out))
        tasks.append(Task(name=f"{k}", words=words, folder=out))
    return tasks


@pytest.fixture(scope="module")
def address():
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        yield cluster.scheduler_address


def test_answers_are_the_bytes_of_this_machine(tmp_path, address):
    here, there = tasks_in(tmp_path / "here", 0.0), tasks_in(tmp_path / "there", 0.0)
    diagnose_all(here, jobs=2, timeout=60.0, ended=lambda task, attempt: None)
    with Cluster(address, 60.0) as cluster:
        assert cluster.width == 2
        diagnose_all(there, jobs=cluster.width, timeout=60.0, begin=cluster.begin, ended=lambda task, attempt: None)
    for mine, its in zip(here, there, strict=True):
        assert attempt_of(its.folder).error is None
        assert (mine.folder / "diagnosis.json").read_bytes() == (its.folder / "diagnosis.json").read_bytes()
        noted = [json.loads((task.folder / "attempt.json").read_text())["code"] for task in (mine, its)]
        assert noted[0] == noted[1] != ""


def test_a_worker_that_is_killed_loses_no_world(tmp_path, address):
    tasks = tasks_in(tmp_path, 2.0)
    with Cluster(address, 60.0) as cluster, distributed.Client(address, set_as_default=False) as client:
        killed = []

        def begin(task):
            running = cluster.begin(task)
            if task.name == "1":
                time.sleep(0.5)
                killed.append(next(iter(client.run(os.getpid).values())))
                os.kill(killed[0], signal.SIGKILL)
            return running

        diagnose_all(tasks, jobs=2, timeout=60.0, begin=begin, ended=lambda task, attempt: None)
    assert killed and [attempt_of(task.folder).error for task in tasks] == [None] * 4


def test_a_diagnosis_that_takes_too_long_there_has_failed(tmp_path, address):
    tasks = tasks_in(tmp_path, 30.0, count=1)
    with Cluster(address, 1.0) as cluster:
        diagnose_all(tasks, jobs=1, timeout=1.0, begin=cluster.begin, ended=lambda task, attempt: None)
    assert attempt_of(tasks[0].folder).error == "stopped after 1 s (--timeout)."


def test_no_scheduler_is_one_line(monkeypatch):
    monkeypatch.setattr("physid_drake.validation.sealing.cluster.PATIENCE", 1.0)
    with pytest.raises(ProofError, match="no scheduler"):
        Cluster("tcp://127.0.0.1:9", 1.0)
