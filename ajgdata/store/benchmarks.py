"""Benchmark files of Snakemake: run time, CPU time and memory of each rule."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import NamedTuple

from ajgdata.types import many

MIB = 2**20 / 1e6  #: Snakemake's unit of memory, in 1e6 bytes
ALL_RULES = "all"  #: name of the row for all rules


class RuleCost(NamedTuple):
    """Cost of all jobs of a rule, in s and 1e6 bytes; the memory is that of the largest job."""

    rule: str
    jobs: int
    wall_s: float
    cpu_s: float
    peak_mb: float


def cost_text(cost: RuleCost) -> str:
    """Return the cost of jobs in words, which the report and the console share."""
    return (
        f"{many(cost.jobs, 'job')}, {cost.wall_s / 60:.1f} min wall time, "
        f"{cost.cpu_s / 60:.1f} min CPU time, peak memory {cost.peak_mb:,.0f} MB"
    )


def read_costs(
    folder: Path, is_included: Callable[[str], bool], without: Collection[str] = ()
) -> list[RuleCost]:
    """Return a row per rule, the longest first, and the row ALL_RULES; no rows without jobs.

    The files in `folder` are `<rule>/<wildcards with dots or slashes>.tsv` and `<rule>.tsv`;
    `is_included` chooses them by the first wildcard ("" without wildcards), and rules of `without`
    are excluded. Each has the last execution of a job.
    """
    import pandas as pd

    jobs = []
    for path in sorted(folder.rglob("*.tsv")):
        rule, *wildcards = path.relative_to(folder).with_suffix("").parts
        first = wildcards[0].partition(".")[0] if wildcards else ""
        if is_included(first) and rule not in without:
            jobs.append(pd.read_csv(path, sep="\t", na_values="-").assign(rule=rule))
    if not jobs:
        return []
    table = pd.concat(jobs)
    # The proportional set size counts memory that processes share once.
    table["peak_mb"] = table.max_pss.fillna(table.max_rss) * MIB
    measured = {"s": ["size", "sum"], "cpu_time": "sum", "peak_mb": "max"}
    rows = table.groupby("rule").agg(measured).itertuples()
    costs = sorted((RuleCost(*row) for row in rows), key=lambda row: -row.wall_s)
    peak_mb = table.peak_mb.max()
    return [*costs, RuleCost(ALL_RULES, len(table), table.s.sum(), table.cpu_time.sum(), peak_mb)]
