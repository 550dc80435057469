"""Which figures a report has: their file names, captions, and how to draw them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from ajgdata.report.comparisons import cost_figure, level_figure, split_figure, tradeoff_figure
from ajgdata.report.content import DatasetSummary, Report, TaskResult
from ajgdata.report.energy_figures import energy_caption, energy_figure
from ajgdata.report.experiments import (
    chance_caption,
    chance_figure,
    curve_caption,
    curve_figure,
    sorting_caption,
    sorting_figure,
)
from ajgdata.report.figures import prediction_figure, spectra_figure
from ajgdata.report.format import Caption
from ajgdata.report.job_times import stages_caption, stages_figure
from ajgdata.report.silent_figures import silent_caption, silent_figure, silent_name
from ajgdata.report.stft import stft_caption, stft_figure
from ajgdata.report.transfer_figures import transfer_caption, transfer_figure
from ajgdata.report.wording import (
    cost_caption,
    level_caption,
    prediction_caption,
    spectra_caption,
    split_caption,
    tradeoff_caption,
)

#: Fewer models of a task can be told apart in the figure of all tasks.
MANY_MODELS = 4
COST, SPLITS = "error-against-run-time", "random-against-grouped"
STAGES = "time-of-stages"


class Illustration(NamedTuple):
    """A figure that is not drawn yet, with its words."""

    caption: Caption
    draw: Callable[[], Figure]


def prediction_name(result: TaskResult) -> str:
    """File name, without suffix, of a result's figure."""
    return f"predictions--{result.dataset}--{result.task}--{result.model}"


def spectra_name(dataset: DatasetSummary) -> str:
    """File name, without suffix, of a data set's spectra."""
    return f"spectra--{dataset.name}"


def tradeoff_name(task: tuple[TaskResult, ...]) -> str:
    """File name, without suffix, of the figure that compares the models of a task."""
    return f"models--{task[0].dataset}--{task[0].task}"


def level_name(task: tuple[TaskResult, ...]) -> str:
    """File name, without suffix, of the figure of a task's errors at several levels."""
    return f"levels--{task[0].dataset}--{task[0].task}"


def illustrations(report: Report) -> dict[str, Illustration]:
    """Every figure of the report by name, in the order of the page; nothing is drawn yet.

    Raises ValueError if names of tasks and models run together to one file name.
    """
    listed = []
    if report.compared():
        listed.append((SPLITS, Illustration(split_caption(report), partial(split_figure, report))))
    if report.results:
        listed.append((COST, Illustration(cost_caption(report), partial(cost_figure, report))))
    for d in report.datasets:
        if d.spectra is not None:
            drawing = Illustration(spectra_caption(d), partial(spectra_figure, d))
            listed.append((spectra_name(d), drawing))
    for r in report.results:
        drawing = Illustration(prediction_caption(r), partial(prediction_figure, r))
        listed.append((prediction_name(r), drawing))
    listed += _of_tasks(report)
    if report.stages:
        sources = tuple(d.source for d in report.datasets)
        draw = partial(stages_figure, report.stages, sources)
        listed.append((STAGES, Illustration(stages_caption(report.stages), draw)))
    named = dict(listed)
    if len(named) != len(listed):
        raise ValueError("two figures would share a file name: rename a task ('--' in a name?)")
    return named


def _of_tasks(report: Report) -> list[tuple[str, Illustration]]:
    """Figures of whole tasks, not of single models."""
    listed = []
    for task in report.tasks():
        if len(task) >= MANY_MODELS:
            drawing = Illustration(tradeoff_caption(task), partial(tradeoff_figure, task))
            listed.append((tradeoff_name(task), drawing))
    for task in report.leveled():
        drawing = Illustration(level_caption(task), partial(level_figure, task))
        listed.append((level_name(task), drawing))
    for task in report.tasks():
        if task[0].silent:
            drawing = Illustration(silent_caption(task), partial(silent_figure, task))
            listed.append((silent_name(task), drawing))
    kinds: tuple[tuple[Sequence[Any], Any, Any], ...] = (
        (report.curves, curve_caption, curve_figure),
        (report.energies, energy_caption, energy_figure),
        (report.transfers, transfer_caption, transfer_figure),
        (report.tests, chance_caption, chance_figure),
        (report.stfts, stft_caption, stft_figure),
        (report.sorting, sorting_caption, sorting_figure),
    )
    for results, caption, figure in kinds:
        listed += [(r.name, Illustration(caption(r), partial(figure, r))) for r in results]
    return listed
