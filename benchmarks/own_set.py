"""From a folder of recordings to its report by the shortest documented way: how long, and on what.

    python benchmarks/own_set.py FOLDER [--dataset knock_material]

Runs `ajgdata import FOLDER --dataset NAME` and `ajgdata run NAME` as a person would, in a temporary
project. A data set of that name that is declared here is read as its declaration says; another
one by the starter kit's convention. Processor time is that of all processes; other programs on the
machine lengthen the wall time, hence its load is told.
"""

import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from typing import Annotated

import typer

from ajgdata.paths import Paths
from ajgdata.store.benchmarks import read_benchmarks

HERE = Paths(Path(__file__).resolve().parents[1])
AJGDATA = [sys.executable, "-c", "from ajgdata.cli import main; main()"]


def timed(project: Path, *arguments: str) -> tuple[float, float]:
    """Return wall and processor time, in s, of an `ajgdata` command in the project's folder."""
    began, used = time.perf_counter(), processor_s()
    done = subprocess.run(
        [*AJGDATA, *arguments], check=False, cwd=project, capture_output=True, text=True
    )
    if done.returncode:
        sys.exit(f"ajgdata {' '.join(arguments)}: exit code {done.returncode}\n{done.stderr}")
    return time.perf_counter() - began, processor_s() - used


def processor_s() -> float:
    """Return the processor time of all children so far."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def spent(paths: Paths) -> list[tuple[float, float, str]]:
    """Return wall and processor time of each kind of job, the longest first."""
    found: dict[str, list[float]] = defaultdict(lambda: [0.0, 0.0])
    for folder in {paths.benchmarks, paths.of_run / "benchmarks"}:
        for job in read_benchmarks(folder):
            kind = job.wildcards[-1] if job.rule in ("experiment", "train") else job.rule
            total = found[f"{job.rule} {kind}" if kind != job.rule else kind]
            total[0] += job.wall_s
            total[1] += job.cpu_s
    return sorted(((wall, cpu, kind) for kind, (wall, cpu) in found.items()), reverse=True)


def main(
    folder: Annotated[Path, typer.Argument(help="folder of recordings")],
    dataset: Annotated[str, typer.Option(help="name of the data set")] = "knock_material",
) -> None:
    """Print wall and processor time of both commands, and of each kind of job."""
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as temporary:
        project = Paths(Path(temporary), run=dataset)
        project.datasets.mkdir()
        if HERE.dataset(dataset).is_file():
            shutil.copytree(HERE.dataset(dataset).parent, project.dataset(dataset).parent)
        shutil.copytree(HERE.root / "profiles", project.root / "profiles")
        named = ("--dataset", dataset, "--reference")
        steps = {
            "import": timed(project.root, "import", str(folder.absolute()), *named),
            "run": timed(project.root, "run", dataset),
        }
        jobs = spent(project)
        if not project.report.is_file():
            sys.exit("there is no report")
    wall, cpu = (sum(one[n] for one in steps.values()) for n in (0, 1))
    print(f"{len(os.sched_getaffinity(0))} cores, load before {load:.1f}")
    for name, (step_wall, step_cpu) in {**steps, "both": (wall, cpu)}.items():
        print(f"{name:8} {step_wall:7.1f} s, {step_cpu:7.1f} s of processor")
    print("jobs, by time:")
    for job_wall, job_cpu, kind in jobs:
        print(f"{job_wall:7.1f} s, {job_cpu:7.1f} s of processor  {kind}")


if __name__ == "__main__":
    typer.run(main)
