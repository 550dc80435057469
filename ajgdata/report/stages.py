"""What each stage of a run took: time and memory of its jobs."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


@dataclass(frozen=True)
class JobTime:
    """One job: its stage and wildcards, s of wall and processor time, MB at most; NaN: too short
    to be measured."""

    stage: str
    parts: tuple[str, ...]
    wall_s: float
    cpu_s: float
    peak_mb: float


class StageTime(NamedTuple):
    """The jobs of a stage together; memory is that of the largest."""

    stage: str
    jobs: int
    wall_s: float
    cpu_s: float
    peak_mb: float


@dataclass(frozen=True)
class Stages:
    """All jobs behind a report; `busy_s`: how long at least one of them was running."""

    jobs: tuple[JobTime, ...]
    busy_s: float

    def table(self) -> list[StageTime]:
        """One row a stage, in order of first appearance, the longest first."""
        grouped = defaultdict(list)
        for job in self.jobs:
            grouped[job.stage].append(job)
        rows = [_together(stage, jobs) for stage, jobs in grouped.items()]
        return sorted(rows, key=lambda row: -row.wall_s)

    def total(self) -> StageTime:
        """All jobs together."""
        return _together("all", list(self.jobs))

    def of_tasks(self) -> list[JobTime]:
        """Return the jobs of single tasks: data set, task and experiment."""
        return [job for job in self.jobs if len(job.parts) == 3]


def _together(stage: str, jobs: list[JobTime]) -> StageTime:
    wall, cpu, peak = np.array([(job.wall_s, job.cpu_s, job.peak_mb) for job in jobs]).T
    largest = float(np.nanmax(peak)) if np.isfinite(peak).any() else float("nan")
    return StageTime(stage, len(jobs), float(np.nansum(wall)), float(np.nansum(cpu)), largest)
