"""Fixtures that several tests share."""

import os
import signal
import subprocess
import sys

import pytest
from hypothesis import settings

# Tests compute little: on a busy machine threads that wait for each other take ten times as long.
# Before anything imports numpy or torch; the processes that tests start inherit it.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# Whoever started pytest in the background of a shell had it ignore Ctrl-C; tests send it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Nothing here is timed: a slow machine is no defect. The same examples each time: a search for new
# ones is `pytest --hypothesis-profile search`.
settings.register_profile("untimed", deadline=None, derandomize=True)
settings.register_profile("search", deadline=None)
settings.load_profile("untimed")


#: The longest first, so that no process is left with one of them at the end (`loadscope` hands out
#: whole files, and `--no-loadscope-reorder` keeps the order given here).
LONGEST = ("workflow/test_incremental", "docs/", "workflow/", "unit/test_publish", "verification/")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the longest files first; the sort is stable."""

    def rank(item: pytest.Item) -> int:
        return next((n for n, part in enumerate(LONGEST) if part in item.nodeid), len(LONGEST))

    items.sort(key=rank)


@pytest.fixture(scope="session")
def run_python():
    """Run code in a fresh interpreter; returns what it prints."""

    def run(code: str) -> str:
        done = subprocess.run(
            [sys.executable, "-c", code], check=False, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run
