"""Processes that may be killed or raced: forked, so that a trial costs what it does."""

from __future__ import annotations

import os
import signal
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

#: Longer than anything here takes on a machine that has other things to do.
LONGEST_S = 300.0
#: Processes that lead a session of their own, and were not waited for yet.
ALIVE: set[int] = set()


def end_all() -> None:
    """Kill all that is still alive, with all that it started: where this run is stopped."""
    for pid in tuple(ALIVE):
        with suppress(ProcessLookupError):
            os.killpg(pid, signal.SIGKILL)
        ALIVE.discard(pid)


class Ended(NamedTuple):
    """How a process ended: exit code, minus the signal that killed it, and what it said."""

    code: int
    said: str

    @property
    def errors(self) -> list[str]:
        """Its lines of error."""
        return [line for line in self.said.splitlines() if line.startswith("error ")]


class Forked:
    """A process that does `what` in the folder `root`, in a session of its own."""

    def __init__(self, what: Callable[[Path], object], root: Path) -> None:
        self._said = root.parent / f".said-{time.monotonic_ns()}"
        sys.stdout.flush()
        self.pid = os.fork()
        if self.pid == 0:
            self._live(what, root)
        ALIVE.add(self.pid)

    def _live(self, what, root: Path) -> None:
        code = 70
        try:
            os.setsid()
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            stream = os.open(self._said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(stream, 1)
            os.dup2(stream, 2)
            sys.stdout = os.fdopen(1, "w", buffering=1)
            sys.stderr = os.fdopen(2, "w", buffering=1)
            os.chdir(root)
            what(root)
            code = 0
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)

    def ended(self, within_s: float = LONGEST_S) -> Ended:
        """Wait for its end, and kill it after a while."""
        deadline = time.monotonic() + within_s
        while time.monotonic() < deadline:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                return self._report(status)
            time.sleep(0.002)
        return self.kill()

    def kill(self) -> Ended:
        """Kill it, and all that it started, now."""
        try:
            os.killpg(self.pid, signal.SIGKILL)
        except ProcessLookupError:  # it is only just being born, or is gone
            os.kill(self.pid, signal.SIGKILL)
        return self._report(os.waitpid(self.pid, 0)[1])

    def _report(self, status: int) -> Ended:
        ALIVE.discard(self.pid)
        said = self._said.read_text(errors="replace") if self._said.exists() else ""
        self._said.unlink(missing_ok=True)
        return Ended(os.waitstatus_to_exitcode(status), said)


def run(what: Callable[[Path], object], root: Path) -> Ended:
    """Do `what` to the end."""
    return Forked(what, root).ended()
