"""Work spread over processes that end with whoever asked for it."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import TypeVar

T = TypeVar("T")


def in_processes(call: Callable[[int], T], indices: Sequence[int], jobs: int) -> Iterator[tuple[int, T]]:
    """Calls with each index in processes of their own, as they end: (index, result).

    Where the caller stops asking, by an interruption or an error, the processes are ended with all that they have not
    finished; a pool that is shut down would finish it first.

    Args:
        call: can be pickled.
        indices: of the calls.
        jobs: processes.
    """
    before = multiprocessing.active_children()
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        futures = {pool.submit(call, index): index for index in indices}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BaseException:
            for child in multiprocessing.active_children():
                if child not in before:
                    child.terminate()
            raise
