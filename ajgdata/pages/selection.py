"""Results of a page: which tasks its figure draws, and texts that all figures of pages share."""

from __future__ import annotations

from collections.abc import Sequence

from ajgdata.experiments.base import TaskResults
from ajgdata.report.comparison import PaperFigure
from ajgdata.report.format import number, with_unit

#: Largest number of letters of a title.
MAX_TITLE = 90
PAPER_SENTENCE = "The paper, on its real gripper: {}."


def tasks_on(results: Sequence[TaskResults], page: str, experiment: str) -> list[TaskResults]:
    """Return the results of an experiment on a page, those that are compared with the paper first.

    Args:
        results: All results of the report.
        page: Name of the page.
        experiment: Name of the experiment.
    """
    own = [task for task in results if (task.page, task.experiment) == (page, experiment)]
    return sorted(own, key=lambda task: not task.papers)


def first_on(results: Sequence[TaskResults], page: str, experiment: str) -> TaskResults | None:
    """Return the task of a page that its figure draws: one that is compared with the paper, if any.

    Other data sets of the page vary one condition, so they are in the folded figures only.
    """
    return next(iter(tasks_on(results, page, experiment)), None)


def published(paper: PaperFigure | None) -> str:
    """Return the published value for a title: `2.7 mm`, or a few words; "" without."""
    return paper.published if paper is not None else ""


def paper_sentence(papers: Sequence[PaperFigure | None]) -> str:
    """Return what the paper reports as a sentence; "" if it reports nothing."""
    texts = dict.fromkeys(paper.text for paper in papers if paper is not None)
    return PAPER_SENTENCE.format("; ".join(texts)) if texts else ""


def shown_value(task: TaskResults, value: float) -> str:
    """Return a value of the metric of a task as it is shown, with its unit: `83.1 %`."""
    return with_unit(number(task.scale * value), task.shown_unit)


def percent(share: float) -> str:
    """Return a share between 0 and 1 in whole per cent: `4 %`, `<1 %` and `>99 %` near the ends."""
    if 0 < share < 0.01:
        return "<1 %"
    if 0.99 < share < 1:
        return ">99 %"
    return f"{100 * share:.0f} %"


def alternative(title: str, lines: Sequence[str]) -> str:
    """Return the alternative text of a figure: its title, and its numbers."""
    return f"{title}. {'; '.join(lines)}."
