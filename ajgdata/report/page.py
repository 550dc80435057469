"""Report and its figures -> one HTML page that needs no network and no other file to be read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath
from typing import Any

from ajgdata.paths import FIGURE_FORMATS, Paths
from ajgdata.report import illustrations as figures
from ajgdata.report import wording
from ajgdata.report.beside import absent, beside, evidence
from ajgdata.report.content import PartResult, Report, TaskResult
from ajgdata.report.energy_figures import energy_rows
from ajgdata.report.experiments import spread
from ajgdata.report.render import Link, data_uri, environment, web_link
from ajgdata.report.silent_figures import silent_name
from ajgdata.report.transfer_figures import transfer_rows

#: A page is read by people: further findings are in the file that it points to.
MAX_FINDINGS = 50


def render_page(
    report: Report,
    svgs: Mapping[str, bytes],
    pages: Sequence[Link] = (),
    published: Sequence[str] = (),
    project: Paths | None = None,
) -> str:
    """The page as HTML text: the same report and figures give the same text.

    `pages` are linked from its contents, and the trees of the data sets `published` from these.
    `svgs` holds the SVG file of each name of `illustrations(report)`; PNG and PDF are linked where
    `Paths.figure` puts them. Raises ValueError if a figure is missing.
    """
    drawn = figures.illustrations(report)
    if missing := [name for name in drawn if name not in svgs]:
        raise ValueError(f"figures not drawn: {', '.join(missing)}")
    return (
        environment(project)
        .get_template("report.html.j2")
        .render(
            report=report,
            rows=beside(report),
            absent=absent(report),
            pages=pages,
            published=published,
            figures=drawn,
            figure_formats=FIGURE_FORMATS,
            image={name: data_uri(svgs[name]) for name in drawn},
            max_findings=MAX_FINDINGS,
            **_names(),
        )
    )


def _names() -> dict[str, Any]:
    """Functions that the template calls."""
    return {
        "COST": figures.COST,
        "DASH": wording.DASH,
        "SPLITS": figures.SPLITS,
        "STAGES": figures.STAGES,
        "best": best,
        "close": close,
        "energy_rows": energy_rows,
        "evidence": evidence,
        "chance": wording.chance,
        "silent_name": silent_name,
        "spread": spread,
        "transfer_rows": transfer_rows,
        "figure_link": figure_link,
        "headline": wording.headline,
        "metric_name": wording.metric_name,
        "paper_cells": paper_cells,
        "part_rows": part_rows,
        "part_chance": wording.part_chance,
        "prediction_name": figures.prediction_name,
        "published_link": published_link,
        "quarantine_link": quarantine_link,
        "spectra_name": figures.spectra_name,
        "tradeoff_name": figures.tradeoff_name,
        "level_name": figures.level_name,
        "web_link": web_link,
    }


def best(task: tuple[TaskResult, ...]) -> TaskResult:
    """The model of lowest error; of equals, the first."""
    return min(task, key=lambda r: r.error.mean)


def close(task: tuple[TaskResult, ...]) -> list[TaskResult]:
    """The best model, and those whose error is within its standard deviation of it."""
    top = best(task).error
    return [r for r in task if r.error.mean <= top.mean + max(top.sd, 0)]


def part_rows(
    task: tuple[TaskResult, ...],
) -> list[tuple[str, list[tuple[TaskResult, PartResult]]]]:
    """Further parts of a task by name, each with the result of every model that has it."""
    found: dict[str, list[tuple[TaskResult, PartResult]]] = {}
    for r in task:
        for part in (*r.parts, *r.elsewhere):
            found.setdefault(wording.part_label(part), []).append((r, part))
    return list(found.items())


def paper_cells(
    task: Sequence[TaskResult] | Sequence[PartResult],
) -> list[tuple[str, str, int]]:
    """Text, source and row span of the paper's cell per model; a span of 0 means no cell.

    A figure that all models share is written once, across their rows.
    """
    cells = [
        (r.paper.text, f"{r.paper.where}; {r.paper.source}") if r.paper else None for r in task
    ]
    shown = [cell or (wording.DASH, "") for cell in cells]
    if len(set(cells)) == 1:
        return [(*shown[0], len(task) if i == 0 else 0) for i in range(len(task))]
    return [(*cell, 1) for cell in shown]


def figure_link(name: str, suffix: str) -> str:
    """Link from the page to a figure's file."""
    return _from_page(PurePosixPath(f"{Paths().figure(name).as_posix()}.{suffix}"))


def quarantine_link(dataset: str) -> str:
    """Link from the page to the table of all findings of a data set."""
    return _from_page(PurePosixPath(Paths().quarantine(dataset).as_posix()))


def published_link(dataset: str) -> str:
    """Link from the page to a published data set."""
    return _from_page(PurePosixPath(Paths().published(dataset).as_posix()))


def _from_page(target: PurePosixPath) -> str:
    """`target` relative to the folder of the page."""
    up, folder = 0, PurePosixPath(Paths().report.as_posix()).parent
    while not target.is_relative_to(folder):
        up, folder = up + 1, folder.parent
    return str(PurePosixPath(*[".."] * up, target.relative_to(folder)))
