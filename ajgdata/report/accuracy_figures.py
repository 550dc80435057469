"""Figures of the study of accuracy: error against run time, and by band."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.gripper.scene import Numerics
from ajgdata.report.blocks import TableFigure
from ajgdata.report.canvas import (
    GREY,
    MARKERS,
    WIDTH_IN,
    line_style,
    model_line,
    new_figure,
    plain_ticks,
)
from ajgdata.report.format import Caption, number
from ajgdata.report.labels import LABEL_PT, REFERENCES, label_end, label_point, wrapped
from ajgdata.types.table import Table

#: The default scheme shall be at least this right, in at most this share of the plain one's time.
TARGET_ERROR, TARGET_RATIO = 0.10, 0.25
RATIOS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)
ERRORS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1)


def _default(table: Table) -> Table:
    """Return the rows of what scenes are solved with unless they say otherwise."""
    return table.where(scheme=Numerics().scheme, dx_mm=Numerics().dx_mm)


def pareto_finding(table: Table) -> str:
    """Return what the default errs and costs, on average over objects."""
    default = _default(table)
    if not default.rows:
        return "A finer grid errs less and takes longer"
    error, ratio = (float(default.numbers(key).mean()) for key in ("error", "ratio"))
    return (
        f"The default, {Numerics().scheme} at {Numerics().dx_mm:g} mm, errs by {number(error, 2)} "
        f"in {number(ratio, 2)} of the plain kernel's time"
    )


def pareto_figure(table: Table) -> Figure:
    """Return error of the feature against run time, one line a scheme and object; grids named."""
    figure = new_figure(
        (WIDTH_IN, 4.6),
        pareto_finding(table),
        "relative L2 error of the feature against the finest grid; numbers: grid spacing in mm",
        ["simulated"],
    )
    axes = figure.subplots()
    for row, (scheme, cases) in enumerate(table.parted("scheme").items()):
        for column, (name, some) in enumerate(cases.parted("object").items()):
            points = np.column_stack([some.numbers(key) for key in ("ratio", "error", "dx_mm")])
            points = points[points[:, 1] > 0]
            style = {**line_style(row), "marker": MARKERS[column % len(MARKERS)]}
            axes.plot(*points[:, :2].T, label=f"{scheme}, {name}", **style)
            if not len(points):
                continue
            last = points[np.argmax(points[:, 0])]
            label_end(axes, last[0], last[1], f"{scheme}, {name}", str(style["color"]))
            for x, y, spacing in points if column == 0 else ():
                label_point(axes, x, y, f"{spacing:g}", str(style["color"]))
    for line, at in ((axes.axhline, TARGET_ERROR), (axes.axvline, TARGET_RATIO)):
        line(at, **REFERENCES["ideal"])
    axes.annotate("target", (TARGET_RATIO, 0), (-3, 3), ha="right", fontsize=LABEL_PT, color=GREY,
                  xycoords=("data", "axes fraction"), textcoords="offset points")  # fmt: skip
    axes.set(xscale="log", yscale="log", ylabel="relative L2 error")
    axes.set(xlabel="run time over that of the plain kernel at 2.5 mm")
    for axis, ticks in ((axes.xaxis, RATIOS), (axes.yaxis, ERRORS)):
        plain_ticks(axis, ticks)
    return figure


def pareto_caption(table: Table) -> Caption:
    """Return the caption of `pareto_figure`."""
    return Caption(
        "Error of the feature against the finest grid, and what it costs, for each object. "
        "Dashed: an error of 0.10, and a quarter of the plain kernel's time at 2.5 mm; to the "
        "lower left of both is where the default shall be. Times belong to the machine that "
        "made this page, their ratios less so.",
        f"{pareto_finding(table)}. Error of the feature against run time, both logarithmic, one "
        "line a scheme and object.",
    )


def bands_finding(table: Table) -> str:
    """Return the level error of the default, or of the first row, in lowest and highest band."""
    bands = [column for column in table.columns if column.key.startswith("db_")]
    name, cases = next(iter(table.parted("object").items()))
    row = (_default(cases).rows or cases.rows)[0]
    told = [
        f"{number(float(row[band.key] or 0), 2)} dB at {band.title.removeprefix('Level, ')}"
        for band in dict.fromkeys((bands[0], bands[-1]))
    ]
    return (
        f"Levels of a {name} at {row['dx_mm']:g} mm ({row['scheme']}) are off by {', '.join(told)}"
    )


def bands_figure(table: Table) -> Figure:
    """Return level error by band against the grid spacing, a panel a band, a line a scheme."""
    bands = [column for column in table.columns if column.key.startswith("db_")]
    _, cases = next(iter(table.parted("object").items()))
    about = "level against the finest grid, dB rms, by band and grid spacing"
    figure = new_figure((WIDTH_IN, 3.0), bands_finding(table), about, ["simulated"])
    panels = figure.subplots(1, len(bands), sharey=True, squeeze=False)[0]
    for axes, band in zip(panels, bands, strict=True):
        for index, scheme in enumerate(table.parted("scheme")):
            _band_line(axes, cases.where(scheme=scheme), band.key, index, axes is panels[-1])
        title = "\n".join(wrapped(band.title.removeprefix("Level, "), 1.3, LABEL_PT + 1))
        axes.set(yscale="log", title=title, xlabel="grid (mm)")
        plain_ticks(axes.yaxis)
    panels[0].set_ylabel("dB rms")
    return figure


def _band_line(axes: Axes, some: Table, key: str, index: int, named: bool) -> None:
    grid, level = some.numbers("dx_mm"), some.numbers(key)
    order = np.argsort(grid)
    style = {**model_line(index), "ms": 4.5, "lw": 1.2}
    scheme = str(some.column("scheme")[0]) if some.rows else ""
    axes.plot(grid[order], level[order], label=scheme, **style)
    if named and some.rows:
        label_end(axes, grid[order[-1]], level[order[-1]], scheme, str(style["color"]))


def bands_caption(table: Table) -> Caption:
    """Return the caption of `bands_figure`."""
    return Caption(
        "How far the level in each band lies from that of the finest grid, in dB (rms), "
        "against the spacing of the grid.",
        f"{bands_finding(table)}. Level error against grid spacing, one panel a band, one line a "
        "scheme.",
    )


ACCURACY = (
    TableFigure("accuracy", "pareto", pareto_caption, pareto_figure),
    TableFigure("accuracy", "bands", bands_caption, bands_figure),
)
