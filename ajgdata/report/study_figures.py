"""Figures of the studies, by study and table. A table without one is shown as it is."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ajgdata.report.blocks import TableFigure
from ajgdata.report.canvas import GREY, MARKERS, WIDTH_IN, line_style, new_figure, plain_ticks
from ajgdata.report.format import Caption
from ajgdata.types.table import Table

#: Grid spacings (mm) that are ticks.
GRIDS_MM = (0.5, 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10)
#: The default scheme shall be at least this right, in at most this share of the plain one's time.
TARGET_ERROR, TARGET_RATIO = 0.10, 0.25
RATIOS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)
ERRORS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1)


def pareto_figure(table: Table) -> Figure:
    """Return error of the feature against run time, one line a scheme and object; grids named."""
    objects = table.parted("object")
    title = "Error of the feature against run time"
    figure = new_figure((WIDTH_IN, 4.8), title, "numbers: grid spacing in mm", ["simulated"])
    axes = figure.subplots()
    for row, (scheme, cases) in enumerate(table.parted("scheme").items()):
        for column, name in enumerate(objects):
            some = cases.where(object=name)
            ratio, error, grid = (some.numbers(key) for key in ("ratio", "error", "dx_mm"))
            shown = error > 0
            style = {**line_style(row), "marker": MARKERS[column % len(MARKERS)]}
            axes.plot(ratio[shown], error[shown], label=f"{scheme}, {name}", **style)
            near: dict[str, Any] = {"textcoords": "offset points", "fontsize": 7}
            for x, y, h in np.column_stack([ratio, error, grid])[shown] if column == 0 else ():
                axes.annotate(f"{h:g}", (x, y), (4, 4), color=style["color"], **near)
    axes.axhline(TARGET_ERROR, color=GREY, lw=1.1, ls=(0, (5, 3)))
    axes.axvline(TARGET_RATIO, color=GREY, lw=1.1, ls=(0, (5, 3)))
    axes.set(xscale="log", yscale="log", ylabel="relative L2 error")
    axes.set(xlabel="run time over that of the plain kernel at 2.5 mm")
    for axis, ticks in ((axes.xaxis, RATIOS), (axes.yaxis, ERRORS)):
        plain_ticks(axis, ticks)
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


def bands_figure(table: Table) -> Figure:
    """Return level error by band against the grid spacing, a panel a band, a line a scheme."""
    bands = [column for column in table.columns if column.key.startswith("db_")]
    name, cases = next(iter(table.parted("object").items()))
    figure = new_figure((WIDTH_IN, 3.0), f"Level error by band, {name}", "", ["simulated"])
    panels = figure.subplots(1, len(bands), sharey=True, squeeze=False)[0]
    for axes, band in zip(panels, bands, strict=True):
        for index, scheme in enumerate(table.parted("scheme")):
            some = cases.where(scheme=scheme)
            grid = some.numbers("dx_mm")
            order = np.argsort(grid)
            axes.plot(grid[order], some.numbers(band.key)[order], label=scheme, **line_style(index))
        axes.set(yscale="log", title=band.title.removeprefix("Level, "), xlabel="grid (mm)")
        plain_ticks(axes.yaxis)
    panels[0].set_ylabel("dB rms")
    panels[-1].legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


def convergence_figure(table: Table) -> Figure:
    """Return relative error of each refined case against the grid, with slopes 1, 2 and 4."""
    cases = table.parted("case")
    figure = new_figure(
        (WIDTH_IN, 4.4), "Error against grid spacing", f"{len(cases)} known answers", ["simulated"]
    )
    axes = figure.subplots()
    for index, (case, rows) in enumerate(cases.items()):
        grid, error = rows.numbers("dx_mm"), rows.numbers("error")
        order = np.lexsort((error, grid))
        label = str(case).replace("_", " ")
        axes.plot(grid[order], error[order], label=label, **line_style(index))
    grids = table.numbers("dx_mm")
    spacing, top = np.array([grids.min(), grids.max()]), table.numbers("error").max()
    for slope in (1, 2, 4):
        line = 1.3 * top * (spacing / spacing[1]) ** slope
        axes.plot(spacing, line, color=GREY, lw=0.9, ls=":")
        axes.text(spacing[0], line[0], f"order {slope} ", color=GREY, fontsize=8, ha="right")
    axes.set(xscale="log", yscale="log", xlabel="grid spacing (mm)", ylabel="relative error")
    axes.set_xlim(spacing[0] / 1.25, spacing[1] * 1.08)
    plain_ticks(axes.xaxis, GRIDS_MM)
    plain_ticks(axes.yaxis)
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


def stability_figure(table: Table) -> Figure:
    """Return energy at the end over that after the strike, of each case that was marched."""
    marched = [(group, rows.numbers("growth"), rows.numbers("growth_single"))
               for group, rows in table.parted("group").items()]  # fmt: skip
    count = sum(int(np.sum(~np.isnan(growth))) for _, growth, _ in marched)
    figure = new_figure(
        (WIDTH_IN, 4.2), "Energy left at the end", f"{count} cases marched", ["simulated"]
    )
    axes = figure.subplots()
    begun = 0
    for group, growth, single in marched:
        kept = ~np.isnan(growth)
        if not kept.any():
            continue
        place = np.arange(begun, begun + kept.sum())
        style = {**line_style(len(axes.lines) // 2), "ls": "none"}
        axes.plot(place, growth[kept], label=group, **style)
        axes.plot(place, single[kept], mfc="none", **{**style, "ms": 8, "mew": 0.8})
        begun += len(place) + 1
    axes.axhline(1, color=GREY, lw=1.1, ls=(0, (5, 3)))
    axes.set(yscale="log", ylabel="energy, last over first", xticks=[], xlabel="cases, by group")
    plain_ticks(axes.yaxis)
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


def omissions_figure(table: Table) -> Figure:
    """Return what leaving each part out does against what was expected; hollow: it is left out."""
    title = "Change of the feature by leaving a part out"
    subtitle = f"{len(table.parted('scene'))} scenes"
    figure = new_figure((WIDTH_IN, 4.6), title, subtitle, ["simulated"])
    axes = figure.subplots()
    tolerance = float(table.numbers("tolerance")[0])
    least = tolerance / 1e3
    for part, rows in table.parted("part").items():
        if np.isnan(rows.numbers("estimate")).all():
            continue
        style = {**line_style(len(axes.lines) // 2), "ls": "none", "ms": 6}
        for kept, fill, label in ((True, style["color"], part), (False, "none", None)):
            some = rows.where(kept=kept)
            points = np.column_stack([some.numbers("estimate"), some.numbers("measured")])
            points = np.maximum(points[~np.isnan(points[:, 0])], least)
            axes.plot(*points.T, mfc=fill, clip_on=False, label=label, **style)
    ends = [least, 2.0]
    axes.plot(ends, ends, color=GREY, lw=1, ls=":", label="as expected")
    for line in (axes.axvline, axes.axhline):
        line(tolerance, color=GREY, lw=1.1, ls=(0, (5, 3)))
    axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends)
    axes.set(xlabel="expected change (relative L2)", ylabel="measured change")
    for axis in (axes.xaxis, axes.yaxis):
        plain_ticks(axis)
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


def distances_figure(table: Table) -> Figure:
    """Return the distance of each material from steel as effects are added, and of grasps."""
    shapes = table.parted("shape")
    fixed = {"shape", "step", "scatter"}
    keys = [column.key for column in table.columns]
    materials = [key for key in keys if key not in fixed and not key.endswith("_low")]
    steps = list(dict.fromkeys(str(step) for step in table.column("step")))
    height = 1.4 + 0.28 * len(steps)
    title = "Distance of the feature from that of steel"
    figure = new_figure((WIDTH_IN, height * len(shapes)), title, "", ["simulated"])
    panels = figure.subplots(len(shapes), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (shape, rows) in zip(panels, shapes.items(), strict=True):
        place = np.array([steps.index(str(step)) for step in rows.column("step")])
        for index, material in enumerate(materials):
            style = {**line_style(index), "ls": "none", "label": material}
            axes.plot(rows.numbers(material), place, **style)
        scatter = rows.numbers("scatter")
        far = ~np.isnan(scatter)
        axes.plot(scatter[far], place[far], "|", color=GREY, ms=14, mew=2, label="another grasp")
        axes.set(xscale="log", title=shape, ylim=(len(steps) - 0.5, -0.5))
        axes.set_yticks(range(len(steps)), steps)
    plain_ticks(panels[-1].xaxis)
    panels[-1].set_xlabel("relative L2 distance")
    panels[0].legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


VERIFICATION = (
    TableFigure(
        "convergence",
        "convergence",
        Caption(
            "Relative error of each case that is refined, against the spacing of its grid. "
            "Dotted: what schemes of order 1, 2 and 4 would do.",
            "Relative error against grid spacing, both logarithmic, one line a case.",
        ),
        convergence_figure,
    ),
)
STABILITY = (
    TableFigure(
        "stability",
        "energies",
        Caption(
            "Energy at the end of each run over that after its strike: dots in float64, rings in "
            "float32. Dashed: what a cavity without losses keeps. A case that blew up would lie "
            "above it.",
            "Energy left at the end of each marched case, logarithmic, by group.",
        ),
        stability_figure,
    ),
)
ACCURACY = (
    TableFigure(
        "accuracy",
        "pareto",
        Caption(
            "Error of the feature against the finest grid, and what it costs, for each object. "
            "Dashed: an error of 0.10, and a quarter of the plain kernel's time at 2.5 mm; to the "
            "lower left of both is where the default shall be. Times belong to the machine that "
            "made this page, their ratios less so.",
            "Error of the feature against run time, both logarithmic, one line a scheme and "
            "object.",
        ),
        pareto_figure,
    ),
    TableFigure(
        "accuracy",
        "bands",
        Caption(
            "How far the level in each band lies from that of the finest grid, in dB (rms), "
            "against the spacing of the grid.",
            "Level error against grid spacing, one panel a band, one line a scheme.",
        ),
        bands_figure,
    ),
)
OMISSIONS = (
    TableFigure(
        "omissions",
        "expected",
        Caption(
            "Each part of each scene: what leaving it out was expected to change, and what it does "
            "change. Filled: solved. Hollow: left out. Dashed: the tolerance; a hollow marker "
            "above it is an error of the plan. Changes too small to be drawn lie on the edge.",
            "Measured against expected change of the feature by leaving parts out, logarithmic.",
        ),
        omissions_figure,
    ),
)
MATERIALS = (
    TableFigure(
        "material_distances",
        "distances",
        Caption(
            "How far the feature of each material lies from that of steel, same shape and same "
            "grasp, as effects are added from top to bottom. Grey bars: how far another grasp of "
            "the steel object lies; materials to the left of it cannot be told by this distance.",
            "Distances between materials by simulated effect, one panel a shape, logarithmic.",
        ),
        distances_figure,
    ),
)
#: Figures by study.
FIGURES: dict[str, tuple[TableFigure, ...]] = {
    "verification": VERIFICATION,
    "stability": STABILITY,
    "accuracy": ACCURACY,
    "omissions": OMISSIONS,
    "materials": MATERIALS,
}
