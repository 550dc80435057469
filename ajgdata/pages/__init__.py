"""Figures of pages of the report: the figure of the paper is the first of its page.

A figure of a page is a plain function of all results of the report, in the module of this package
with the name of the page. It selects the results that it draws. It has no roles of columns, because
it draws results of several tasks or experiments, and it shows the published values.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from ajgdata.experiments.base import TaskResults
from ajgdata.pages import (
    baselines,
    datasize,
    embedding_distances,
    embedding_knn,
    embedding_projections,
    materials,
    media,
    noise,
    orientation,
    placement,
    size,
    sorting,
    ycb,
)
from ajgdata.report.comparison import Reason
from ajgdata.report.report_data import Illustration

#: Function of the results of the report, by the name of the page.
PAGE_FIGURES: dict[str, Callable[[Sequence[TaskResults]], Iterable[Illustration]]] = {
    baselines.PAGE: baselines.figures,
    datasize.PAGE: datasize.figures,
    embedding_distances.PAGE: embedding_distances.figures,
    embedding_knn.PAGE: embedding_knn.figures,
    embedding_projections.PAGE: embedding_projections.figures,
    materials.PAGE: materials.figures,
    media.PAGE: media.figures,
    noise.PAGE: noise.figures,
    orientation.PAGE: orientation.figures,
    placement.PAGE: placement.figures,
    size.PAGE: size.figures,
    sorting.PAGE: sorting.figures,
    ycb.PAGE: ycb.figures,
}
#: Functions that test causes of differences from the paper with the stored results. Other causes
#: need new measurements (`experiments.hypotheses`).
PAGE_CAUSES: tuple[Callable[[Sequence[TaskResults]], Iterable[Reason]], ...] = (orientation.causes,)


def page_causes(results: Sequence[TaskResults]) -> Iterator[Reason]:
    """Yield the tested causes that follow from the results of the experiments."""
    for causes in PAGE_CAUSES:
        yield from causes(results)


def page_figures(page: str, results: Sequence[TaskResults]) -> tuple[Illustration, ...]:
    """Return the figures of a page from all results; none for a page without its own figure."""
    figures = PAGE_FIGURES.get(page)
    return tuple(figures(results)) if figures else ()
