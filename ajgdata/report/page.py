"""Report -> its page, and the figures that the page shows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import PurePosixPath

from ajgdata.paths import Paths
from ajgdata.report.blocks import Illustration, ResultRow
from ajgdata.report.comparison import evidence
from ajgdata.report.format import DASH
from ajgdata.report.render import Link, Picture, render, web_link
from ajgdata.report.report_data import Report

#: A page is read by people: further findings are in the file that it points to.
MAX_FINDINGS = 50
STAGES = "time-of-stages"


def illustrations(report: Report) -> Iterator[Illustration]:
    """Yield every figure of the report, in the order of the page; nothing is drawn yet."""
    from ajgdata.report.job_times import stages_caption, stages_figure
    from ajgdata.report.spectra import spectra_caption, spectra_figure

    yield from report.across
    for d in report.datasets:
        if d.spectra is not None:
            yield Illustration(spectra_name(d.name), spectra_caption(d), partial(spectra_figure, d))
    for section in report.sections:
        for part in section.parts:
            yield from part.figures
    if report.stages:
        sources = tuple(d.source for d in report.datasets)
        draw = partial(stages_figure, report.stages, sources)
        yield Illustration(STAGES, stages_caption(report.stages), draw)


def spectra_name(dataset: str) -> str:
    """Return the file name, without suffix, of a data set's spectra."""
    return f"spectra--{dataset}"


def render_page(
    report: Report,
    figures: Mapping[str, Picture],
    pages: Sequence[Link] = (),
    published: Sequence[str] = (),
    project: Paths | None = None,
) -> str:
    """Return the page as HTML text: the same report and figures give the same text.

    `figures` are those of `illustrations(report)`, drawn, by name. `pages` are linked from its
    contents, and the trees of the data sets `published` from these. Raises
    jinja2.UndefinedError if a figure is missing.
    """
    return render(
        "report.html.j2",
        figures,
        project=project,
        report=report,
        pages=pages,
        published=published,
        max_findings=MAX_FINDINGS,
        DASH=DASH,
        STAGES=STAGES,
        evidence=evidence,
        paper_cells=paper_cells,
        published_link=published_link,
        quarantine_link=quarantine_link,
        spectra_name=spectra_name,
        web_link=web_link,
    )


def paper_cells(rows: Sequence[ResultRow]) -> list[tuple[str, str, int]]:
    """Return text, source and row span of the paper's cell per row; a span of 0 means no cell.

    A figure that neighbouring rows share is written once, across them.
    """
    cells: list[tuple[str, str, int]] = []
    start = 0
    for at, row in enumerate(rows):
        if at and (row.paper, row.part) == (rows[start].paper, rows[start].part):
            text, where, span = cells[start]
            cells[start] = text, where, span + 1
            cells.append(("", "", 0))
        else:
            start = at
            paper = row.paper
            told = (paper.text, f"{paper.where}; {paper.source}") if paper else (DASH, "")
            cells.append((*told, 1))
    return cells


def quarantine_link(dataset: str) -> str:
    """Return the link from the page to the table of all findings of a data set."""
    return _from_page(PurePosixPath(Paths().quarantine(dataset).as_posix()))


def published_link(dataset: str) -> str:
    """Return the link from the page to a published data set."""
    return _from_page(PurePosixPath(Paths().published(dataset).as_posix()))


def _from_page(target: PurePosixPath) -> str:
    """Return `target` relative to the folder of the page."""
    up, folder = 0, PurePosixPath(Paths().report.as_posix()).parent
    while not target.is_relative_to(folder):
        up, folder = up + 1, folder.parent
    return str(PurePosixPath(*[".."] * up, target.relative_to(folder)))
