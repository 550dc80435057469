"""Report -> its pages, and the figures that they show."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ajgdata.paths import INDEX, Paths
from ajgdata.report.comparison import SIGNS, evidence
from ajgdata.report.format import DASH
from ajgdata.report.navigation import FIXED, Group, experiment_link
from ajgdata.report.render import Picture, render, web_link
from ajgdata.report.report_data import ExperimentPage, Illustration, Report

#: Figure of the first page, see `report.figures`.
SKILL = "beside-paper"
#: End of the name of a task's figure of error against run time.
RUN_TIME = "--run-time"
#: A page is to open quickly: further findings are in the file that it points to.
MAX_FINDINGS = 2000


def illustrations(report: Report) -> Iterator[Illustration]:
    """Yield every figure of the report, in the order of its pages; nothing is drawn yet."""
    from ajgdata.report.figures import skill_figure, spectra_figure

    if first := skill_figure(report.comparisons):
        yield first
    for d in report.datasets:
        if d.spectra is not None:
            yield spectra_figure(d, d.spectra)
    for section in report.sections:
        for part in section.parts:
            yield from part.figures


def spectra_name(dataset: str) -> str:
    """Return the file name, without suffix, of a data set's spectra."""
    return f"spectra--{dataset}"


def render_pages(
    report: Report,
    figures: Mapping[str, Picture],
    nav: Sequence[Group] = (),
    published: Sequence[str] = (),
    project: Paths | None = None,
) -> dict[str, str]:
    """Return each page as HTML text, by file name relative to the report's folder.

    The same report and figures give the same text. `figures` are those of `illustrations(report)`,
    drawn, by name; `nav` stands on every page; from the data sets `published` their trees are
    linked. Raises jinja2.UndefinedError if a figure is missing.
    """
    places = project or Paths()
    shared = {
        "report": report,
        "nav": nav,
        "published": published,
        "max_findings": MAX_FINDINGS,
        "DASH": DASH,
        "SIGNS": SIGNS,
        "evidence": evidence,
        "published_link": lambda name: link_from_report(places, places.published(name)),
        "quarantine_link": lambda name: link_from_report(places, places.quarantine(name)),
        "spectra_name": spectra_name,
        "web_link": web_link,
        "page_of_section": lambda section: experiment_link(section.parts[0].page),
        "run_time_link": run_time_link(report),
    }
    own = {
        INDEX: ("index.html.j2", {"figure": figures.get(SKILL)}),
        **{link.link: (f"{name}.html.j2", {}) for name, link in FIXED.items()},
        **{experiment_link(p.name): ("experiment.html.j2", _on(p, report)) for p in report.pages},
    }
    return {
        name: render(template, figures, here=name, project=project, **(shared | values))
        for name, (template, values) in own.items()
    }


def _on(page: ExperimentPage, report: Report) -> dict[str, Any]:
    """Return what the template of a page on an experiment is given."""
    link = experiment_link(page.name)
    sections = report.on(page.name)
    names = dict.fromkeys(section.dataset for section in sections)
    told = ((part.title, part.text) for section in sections for part in section.parts)
    return {
        "page": page,
        "sections": sections,
        "first": [one for s in sections for part in s.parts for one in part.figures][:1],
        "comparisons": [one for one in report.comparisons if one.page == link],
        "sources": sorted({section.source for section in sections}),
        "texts": [one for one in dict.fromkeys(told) if one[1]],
        "datasets": [d for d in report.datasets if d.name in names],
    }


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
    return Path(os.path.relpath(target, paths.report.parent)).as_posix()
