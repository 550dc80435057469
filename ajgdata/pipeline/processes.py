"""Calls of a function for many items, shared with other processes if there are enough items."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from itertools import chain, islice
from typing import TypeVar

from threadpoolctl import threadpool_limits

from ajgdata.types import DataError

Item = TypeVar("Item")
Result = TypeVar("Result")

#: Recordings for each process. Another process needs 0.45 s to import its modules, in which one
#: core computes the features of 650 recordings of one second.
ITEMS_PER_PROCESS = 1_000
#: Items that a process computes at a time: 20 ms, the longest wait for another process at the end.
_BLOCK = 32


def process_count(items: int) -> int:
    """Return the number of processes, this one included, for which there are enough items.

    >>> from ajgdata.pipeline.processes import process_count
    >>> process_count(999), process_count(1_000), process_count(5_000)
    (1, 2, 6)
    """
    return 1 + items // ITEMS_PER_PROCESS


def results_of(
    function: Callable[[Item], Result], items: Iterable[Item], processes: int
) -> list[Result]:
    """Return the results of a function for all items, in their order.

    Up to `processes` processes compute, this one included. The others start if there are
    ITEMS_PER_PROCESS items or more. They compute while an iterator `items` is read. Function, items
    and results can be pickled. Raises what the function raises, and DataError if a process is
    killed.
    """
    source = iter(items)
    first = list(islice(source, ITEMS_PER_PROCESS)) if processes > 1 else []
    every = chain(first, source)
    if len(first) < ITEMS_PER_PROCESS:
        return [function(item) for item in every]
    # Forking would copy the locks of threads in any state.
    context = multiprocessing.get_context("spawn")
    try:
        with ProcessPoolExecutor(processes - 1, context, _prepare_worker) as pool:
            try:
                return _shared(pool, partial(_each, function), every)
            except BaseException:  # also Ctrl-C: only wait for blocks that are being computed
                pool.shutdown(cancel_futures=True)
                raise
    except BrokenProcessPool:
        problem = "one of the processes that share this job was killed, perhaps for lack of memory"
        fix = "close other programs, or run again with `--cores 1`"
        raise DataError(f"process {os.getpid()}", problem, fix) from None


def _shared(
    pool: ProcessPoolExecutor,
    each: Callable[[Sequence[Item]], list[Result]],
    items: Iterable[Item],
) -> list[Result]:
    """Return the results for all items. The pool begins with the first, this process with the last
    block of items."""
    source = iter(items)
    blocks: list[list[Item]] = []
    futures: list[Future[list[Result]]] = []
    while block := list(islice(source, _BLOCK)):
        blocks.append(block)
        futures.append(pool.submit(each, block))
    results: list[list[Result]] = [[] for _ in blocks]
    for number in reversed(range(len(blocks))):
        is_ours = futures[number].cancel()
        results[number] = each(blocks[number]) if is_ours else futures[number].result()
    return list(chain.from_iterable(results))


def _each(function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Return the results of a function for some items."""
    return [function(item) for item in items]


def _prepare_worker() -> None:
    """Use one core, leave Ctrl-C to the parent, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threadpool_limits(limits=1)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process if its parent is killed, for which the pool would wait for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
