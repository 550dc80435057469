"""Report -> its pages, and the figures that they show."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from ajgdata.paths import INDEX, Paths
from ajgdata.report.datasets_page import datasets_view
from ajgdata.report.diagnosis_page import diagnosis_view
from ajgdata.report.experiment_page import experiment_view, replaced_names
from ajgdata.report.figures import spectra_figure
from ajgdata.report.index_page import index_view
from ajgdata.report.navigation import DIAGNOSIS_PAGE, FIXED, PAPER_PAGE, Group, experiment_link
from ajgdata.report.paper_page import paper_view
from ajgdata.report.render import DrawnFigure, render
from ajgdata.report.report_data import Illustration, Report
from ajgdata.report.run_page import run_view


def illustrations(report: Report) -> Iterator[Illustration]:
    """Yield every figure of the report, in the order of its pages; nothing is drawn yet."""
    for dataset in report.datasets:
        if dataset.spectra is not None:
            yield spectra_figure(dataset, dataset.spectra)
    for diagnosis in report.diagnoses:
        yield diagnosis.figure
    for page in report.pages:
        yield from page.figures
    replaced = {name for page in report.pages for name in replaced_names(page)}
    for section in report.sections:
        for part in section.parts:
            yield from (figure for figure in part.figures if figure.name not in replaced)


def render_pages(
    report: Report,
    figures: Mapping[str, DrawnFigure],
    nav: Sequence[Group] = (),
    published: Sequence[str] = (),
    project: Paths | None = None,
) -> dict[str, str]:
    """Return each page as HTML text, by file name relative to the folder of the report.

    `figures` are the drawn figures of `illustrations(report)` by name. `published` are the data
    sets with a link to their published folder. Raises KeyError if a figure is missing.
    """
    paths = project or Paths()
    datasets = FIXED["datasets"].link
    run = FIXED["run"].link
    views: dict[str, tuple[str, object]] = {INDEX: ("index.html.j2", index_view(report, figures))}
    if report.diagnoses:
        views[DIAGNOSIS_PAGE.link] = ("diagnosis.html.j2", diagnosis_view(report, figures))
    if report.comparisons:
        views[PAPER_PAGE.link] = ("paper.html.j2", paper_view(report))
    views[datasets] = ("datasets.html.j2", datasets_view(report, figures, published, paths))
    views[run] = ("run.html.j2", run_view(report))
    for page in report.pages:
        view = experiment_view(page, report, figures)
        views[experiment_link(page.name)] = ("experiment.html.j2", view)
    return {
        name: render(template, here=name, nav=nav, project=project, page=view)
        for name, (template, view) in views.items()
    }
