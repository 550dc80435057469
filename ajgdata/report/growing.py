"""First page of a report that is still being computed: what is known, and what it waits for."""

from __future__ import annotations

from dataclasses import dataclass

from ajgdata.paths import Paths
from ajgdata.report.page import paper_cells
from ajgdata.report.panel import SIGNS, Panel
from ajgdata.report.render import render
from ajgdata.report.report_data import TaskSection


@dataclass(frozen=True)
class Waiting:
    """What is still computed of one data set: how many experiments, and which."""

    title: str
    count: int
    experiments: tuple[str, ...]


@dataclass(frozen=True)
class Growing:
    """`made` of `asked` experiments are there; `stopped`: the run ended before the rest; `failed`
    names its jobs that ended in an error, with their logs."""

    title: str
    made: int
    asked: int
    panels: tuple[Panel, ...]
    sections: tuple[TaskSection, ...]
    waiting: tuple[Waiting, ...]
    stopped: bool = False
    failed: tuple[str, ...] = ()


def render_growing(growing: Growing, project: Paths | None = None) -> str:
    """Return the page as HTML text: it needs no other file."""
    return render(
        "growing.html.j2",
        {},
        project=project,
        growing=growing,
        paper_cells=paper_cells,
        SIGNS=SIGNS,
    )
