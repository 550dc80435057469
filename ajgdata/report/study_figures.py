"""Figures of the studies, by study and table. A table without one is shown as it is."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.report.accuracy_figures import ACCURACY
from ajgdata.report.acoustics_figures import ACOUSTICS
from ajgdata.report.blocks import TableFigure
from ajgdata.report.canvas import GREY, WIDTH_IN, line_style, new_figure, plain_ticks
from ajgdata.report.format import Caption, number, value, words
from ajgdata.report.labels import (
    LABEL_PT,
    ink,
    label_end,
    reference_line,
)
from ajgdata.types.table import Table

#: Changes of the feature by an effect below this (relative L2) are drawn at it.
LEAST_CHANGE = 1e-4
#: Grid spacings (mm) that are ticks.
GRIDS_MM = (0.5, 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10)


def convergence_finding(table: Table) -> str:
    """Return how many known answers refinement brings nearer, and at which orders."""
    orders = []
    for rows in table.parted("case").values():
        grid, error = rows.numbers("dx_mm"), rows.numbers("error")
        fine, coarse = int(np.argmin(grid)), int(np.argmax(grid))
        if grid[fine] < grid[coarse] and error[fine] > 0 and error[coarse] > 0:
            orders.append(np.log(error[coarse] / error[fine]) / np.log(grid[coarse] / grid[fine]))
    nearer = sum(order > 0 for order in orders)
    if not nearer:
        return f"Refinement brings none of {len(orders)} known answers nearer"
    low, high = (number(f(o for o in orders if o > 0), 2) for f in (min, max))
    return (
        f"Refinement brings {nearer} of {len(orders)} known answers nearer, at orders from {low} "
        f"to {high}"
    )


def convergence_figure(table: Table) -> Figure:
    """Return relative error of each refined case against the grid, with slopes 1, 2 and 4."""
    cases = table.parted("case")
    figure = new_figure(
        (WIDTH_IN, max(4.4, 1.4 + 0.17 * len(cases))),
        convergence_finding(table),
        f"{len(cases)} known answers: relative error against the spacing of the grid",
        ["simulated"],
    )
    axes = figure.subplots()
    for index, (case, rows) in enumerate(cases.items()):
        grid, error = rows.numbers("dx_mm"), rows.numbers("error")
        order = np.lexsort((error, grid))
        style = line_style(index)
        axes.plot(grid[order], error[order], label=words(str(case)), **style)
        last = order[-1]
        label_end(axes, grid[last], error[last], words(str(case)), str(style["color"]))
    grids = table.numbers("dx_mm")
    spacing, top = np.array([grids.min(), grids.max()]), table.numbers("error").max()
    for slope in (1, 2, 4):
        line = 1.3 * top * (spacing / spacing[1]) ** slope
        axes.plot(spacing, line, color=GREY, lw=0.9, ls=":")
        axes.text(spacing[0], line[0], f"order {slope} ", color=GREY, fontsize=8, ha="right")
    axes.set(xscale="log", yscale="log", xlabel="grid spacing (mm)", ylabel="relative error")
    axes.set_xlim(spacing[0] / 1.35, spacing[1] * 1.08)
    plain_ticks(axes.xaxis, GRIDS_MM)
    plain_ticks(axes.yaxis)
    return figure


def convergence_caption(table: Table) -> Caption:
    """Return the caption of `convergence_figure`."""
    return Caption(
        "Relative error of each case that is refined, against the spacing of its grid. "
        "Dotted: what schemes of order 1, 2 and 4 would do.",
        f"{convergence_finding(table)}. Relative error against grid spacing, both logarithmic, one "
        "line a case.",
    )


def stability_finding(table: Table) -> str:
    """Return how many of the marched cases can grow, or the most that a step can add to any."""
    marched = [row for row in table.rows if row["outcome"] != "refused"]
    grows = sum(row["outcome"] == "grows" for row in marched)
    if grows:
        return f"{grows} of {len(marched)} marched cases can gain energy"
    gain = value(max(row["gain"] for row in marched))
    return f"None of {len(marched)} marched cases gains energy: at most {gain} per step, any state"


def worst_transient(table: Table) -> str:
    """Return how far the stored energy of any state can grow, and in which case."""
    growth = table.numbers("transient")
    worst = int(np.nanargmax(growth))
    usual = number(float(np.nanmedian(growth)), 2)
    row = table.rows[worst]
    return (
        "The stored energy of some state can rise for a moment, at frequencies near the limit of "
        f"the grid: by a factor of {usual} in half of the cases and of {number(growth[worst], 2)} "
        f"in the worst, {row['name']}"
    )


def stability_figure(table: Table) -> Figure:
    """Return energy at the end over that after the strike, of each case that was marched."""
    count = int(np.sum(~np.isnan(table.numbers("growth"))))
    figure = new_figure(
        (WIDTH_IN, 4.2),
        stability_finding(table),
        f"{count} cases marched: energy at the end over that after the strike; dots float64, rings "
        "float32",
        ["simulated"],
    )
    axes = figure.subplots()
    begun, colour = 0, 0
    for group, rows in table.parted("group").items():
        growth, single = rows.numbers("growth"), rows.numbers("growth_single")
        kept = ~np.isnan(growth)
        if not kept.any():
            continue
        place = np.arange(begun, begun + kept.sum())
        style = {**line_style(colour), "ls": "none"}
        axes.plot(place, growth[kept], label=group, **style)
        axes.plot(place, single[kept], mfc="none", **{**style, "ms": 8, "mew": 0.8})
        _group_name(axes, place, str(group), str(style["color"]), colour)
        begun, colour = begun + len(place) + 1, colour + 1
    reference_line(axes, "ideal", 1, "as much\nas given")
    axes.set(yscale="log", ylabel="energy, last over first", xticks=[])
    plain_ticks(axes.yaxis)
    return figure


def _group_name(axes: Axes, place: np.ndarray, name: str, colour: str, index: int) -> None:
    """Write the name of a group below its cases, of neighbours at different heights."""
    axes.annotate(
        name, (float(place.mean()), 0), (0, -4 - 11 * (index % 2)), ha="center", va="top",
        xycoords=("data", "axes fraction"), textcoords="offset points", fontsize=LABEL_PT,
        color=ink(colour),
    )  # fmt: skip


def stability_caption(table: Table) -> Caption:
    """Return the caption of `stability_figure`."""
    return Caption(
        "Energy at the end of each run over that after its strike: dots in float64, rings in "
        "float32. Dashed: what a cavity without losses keeps. A case that blew up would lie "
        f"above it. {worst_transient(table)}.",
        f"{stability_finding(table)}. Energy left at the end of each marched case, logarithmic, by "
        "group.",
    )


def omissions_finding(table: Table) -> str:
    """Return how many of the parts that are left out change more than is tolerated."""
    absent = table.where(kept=False)
    tolerance = float(table.numbers("tolerance")[0])
    above = int(np.sum(absent.numbers("measured") > tolerance))
    count = f"{above or 'None'} of {len(absent.rows)}"
    verb = "change" if above > 1 else "changes"
    return f"{count} parts left out {verb} any third octave by more than {number(tolerance)}"


def omissions_figure(table: Table) -> Figure:
    """Return what leaving each part out changes, one row per part; hollow: it is left out."""
    about = f"{len(table.parted('scene'))} scenes; filled: solved, hollow: left out"
    figure = new_figure((WIDTH_IN, 3.6), omissions_finding(table), about, ["simulated"])
    axes = figure.subplots()
    tolerance = float(table.numbers("tolerance")[0])
    least, parts = tolerance / 1e3, table.parted("part")
    for place, (name, rows) in enumerate(parts.items()):
        style = {**line_style(place), "ls": "none", "ms": 6}
        for kept, fill in ((True, style["color"]), (False, "none"), (None, "none")):
            measured = np.maximum(rows.where(kept=kept).numbers("measured"), least)
            if len(measured):
                height = np.full(len(measured), float(place))
                axes.plot(measured, height, clip_on=False, label=name, **style | {"mfc": fill})
    reference_line(axes, "ideal", tolerance, "tolerance", axis="x")
    axes.set_yticks(range(len(parts)), list(parts))
    axes.set(xscale="log", xlim=(least, 3.0), ylim=(len(parts) - 0.5, -0.7))
    axes.set_xlabel("measured change (relative L2)")
    plain_ticks(axes.xaxis)
    return figure


def omissions_caption(table: Table) -> Caption:
    """Return the caption of `omissions_figure`."""
    return Caption(
        "What leaving out each part of each scene changes. Filled: the part is solved. Hollow: it "
        "is left out, as is all that the last row sums up. Dashed: the tolerance; a hollow marker "
        "to the right of it is an error of the plan. Smaller changes are drawn at the edge.",
        f"{omissions_finding(table)}. Measured change of the worst third octave, or of the "
        "feature, by leaving parts out, logarithmic, one row per part.",
    )


def _materials(table: Table) -> list[str]:
    fixed = {"shape", "step", "scatter"}
    keys = [column.key for column in table.columns]
    return [key for key in keys if key not in fixed and not key.endswith("_low")]


def distances_finding(table: Table) -> str:
    """Return how many materials of all shapes lie further from steel than another grasp does."""
    told, count = [], 0
    for shape, rows in table.parted("shape").items():
        scatter = rows.numbers("scatter")
        known = scatter[~np.isnan(scatter)]
        for material in _materials(table) if len(known) else ():
            count += 1
            if rows.numbers(material)[-1] > known[-1]:
                told.append(f"{material} ({shape})")
    far = f"{len(told)} of {count}: {', '.join(told)}" if told else f"none of {count}"
    return f"Materials that lie further from steel than another grasp of it: {far}"


def distances_figure(table: Table) -> Figure:
    """Return the distance of each material from steel as effects are added, and of grasps."""
    shapes = table.parted("shape")
    steps = list(dict.fromkeys(str(step) for step in table.column("step")))
    height = 0.5 + 0.2 * len(steps)
    figure = new_figure(
        (WIDTH_IN, 1.1 + height * len(shapes)),
        distances_finding(table),
        "relative L2 distance of the feature, as effects are added from top to bottom",
        ["simulated"],
    )
    panels = figure.subplots(len(shapes), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (shape, rows) in zip(panels, shapes.items(), strict=True):
        _distances_panel(axes, rows, steps, _materials(table))
        axes.set(xscale="log", title=shape, ylim=(len(steps) - 0.5, -1.1))
        axes.set_yticks(range(len(steps)), steps)
    plain_ticks(panels[-1].xaxis)
    panels[-1].set_xlabel("relative L2 distance")
    return figure


def _distances_panel(axes: Axes, rows: Table, steps: list[str], materials: list[str]) -> None:
    """Draw the distances of the materials, and how far another grasp lies."""
    place = np.array([steps.index(str(step)) for step in rows.column("step")])
    for index, material in enumerate(materials):
        style = {**line_style(index), "ls": "none", "label": material}
        distance = rows.numbers(material)
        axes.plot(distance, place, **style)
        label_end(axes, distance[-1], float(place[-1]), material, str(style["color"]))
    scatter = rows.numbers("scatter")
    far = ~np.isnan(scatter)
    axes.plot(scatter[far], place[far], "|", color=GREY, ms=10, mew=2, label="another grasp")
    if far.any():
        label_end(axes, scatter[far][-1], float(place[far][-1]), "another grasp", GREY)


def distances_caption(table: Table) -> Caption:
    """Return the caption of `distances_figure`."""
    return Caption(
        "How far the feature of each material lies from that of steel, same shape and same "
        "grasp, as effects are added from top to bottom. Grey bars: how far another grasp of "
        "the steel object lies; materials to the left of it cannot be told by this distance.",
        f"{distances_finding(table)}. Distances between materials by simulated effect, one panel a "
        "shape, logarithmic.",
    )


def effects_finding(table: Table) -> str:
    """Return how many changes exceed the tolerance, and which is the largest."""
    change, tolerance = table.numbers("change"), float(table.numbers("tolerance")[0])
    above = int(np.sum(change > tolerance))
    largest = table.rows[int(np.argmax(change))]
    return (
        f"{above} of {len(change)} changes of the contact move the feature by more than "
        f"{number(tolerance)}; most: {largest['effect']} ({largest['object']})"
    )


def effects_figure(table: Table) -> Figure:
    """Return the change of the feature by each effect, whole band and low, and two grasps' own."""
    effects = table.parted("effect")
    lines = sum(len(rows.rows) + 1 for rows in effects.values())
    figure = new_figure(
        (WIDTH_IN, 1.2 + 0.2 * lines),
        effects_finding(table),
        "filled: whole band, hollow: below 1.2 kHz, grey bar: two grasps",
        ["simulated"],
    )
    axes = figure.subplots()
    place, names = 0.0, []
    for index, (effect, rows) in enumerate(effects.items()):
        names.append((place, f"{effect}:"))
        places = place + 1 + np.arange(len(rows.rows))
        names += [(at, str(thing)) for at, thing in zip(places, rows.column("object"), strict=True)]
        _effect_marks(axes, rows, places, index)
        place = float(places[-1]) + 1
    tolerance = float(table.numbers("tolerance")[0])
    reference_line(axes, "ideal", tolerance, "tolerance", axis="x")
    axes.set(xscale="log", xlabel="relative L2 change of the feature", ylim=(place, -0.7))
    axes.set_yticks(*zip(*names, strict=True))
    axes.tick_params(axis="y", length=0)
    plain_ticks(axes.xaxis)
    return figure


def _effect_marks(axes: Axes, rows: Table, places: np.ndarray, index: int) -> None:
    style = {**line_style(index), "ls": "none", "clip_on": False}
    axes.plot(np.maximum(rows.numbers("change_low"), LEAST_CHANGE), places, mfc="none", **style)
    axes.plot(np.maximum(rows.numbers("change"), LEAST_CHANGE), places, **style)
    axes.plot(rows.numbers("scatter"), places, "|", color=GREY, ms=8, mew=2)


def effects_caption(table: Table) -> Caption:
    """Return the caption of `effects_figure`."""
    return Caption(
        "What one change of the scene does to the feature, object by object: in the whole band "
        "(filled), below 1.2 kHz (hollow). Grey bars: how far two grasps of the changed scene "
        "lie apart. Dashed: the tolerance below which a plan leaves an effect out.",
        f"{effects_finding(table)}. Change of the feature by effect and object, logarithmic.",
    )


#: Figures by study.
FIGURES: dict[str, tuple[TableFigure, ...]] = {
    "verification": (
        TableFigure("convergence", "convergence", convergence_caption, convergence_figure),
    ),
    "stability": (TableFigure("stability", "energies", stability_caption, stability_figure),),
    "accuracy": ACCURACY,
    "omissions": (TableFigure("omissions", "changes", omissions_caption, omissions_figure),),
    "acoustics": ACOUSTICS,
    "materials": (
        TableFigure("material_distances", "distances", distances_caption, distances_figure),
    ),
    "effects": (TableFigure("effects", "effects", effects_caption, effects_figure),),
}
