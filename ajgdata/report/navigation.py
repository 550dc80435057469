"""Pages of the report and the navigation that all of them show."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from ajgdata.paths import EXPERIMENT_PAGES, INDEX


class Link(NamedTuple):
    """Another page, relative to the report's folder, and the group that it belongs to."""

    link: str
    title: str
    about: str


class Lead(NamedTuple):
    """Title of a page, the question that it answers, and the group of pages that it belongs to."""

    title: str
    text: str
    about: str = "The virtual gripper"


LEADS = {
    "ablations": Lead(
        "Why simulation and paper differ",
        "Each hypothesis is put to an experiment that could refute it: one thing is changed, all"
        " else stays, and errors are compared on the same grasps. What is supported is a reason"
        " within the simulation; that it holds for the real gripper, too, is a guess.",
        "Results",
    ),
    "verification": Lead(
        "Verification",
        "Does the solver solve the equations it claims to solve? Identities that hold at "
        "round-off, and known answers that it approaches at a known rate.",
    ),
    "stability": Lead(
        "Stability",
        "What becomes of stiff, light, heavy, tiny, huge, hot and impossible scenes: each stays "
        "bounded, or is refused with a reason before anything runs.",
    ),
    "accuracy": Lead(
        "Error against run time",
        "How far a response is from that of a much finer grid, and what it costs to come closer.",
    ),
    "omissions": Lead(
        "What is left out",
        "What a plan leaves out of a scene because a measured table allows it, and what that "
        "changes in scenes that the table does not hold.",
    ),
}


class Group(NamedTuple):
    """Links of the navigation that belong together, relative to the report's folder."""

    title: str
    links: tuple[Link, ...]


#: Pages that every report has, by file name without suffix.
FIXED = {
    "paper": Link("paper.html", "Beside the paper", "Results"),
    "results": Link("results.html", "All results", "Results"),
    "datasets": Link("datasets.html", "Data sets", "This run"),
    "run": Link("run.html", "How it was made", "This run"),
}
EXPLORERS = "Projections"


def experiment_link(page: str) -> str:
    """Return where the page on an experiment is."""
    return f"{EXPERIMENT_PAGES}/{page}.html"


def page_links(names: Sequence[str], groups: Sequence[str]) -> list[Link]:
    """Return links to those of the pages `names` that are of some groups, in their order."""
    return [
        Link(f"{name}.html", lead.title, lead.about)
        for name, lead in LEADS.items()
        if name in names and lead.about in groups
    ]


def navigation(
    experiments: Sequence[Link], pages: Sequence[str], explorers: Iterable[Link]
) -> list[Group]:
    """Return the navigation of a report, in the order in which it is shown.

    `experiments` are its pages on experiments, `pages` names those on ablations and on the virtual
    gripper, `explorers` those with scatter plots of recordings.
    """
    overview = Link(INDEX, "Overview", "Results")
    first = [overview, FIXED["paper"], *page_links(pages, ("Results",)), FIXED["results"]]
    listed = [Group("Results", tuple(first))]
    for about in dict.fromkeys(link.about for link in experiments):
        listed.append(Group(about, tuple(link for link in experiments if link.about == about)))
    listed.append(Group(EXPLORERS, tuple(explorers)))
    listed.append(Group("The virtual gripper", tuple(page_links(pages, ("The virtual gripper",)))))
    listed.append(Group("This run", (FIXED["datasets"], FIXED["run"])))
    return [group for group in listed if group.links]
