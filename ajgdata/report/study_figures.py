"""Figures of the studies, by study and table. A table without one is shown as it is."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ajgdata.gripper.scene import Numerics
from ajgdata.report.blocks import TableFigure
from ajgdata.report.format import Score, number, value, words
from ajgdata.report.marks import Picture, Point
from ajgdata.types.table import Table, Value

CHANGE = ("relative L2 change of the feature", "")
GRID = ("grid spacing", "mm")


def points_of(
    table: Table, value_key: str, series: str, x: str, panel: str = "", least: float = -math.inf
) -> Iterator[Point]:
    """Yield a point per row with a finite value: the columns of value, series, x and panel.

    Values below `least` are drawn at it.
    """
    for row, number_ in zip(table.rows, table.numbers(value_key), strict=True):
        if math.isfinite(number_):
            place = _text(row[x]) if isinstance(row[x], str) else float(row[x] or 0)
            name, where = (_text(row[key]) if key else "" for key in (series, panel))
            yield Point(where, name, place, Score(max(float(number_), least), math.nan))


def _text(cell: Value) -> str:
    return words(str(cell))


def picture_of(
    title: str, subtitle: str, points: Iterator[Point] | list[Point], axis: tuple[str, str],
    place: tuple[str, str] = ("", ""), limit: tuple[str, float] | None = None, log: bool = True,
) -> Picture:  # fmt: skip
    """Return a picture of simulated results with a logarithmic axis."""
    return Picture(
        title, subtitle, ("simulated",), tuple(points), axis, place, limit=limit, log=log
    )


def _tolerance(table: Table) -> tuple[str, float]:
    return "tolerance", float(table.numbers("tolerance")[0])


def convergence_finding(table: Table) -> str:
    """Return how many known answers refinement brings nearer, and at which orders."""
    orders = []
    for rows in table.parted("case").values():
        grid, error = rows.numbers("dx_mm"), rows.numbers("error")
        fine, coarse = int(np.argmin(grid)), int(np.argmax(grid))
        if grid[fine] < grid[coarse] and error[fine] > 0 and error[coarse] > 0:
            orders.append(np.log(error[coarse] / error[fine]) / np.log(grid[coarse] / grid[fine]))
    nearer = [order for order in orders if order > 0]
    if not nearer:
        return f"Refinement brings none of {len(orders)} known answers nearer"
    low, high = (number(f(nearer), 2) for f in (min, max))
    return (
        f"Refinement brings {len(nearer)} of {len(orders)} known answers nearer, at orders from "
        f"{low} to {high}"
    )


def convergence(table: Table) -> Picture:
    """Return relative error of each refined case against the grid spacing."""
    points = [p for p in points_of(table, "error", "case", "dx_mm") if p.score.mean > 0]
    about = f"{len(table.parted('case'))} known answers"
    return picture_of(convergence_finding(table), about, points, ("relative error", ""), GRID)


def stability_finding(table: Table) -> str:
    """Return how many of the marched cases can grow, or the most that a step can add to any."""
    marched = [row for row in table.rows if row["outcome"] != "refused"]
    grows = sum(row["outcome"] == "grows" for row in marched)
    if grows:
        return f"{grows} of {len(marched)} marched cases can gain energy"
    gain = value(max(row["gain"] for row in marched))
    return f"None of {len(marched)} marched cases gains energy: at most {gain} per step, any state"


def stability_text(table: Table) -> str:
    """Return the caption of the energies, with how far the energy of any state can grow."""
    growth = table.numbers("transient")
    worst = int(np.nanargmax(growth))
    usual = number(float(np.nanmedian(growth)), 2)
    return (
        "Energy at the end of each run over that after its strike; a case that blew up would lie "
        "above 1. The stored energy of some state can rise for a moment, at frequencies near the "
        f"limit of the grid: by a factor of {usual} in half of the cases and of "
        f"{number(growth[worst], 2)} in the worst, {table.rows[worst]['name']}."
    )


def stability(table: Table) -> Picture:
    """Return energy at the end over that after the strike, of each case that was marched."""
    points = []
    for name, key in (("float64", "growth"), ("float32", "growth_single")):
        found = points_of(table, key, "group", "group")
        points += [point._replace(series=name) for point in found if point.score.mean > 0]
    axis = ("energy, last over first", "")
    about = f"{int(np.sum(~np.isnan(table.numbers('growth'))))} cases that were marched"
    return picture_of(stability_finding(table), about, points, axis, limit=("no losses", 1.0))


def _default(table: Table) -> Table:
    """Return the rows of the default scheme and grid."""
    return table.where(scheme=Numerics().scheme, dx_mm=Numerics().dx_mm)


def accuracy_finding(table: Table) -> str:
    """Return error and cost of the default, on average over objects."""
    default = _default(table)
    if not default.rows:
        return "A finer grid has a smaller error and takes longer"
    error, ratio = (float(default.numbers(key).mean()) for key in ("error", "ratio"))
    return (
        f"The default, {Numerics().scheme} at {Numerics().dx_mm:g} mm, has an error of "
        f"{number(error, 2)} in {number(ratio, 2)} of the plain kernel's time"
    )


def accuracy(table: Table) -> Picture:
    """Return error of the feature against run time: a panel per object, a series per scheme."""
    points = [p for p in points_of(table, "error", "scheme", "ratio", "object") if p.score.mean > 0]
    axis = ("relative L2 error of the feature", "")
    place = ("run time over that of the plain kernel at 2.5 mm", "")
    about = "error against the finest grid; each point is a grid spacing"
    limit = ("target", 0.10)
    return picture_of(accuracy_finding(table), about, points, axis, place, limit)


def omissions_finding(table: Table) -> str:
    """Return how many of the parts that are left out change more than is tolerated."""
    absent = table.where(kept=False)
    tolerance = _tolerance(table)[1]
    above = int(np.sum(absent.numbers("measured") > tolerance))
    count = f"{above or 'None'} of {len(absent.rows)}"
    verb = "change" if above > 1 else "changes"
    return f"{count} parts left out {verb} any third octave by more than {number(tolerance)}"


def omissions(table: Table) -> Picture:
    """Return the measured change if each part is left out: a row per part."""
    limit = _tolerance(table)
    least = limit[1] / 1e3
    points = [
        point._replace(series=name)
        for kept, name in ((True, "solved"), (False, "left out"), (None, "all that is left out"))
        for point in points_of(table.where(kept=kept), "measured", "part", "part", "", least)
    ]
    about = f"{len(table.parted('scene'))} scenes"
    return picture_of(omissions_finding(table), about, points, CHANGE, limit=limit)


#: Figures by study.
FIGURES: dict[str, tuple[TableFigure, ...]] = {
    "verification": (
        TableFigure(
            "convergence", "convergence", "lines", convergence,
            "Relative error of each case that is refined, against the spacing of its grid.",
        ),
    ),
    "stability": (TableFigure("stability", "energies", "rows", stability, stability_text),),
    "accuracy": (
        TableFigure(
            "accuracy", "pareto", "scatter", accuracy,
            "Error of the feature against the finest grid, and its cost. Dashed: an error of 0.10. "
            "Times belong to the machine that made this page, their ratios less so.",
        ),
    ),
    "omissions": (
        TableFigure(
            "omissions", "changes", "rows", omissions,
            "The change if each part of each scene is left out. A part that is left out and lies "
            "to the right of the tolerance is an error of the plan.",
        ),
    ),
}  # fmt: skip
