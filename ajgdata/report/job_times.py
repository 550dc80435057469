"""Time and memory of the jobs behind a report, by stage, and their figure."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ajgdata.report.format import Caption, Source, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Stages beyond these share one colour: more cannot be told apart.
SHOWN = 7
OTHERS = "others"
NO_DATA_SET = "of no data set"


@dataclass(frozen=True)
class JobTime:
    """One job: its stage and wildcards, s of wall and processor time, MB at most; NaN: too short
    to be measured. `of_task`: an experiment on a task."""

    stage: str
    parts: tuple[str, ...]
    wall_s: float
    cpu_s: float
    peak_mb: float
    of_task: bool = False


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
        """Return one row for each stage, the longest first."""
        grouped = defaultdict(list)
        for job in self.jobs:
            grouped[job.stage].append(job)
        rows = [_together(stage, jobs) for stage, jobs in grouped.items()]
        return sorted(rows, key=lambda row: -row.wall_s)

    def total(self) -> StageTime:
        """Return the sum of all jobs."""
        return _together("all", list(self.jobs))

    def of_tasks(self) -> list[JobTime]:
        """Return the experiments on tasks; their parts are data set, task and experiment."""
        return [job for job in self.jobs if job.of_task]


def _together(stage: str, jobs: list[JobTime]) -> StageTime:
    wall, cpu, peak = np.array([(job.wall_s, job.cpu_s, job.peak_mb) for job in jobs]).T
    largest = float(np.nanmax(peak)) if np.isfinite(peak).any() else float("nan")
    return StageTime(stage, len(jobs), float(np.nansum(wall)), float(np.nansum(cpu)), largest)


def stages_figure(stages: Stages, sources: tuple[Source, ...]) -> Figure:
    """Return a bar for each data set: wall time of its jobs, stage upon stage."""
    from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure

    longest = [row.stage for row in stages.table()]
    shown = longest if len(longest) <= SHOWN else [*longest[: SHOWN - 1], OTHERS]
    seconds: dict[str, dict[str, float]] = defaultdict(lambda: dict.fromkeys(shown, 0.0))
    for job in stages.jobs:
        stage = job.stage if job.stage in shown else OTHERS
        seconds[job.parts[0] if job.parts else NO_DATA_SET][stage] += job.wall_s
    bars = sorted(seconds, key=lambda name: sum(seconds[name].values()))
    figure = new_figure(
        (WIDTH_IN, 1.6 + 0.22 * len(bars)),
        "Time of each stage",
        f"jobs {number(stages.total().wall_s)} s, one after the other; "
        f"{number(stages.busy_s)} s as they ran",
        sources,
    )
    axes = figure.subplots()
    left = np.zeros(len(bars))
    for stage, colour in zip(shown, (*COLOURS[: len(shown) - 1], GREY), strict=True):
        width = np.array([seconds[name][stage] for name in bars])
        axes.barh(bars, width, left=left, color=colour, label=stage)
        left += width
    axes.set_xlabel("s of wall time, summed over jobs")
    axes.grid(axis="y", visible=False)
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


def stages_caption(stages: Stages) -> Caption:
    """Return the caption of `stages_figure`."""
    total = stages.total()
    told = ", ".join(f"{row.stage} {number(row.wall_s)} s" for row in stages.table())
    return Caption(
        f"Wall time of the {total.jobs} jobs behind this page, each as it was when it last ran, as "
        "Snakemake measured it: starting Python and reading files included. The report's own time "
        f"is that until this figure. Jobs side by side: {number(stages.busy_s)} s in all.",
        f"Time of each stage by data set. {told}.",
    )
