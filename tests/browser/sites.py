"""Folders of pages, and what is written in them."""

import dataclasses
from html.parser import HTMLParser
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote, urlsplit

from report_samples import PAPER, sample_report

from ajgdata.paths import FIGURES_FOLDER, TABLES_FOLDER
from ajgdata.pipeline.exports import write_exports
from ajgdata.report.comparison import PaperComparison, ResultCost, mark_of
from ajgdata.report.format import Score
from ajgdata.report.navigation import Link, experiment_link, navigation
from ajgdata.report.page import illustrations, render_pages
from ajgdata.report.render import draw_figures
from ajgdata.report.report_data import Report
from ajgdata.store.files import write_bytes


class Written(HTMLParser):
    """What a page names: places in it, addresses that it leads to or loads, and words of images."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.places = set()
        self.addresses = set()
        self.alternatives = []
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.places.add(given.get("id"))
        self.addresses |= {given[key] for key in ("href", "src", "srcset") if given.get(key)}
        if tag == "img":
            self.alternatives.append(given.get("alt"))


class Site(NamedTuple):
    """A folder of pages; the first is its index."""

    folder: Path

    @property
    def index(self) -> Path:
        return self.folder / "index.html"

    @property
    def pages(self) -> list[Path]:
        return [self.index, *sorted(set(self.folder.rglob("*.html")) - {self.index})]

    def name(self, page: Path) -> str:
        return page.relative_to(self.folder).as_posix()

    def written(self) -> dict[Path, Written]:
        return {page: Written(page.read_text(encoding="utf-8")) for page in self.pages}

    def astray(self) -> list[str]:
        """Links of pages to a file, or a place in a page, that is not there."""
        written = self.written()
        wrong = []
        for page, content in written.items():
            for address in sorted(content.addresses):
                parts = urlsplit(address)
                if parts.scheme in ("http", "https", "data", "mailto"):
                    continue
                target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
                place = unquote(parts.fragment)
                project = self.folder.parent.parent  # sounds are in its data/
                there = target.exists() and target.is_relative_to(project)
                if not there or (place and place not in written[target].places):
                    wrong.append(f"{self.name(page)}: {address}")
        return wrong


def sample_site(folder: Path) -> Site:
    """A small report with hostile names, all kinds of pages, as the workflow leaves it."""
    index = folder / "report/index.html"
    report = full_report()
    listed = [Link(experiment_link(page.name), page.title, page.about) for page in report.pages]
    nav = navigation(listed, [])
    figures = draw_figures(illustrations(report), index.parent / FIGURES_FOLDER)
    pages = render_pages(report, figures, nav)
    for name, html in pages.items():
        write_bytes(index.parent / name, html.encode())
    for name in ("metrics.csv", "predictions.csv"):
        write_bytes(folder / name, b"dataset\n")
    write_exports(report, [], index.parent / TABLES_FOLDER)
    for dataset in report.datasets:
        write_bytes(folder / "quarantine" / f"{dataset.name}.csv", b"session_id\n")
    return Site(index.parent)


def full_report() -> Report:
    """The report that unit tests draw, with a panel of each kind."""
    report = sample_report()
    marks = (
        mark_of("ours", Score(0.7, 0.1)),
        mark_of("baseline", Score(0.9, 0.2)),
        mark_of("chance", Score(5.2, 0.0)),
    )
    page = experiment_link("size")
    comparison = PaperComparison(
        PAPER,
        "size",
        "edge",
        "simulated",
        "0.7 ± 0.1 mm",
        "CNN",
        "better",
        ResultCost(7.6, 0.9),
        marks=marks,
        page=page,
    )
    absent = PAPER.model_copy(update={"id": "x", "where": "angles", "text": "8°"})
    return dataclasses.replace(report, comparisons=(comparison,), paper=(PAPER, absent))
