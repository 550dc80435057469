"""Figures of the study of error against run time."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ajgdata.report.canvas import GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.plots import MARKERS, look, parted, plain_ticks
from ajgdata.types.table import Table

#: The default scheme shall be at least this right, in at most this share of the plain one's time.
TARGET_ERROR, TARGET_RATIO = 0.10, 0.25
RATIOS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)
ERRORS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1)


@styled
def pareto_figure(table: Table) -> Figure:
    """Error of the feature against run time, one line a scheme and object; grids are named."""
    objects = parted(table, "object")
    title = "Error of the feature against run time"
    figure = new_figure((WIDTH_IN, 4.8), title, "numbers: grid spacing in mm", ["simulated"])
    axes = figure.subplots()
    for row, (scheme, cases) in enumerate(parted(table, "scheme").items()):
        for column, name in enumerate(objects):
            some = [case for case in cases if case["object"] == name and case["error"] > 0]
            points = np.reshape([(case["ratio"], case["error"]) for case in some], (-1, 2))
            shown = {**look(row), "marker": MARKERS[column % len(MARKERS)]}
            axes.plot(*points.T, label=f"{scheme}, {name}", **shown)
            near: dict[str, Any] = {"textcoords": "offset points", "fontsize": 7}
            for point, case in zip(points if column == 0 else (), some, strict=False):
                label = f"{case['dx_mm']:g}"
                axes.annotate(label, point, (4, 4), color=shown["color"], **near)
    axes.axhline(TARGET_ERROR, color=GREY, lw=1.1, ls=(0, (5, 3)))
    axes.axvline(TARGET_RATIO, color=GREY, lw=1.1, ls=(0, (5, 3)))
    axes.set(xscale="log", yscale="log", ylabel="relative L2 error")
    axes.set(xlabel="run time over that of the plain kernel at 2.5 mm")
    for axis, ticks in ((axes.xaxis, RATIOS), (axes.yaxis, ERRORS)):
        plain_ticks(axis, ticks)
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


@styled
def bands_figure(table: Table) -> Figure:
    """Level error by band against the grid spacing, one panel a band, one line a scheme."""
    bands = [column for column in table.columns if column.key.startswith("db_")]
    name, rows = next(iter(parted(table, "object").items()))
    figure = new_figure((WIDTH_IN, 3.0), f"Level error by band, {name}", "", ["simulated"])
    panels = figure.subplots(1, len(bands), sharey=True, squeeze=False)[0]
    for axes, band in zip(panels, bands, strict=True):
        for index, scheme in enumerate(parted(table, "scheme")):
            points = sorted((r["dx_mm"], r[band.key]) for r in rows if r["scheme"] == scheme)
            axes.plot(*np.reshape(points, (-1, 2)).T, label=scheme, **look(index))
        axes.set(yscale="log", title=band.title.removeprefix("Level, "), xlabel="grid (mm)")
        plain_ticks(axes.yaxis)
    panels[0].set_ylabel("dB rms")
    panels[-1].legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure
