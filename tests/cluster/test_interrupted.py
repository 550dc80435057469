"""Interrupted tests leave nothing that keeps the next ones from running."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from runs import ROOT

from tools.loopback_slurm import (
    CONFIGURATION,
    WITH_PARENT,
    loopback_slurm,
    missing,
    processes,
    wait_until,
)

#: A test of this tier that waits for a job.
TESTED = "tests/cluster/test_cluster.py::test_a_controller_that_restarts_loses_no_job"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_the_next_run_of_this_tier_starts(_can_start, tmp_path, number):
    command = [sys.executable, "-m", "pytest", "-n", "0", "-m", "cluster", TESTED]
    with (tmp_path / "out").open("w") as out:
        tests = subprocess.Popen(
            [*WITH_PARENT, *command, "--basetemp", str(tmp_path / "interrupted")],
            cwd=ROOT, stdout=out, stderr=out, start_new_session=True,
        )  # fmt: skip
    wait_until(lambda: watched_jobs() or tests.poll() is not None, "a job")
    assert tests.poll() is None, (tmp_path / "out").read_text()
    tests.send_signal(number)
    tests.wait(120)
    if number != signal.SIGKILL:
        assert not CONFIGURATION.exists()
        assert processes() == []
    assert missing() == ""
    with loopback_slurm(tmp_path / "next") as slurm:
        assert slurm.jobs() == []
    assert not CONFIGURATION.exists()
    assert processes() == []


def watched_jobs() -> list[int]:
    """Return the processes of loopback SLURMs that belong to jobs."""
    jobs = []
    for pid in processes():
        try:
            environment = Path(f"/proc/{pid}/environ").read_bytes()
        except OSError:  # it has ended
            continue
        jobs += [pid] * (b"SLURM_JOB_ID=" in environment)
    return jobs
