"""Figures of the simulation studies and of causes of differences, and conclusions of a study."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ajgdata.report.accuracy_figure import accuracy_figure
from ajgdata.report.format import Score, number, words
from ajgdata.report.marks import FigureContent, Point, illustration
from ajgdata.report.omissions_figure import omissions_figure
from ajgdata.report.report_data import Illustration
from ajgdata.report.stability_figure import stability_figure
from ajgdata.report.study_tables import passed
from ajgdata.report.validation import validation
from ajgdata.types.table import Table


def conclusions(study: str, tables: Sequence[Table]) -> str:
    """Return sentences: the number of passed checks per table, and the title of the figure."""
    checks = [passed(table) for table in tables]
    titles = [f"{figure.title}." for figure in figures_of(study, tables)]
    return " ".join(filter(None, [*checks, *titles]))


def figures_of(study: str, tables: Sequence[Table]) -> Iterator[Illustration]:
    """Yield the figure of a study, if it has one; nothing is drawn yet.

    The figure has the name of its first table. If one of its tables has no rows, there is no
    figure.
    """
    if study not in STUDY_FIGURES:
        return
    names, figure = STUDY_FIGURES[study]
    shown = {table.name: table for table in tables if table.rows}
    if shown.keys() >= set(names):
        yield figure(*(shown[name] for name in names))


def convergence(table: Table) -> Illustration:
    """Return the relative error of each refined case against the grid spacing.

    The title has the orders at which the errors decrease.
    """
    orders = []
    cases = table.split_by("case").values()
    for rows in cases:
        grid = rows.numbers("dx_mm")
        error = rows.numbers("error")
        fine = int(np.argmin(grid))
        coarse = int(np.argmax(grid))
        if grid[fine] < grid[coarse] and error[fine] > 0 and error[coarse] > 0:
            orders.append(np.log(error[coarse] / error[fine]) / np.log(grid[coarse] / grid[fine]))
    nearer = [order for order in orders if order > 0]
    title = f"Refinement brings {len(nearer)} of {len(orders)} known answers nearer"
    if nearer:
        title += f", at orders from {number(min(nearer), 2)} to {number(max(nearer), 2)}"
    points = [
        Point("", words(str(row["case"])), float(row["dx_mm"]), Score(float(error), math.nan))
        for row, error in zip(table.rows, table.numbers("error"), strict=True)
        if math.isfinite(error) and error > 0  # the axis is logarithmic
    ]
    content = FigureContent(
        title,
        f"{len(cases)} known answers",
        ("simulated",),
        tuple(points),
        ("relative error", ""),
        ("grid spacing", "mm"),
        log=True,
    )
    text = "Relative error of each case that is refined, against the spacing of its grid."
    return illustration(table.name, "lines", content, text)


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
    """Return the smallest change per task with an error below half of the chance level.

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
    "causes": (("breaking_mirror",), breaking_mirror),
}
