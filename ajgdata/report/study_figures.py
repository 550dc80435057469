"""Figures of the studies, by study and table. A table without one is shown as it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator
from numpy.typing import NDArray

from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.illustrations import Illustration
from ajgdata.report.wording import Caption, value
from ajgdata.studies.table import Table

Draw = Callable[[Table], Figure]
GRIDS_MM = (0.5, 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10)
MARKERS = "osD^vP*"


def look(index: int) -> dict[str, Any]:
    """Colour and marker of the `index`-th of several lines; they repeat late, and apart."""
    return {
        "color": COLOURS[index % len(COLOURS)],
        "marker": MARKERS[index // len(COLOURS) % len(MARKERS)],
        "ms": 4.5,
        "lw": 1.2,
    }


def parted(table: Table, key: str) -> dict[str, list[dict[str, Any]]]:
    """Rows by the value of one column, in order of first appearance."""
    parts: dict[str, list[dict[str, Any]]] = {}
    for row in table.rows:
        parts.setdefault(str(row[key]), []).append(row)
    return parts


def numbers(table: Table, key: str) -> NDArray[np.floating]:
    """A column as numbers; gaps are NaN."""
    return np.array([np.nan if v is None else float(v) for v in table.column(key)])


def plain_ticks(axis: Axis, at: Sequence[float] = ()) -> None:
    """Numbers instead of powers at the ticks of a logarithmic axis, and only at `at` if given."""
    if at:
        low, high = axis.get_view_interval()
        axis.set_ticks([tick for tick in at if low <= tick <= high])
        axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda given, _: value(float(given))))
    axis.set_minor_formatter(NullFormatter())


@styled
def convergence_figure(table: Table) -> Figure:
    """Relative error of each refined case against the grid spacing, with slopes 1 and 2."""
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
    for order in (1, 2):
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


#: Caption and drawing by (study, table).
FIGURES: dict[tuple[str, str], tuple[Caption, Draw]] = {
    ("verification", "convergence"): (
        Caption(
            "Relative error of each case that is refined, against the spacing of its grid. "
            "Dotted: what schemes of order 1 and 2 would do.",
            "Relative error against grid spacing, both logarithmic, one line a case.",
        ),
        convergence_figure,
    ),
    ("stability", "stability"): (
        Caption(
            "Energy at the end of each run over that after its strike: dots in float64, rings in "
            "float32. Dashed: what a cavity without losses keeps. A case that blew up would lie "
            "above it.",
            "Energy left at the end of each marched case, logarithmic, by group: none above one.",
        ),
        stability_figure,
    ),
}


def study_figures(name: str, tables: Sequence[Table]) -> Mapping[str, Mapping[str, Illustration]]:
    """What to draw for each table of the study `name`; nothing is drawn yet."""
    found: dict[str, dict[str, Illustration]] = {}
    for table in tables:
        if (name, table.name) in FIGURES and table.rows:
            caption, draw = FIGURES[name, table.name]
            found[table.name] = {table.name: Illustration(caption, partial(draw, table))}
    return found
