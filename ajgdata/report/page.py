"""Report -> its pages, and the figures that they show."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from ajgdata.evaluate.agreement import VERDICT_MEANINGS
from ajgdata.paths import INDEX, Paths
from ajgdata.report.answer import best_sentence, compared_sentence
from ajgdata.report.comparison import (
    ASSUMED_N,
    SIGNS,
    PaperComparison,
    Reason,
    evidence,
    tally,
    tally_text,
)
from ajgdata.report.forest import TICKS, model_rows, paper_rows, place
from ajgdata.report.format import DASH, enumerated, sentence
from ajgdata.report.navigation import FIXED, PAPER_PAGE, Group, experiment_link
from ajgdata.report.render import DrawnFigure, render, web_link
from ajgdata.report.report_data import ExperimentPage, Illustration, Report, ReportPart, TaskSection
from ajgdata.types import FeatureSettings

#: End of the name of a task's figure of error against run time.
RUN_TIME = "--run-time"
#: Figures of a page that are not folded, and rows of a table, or lines, that are not folded.
MAX_OPEN_FIGURES, MAX_OPEN_ROWS = 4, 6


class FoldedPart(NamedTuple):
    """Details of an experiment on a task that a page shows on demand."""

    title: str
    summary: str
    figures: tuple[Illustration, ...]


def illustrations(report: Report) -> Iterator[Illustration]:
    """Yield every figure of the report, in the order of its pages; nothing is drawn yet."""
    from ajgdata.report.figures import spectra_figure

    for d in report.datasets:
        if d.spectra is not None:
            yield spectra_figure(d, d.spectra)
    for page in report.pages:
        yield from page.figures
    replaced = {name for page in report.pages for name in replaced_names(page)}
    for section in report.sections:
        for part in section.parts:
            yield from (figure for figure in part.figures if figure.name not in replaced)


def replaced_names(page: ExperimentPage) -> set[str]:
    """Return the names of the figures of experiments that the figures of a page replace."""
    return {name for figure in page.figures for name in figure.replaces}


def task_figures(report: Report) -> list[Illustration]:
    """Return the first figure of each task, or the figure of a page that replaces it."""
    replacing = {
        name: figure for page in report.pages for figure in page.figures for name in figure.replaces
    }
    shown = {}
    for section in report.sections:
        for first in section.parts[0].figures[:1]:
            figure = replacing.get(first.name, first)
            shown[figure.name] = figure
    return list(shown.values())


def render_pages(
    report: Report,
    figures: Mapping[str, DrawnFigure],
    nav: Sequence[Group] = (),
    published: Sequence[str] = (),
    project: Paths | None = None,
) -> dict[str, str]:
    """Return each page as HTML text, by file name relative to the report's folder.

    `figures` are those of `illustrations(report)`, drawn, by name; `published` are data sets whose
    published folders are linked. Raises jinja2.UndefinedError if a figure is missing.
    """
    shared = {"nav": nav, "published": published, **_shared(report, project or Paths())}
    first = {
        "paper_rows": paper_rows(report.comparisons),
        "model_rows": model_rows(report.sections),
        "task_figures": task_figures(report),
    }
    own = {
        INDEX: ("index.html.j2", first),
        **({PAPER_PAGE.link: ("paper.html.j2", _rules(report))} if report.comparisons else {}),
        **{link.link: (f"{name}.html.j2", {}) for name, link in FIXED.items()},
        **{experiment_link(p.name): ("experiment.html.j2", _on(p, report)) for p in report.pages},
    }
    return {
        name: render(template, figures, here=name, project=project, **(shared | values))
        for name, (template, values) in own.items()
    }


def _shared(report: Report, project: Paths) -> dict[str, Any]:
    """Return the values of the templates of all pages, by name."""
    return {
        "report": report,
        "max_open_rows": MAX_OPEN_ROWS,
        "DASH": DASH,
        "SIGNS": SIGNS,
        "evidence": evidence,
        "published_link": lambda name: link_from_report(project, project.published(name)),
        "quarantine_link": lambda name: link_from_report(project, project.quarantine(name)),
        "web_link": web_link,
        "feature_settings": _feature_settings(report),
        "run_time_link": run_time_link(report),
        "ticks": TICKS,
        "place": place,
        "texts": dict.fromkeys(
            (p.experiment, p.title, p.text) for s in report.sections for p in s.parts if p.text
        ),
    }


def _rules(report: Report) -> dict[str, Any]:
    """Return the values of the template of the comparison with the paper, by name.

    The table has a column of causes only if a cause was tested.
    """
    return {
        "verdict_meanings": VERDICT_MEANINGS,
        "assumed_n": enumerated([str(n) for n in ASSUMED_N]),
        "has_causes": any(row.reasons for row in report.comparisons),
    }


def _feature_settings(report: Report) -> list[tuple[str, FeatureSettings]]:
    """Return each of the feature settings with the names of the data sets that have it."""
    names: dict[FeatureSettings, list[str]] = {}
    for d in report.datasets:
        names.setdefault(d.features, []).append(d.name)
    return [(", ".join(named), settings) for settings, named in names.items()]


def _on(page: ExperimentPage, report: Report) -> dict[str, Any]:
    """Return the values of the template of a page on an experiment, by name."""
    link = experiment_link(page.name)
    sections = report.on(page.name)
    names = dict.fromkeys(section.dataset for section in sections)
    comparisons = [row for row in report.comparisons if row.page == link]
    first = {(row.dataset, row.task, row.experiment) for row in comparisons[:1]}
    parts = sorted(
        ((section, part) for section in sections for part in section.parts),
        key=lambda pair: (pair[0].dataset, pair[0].task, pair[1].experiment) not in first,
    )
    headlines: dict[str, list[str]] = {}
    for section, part in parts:
        if part.headline:
            title, _, task = section.title.rpartition(" · ")
            headlines.setdefault(title, []).append(f"{task}, {part.headline}")
    counts = tally(comparisons)
    shown = open_figures(page, [part for _, part in parts])
    causes = _causes(comparisons)
    untested = [row.name for row in comparisons if row.differs and not row.reasons]
    return {
        "page": page,
        "sections": sections,
        "first_figures": shown[:1],
        "more_figures": shown[1:],
        "folded": folded_parts(page, sections, shown),
        "headlines": list(headlines.items()) if len(parts) > 1 else [],
        "more_heading": "Results by data set" if len(parts) > 1 else "More results",
        "answer": _page_answer(page, comparisons, parts),
        "comparisons": comparisons,
        "causes": causes,
        "untested": untested,
        "has_differences": bool(causes or untested),
        "remarks": [row for row in comparisons if row.remark],
        "paper_rows": paper_rows(comparisons),
        "verdicts": next(iter(counts)) if len(counts) == 1 else tally_text(counts),
        "n_rows": sum(len(section.rows) for section in sections),
        "sources": sorted({section.source for section in sections}),
        "methods": dict.fromkeys((p.experiment, p.title) for _, p in parts if p.text),
        "datasets": [d for d in report.datasets if d.name in names],
    }


def open_figures(page: ExperimentPage, parts: Sequence[ReportPart]) -> list[Illustration]:
    """Return the figures of a page that are not folded.

    A page with its own figures shows only them. Other pages show the first figure of each part.
    """
    figures = [part.figures[0] for part in parts if part.figures]
    return [*(page.figures or figures)][:MAX_OPEN_FIGURES]


def folded_parts(
    page: ExperimentPage, sections: Sequence[TaskSection], shown: Sequence[Illustration]
) -> list[FoldedPart]:
    """Return the folded details of each part that has a summary, or figures that are not shown.

    Figures that a figure of the page replaces are left out.
    """
    names = {figure.name for figure in shown} | replaced_names(page)
    folded = []
    for section in sections:
        for part in section.parts:
            figures = [figure for figure in part.figures if figure.name not in names]
            if part.summary or figures:
                title = f"{section.title}: {part.title.lower()}"
                folded.append(FoldedPart(title, part.summary, tuple(figures)))
    return folded


def _causes(comparisons: Sequence[PaperComparison]) -> list[tuple[bool, Reason, list[str]]]:
    """Return whether each tested cause is supported, the cause, and the names of its results;
    supported ones come first."""
    names: dict[tuple[bool, Reason], list[str]] = {}
    for row in comparisons:
        for reason in row.reasons if row.differs else ():
            names.setdefault((reason in row.why, reason), []).append(row.name)
    return sorted(((*key, of) for key, of in names.items()), key=lambda cause: not cause[0])


def _page_answer(
    page: ExperimentPage,
    comparisons: Sequence[PaperComparison],
    parts: Sequence[tuple[TaskSection, ReportPart]],
) -> str:
    """Return the first sentence of a page: on the paper's result, the figure or the best model."""
    compared = filter(None, map(compared_sentence, comparisons))
    best = (
        best_sentence(section, row) for section, part in parts for row in part.rows if row.answer
    )
    conclusions = [figure.title for figure in page.figures]
    conclusions += [part.headline for _, part in parts]
    titles = (f"{sentence(title)}." for title in conclusions if title)
    choices = (compared, titles, best) if comparisons else (best, titles)
    return next((text for texts in choices for text in texts), "")


def run_time_link(report: Report) -> str:
    """Return the link to the figure of error against run time with most models, or ""."""
    parts = [part for section in report.sections for part in section.parts]
    links = {
        f"{experiment_link(part.page)}#{figure.name}": len(part.rows)
        for part in parts
        for figure in part.figures
        if figure.name.endswith(RUN_TIME)
    }
    return max(links, key=lambda link: links[link], default="")


def link_from_report(paths: Paths, target: Path) -> str:
    """Return the link from the report of `paths` to a file or folder of the same project."""
    return quote(Path(os.path.relpath(target, paths.report.parent)).as_posix())
