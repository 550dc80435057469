"""Fixtures that several tests share."""

import subprocess
import sys

import pytest


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
