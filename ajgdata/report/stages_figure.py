"""Time of each stage, as a figure."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from matplotlib.figure import Figure

from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.format import Caption, Source, number
from ajgdata.report.job_times import Stages

#: Stages beyond these share one colour: more cannot be told apart.
SHOWN = len(COLOURS)
OTHERS = "others"
NO_DATA_SET = "of no data set"


@styled
def stages_figure(stages: Stages, sources: tuple[Source, ...]) -> Figure:
    """A bar a data set: wall time of its jobs, stage upon stage."""
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
    """Caption of `stages_figure`."""
    total = stages.total()
    told = ", ".join(f"{row.stage} {number(row.wall_s)} s" for row in stages.table())
    return Caption(
        f"Wall time of the {total.jobs} jobs behind this page, each as it was when it last ran, as "
        "Snakemake measured it: starting Python and reading files included. The report's own time "
        f"is that until this figure. Jobs side by side: {number(stages.busy_s)} s in all.",
        f"Time of each stage by data set. {told}.",
    )
