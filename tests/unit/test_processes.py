"""Processes end with whoever asked for them."""

import contextlib
import functools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from physid_drake.errors import WorkerError
from physid_drake.processes import in_processes


def touch(folder, index):
    time.sleep(0.3 * index)
    (folder / str(index)).write_text("")
    return index * index


def test_results_come_as_they_end(tmp_path):
    assert list(in_processes(functools.partial(touch, tmp_path), [2, 0], 2)) == [(0, 0), (2, 4)]


def test_what_is_not_asked_for_any_more_is_not_made(tmp_path):
    with (
        pytest.raises(KeyboardInterrupt),
        contextlib.closing(in_processes(functools.partial(touch, tmp_path), range(12), 2)) as calls,
    ):
        next(calls)
        raise KeyboardInterrupt
    made = len(list(tmp_path.iterdir()))
    time.sleep(1.5)
    assert len(list(tmp_path.iterdir())) == made < 4


def kill_oneself(index):
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_process_that_the_system_ends_is_one_line():
    with pytest.raises(WorkerError, match="was ended by the system"):
        list(in_processes(kill_oneself, [0, 1], 2))


def living():
    """The parent of every process that is alive, by its number."""
    parents = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, parent = file.read_text().rpartition(") ")[2].split()[:2]
            if state != "Z":
                parents[int(file.parent.name)] = int(parent)
    return parents


def descendants(pid):
    parents, found = living(), {pid}
    while more := {child for child, parent in parents.items() if parent in found} - found:
        found |= more
    return found - {pid}


LOKY = """
import time
from joblib import Parallel, delayed
from physid_drake.processes import end_with_parent
Parallel(n_jobs=2, initializer=end_with_parent)(delayed(time.sleep)(60) for _ in range(4))
"""
SPAWNED = """
import time
from physid_drake.processes import in_processes
if __name__ == "__main__":
    list(in_processes(time.sleep, [60, 60, 60], 2))
"""


@pytest.mark.parametrize("script", [LOKY, SPAWNED], ids=["loky", "spawned"])
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_processes_end_with_the_one_that_asked_for_them_however_that_is_ended(script, number, tmp_path):
    (tmp_path / "parent.py").write_text(script)
    parent = subprocess.Popen([sys.executable, str(tmp_path / "parent.py")], stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 60.0
    while len(workers := descendants(parent.pid)) < 3 and time.monotonic() < deadline:  # and one that tracks them
        time.sleep(0.1)
    time.sleep(1.5)  # until they work
    parent.send_signal(number)
    parent.wait(60)
    while workers & set(living()) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert len(workers) >= 3 and not workers & set(living())
