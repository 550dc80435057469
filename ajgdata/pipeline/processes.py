"""Call a function for many items. With enough items, several processes share the work."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import chain, islice
from typing import TypeVar

from threadpoolctl import threadpool_limits

from ajgdata.types import DataError

Item = TypeVar("Item")
Returned = TypeVar("Returned")

#: Recordings for each process. A process needs 0.45 s to import its modules. In this time, one core
#: computes the features of 650 recordings of one second.
ITEMS_PER_PROCESS = 1_000
#: Largest number of processes that share a job. Windows does not allow more.
MAX_PROCESSES = 61
#: Items that a process computes at a time, in about 20 ms.
_BLOCK = 32


def process_count(items: int) -> int:
    """Return the number of processes that share this number of items.

    >>> from ajgdata.pipeline.processes import process_count
    >>> process_count(999), process_count(1_000), process_count(5_000)
    (1, 2, 6)
    """
    return 1 + items // ITEMS_PER_PROCESS


def results_of(
    function: Callable[[Item], Returned], items: Iterable[Item], processes: int
) -> list[Returned]:
    """Return the results of a function for all items, in their order.

    With at least ITEMS_PER_PROCESS items, `processes` other processes compute the results, and
    begin while `items` is read. Otherwise this process computes them. Function, items and results
    must be picklable. Raises errors of the function, and DataError if a process is killed.
    """
    source = iter(items)
    first = list(islice(source, ITEMS_PER_PROCESS)) if processes > 1 else []
    every = chain(first, source)
    if len(first) < ITEMS_PER_PROCESS:
        return [function(item) for item in every]
    # A fork would copy locks that other threads hold.
    context = multiprocessing.get_context("spawn")
    try:
        with ProcessPoolExecutor(min(processes, MAX_PROCESSES), context, _prepare_worker) as pool:
            try:
                waiting = _blocks(every)
                with _interrupts_blocked():  # the processes start with the first blocks
                    begun = islice(waiting, processes)
                    blocks = [pool.submit(_each, function, block) for block in begun]
                blocks += [pool.submit(_each, function, block) for block in waiting]
                return [result for block in blocks for result in block.result()]
            except BaseException:  # after Ctrl-C as well, blocks that have not begun are dropped
                pool.shutdown(cancel_futures=True)
                raise
    except BrokenProcessPool:
        problem = "one of the processes that share this job was killed, perhaps for lack of memory"
        fix = "close other programs, or run again with `--cores 1`"
        raise DataError(f"process {os.getpid()}", problem, fix) from None


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Block Ctrl-C for this thread and for processes that it starts, except on Windows.

    A process inherits the block, so Ctrl-C does not end it before it ignores Ctrl-C.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _blocks(items: Iterator[Item]) -> Iterator[list[Item]]:
    """Yield all items in lists of up to _BLOCK."""
    block = list(islice(items, _BLOCK))
    while block:
        yield block
        block = list(islice(items, _BLOCK))


def _each(function: Callable[[Item], Returned], items: Sequence[Item]) -> list[Returned]:
    """Return the results of a function for some items, computed by one core."""
    # The limit applies to libraries that are loaded, so it is set for each block.
    with threadpool_limits(limits=1):
        return [function(item) for item in items]


def _prepare_worker() -> None:
    """Let only the parent handle Ctrl-C, and end this process with its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process if its parent is killed. Otherwise it would wait for work without end."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
