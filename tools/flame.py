"""Where the time of a run went, job by job: `python tools/flame.py [--results DIR] [--svg FILE]`.

Reads what Snakemake measured of each job (`results/benchmarks`) and what the job itself said
at its end (`results/logs`), writes a chart of the last run
(a row per core, a bar per job, coloured by rule; names and figures on hovering) and prints a table
by rule. A job of an earlier run, before a pause of `--pause-min`, is no part of it.
"""

import argparse
import math
import statistics
import sys
from collections.abc import Sequence
from html import escape
from itertools import groupby
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.store.benchmarks import Job, read_benchmarks
from ajgdata.store.files import write_bytes

WIDTH, ROW, MARGIN, LEGEND = 1200, 44, 50, 22
#: Tab20's saturated colours first, then its light ones.
COLOURS = (
    "#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2", "#7f7f7f",
    "#bcbd22", "#17becf", "#aec7e8", "#ffbb78", "#98df8a", "#ff9896", "#c5b0d5", "#c49c94",
)  # fmt: skip


def start_s(job: Job) -> float:
    """Return when a job started (s since 1970)."""
    return job.ended_s - job.wall_s


def last_run(jobs: Sequence[Job], pause_s: float) -> list[Job]:
    """Return the jobs after the last pause of `pause_s` in which none ran, by their start."""
    ordered = sorted(jobs, key=start_s)
    first, reached = 0, -math.inf
    for number, job in enumerate(ordered):
        if start_s(job) > reached + pause_s:
            first = number
        reached = max(reached, job.ended_s)
    return ordered[first:]


def rows_of(jobs: Sequence[Job], slack_s: float = 0.5) -> list[int]:
    """Return a row for each job, in order of their start, so that none overlaps in one.

    A file's time is that of its writing, a moment after the job: `slack_s` of overlap is none.
    """
    ends: list[float] = []
    rows = []
    for job in jobs:
        free = [row for row, end in enumerate(ends) if end <= start_s(job) + slack_s]
        row = free[0] if free else len(ends)
        ends[row : row + 1] = [job.ended_s]
        rows.append(row)
    return rows


def chart(jobs: Sequence[Job]) -> str:
    """Return the chart of some jobs as SVG."""
    begin, end = min(map(start_s, jobs)), max(job.ended_s for job in jobs)
    rows, scale = rows_of(jobs), (WIDTH - 2 * MARGIN) / max(end - begin, 1e-9)
    rules = sorted({job.rule for job in jobs}, key=lambda rule: -_sum(jobs, rule, "wall_s"))
    colour = {rule: COLOURS[n % len(COLOURS)] for n, rule in enumerate(rules)}
    bottom = MARGIN + (max(rows) + 1) * ROW
    height = bottom + 40 + LEGEND * math.ceil(len(rules) / 5)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
        f'font-family="sans-serif" font-size="13"><rect width="100%" height="100%" fill="white"/>',
        f'<text x="{MARGIN}" y="28" font-size="16">{len(jobs)} jobs in '
        f"{(end - begin) / 60:.1f} min, by rule; a row is a job at a time</text>",
    ]
    for job, row in zip(jobs, rows, strict=True):
        x, wide = MARGIN + (start_s(job) - begin) * scale, max(job.wall_s * scale, 0.5)
        named = escape(f"{job.rule} {' '.join(job.parts)}")
        parts.append(
            f'<rect x="{x:.1f}" y="{MARGIN + row * ROW}" width="{wide:.1f}" height="{ROW - 4}" '
            f'fill="{colour[job.rule]}" stroke="white" stroke-width="0.3">'
            f"<title>{named}: {job.wall_s:.1f} s, {job.cpu_s:.1f} s of processor time</title>"
            "</rect>"
        )
    minutes = (end - begin) / 60
    step = next((s for s in (1, 2, 5, 10, 20, 60) if minutes / s <= 12), 240)
    for minute in range(0, math.floor(minutes) + 1, step):
        x = MARGIN + minute * 60 * scale
        parts.append(f'<text x="{x:.0f}" y="{bottom + 14}" text-anchor="middle">{minute}</text>')
    parts.append(f'<text x="{WIDTH - MARGIN}" y="{bottom + 30}" text-anchor="end">min</text>')
    for number, rule in enumerate(rules):
        x, y = MARGIN + number % 5 * 220, bottom + 34 + number // 5 * LEGEND
        parts.append(
            f'<rect x="{x}" y="{y}" width="12" height="12" fill="{colour[rule]}"/>'
            f'<text x="{x + 18}" y="{y + 11}">{escape(rule)}</text>'
        )
    return "\n".join([*parts, "</svg>", ""])


def _sum(jobs: Sequence[Job], rule: str, key: str) -> float:
    values = [getattr(job, key) for job in jobs if job.rule == rule]
    return sum(value for value in values if not math.isnan(value))


def table(jobs: Sequence[Job]) -> str:
    """Return time by rule as Markdown, the longest first.

    The shortest job of a rule is an upper bound of what each of them spends on its start.
    """
    told = ["| rule | jobs | wall, s | processor, s | median, s | shortest, s | largest, MB |"]
    told.append("|---|---:|---:|---:|---:|---:|---:|")
    by_rule = groupby(sorted(jobs, key=lambda job: job.rule), key=lambda job: job.rule)
    rows: list[tuple[str, int, float, float, float, float, float]] = []
    for rule, some in by_rule:
        of_rule = list(some)
        wall, cpu = (_sum(of_rule, rule, key) for key in ("wall_s", "cpu_s"))
        each = [job.cpu_s for job in of_rule if not math.isnan(job.cpu_s)] or [math.nan]
        largest = max((j.peak_mb for j in of_rule if not math.isnan(j.peak_mb)), default=math.nan)
        rows.append((rule, len(of_rule), wall, cpu, statistics.median(each), min(each), largest))
    for rule, count, *took, largest in sorted(rows, key=lambda row: -row[3]):
        told.append(_line(rule, f"{count}", *(f"{s:,.1f}" for s in took), f"{largest:,.0f}"))
    wall, cpu = (sum(row[n] for row in rows) for n in (2, 3))
    told.append(_line("all", f"{len(jobs)}", f"{wall:,.1f}", f"{cpu:,.1f}", "", "", ""))
    return "\n".join(told)


def _line(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Write the chart and print the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--results", type=Path, default=Path("results"))
    options.add_argument("--svg", type=Path, help="default: flame.svg in the results")
    options.add_argument("--pause-min", type=float, default=10.0)
    asked = options.parse_args()
    paths = Paths()
    folder, logs = (
        asked.results / p.relative_to(paths.results) for p in (paths.benchmarks, paths.logs)
    )
    jobs = last_run(read_benchmarks(folder, logs), asked.pause_min * 60)
    if not jobs:
        sys.exit(f"{folder}: holds no benchmark of a job; run `snakemake` first")
    svg = asked.svg or asked.results / "flame.svg"
    write_bytes(svg, chart(jobs).encode())
    print(table(jobs), f"\nwrote {svg}", sep="\n")


if __name__ == "__main__":
    main()
