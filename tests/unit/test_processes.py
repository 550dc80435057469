"""Results are the same with several processes; a killed process ends in one error, not a hang."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from ajgdata.pipeline import processes
from ajgdata.pipeline.processes import process_count, results_of
from ajgdata.types import DataError

#: More blocks than the pool queues, so that this process takes some of them.
ITEMS = range(300)


@pytest.fixture
def few(monkeypatch):
    """Other processes start with a hundred items."""
    monkeypatch.setattr(processes, "ITEMS_PER_PROCESS", 100)


def process_of(item):
    time.sleep(0.01)
    return item, os.getpid()


def killed_with(item):
    if multiprocessing.parent_process() is not None:
        os.kill(os.getpid(), signal.SIGKILL)
    return item


def threads_of(item):
    """Return the threads of each library that this process has loaded, and whether it is another
    process than that of the test."""
    np.dot(np.ones((50, 50)), np.ones((50, 50)))
    is_other = multiprocessing.parent_process() is not None
    return is_other, [pool["num_threads"] for pool in threadpool_info()]


def failed_with(item):
    if item == 7:
        raise ValueError(f"item {item}")
    return item


def test_results_have_the_order_of_the_items(few):
    results = results_of(process_of, iter(ITEMS), 2)
    assert [item for item, _ in results] == [*ITEMS]
    used = {process for _, process in results}
    assert os.getpid() not in used
    assert len(used) == 2


@pytest.mark.parametrize(("count", "allowed"), [(99, 2), (300, 1)])
def test_few_items_or_one_core_start_no_process(few, count, allowed):
    results = results_of(process_of, range(count), allowed)
    assert results == [(item, os.getpid()) for item in range(count)]


def test_each_process_uses_one_core(few):
    threads = results_of(threads_of, ITEMS, 2)
    assert all(is_other for is_other, _ in threads)
    assert threads[-1][1]  # a library with threads is loaded
    assert all(count == 1 for _, pools in threads for count in pools)


def test_one_process_more_for_every_thousand_items():
    counts = [process_count(items) for items in (0, 999, 1_000, 1_999, 2_000, 50_000)]
    assert counts == [1, 1, 2, 2, 3, 51]


def test_a_killed_process_is_one_error(few):
    with pytest.raises(DataError, match=r"one of the processes .* was killed") as raised:
        results_of(killed_with, ITEMS, 2)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("allowed", [1, 2])
def test_an_error_is_raised_as_without_processes(few, allowed):
    with pytest.raises(ValueError, match=r"^item 7$"):
        results_of(failed_with, ITEMS, allowed)


def test_an_error_of_the_items_ends_the_other_processes(few):
    def items():
        yield from ITEMS
        raise DataError("table", "cannot be read", "check the file")

    with pytest.raises(DataError, match="cannot be read"):
        results_of(process_of, items(), 2)
    assert multiprocessing.active_children() == []


JOB = """
import multiprocessing, signal, time
from ajgdata.pipeline.processes import results_of

def compute(item):
    if item == 0:
        print("computing", flush=True)
    time.sleep(0.01)

def items():
    yield from range(1100)
    print("starting", flush=True)  # the other processes import their modules
    yield from range(1100, 10_000)

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # pytest-xdist ignores it
    results_of(compute, items(), 2)
"""


@pytest.mark.parametrize(
    ("number", "moment"),
    [(signal.SIGINT, "starting"), (signal.SIGINT, "computing"), (signal.SIGKILL, "computing")],
)
def test_processes_end_with_their_parent(tmp_path, number, moment):
    """Ctrl-C reaches all processes of a terminal; a lack of memory may kill only the parent."""
    (tmp_path / "job.py").write_text(JOB)
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    command = [sys.executable, tmp_path / "job.py"]
    with subprocess.Popen(command, start_new_session=True, **pipes) as parent:
        printed = ""
        while printed != f"{moment}\n":
            printed = parent.stdout.readline()
            assert printed
        send = os.killpg if number == signal.SIGINT else os.kill
        send(parent.pid, number)
        errors = parent.communicate(timeout=300)[1]  # the other process has closed the pipes
    assert parent.returncode == -number, errors
    assert errors.count("Traceback") == (number == signal.SIGINT)
