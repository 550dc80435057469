"""Time and memory of the jobs behind a report, by stage, and their figure."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ajgdata.report.format import Caption, Source, number, sentence

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Stages beyond these share one column: more have no room.
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


def stages_finding(stages: Stages) -> str:
    """Return which stage takes most time, and how much of all."""
    total, rows = stages.total().wall_s, stages.table()
    if not rows or not total > 0:
        return "Time of each stage"
    return (
        f"{rows[0].stage} takes {number(rows[0].wall_s)} of {number(total)} s of jobs, the most of "
        f"{len(rows)} stages"
    )


def seconds_of(stages: Stages) -> tuple[list[str], list[str], np.ndarray]:
    """Return data sets, stages (the longest first, further ones together), and s (d, s) of wall
    time, the data set of most time first."""
    longest = [row.stage for row in stages.table()]
    shown = longest if len(longest) <= SHOWN else [*longest[: SHOWN - 1], OTHERS]
    seconds: dict[str, dict[str, float]] = defaultdict(lambda: dict.fromkeys(shown, 0.0))
    for job in stages.jobs:
        stage = job.stage if job.stage in shown else OTHERS
        spent = 0.0 if np.isnan(job.wall_s) else job.wall_s
        seconds[job.parts[0] if job.parts else NO_DATA_SET][stage] += spent
    names = sorted(seconds, key=lambda name: (-sum(seconds[name].values()), name))
    return names, shown, np.array([[seconds[name][stage] for stage in shown] for name in names])


def stages_figure(stages: Stages, sources: tuple[Source, ...]) -> Figure:
    """Return the s of wall time of each data set and stage, written in cells shaded by it."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure
    from ajgdata.report.labels import LABEL_PT, wrapped

    names, shown, seconds = seconds_of(stages)
    figure = new_figure(
        (WIDTH_IN, 1.5 + 0.19 * len(names)),
        stages_finding(stages),
        f"s of wall time, one job after the other; {number(stages.busy_s)} s as they ran; at the "
        "right: sum",
        sources,
    )
    axes = figure.subplots()
    most = float(seconds.max(initial=0.0)) or 1.0
    axes.imshow(np.sqrt(seconds / most), cmap="Blues", vmin=0, vmax=1, aspect="auto")
    style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": LABEL_PT}
    for (row, column), spent in np.ndenumerate(seconds):
        if spent > 0:
            colour = "white" if spent > 0.4 * most else "#222222"
            axes.text(column, row, number(spent, 2), color=colour, **style)
    for row, spent in enumerate(seconds.sum(axis=1)):
        place: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "va": "center"}
        place |= {"textcoords": "offset points", "fontsize": LABEL_PT, "fontweight": "bold"}
        axes.annotate(number(spent), (1, row), (5, 0), **place)
    heads = ["\n".join(wrapped(stage, 0.75, LABEL_PT)) for stage in shown]
    axes.set_xticks(range(len(shown)), heads)
    axes.set_yticks(range(len(names)), names)
    axes.tick_params(length=0, labeltop=True, labelbottom=False)
    axes.grid(False)
    axes.spines[:].set_visible(False)
    return figure


def stages_caption(stages: Stages) -> Caption:
    """Return the caption of `stages_figure`."""
    total = stages.total()
    told = ", ".join(f"{row.stage} {number(row.wall_s)} s" for row in stages.table())
    return Caption(
        f"Wall time of the {total.jobs} jobs behind this page, each as it was when it last ran, as "
        "Snakemake measured it: starting Python and reading files included. The report's own time "
        f"is that until this figure. Jobs side by side: {number(stages.busy_s)} s in all.",
        f"{sentence(stages_finding(stages))}. Time of each stage: {told}.",
    )
