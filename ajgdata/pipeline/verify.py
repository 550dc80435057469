"""Tests of what was built, and those of the solver that are too long for the test suite."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from ajgdata.paths import RUN_VARIABLE
from ajgdata.store.files import write_bytes
from ajgdata.types import DataError


def verify(tests: Path, summary: Path, *, run: str, log: Path) -> None:
    """Run the `tests` of the built results and write pytest's closing line.

    `run` names a run of some data sets alone, "" is a whole one. Raises DataError when a test
    fails; pytest's output is in the `log`.
    """
    chosen = [str(tests.parent), "-m", "artefact"]
    write_bytes(summary, _tested(tests, chosen, "a check of the results failed", log, run))


def verify_solver(tests: Path, summary: Path, *, log: Path) -> None:
    """Run the solver's `tests` too long for the test suite, and write pytest's closing line.

    They look at no result: a run makes them beside everything else. Raises DataError when one
    fails; pytest's output is in the `log`.
    """
    chosen = [str(tests.parent), "-m", "slow"]
    write_bytes(summary, _tested(tests, chosen, "a check of the solver failed", log))


def _tested(tests: Path, chosen: list[str], problem: str, log: Path, run: str = "") -> bytes:
    """Return the closing line of pytest, in this job's one process."""
    command = [sys.executable, "-m", "pytest", *chosen, "-n", "0", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*command, "--rootdir", str(tests.parents[2])],
        check=False,
        capture_output=True,
        text=True,
        env={**os.environ, RUN_VARIABLE: run},
    )
    print(done.stdout, done.stderr)
    if done.returncode:
        raise DataError(tests, problem, f"see {log}")
    return (done.stdout.strip().splitlines()[-1].strip("= ") + "\n").encode()
