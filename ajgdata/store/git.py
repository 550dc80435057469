"""Calls of git that neither depend on settings of the user nor ask for a password."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

from ajgdata.store.addresses import without_credentials
from ajgdata.types import DataError

_SETTINGS = (
    "core.autocrlf=false",
    "core.symlinks=false",
    "core.hooksPath=",
    "gc.auto=0",
    "http.lowSpeedLimit=1000",
    "http.lowSpeedTime=30",
)


def run_git(
    where: object, *words: str, folder: Path, may_fail: bool = False, **variables: str
) -> str:
    """Return the output of git, started in `folder` with environment `variables`.

    Raises DataError about `where`, with the message of git, if it fails, except if it `may_fail`.
    """
    program = shutil.which("git")
    if program is None:
        fix = "install git, then run it again"
        raise DataError("git", "is not installed, but downloads the recordings", fix)
    settings = [word for setting in _SETTINGS for word in ("-c", setting)]
    completed = subprocess.run(
        [program, *settings, *words],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        check=False,
        env={**os.environ, "GIT_TERMINAL_PROMPT": "0", "LC_ALL": "C", **variables},
        cwd=folder,
    )
    if completed.returncode and not may_fail:
        message = without_credentials(" ".join(completed.stderr.split()))
        reason = message[:400] or "it gives no reason"
        fix = "correct the cause, then run it again: complete files are kept"
        raise DataError(where, f"git failed ({reason})", fix)
    return completed.stdout.strip()
