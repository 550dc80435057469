"""Figures of the studies, by study and table. A table without one is shown as it is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from ajgdata.report.ablation_figures import grippers_figure, levels_figure, scatter_figure
from ajgdata.report.accuracy_figures import bands_figure, pareto_figure
from ajgdata.report.blocks import Illustration
from ajgdata.report.canvas import GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.format import Caption
from ajgdata.report.plots import GRIDS_MM, look, numbers, parted, plain_ticks
from ajgdata.types.table import Table

Draw = Callable[[Table], Figure]


@styled
def convergence_figure(table: Table) -> Figure:
    """Relative error of each refined case against the grid spacing, with slopes 1, 2 and 4."""
    cases = parted(table, "case")
    figure = new_figure(
        (WIDTH_IN, 4.4), "Error against grid spacing", f"{len(cases)} known answers", ["simulated"]
    )
    axes = figure.subplots()
    for index, (case, rows) in enumerate(cases.items()):
        points = sorted((float(row["dx_mm"]), float(row["error"])) for row in rows)
        axes.plot(*zip(*points, strict=True), label=case.replace("_", " "), **look(index))
    grids = numbers(table, "dx_mm")
    spacing, top = np.array([grids.min(), grids.max()]), numbers(table, "error").max()
    for order in (1, 2, 4):
        line = 1.3 * top * (spacing / spacing[1]) ** order
        axes.plot(spacing, line, color=GREY, lw=0.9, ls=":")
        axes.text(spacing[0], line[0], f"order {order} ", color=GREY, fontsize=8, ha="right")
    axes.set(xscale="log", yscale="log", xlabel="grid spacing (mm)", ylabel="relative error")
    axes.set_xlim(spacing[0] / 1.25, spacing[1] * 1.08)
    plain_ticks(axes.xaxis, GRIDS_MM)
    plain_ticks(axes.yaxis)
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


@styled
def stability_figure(table: Table) -> Figure:
    """Energy at the end over that after the strike, of each case that was marched."""
    groups = {
        group: [row for row in rows if row["growth"] is not None]
        for group, rows in parted(table, "group").items()
    }
    marched = {group: rows for group, rows in groups.items() if rows}
    count = sum(map(len, marched.values()))
    figure = new_figure(
        (WIDTH_IN, 4.2), "Energy left at the end", f"{count} cases marched", ["simulated"]
    )
    axes = figure.subplots()
    begun = 0
    for index, (group, rows) in enumerate(marched.items()):
        place = np.arange(begun, begun + len(rows))
        shown = {**look(index), "ls": "none"}
        axes.plot(place, [row["growth"] for row in rows], label=group, **shown)
        axes.plot(
            place,
            [row["growth_single"] for row in rows],
            mfc="none",
            **{**shown, "ms": 8, "mew": 0.8},
        )
        begun += len(rows) + 1
    axes.axhline(1, color=GREY, lw=1.1, ls=(0, (5, 3)))
    axes.set(yscale="log", ylabel="energy, last over first", xticks=[], xlabel="cases, by group")
    plain_ticks(axes.yaxis)
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


@styled
def omissions_figure(table: Table) -> Figure:
    """What leaving each part out does, against what was expected; hollow where it is left out."""
    guessed = {
        part: [row for row in rows if row["estimate"] is not None]
        for part, rows in parted(table, "part").items()
    }
    title = "Change of the feature by leaving a part out"
    subtitle = f"{len(parted(table, 'scene'))} scenes"
    figure = new_figure((WIDTH_IN, 4.6), title, subtitle, ["simulated"])
    axes = figure.subplots()
    tolerance = float(numbers(table, "tolerance")[0])
    least = tolerance / 1e3
    for index, (part, rows) in enumerate((p, rows) for p, rows in guessed.items() if rows):
        for kept in (True, False):
            points = [
                (max(row["estimate"], least), max(row["measured"], least))
                for row in rows
                if row["kept"] is kept
            ]
            shown = {**look(index), "ls": "none", "ms": 6, "label": part if kept else None}
            fill = shown["color"] if kept else "none"
            axes.plot(*np.reshape(points, (-1, 2)).T, mfc=fill, clip_on=False, **shown)
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


@styled
def distances_figure(table: Table) -> Figure:
    """Distance of each material from steel as effects are added, beside the scatter of grasps."""
    shapes = parted(table, "shape")
    fixed = {"shape", "step", "scatter"}
    keys = [column.key for column in table.columns]
    materials = [key for key in keys if key not in fixed and not key.endswith("_low")]
    steps = list(dict.fromkeys(str(step) for step in table.column("step")))
    height = 1.4 + 0.28 * len(steps)
    title = "Distance of the feature from that of steel"
    figure = new_figure((WIDTH_IN, height * len(shapes)), title, "", ["simulated"])
    panels = figure.subplots(len(shapes), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (shape, rows) in zip(panels, shapes.items(), strict=True):
        place = [steps.index(str(row["step"])) for row in rows]
        for index, material in enumerate(materials):
            shown = {**look(index), "ls": "none", "label": material}
            axes.plot([row[material] for row in rows], place, **shown)
        scatter = [(row["scatter"], at) for row, at in zip(rows, place, strict=True)]
        far = [one for one in scatter if one[0] is not None]
        axes.plot(*np.reshape(far, (-1, 2)).T, "|", color=GREY, ms=14, mew=2, label="another grasp")
        axes.set(xscale="log", title=shape, ylim=(len(steps) - 0.5, -0.5))
        axes.set_yticks(range(len(steps)), steps)
    plain_ticks(panels[-1].xaxis)
    panels[-1].set_xlabel("relative L2 distance")
    panels[0].legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


#: Caption and drawing by study, table and name of the figure.
FIGURES: dict[tuple[str, str, str], tuple[Caption, Draw]] = {
    ("accuracy", "accuracy", "pareto"): (
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
    ("accuracy", "accuracy", "bands"): (
        Caption(
            "How far the level in each band lies from that of the finest grid, in dB (rms), "
            "against the spacing of the grid.",
            "Level error against grid spacing, one panel a band, one line a scheme.",
        ),
        bands_figure,
    ),
    ("verification", "convergence", "convergence"): (
        Caption(
            "Relative error of each case that is refined, against the spacing of its grid. "
            "Dotted: what schemes of order 1, 2 and 4 would do.",
            "Relative error against grid spacing, both logarithmic, one line a case.",
        ),
        convergence_figure,
    ),
    ("stability", "stability", "energies"): (
        Caption(
            "Energy at the end of each run over that after its strike: dots in float64, rings in "
            "float32. Dashed: what a cavity without losses keeps. A case that blew up would lie "
            "above it.",
            "Energy left at the end of each marched case, logarithmic, by group.",
        ),
        stability_figure,
    ),
    ("omissions", "omissions", "expected"): (
        Caption(
            "Each part of each scene: what leaving it out was expected to change, and what it does "
            "change. Filled: solved. Hollow: left out. Dashed: the tolerance; a hollow marker "
            "above it is an error of the plan. Changes too small to be drawn lie on the edge.",
            "Measured against expected change of the feature by leaving parts out, logarithmic.",
        ),
        omissions_figure,
    ),
    ("ablations", "mirror_grippers", "misfit"): (
        Caption(
            "Left: error of the bar's direction against how far each gripper is from being its own"
            " mirror image. Right: how well the part of the angle is read that the mirror keeps,"
            " and the one that it flips; 0: no better than the mean.",
            "Error of the direction, and R² of its two parts, against the misfit of the mirror"
            " plane.",
        ),
        grippers_figure,
    ),
    ("ablations", "materials_scatter", "share"): (
        Caption(
            "As less of the scatter of grasps is left. Left: distance of two grasps of one material"
            " (filled) and of the materials' means (hollow). Right: accuracy.",
            "Distances within and between materials, and accuracy, against the share of scatter.",
        ),
        scatter_figure,
    ),
    ("ablations", "noise_levels", "levels"): (
        Caption(
            "Error of the edge length against the level of noise outside, by what a model was"
            " trained on.",
            "Error against noise level, logarithmic, one line a model and training set.",
        ),
        levels_figure,
    ),
    ("materials", "material_distances", "distances"): (
        Caption(
            "How far the feature of each material lies from that of steel, same shape and same "
            "grasp, as effects are added from top to bottom. Grey bars: how far another grasp of "
            "the steel object lies; materials to the left of it cannot be told by this distance.",
            "Distances between materials by simulated effect, one panel a shape, logarithmic.",
        ),
        distances_figure,
    ),
}


def study_figures(name: str, tables: Sequence[Table]) -> dict[str, list[Illustration]]:
    """Return the figures of each table of the study `name`, by table; nothing is drawn yet."""
    found: dict[str, list[Illustration]] = {}
    filled = {table.name: table for table in tables if table.rows}
    for (study, part, figure), (caption, draw) in FIGURES.items():
        if study == name and part in filled:
            drawing = Illustration(figure, caption, partial(draw, filled[part]))
            found.setdefault(part, []).append(drawing)
    return found
