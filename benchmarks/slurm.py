"""What a job costs on SLURM beside its work: waiting, and the two Snakemakes around it.

Starts a SLURM of its own on this machine (as root; tools/loopback_slurm.py) and has the features
of a few short sessions made through profiles/slurm, one by one and all together. Every Python
process tells the CPU seconds that it took, which a busy machine does not change; what SLURM itself
takes, from submission to the end of an empty job, is wall time.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from statistics import median
from typing import Annotated

import numpy as np
import typer
import yaml
from rich.console import Console
from rich.table import Table

from ajgdata.paths import Paths
from ajgdata.store.audio import write_pcm24
from ajgdata.store.sessions import write_session
from ajgdata.types import Recording, Session
from tools.loopback_slurm import loopback_slurm, missing

ROOT = Path(__file__).resolve().parents[1]
LOG = "AJGDATA_CPU_LOG"
#: Imported by every Python process that starts with it on its path.
COUNTER = f"""
import atexit, os, sys, time
def tell():
    with open(os.environ["{LOG}"], "a") as log:
        log.write(f"{{time.process_time():.3f}} {{' '.join(sys.orig_argv)!r}}\\n")
atexit.register(tell)
"""
GROUPS = (1, 2, 4, 8, 16, 32, 100)


def declare(paths: Paths, sessions: int) -> list[Path]:
    """Make a data set of sessions of one recording; return the files of their features."""
    path = paths.dataset("tones")
    path.parent.mkdir(parents=True)
    path.write_text(yaml.safe_dump({"name": "tones", "targets": {}}))
    noise = np.random.default_rng(0)
    for number in range(sessions):
        folder = paths.session("tones", f"day{number}")
        write_pcm24(folder / "audio/0.wav", 0.1 * noise.normal(size=9_000).clip(-9, 9), 44_100)
        one = Recording(recording_id="0", file="audio/0.wav", grasp_id="0", labels={})
        write_session(folder, Session(session_id=folder.name, source="import"), [one])
    return [paths.shard("tones", f"day{number}") for number in range(sessions)]


def role(command: str) -> str:
    """Return what a Python process was for."""
    if "slurm-jobstep" in command:
        return "submission"
    if ".snakemake/scripts" in command:
        return "work"
    return "job" if "--mode" in command else "main"


def run(root: Path, targets: list[Path], group: int) -> dict[str, float]:
    """Have the targets made in groups of that size; return CPU seconds by role."""
    log = root / "cpu.log"
    log.write_text("")
    shutil.rmtree(root / "results", ignore_errors=True)
    profile = ("--workflow-profile", str(ROOT / "profiles/slurm"), "--cores", "1")
    more = ("--slurm-init-seconds-before-status-checks", "1")
    names = [str(path.relative_to(root)) for path in targets]
    subprocess.run(
        [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "Snakefile"), *profile,
         *more, "--group-components", f"features={group}", "--", *names],
        check=True, cwd=root, env=os.environ | {LOG: str(log)}, capture_output=True,
    )  # fmt: skip
    spent: dict[str, float] = defaultdict(float)
    for line in log.read_text().splitlines():
        seconds, command = line.split(" ", 1)
        spent[role(command)] += float(seconds)
    return spent


def empty_job_s(repeats: int) -> float:
    """Return wall time from the submission of an empty job to its end, s: the median."""
    took = []
    for _ in range(repeats):
        began = time.perf_counter()
        command = ["sbatch", "--wait", "--output=/dev/null", "--wrap=true"]
        subprocess.run(command, check=True, capture_output=True)
        took.append(time.perf_counter() - began)
    return median(took)


def main(
    sessions: Annotated[int, typer.Option(min=2)] = 4,
) -> None:
    """Print the cost of a submission and of a job, and the work above which they are below 10 %."""
    if reason := missing():
        sys.exit(reason)
    with tempfile.TemporaryDirectory() as temporary:
        root, counter = Path(temporary) / "project", Path(temporary) / "counter"
        targets = declare(Paths(root), sessions)
        counter.mkdir()
        (counter / "sitecustomize.py").write_text(COUNTER)
        path = (str(counter), str(ROOT), os.environ.get("PYTHONPATH", ""))
        os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, path))
        with loopback_slurm(Path(temporary) / "slurm", nodes=2, cpus=1):
            waited = empty_job_s(5)
            alone, together = run(root, targets, 1), run(root, targets, sessions)
    show(alone, together, waited, sessions)


def show(alone: dict[str, float], together: dict[str, float], waited: float, jobs: int) -> None:
    """Print both tables."""
    table = Table("CPU s", f"{jobs} jobs, each alone", f"{jobs} jobs, one group")
    for name in ("main", "submission", "job", "work"):
        table.add_row(name, f"{alone[name]:.1f}", f"{together[name]:.1f}")
    Console(width=100).print(table)
    submission, job = alone["submission"] / jobs + waited, together["job"] / jobs
    print(f"load {os.getloadavg()[0]:.0f}; an empty job of SLURM's: {waited:.1f} s of wall time")
    print(f"a submission: {submission:.1f} s; a job in it: {job:.1f} s, beside its work")
    print("jobs in a group: s of work in each, above which all this is less than 10 %")
    for size in GROUPS:
        print(f"{size:4}: {10 * (submission / size + job):6.0f}")


if __name__ == "__main__":
    typer.run(main)
