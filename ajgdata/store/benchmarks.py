"""Benchmark files of Snakemake: run time, CPU time and memory of each rule."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from ajgdata.types import many

#: Snakemake's unit of memory, in 1e6 bytes.
MIB = 2**20 / 1e6
#: Name of the row for all rules.
ALL_RULES = "all"


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
    """Return a row per rule, in descending order of wall time, and the row ALL_RULES.

    There are no rows if there are no jobs. The files in `folder` are `<rule>/<wildcards with dots
    or slashes>.tsv` and `<rule>.tsv`, with the last execution of each job. `is_included` selects
    them by the first wildcard ("" without wildcards). Rules of `without` are excluded.
    """
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
