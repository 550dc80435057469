"""The last rule: tests on what was built, and those too long for the test suite."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from ajgdata.paths import RUN_VARIABLE
from ajgdata.store.files import write_bytes
from ajgdata.types import DataError


def verify(tests: Path, summary: Path, *, quick: bool, run: str, log: Path) -> None:
    """Run the tests of the built results and, unless `quick`, the slow tier; write pytest's closing
    line.

    `run` names a run of some data sets alone, "" is a whole one. Raises DataError when a test
    fails; pytest's output is in the `log`.
    """
    built = [str(tests / "artefacts"), "-m", "artefact", "-n", "0"]  # to collect all takes longer
    chosen = built if quick else [str(tests), "-m", "artefact or slow"]
    command = [sys.executable, "-m", "pytest", *chosen, "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*command, "--rootdir", str(tests.parent)],
        check=False,
        capture_output=True,
        text=True,
        env={**os.environ, RUN_VARIABLE: run},
    )
    print(done.stdout, done.stderr)
    if done.returncode:
        raise DataError(tests, "a check of the results failed", f"see {log}")
    write_bytes(summary, (done.stdout.strip().splitlines()[-1].strip("= ") + "\n").encode())
