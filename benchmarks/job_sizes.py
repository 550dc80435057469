"""What jobs took in a run, beside what profiles/slurm asks for: memory and time, rule by rule.

Reads `results/benchmarks` of the project in the current folder, or of the one that is named.
Headroom is what is asked for at the first attempt over what the largest job took, with the memory
of the two Snakemakes that a job on a cluster runs inside of; below 1.3 it is told.
"""

from __future__ import annotations

import math
from collections import defaultdict
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from ajgdata.paths import Paths
from ajgdata.store.benchmarks import MIB, read_benchmarks
from ajgdata.store.files import read_yaml

PROFILE = Path(__file__).resolve().parents[1] / "profiles/slurm/config.yaml"
#: MB of 2**20 bytes: the peak of a Snakemake that has read all data sets is 290 of them.
SNAKEMAKES_MIB = 600
#: Rules whose benchmarks stand under another name.
RENAMED = {"publish": "publish_dataset"}


def asked(needs: dict[str, str | int], name: str) -> int:
    """Return what a job on little data asks for at its first attempt."""
    return eval(str(needs[name]), {}, {"attempt": 1, "input": SimpleNamespace(size_mb=0)})


def main(
    project: Annotated[Path, typer.Argument(help="folder of the project")] = Path(),
) -> None:
    """Print the table."""
    needs = read_yaml(PROFILE)["set-resources"]
    jobs = defaultdict(list)
    paths = Paths(project)
    for job in read_benchmarks(paths.benchmarks):
        jobs[RENAMED.get(job.rule, job.rule)].append(job)
    table = Table(*("rule", "jobs", "longest s", "peak MiB", "asked MiB", "headroom", "asked min"))
    short = []
    for rule, some in sorted(jobs.items()):
        if rule not in needs:
            continue
        longest = max(job.wall_s for job in some)
        peak = max((j.peak_mb for j in some if not math.isnan(j.peak_mb)), default=0.0) / MIB
        memory, minutes = asked(needs[rule], "mem_mb"), asked(needs[rule], "runtime")
        room = memory / (peak + SNAKEMAKES_MIB)
        short += [rule] if room < 1.3 or 60 * minutes < 1.3 * longest else []
        numbers = f"{len(some)}", f"{longest:.0f}", f"{peak:.0f}", f"{memory}", f"{room:.1f}"
        table.add_row(rule, *numbers, f"{minutes}")
    Console(width=100).print(table)
    print(f"too little headroom: {', '.join(short)}" if short else "headroom is 1.3 or more")


if __name__ == "__main__":
    typer.run(main)
