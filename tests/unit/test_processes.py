"""Processes end with whoever asked for them."""

import contextlib
import functools
import time

import pytest

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
