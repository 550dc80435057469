"""What models make of silence -> figure and words."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.content import ElsewhereResult, SilentResult, TaskResult
from ajgdata.report.format import Caption, number, with_unit
from ajgdata.report.wording import headline, metric_name, task_name


def silent_name(task: tuple[TaskResult, ...]) -> str:
    """File name of the figure, without suffix."""
    return f"silent--{task[0].dataset}--{task[0].task}"


def silent_text(result: TaskResult, test: SilentResult) -> str:
    """Whether a model is flagged, in a sentence."""
    found = f"{test.measure} with the truth {number(test.value, 2)}"
    by_chance = f"{number(test.null, 2)} with labels exchanged, p = {number(test.p, 2)}"
    verdict = (
        "flagged: it has learned a sound that is not the object's"
        if test.flagged
        else "not flagged"
    )
    return f"{result.model_label} on {test.title}: {found}, {by_chance}: {verdict}."


@styled
def silent_figure(task: tuple[TaskResult, ...]) -> Figure:
    """Errors where models were trained and elsewhere, and what is left of them in silence."""
    first = task[0]
    figure = new_figure(
        (WIDTH_IN, 3.9),
        f"{task_name(first)} · what is learned?",
        f"{metric_name(first)}, mean ± sd over {first.folds} folds, and dependence on the truth "
        "of what is predicted from silence",
        [first.source],
    )
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    _errors(left, task)
    _silence(right, task)
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower left", ncols=2)
    return figure


def _sounding(result: TaskResult) -> list[ElsewhereResult]:
    """Where else a model was tested while something was played."""
    silent = {test.dataset for test in result.silent}
    return [other for other in result.elsewhere if other.part not in silent]


def _errors(axes: Axes, task: tuple[TaskResult, ...]) -> None:
    first = task[0]
    scale = 100 if first.kind == "classification" else 1
    unit = "%" if scale == 100 else first.unit
    elsewhere = (f"on {other.title}" for other in _sounding(first))
    titles = [f"held out of {first.dataset_title}", *elsewhere]
    width = 0.8 / len(titles)
    for i, title in enumerate(titles):
        scores = [r.score if i == 0 else _sounding(r)[i - 1].score for r in task]
        place = np.arange(len(task)) + (i - (len(titles) - 1) / 2) * width
        mean, sd = [scale * s.mean for s in scores], [scale * s.sd for s in scores]
        whiskers = {"lw": 1, "capsize": 2, "ecolor": "#333333"}
        axes.bar(
            place, mean, 0.9 * width, yerr=sd, color=COLOURS[i], label=title, error_kw=whiskers
        )
    axes.axhline(scale * first.chance, color=GREY, ls=":", lw=1.1, label="chance")
    axes.set_xticks(range(len(task)), [r.model_label for r in task])
    axes.grid(False, axis="x")
    axes.set_ylabel(f"{metric_name(first)} ({unit})" if unit else metric_name(first))


def _silence(axes: Axes, task: tuple[TaskResult, ...]) -> None:
    """A bar for each model, in another colour if it is flagged, with chance as a line across it."""
    tests = [(r, test) for r in task for test in r.silent]
    value = np.array([test.value for _, test in tests])
    colours = [COLOURS[3] if test.flagged else COLOURS[2] for _, test in tests]
    axes.bar(range(len(tests)), value, 0.6, color=colours)
    null = [test.null for _, test in tests]
    axes.hlines(null, np.arange(len(tests)) - 0.4, np.arange(len(tests)) + 0.4, color=GREY, ls=":")
    for x, (_, test) in enumerate(tests):
        text = f"{'flagged' if test.flagged else 'not flagged'}\np = {number(test.p, 2)}"
        top = (x, max(test.value, test.null))
        axes.annotate(text, top, (0, 3), textcoords="offset points", ha="center", fontsize=7.5)
    axes.set_xticks(range(len(tests)), [r.model_label for r, _ in tests])
    axes.grid(False, axis="x")
    axes.margins(y=0.25)
    axes.set_ylim(bottom=0)
    axes.set_ylabel(f"{tests[0][1].measure}, speaker silent")


def silent_caption(task: tuple[TaskResult, ...]) -> Caption:
    """Caption of `silent_figure`."""
    first = task[0]
    where = "; ".join(
        f"{r.model_label}: {headline(r)}"
        + "".join(f", {headline(r, o.score)} on {o.title}" for o in _sounding(r))
        for r in task
    )
    told = " ".join(silent_text(r, test) for r in task for test in r.silent)
    period = ""
    if first.period is not None:
        period = f" Errors are the shortest way round of {with_unit(number(first.period), '°')}."
    return Caption(
        f"Left: models of {task_name(first)} on grasps held out of their own data set and on the "
        f"same grasps elsewhere. Right: recordings with the speaker silent hold nothing of the "
        f"object; dotted: chance, labels of grasps exchanged. {told}{period}",
        f"{metric_name(first)} in several conditions. {where}. {told}",
    )
