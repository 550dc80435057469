"""Pages of the report and the navigation that all of them show."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

from ajgdata.paths import EXPERIMENT_PAGES_FOLDER, INDEX, Paths
from ajgdata.report.format import Source


class Link(NamedTuple):
    """Link to a page, relative to the folder of the report; `about` is its group."""

    link: str
    title: str
    about: str


class Lead(NamedTuple):
    """Title and introduction of a page on studies, its group, and the sources of its data."""

    title: str
    text: str
    about: str = "The virtual gripper"
    sources: tuple[Source, ...] = ("simulated",)


LEADS = {
    "causes": Lead(
        "Causes of differences",
        "Each hypothesis is tested by an experiment that could refute it: one factor changes, and"
        " errors are compared on the same grasps. A supported cause holds within the simulation;"
        " this does not show that it is the cause on the real gripper.",
        "Results",
    ),
    "verification": Lead(
        "Verification",
        "The solver is compared with identities that must hold to rounding error, and with known"
        " answers that it must approach at a known rate.",
    ),
    "validation": Lead(
        "Validation",
        "The solver simulates resonators that other groups measured: a sphere, eight tubes and an"
        " impedance tube. Measured, simulated and analytic values are compared. This does not cover"
        " grains, the membrane or grasped objects. The impedance tube shows the order of magnitude"
        " of wall_admittance; it is not a source for a printed housing.",
        sources=("simulated", "recorded"),
    ),
    "stability": Lead(
        "Stability",
        "The energy of stiff, light, heavy, very small, very large and hot scenes must stay"
        " bounded, and extreme scenes must approach known limits.",
    ),
    "accuracy": Lead(
        "Error against run time",
        "Error of the feature by its source (grid, time step, stopping, modes, medium, precision,"
        " omissions), the run time of each setting, and the error in differences between objects.",
    ),
    "omissions": Lead(
        "Omitted parts",
        "An omission must save time and hardly change the sound. The simulation leaves out modes"
        " above 8 kHz, and the frame of the grains under hard blocks; this study measures both, and"
        " all omissions that it does not use.",
    ),
}


class Group(NamedTuple):
    """Group of links of the navigation."""

    title: str
    links: tuple[Link, ...]


class LinkOnPage(NamedTuple):
    """A link of the navigation as one page shows it: `is_current` if it leads to this page."""

    link: str
    title: str
    is_current: bool


class GroupOnPage(NamedTuple):
    """A group of the navigation as one page shows it."""

    title: str
    links: tuple[LinkOnPage, ...]


#: Page of a report that compares results with published values.
PAPER_PAGE = Link("paper.html", "Comparison with the paper", "Results")
#: Page of own data: object or placement.
DIAGNOSIS_PAGE = Link("diagnosis.html", "Object or placement?", "Results")
#: Pages that every report has, by file name without suffix.
FIXED = {
    "datasets": Link("datasets.html", "Data sets", "This run"),
    "run": Link("run.html", "Method and cost", "This run"),
}


def experiment_link(page: str) -> str:
    """Return the link to the page on an experiment, relative to the folder of the report."""
    return f"{EXPERIMENT_PAGES_FOLDER}/{page}.html"


def link_from_report(paths: Paths, target: Path) -> str:
    """Return the link from the report of `paths` to a file or folder.

    The link is relative, except to another drive of Windows, where imported audio can be.
    """
    if target.absolute().drive != paths.report.absolute().drive:
        return target.absolute().as_uri()
    return quote(Path(os.path.relpath(target, paths.report.parent)).as_posix())


def navigation(
    experiments: Sequence[Link],
    pages: Sequence[str],
    *,
    compares: bool = True,
    diagnoses: bool = False,
) -> list[Group]:
    """Return the navigation of a report, in the order in which it is shown.

    `experiments` are links to the pages on experiments. `pages` are the names of the pages on
    causes and on the virtual gripper. `compares`: results are compared with published values.
    `diagnoses`: the report has the page on object or placement.
    """
    studies = [
        Link(f"{name}.html", lead.title, lead.about)
        for name, lead in LEADS.items()
        if name in pages
    ]
    links = [
        Link(INDEX, "Overview", "Results"),
        *([DIAGNOSIS_PAGE] if diagnoses else []),
        *([PAPER_PAGE] if compares else []),
        *(link for link in studies if link.about == "Results"),
        *experiments,
        *(link for link in studies if link.about != "Results"),
        FIXED["datasets"],
        FIXED["run"],
    ]
    groups: dict[str, list[Link]] = {}
    for link in links:
        groups.setdefault(link.about, []).append(link)
    return [Group(title, tuple(some)) for title, some in groups.items()]


def groups_on(page: str, groups: Sequence[Group]) -> list[GroupOnPage]:
    """Return the navigation as the file `page` shows it, with the link to this page marked."""
    return [
        GroupOnPage(
            group.title,
            tuple(LinkOnPage(link.link, link.title, link.link == page) for link in group.links),
        )
        for group in groups
    ]
