"""Pages of the simulation studies and ablations: their tables, and figures of two studies."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ajgdata.gripper.scene import Numerics
from ajgdata.paths import Paths
from ajgdata.report.format import Score, number, words
from ajgdata.report.marks import MarkName, Picture, Point, illustration
from ajgdata.report.navigation import LEADS, Group
from ajgdata.report.render import Picture as Drawn
from ajgdata.report.render import render
from ajgdata.report.report_data import Illustration
from ajgdata.report.stability_figure import stability_figure
from ajgdata.report.study_tables import holds, numeric, passed, shown_tables
from ajgdata.types.table import Table


def render_study(
    name: str,
    provenance: Mapping[str, Any],
    tables: Sequence[Table],
    figures: Mapping[str, Drawn],
    nav: Sequence[Group] = (),
    project: Paths | None = None,
) -> str:
    """Return the page as HTML text; `figures` are those of tables, by their names."""
    return render(
        "study.html.j2",
        figures,
        project=project,
        title=LEADS[name].title,
        lead=LEADS[name].text,
        provenance=provenance,
        tables=tables,
        numeric=numeric,
        passed=passed,
        holds=holds,
        shown_tables=shown_tables(name, tables),
        nav=nav,
        here=f"{name}.html",
    )


def conclusions(study: str, tables: Sequence[Table]) -> str:
    """Return how many checks of a study passed, and the titles of its figures, as sentences."""
    texts = [f"{figure.title}." for figure in figures_of(study, tables)]
    texts += [omitted(table) for table in tables if table.name == "omissions" and table.rows]
    return " ".join(filter(None, [*map(passed, tables), *texts]))


def omitted(table: Table) -> str:
    """Return how many parts of the studied scenes are omitted, and the largest change by that."""
    rows = table.where(kept=False)
    text = f"the simulation omits {len(rows.rows)} of {len(table.rows)} tested parts of scenes"
    if not rows.rows:
        return f"{text}."
    change, tolerance = (number(float(rows.numbers(k).max()), 2) for k in ("measured", "tolerance"))
    return f"{text}; largest relative change of a response {change} (tolerance {tolerance})."


# Figures


def figures_of(study: str, tables: Sequence[Table]) -> Iterator[Illustration]:
    """Yield the figure of a study that has one, named like its table; nothing is drawn yet."""
    if study == "stability":
        figure_of_stability = stability_figure(tables)
        if figure_of_stability is not None:
            yield figure_of_stability
    name, figure = FIGURES.get(study, ("", convergence))
    for table in tables:
        if table.name == name and table.rows:
            yield figure(table)


def _illustration(
    table: Table, mark: MarkName, title: str, about: str, points: list[Point],
    axis: str, text: str, place: tuple[str, str],
) -> Illustration:  # fmt: skip
    """Return a figure of simulated results with a logarithmic axis; values of 0 are left out."""
    shown = tuple(point for point in points if point.score.mean > 0)
    picture = Picture(title, about, ("simulated",), shown, (axis, ""), place, log=True)
    return illustration(table.name, mark, picture, text)


def _points(table: Table, key: str, series: str, x: str) -> list[Point]:
    """Return a point per row with a finite value in the column `key`."""
    return [
        Point("", words(str(row[series])), float(row[x] or 0), Score(float(number_), math.nan))
        for row, number_ in zip(table.rows, table.numbers(key), strict=True)
        if math.isfinite(number_)
    ]


def convergence(table: Table) -> Illustration:
    """Return the relative error of each refined case against the grid spacing, and the orders at
    which refinement brings the known answers nearer."""
    orders = []
    cases = table.split_by("case").values()
    for rows in cases:
        grid, error = rows.numbers("dx_mm"), rows.numbers("error")
        fine, coarse = int(np.argmin(grid)), int(np.argmax(grid))
        if grid[fine] < grid[coarse] and error[fine] > 0 and error[coarse] > 0:
            orders.append(np.log(error[coarse] / error[fine]) / np.log(grid[coarse] / grid[fine]))
    nearer = [order for order in orders if order > 0]
    title = f"Refinement brings {len(nearer)} of {len(orders)} known answers nearer"
    if nearer:
        title += f", at orders from {number(min(nearer), 2)} to {number(max(nearer), 2)}"
    return _illustration(
        table, "lines", title, f"{len(cases)} known answers",
        _points(table, "error", "case", "dx_mm"), "relative error",
        "Relative error of each case that is refined, against the spacing of its grid.",
        ("grid spacing", "mm"),
    )  # fmt: skip


def accuracy(table: Table) -> Illustration:
    """Return the error of the feature against run time: a series per object."""
    default = table.where(dx_mm=Numerics().dx_mm)
    title = "A finer grid has a smaller error and takes longer"
    if default.rows:
        error, time_s = (number(float(default.numbers(k).mean()), 2) for k in ("error", "time_s"))
        title = f"Default grid of {Numerics().dx_mm:g} mm: relative error of the feature {error}"
        title += f", run time {time_s} s"
    return _illustration(
        table, "scatter", title, "error against the finest grid; each point is a grid spacing",
        _points(table, "error", "object", "ratio"), "relative L2 error of the feature",
        "Error of the feature against the finest grid, and its cost. "
        "Times belong to the machine that made this page, their ratios less so.",
        ("run time over that of the default grid", ""),
    )  # fmt: skip


#: Table and figure of each study.
FIGURES: dict[str, tuple[str, Callable[[Table], Illustration]]] = {
    "verification": ("convergence", convergence),
    "accuracy": ("accuracy", accuracy),
}
