"""Figures of the simulation studies and ablations, and the conclusions of a study."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ajgdata.report.accuracy_figure import accuracy_figure
from ajgdata.report.format import Score, number, words
from ajgdata.report.marks import FigureContent, MarkName, Point, illustration
from ajgdata.report.omissions_figure import omissions_figure
from ajgdata.report.report_data import Illustration
from ajgdata.report.stability_figure import stability_figure
from ajgdata.report.study_tables import passed
from ajgdata.report.validation import validation
from ajgdata.types.table import Table


def conclusions(study: str, tables: Sequence[Table]) -> str:
    """Return how many checks of a study passed, and the titles of its figures, as sentences."""
    texts = [f"{figure.title}." for figure in figures_of(study, tables)]
    return " ".join(filter(None, [*map(passed, tables), *texts]))


def figures_of(study: str, tables: Sequence[Table]) -> Iterator[Illustration]:
    """Yield the figure of a study that has one, named like its first table; nothing is drawn yet.

    A study without rows in one of the tables that its figure shows has no figure.
    """
    if study not in STUDY_FIGURES:
        return
    names, figure = STUDY_FIGURES[study]
    shown = {table.name: table for table in tables if table.rows}
    if shown.keys() >= set(names):
        yield figure(*(shown[name] for name in names))


def _illustration(
    table: Table, mark: MarkName, title: str, about: str, points: list[Point],
    axis: str, text: str, place: tuple[str, str],
) -> Illustration:  # fmt: skip
    """Return a figure of simulated results with a logarithmic axis; values of 0 are left out."""
    shown = tuple(point for point in points if point.score.mean > 0)
    content = FigureContent(title, about, ("simulated",), shown, (axis, ""), place, log=True)
    return illustration(table.name, mark, content, text)


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


#: Share of the chance level below which an error at withheld angles counts as measurable.
MEASURABLE = 0.5


def breaking_mirror(table: Table) -> Illustration:
    """Return the error at withheld angles against the misfit of the transducers, by jig offset."""
    x_title, series_title = (column.title for column in table.columns[1:3])
    points = [
        Point(
            str(row["task"]),
            f"{series_title.partition(' (')[0]}: {number(float(row['series']))} mm",
            float(row["x"]),
            Score(float(row["error"]), float(row["sd"])),
        )
        for row in table.rows
    ]
    chance = {str(row["task"]): float(row["chance"]) for row in table.rows}
    title, _, unit = x_title.removesuffix(")").partition(" (")
    content = FigureContent(
        smallest_changes(table),
        "paper's protocol: 19 angles, 8 withheld; mean and standard deviation over folds",
        ("simulated",),
        tuple(points),
        ("RMSE at withheld angles", "°"),
        (title, unit),
        chance=tuple(chance.items()),
        limits=(0.0, math.inf),
    )
    text = (
        "Error of the direction of the bar at withheld angles. A plain number, as in the paper, or "
        "sine and cosine of twice the angle are predicted."
    )
    return illustration(table.name, "lines", content, text)


def smallest_changes(table: Table) -> str:
    """Return for each task the smallest change with less than half of the chance level.

    The size of a change is the sum of both distances in mm.
    """
    texts = []
    for task, rows in table.split_by("task").items():
        enough = [row for row in rows.rows if row["error"] < MEASURABLE * row["chance"]]
        if not enough:
            texts.append(f"{task} with no change")
            continue
        best = min(enough, key=lambda row: (row["x"] + row["series"], row["error"]))
        distances = {"jig": float(best["series"]), "misfit": float(best["x"])}
        changes = [f"{name} {number(mm)} mm" for name, mm in distances.items() if mm > 0]
        listed = " and ".join(changes) or "the symmetric gripper"
        texts.append(f"{task} with {listed} ({number(float(best['error']))}°)")
    return f"Below half of the chance level: {'; '.join(texts)}"


#: Tables and figure of each study.
STUDY_FIGURES: dict[str, tuple[tuple[str, ...], Callable[..., Illustration]]] = {
    "verification": (("convergence",), convergence),
    "validation": (("resonances", "attenuation"), validation),
    "stability": (
        ("limits", "unreached", "long_runs", "energy", "distances"),
        stability_figure,
    ),
    "accuracy": (("accuracy",), accuracy_figure),
    "omissions": (("omissions",), omissions_figure),
    "ablations": (("breaking_mirror",), breaking_mirror),
}
