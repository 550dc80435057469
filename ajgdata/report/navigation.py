"""Pages of the report and the navigation that all of them show."""

from __future__ import annotations

from collections.abc import Sequence
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
        "What becomes of stiff, light, heavy, tiny, huge and hot scenes: the energy of each stays "
        "bounded.",
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


def experiment_link(page: str) -> str:
    """Return where the page on an experiment is."""
    return f"{EXPERIMENT_PAGES}/{page}.html"


def navigation(experiments: Sequence[Link], pages: Sequence[str]) -> list[Group]:
    """Return the navigation of a report, in the order in which it is shown.

    `experiments` are its pages on experiments, `pages` names those on ablations and on the virtual
    gripper.
    """
    links = [Link(INDEX, "Overview", "Results"), FIXED["paper"]]
    studies = [Link(f"{n}.html", lead.title, lead.about) for n, lead in LEADS.items() if n in pages]
    links += [link for link in studies if link.about == "Results"]
    links += [FIXED["results"], *experiments]
    links += [link for link in studies if link.about != "Results"]
    links += [FIXED["datasets"], FIXED["run"]]
    groups: dict[str, list[Link]] = {}
    for link in links:
        groups.setdefault(link.about, []).append(link)
    return [Group(title, tuple(some)) for title, some in groups.items()]
