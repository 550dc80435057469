"""Figures of pages of the report: a page can begin with a figure of its own.

A figure of a page is a plain function of all results of the report, in a module of this package. It
selects the results that it draws, and has no roles of columns, because it draws results of several
tasks or experiments.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from ajgdata.experiments.base import TaskResults
from ajgdata.pages import models, noise, orientation, placement
from ajgdata.report.comparison import Reason
from ajgdata.report.report_data import Illustration

#: Function of the results of the report, by the name of the page.
PAGE_FIGURES: dict[str, Callable[[Sequence[TaskResults]], Iterable[Illustration]]] = {
    "baselines": models.figures,
    "noise": noise.figures,
    "orientation": orientation.figures,
    "placement": placement.figures,
}
#: Functions that test causes of differences from the paper with the stored results. Other causes
#: need new measurements (`ablations`).
PAGE_CAUSES: tuple[Callable[[Sequence[TaskResults]], Iterable[Reason]], ...] = (orientation.causes,)


def page_causes(results: Sequence[TaskResults]) -> Iterator[Reason]:
    """Yield the tested causes that follow from the results of a run without ablations."""
    for causes in PAGE_CAUSES:
        yield from causes(results)


def page_figures(page: str, results: Sequence[TaskResults]) -> tuple[Illustration, ...]:
    """Return the figures of a page from all results; none for a page without its own figure."""
    figures = PAGE_FIGURES.get(page)
    return tuple(figures(results)) if figures else ()
