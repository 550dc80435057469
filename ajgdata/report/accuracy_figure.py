"""Figure of the error budget: error of the feature against run time, by source of the error."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.report.canvas import WIDTH_IN, line_style, new_figure, plain_ticks, power_ticks
from ajgdata.report.format import Caption, number
from ajgdata.report.report_data import Illustration
from ajgdata.studies import ALL_SOURCES
from ajgdata.types.table import Table

PANEL_IN = 2.4
PANELS_PER_ROW = 3
#: Smaller errors are rounding errors of the feature, which are not drawn.
SMALLEST_ERROR = 1e-6
TOTAL_STYLE: dict[str, Any] = {"marker": "*", "ms": 13, "color": "black", "ls": "", "zorder": 5}
DEFAULT_STYLE: dict[str, Any] = {"marker": "o", "ms": 9, "mfc": "none", "color": "black", "ls": ""}
TEXT = (
    "Each panel is a class of scenes. A line is a source of the error: only its setting varies, and"
    " its reference has the best setting. Rings are the default settings; the star is the error of"
    " grid, stopping, modes and omissions together. Times belong to the machine that made this"
    " page, their ratios less so."
)


def accuracy_figure(table: Table) -> Illustration:
    """Return the figure of the error budget, named like its table."""
    total = table.where(source=ALL_SOURCES).numbers("error")
    title = (
        f"Default settings: relative error of the feature {number(total.min(), 2)} to"
        f" {number(total.max(), 2)}, mostly from {largest_source(table)}"
    )
    points = "; ".join(
        f"{row['kind']}, {row['source']}: {number(float(row['error']), 2)}"
        for row in table.where(is_default=True).rows
    )
    draw = partial(_draw, title, table)
    return Illustration(table.name, Caption(TEXT, f"{title}. {points}."), draw, title)


def largest_source(table: Table) -> str:
    """Return the source with the largest error at the default settings, on average over scenes."""
    by_source = {
        source: float(rows.numbers("error").mean())
        for source, rows in table.where(is_default=True).split_by("source").items()
        if source != ALL_SOURCES
    }
    return f"the {max(by_source, key=lambda source: by_source[source])}"


def _draw(title: str, table: Table) -> Figure:
    scene_classes = table.split_by("kind")
    columns = min(PANELS_PER_ROW, len(scene_classes))
    n_rows = math.ceil(len(scene_classes) / columns)
    size = (WIDTH_IN, 1.0 + PANEL_IN * n_rows)
    figure = new_figure(
        size, title, "error against run time over that of the default", ("simulated",)
    )
    grid = figure.subplots(n_rows, columns, sharex=True, sharey=True, squeeze=False)
    sources = [source for source in table.split_by("source") if source != ALL_SOURCES]
    for axes, (scene_class, rows) in zip(grid.ravel(), scene_classes.items(), strict=False):
        _draw_scene_class(axes, scene_class, rows, sources)
    for axes in grid[-1]:
        axes.set_xlabel("run time over the default's")
    for axes in grid[:, 0]:
        axes.set_ylabel("relative error of the feature")
    for axes in grid.ravel()[len(scene_classes) :]:
        axes.set_visible(False)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def _draw_scene_class(axes: Axes, scene_class: str, rows: Table, sources: list[str]) -> None:
    """Draw a class of scenes: a line for each source, the defaults and the total."""
    for index, source in enumerate(sources):
        own = rows.where(source=source)
        time = own.numbers("ratio")
        error = own.numbers("error")
        order = np.argsort(time, kind="stable")
        shown = error[order] > SMALLEST_ERROR
        axes.plot(time[order][shown], error[order][shown], label=source, **line_style(index))
    default = rows.where(is_default=True)
    is_total = np.array([source == ALL_SOURCES for source in default.column("source")])
    error = default.numbers("error")
    drawn = ~is_total & (error > SMALLEST_ERROR)
    axes.plot(np.ones(drawn.sum()), error[drawn], label="default", **DEFAULT_STYLE)
    axes.plot(np.ones(is_total.sum()), error[is_total], label="together", **TOTAL_STYLE)
    axes.set(xscale="log", yscale="log")
    axes.set_title(scene_class, fontsize=9)
    plain_ticks(axes.xaxis, (0.5, 1, 2, 4))
    power_ticks(axes.yaxis)
