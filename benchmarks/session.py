"""CPU use of a session: of the process that holds the sound card, and of the one that records.

Through PortAudio, against a simulated card on a JACK server of its own (Debian: jackd2,
libportaudio2), whose own time is not counted: a plain ratio of CPU seconds to seconds that passed.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml
from rich.console import Console

from ajgdata.acquire.card import CardSettings
from ajgdata.acquire.line import PortAudioLine
from ajgdata.acquire.operator import Unattended
from ajgdata.acquire.simulated_card import DEVICE, SERVER_VARIABLE
from ajgdata.cli.terminal import TerminalOperator
from ajgdata.paths import Paths
from ajgdata.pipeline.acquire_live import Noted, acquire_live

CARD = """
import numpy as np
from ajgdata.acquire.plant import Plant
from ajgdata.acquire.simulated_card import jack_server, run_card
response = 0.02 * np.exp(-np.arange(400) / 40)
with jack_server():
    run_card(Plant(response, 1e-4), {}, lambda: print("ready", flush=True))
"""


def declared(root: Path, grasps: int) -> Paths:
    """A project whose only data set is a protocol of that many grasps, two sweeps of 1 s each."""
    paths = Paths(root)
    content: dict[str, Any] = {
        "name": "d",
        "targets": {"label": {"kind": "classification"}},
        "excitation": {"kind": "log_sweep", "length_s": 1.0},
        "protocol": {
            "objects": [{"name": "cube", "targets": {"label": "cube"}}],
            "grasps_per_object": grasps,
            "samples_per_grasp": 2,
            "wait_s": 0,
        },
    }
    paths.dataset("d").parent.mkdir(parents=True)
    paths.dataset("d").write_text(yaml.safe_dump(content))
    return paths


def spent_s(pid: int) -> float:
    """CPU seconds of a process that runs (Linux)."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def row(what: str, cpu_s: float, wall_s: float) -> None:
    print(f"{what:42} {cpu_s:8.2f} {wall_s:9.1f} {100 * cpu_s / wall_s:8.1f} %", flush=True)


def waiting(seconds: float) -> None:
    """The recorder while an operator thinks: its stream is open."""
    line = PortAudioLine(CardSettings(device=DEVICE))
    try:
        begin, before = time.monotonic(), spent_s(line.pid or 0)
        time.sleep(seconds)
        row("recorder, stream open, nothing asked", spent_s(line.pid or 0) - before,
            time.monotonic() - begin)  # fmt: skip
    finally:
        line.close()


def session(grasps: int) -> None:
    """A whole session without anybody; the recorder counts as soon as it has ended."""
    operator = Unattended(TerminalOperator(Console(quiet=True)))
    with tempfile.TemporaryDirectory() as folder:
        paths = declared(Path(folder) / "project", grasps)
        begin, before = time.monotonic(), os.times()
        _, done = acquire_live(
            paths, "d", "", device={"device": DEVICE}, operator=operator, noted=Noted()
        )
        wall, after = time.monotonic() - begin, os.times()
    row("recorder, session with its start", after[2] + after[3] - before[2] - before[3], wall)
    row("acquisition, session", after[0] + after[1] - before[0] - before[1], wall)
    print(f"{done.recorded} recordings of 1 s in {wall:.1f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--grasps", type=int, default=10, help="of two recordings each")
    parser.add_argument("--idle", type=float, default=20.0, help="seconds of an open stream")
    given = parser.parse_args()
    os.environ[SERVER_VARIABLE] = f"ajgdata-benchmark-{os.getpid()}"
    with subprocess.Popen([sys.executable, "-c", CARD], stdout=subprocess.PIPE, text=True) as card:
        try:
            if not (card.stdout and card.stdout.readline()):
                sys.exit("the simulated card does not start")
            print(f"{platform.machine()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
            print(f"{'':42} {'CPU s':>8} {'passed s':>9} {'of a core':>10}")
            waiting(given.idle)
            session(given.grasps)
        finally:
            card.terminate()


if __name__ == "__main__":
    main()
