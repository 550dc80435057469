"""Benchmark files of Snakemake: run time, CPU time and memory of each job."""

from __future__ import annotations

import csv
import io
import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from ajgdata.store.files import read_text
from ajgdata.types import DataError

MIB = 2**20 / 1e6  #: Snakemake's unit of memory, in 1e6 bytes
ALL = "all"  #: name of the row for all rules


@dataclass(frozen=True)
class Job:
    """The last execution of one job. Values that Snakemake did not measure are NaN.

    `wall_s` and `cpu_s` are in s, `peak_mb` in 1e6 bytes.
    """

    rule: str
    wildcards: tuple[str, ...]
    wall_s: float
    cpu_s: float
    peak_mb: float


class RuleCost(NamedTuple):
    """Cost of all jobs of a rule; the memory is that of the largest job."""

    rule: str
    jobs: int
    wall_s: float
    cpu_s: float
    peak_mb: float


def read_benchmarks(folder: Path) -> list[Job]:
    """Return the jobs of the files `<rule>/<wildcards with dots>.tsv` and `<rule>.tsv` in `folder`.

    Raises DataError for a file that Snakemake did not write.
    """
    jobs = []
    for path in sorted(folder.rglob("*.tsv")):
        has_wildcards = path.parent != folder
        rule = path.parent.name if has_wildcards else path.stem
        wildcards = tuple(path.stem.split(".")) if has_wildcards else ()
        for row in csv.DictReader(io.StringIO(read_text(path)), delimiter="\t"):
            try:
                columns = ("s", "cpu_time", "max_rss", "max_pss")
                wall, cpu, resident, shared = (_number(row[column]) for column in columns)
            except (KeyError, ValueError, TypeError):
                problem = "is not a benchmark file of Snakemake"
                raise DataError(path, problem, "delete it and run again") from None
            # The proportional set size counts memory that processes share once.
            memory = resident if math.isnan(shared) else shared
            jobs.append(Job(rule, wildcards, wall, cpu, memory * MIB))
    return jobs


def cost_by_rule(jobs: Sequence[Job]) -> list[RuleCost]:
    """Return a row per rule, the longest first, and the row ALL; no rows without jobs."""
    if not jobs:
        return []
    grouped: dict[str, list[Job]] = defaultdict(list)
    for job in jobs:
        grouped[job.rule].append(job)
    rows = [_cost(rule, some) for rule, some in grouped.items()]
    return [*sorted(rows, key=lambda row: -row.wall_s), _cost(ALL, jobs)]


def _cost(rule: str, jobs: Sequence[Job]) -> RuleCost:
    wall, cpu = (
        math.fsum(value for value in values if not math.isnan(value))
        for values in ((job.wall_s for job in jobs), (job.cpu_s for job in jobs))
    )
    peak = max((job.peak_mb for job in jobs if not math.isnan(job.peak_mb)), default=math.nan)
    return RuleCost(rule, len(jobs), wall, cpu, peak)


def _number(text: str) -> float:
    return math.nan if text in ("NA", "-") else float(text)
