"""Work spread over processes that end with whoever asked for it."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Final, TypeVar

from physid_drake.errors import WorkerError

T = TypeVar("T")
_LIBC: Final = ctypes.CDLL(None)
_PR_SET_PDEATHSIG: Final = 1
LOOK: Final = 0.5  # s between looks at whether the parent lives
ENDED: Final = (
    "a process was ended by the system, perhaps for want of memory; the same command with fewer jobs goes on from"
    " what is kept."
)


def end_with_parent() -> None:
    """From now on this process ends when the one that asked for it does, however that was ended."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_watch, args=[parent.pid], daemon=True).start()


def killed_with_parent() -> None:
    """From now on the system kills this process when the one that started it is gone, even if it is busy."""
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def _watch(parent: int | None) -> None:
    while os.getppid() == parent:
        time.sleep(LOOK)
    os._exit(1)


def in_processes(call: Callable[[int], T], indices: Sequence[int], jobs: int) -> Iterator[tuple[int, T]]:
    """Calls with each index in processes of their own, as they end: (index, result).

    Where the caller stops asking, by an interruption or an error, the processes are ended with all that they have not
    finished; a pool that is shut down would finish it first.

    Args:
        call: can be pickled.
        indices: of the calls.
        jobs: processes.

    Raises:
        WorkerError: if one of the processes is ended by somebody else.
    """
    before = multiprocessing.active_children()
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=spawn, initializer=end_with_parent) as pool:
        futures = {pool.submit(call, index): index for index in indices}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BrokenProcessPool as error:
            raise WorkerError(ENDED) from error
        except BaseException:
            for child in multiprocessing.active_children():
                if child not in before:
                    child.terminate()
            raise
