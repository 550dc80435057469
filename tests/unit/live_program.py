"""The command line, and a process that is killed, with a fake card.

    python live_program.py acquire d --device …             the command, its faults in FAULTS (JSON)
    python live_program.py forks                            one acquisition a line on standard input

The second imports everything once: each acquisition is a fork that is killed after a while.
"""

from __future__ import annotations

import json
import os
import sys
import traceback
from pathlib import Path

import pytest
from fake_card import FakeLine, Fault
from live_lab import Lab, Scripted, response

from ajgdata.cli import main
from ajgdata.paths import Paths


def forks(lab: Lab) -> None:
    """Print the number of each process, and how it ended."""
    for line in sys.stdin:
        process = os.fork()
        if process == 0:
            try:
                lab.lines = [FakeLine(response(), noise=1e-4 * (1 + float(line)))]
                lab.acquire(Scripted())
                os._exit(0)
            except BaseException:
                traceback.print_exc()
                os._exit(1)
        print(process, flush=True)
        print(os.waitpid(process, 0)[1], flush=True)


if __name__ == "__main__":
    lab = Lab(Paths(Path.cwd()), pytest.MonkeyPatch())
    if sys.argv[1:] == ["forks"]:
        forks(lab)
    else:
        faults = [Fault(**fault) for fault in json.loads(os.environ.get("FAULTS", "[]"))]
        lab.lines = [FakeLine(response(), noise=1e-4, faults=faults)]
        main()
