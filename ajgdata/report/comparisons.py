"""All results of a report -> the figures that compare them: error against time, and splits."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.content import Report, TaskResult, pareto_front
from ajgdata.report.format import Score, number
from ajgdata.report.wording import headline, metric_name, task_name

MARKERS = ("o", "s", "^", "D", "v", "P", "X")
TIMES = {
    "train_s": "training, all folds (s)",
    "inference_ms_per_recording": "inference, one recording alone (ms)",
}
#: Errors below this share of chance would be squeezed together on an axis that reaches it.
FAR_BELOW_CHANCE = 0.5
# A time measured as zero has no place on a log axis.
SHORTEST = 1e-4


def _marker_area(peak_memory_mb: float, largest_mb: float) -> float:
    """Area in points², proportional to memory, but never too small to see."""
    return 18 + 110 * peak_memory_mb / (largest_mb or 1)


@styled
def cost_figure(report: Report) -> Figure:
    """Normalised error against training time and inference time, one colour per task."""
    figure = new_figure(
        (WIDTH_IN, 3.9 + 0.17 * max(len(report.tasks()), 5)),
        "Error against run time",
        "normalised error of every model on every task",
        [r.source for r in report.results],
    )
    panels = figure.subplots(1, 2, sharey=True)
    models = dict.fromkeys(r.model for r in report.results)
    markers = {model: MARKERS[i % len(MARKERS)] for i, model in enumerate(models)}
    for axes, (time, label) in zip(panels, TIMES.items(), strict=True):
        _cost_panel(axes, report, time, markers)
        axes.set(xscale="log", xlabel=label)
        axes.margins(x=0.12)
        _label_times(axes)
    worst = max((r.error.mean for r in report.results), default=1.0)
    for axes in panels:
        _mark_chance(axes, worst)
    panels[1].tick_params(axis="y", length=0)
    panels[0].set_ylabel("error (0 perfect, 1 chance)")
    _cost_legends(figure, report, markers)
    return figure


def _mark_chance(axes: Axes, worst: float) -> None:
    """A line at chance; where all errors are far below it, the axis ends above them and says so."""
    far = worst < FAR_BELOW_CHANCE
    axes.set_ylim(0, 1.3 * worst if far and worst > 0 else max(1.08, 1.05 * worst))
    if not far:
        axes.axhline(1, color=GREY, ls=":", lw=1.1)
    axes.annotate(
        "chance is 1, far above" if far else "chance",
        (1, 1),
        (-2, -10 if far else 2),
        xycoords=("axes fraction", "axes fraction" if far else "data"),
        textcoords="offset points",
        ha="right",
        fontsize=8,
        color=GREY,
    )


def _label_times(axes: Axes) -> None:
    """Plain numbers at decades, and at 2 and 5 as well where the axis spans less than two."""
    low, high = axes.get_xlim()
    if high < 100 * low:
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda t, _: number(t)))
    axes.xaxis.set_minor_formatter(NullFormatter())


def _cost_panel(axes: Axes, report: Report, time: str, markers: dict[str, str]) -> None:
    """Every result as a marker, and a line through the Pareto front of each task."""
    largest = _largest_mb(report)
    for i, task in enumerate(report.tasks()):
        colour, line = _task_style(i)
        times = np.array([getattr(r.cost, time) for r in task])
        error = np.array([r.error.mean for r in task])
        front = pareto_front(times, error)
        times = np.maximum(times, SHORTEST)
        order = np.flatnonzero(front)[np.argsort(times[front])]
        axes.plot(times[order], error[order], color=colour, ls=line, lw=1.2, alpha=0.7)
        for r, x, on_front in zip(task, times, front, strict=True):
            axes.scatter(
                x,
                r.error.mean,
                s=_marker_area(r.cost.peak_memory_mb, largest),
                marker=markers[r.model],
                facecolor=colour if on_front else "white",
                edgecolor=colour,
                linewidth=1.2,
                zorder=3,
            )


def _task_style(index: int) -> tuple[str, str]:
    """Colour and line style of a task: the palette once solid, then once dashed, then dotted."""
    return COLOURS[index % len(COLOURS)], ("-", "--", ":")[index // len(COLOURS) % 3]


def _largest_mb(report: Report) -> float:
    return max((r.cost.peak_memory_mb for r in report.results), default=0.0)


def _cost_legends(figure: Figure, report: Report, markers: dict[str, str]) -> None:
    """Below the panels: tasks (colours); models (markers) and memory (areas)."""
    tasks = []
    for i, task in enumerate(report.tasks()):
        colour, line = _task_style(i)
        label = f"{task_name(task[0])} ({task[0].source})"
        tasks.append(Line2D([], [], color=colour, ls=line, lw=2, label=label))

    def grey(label: str, marker: str, area: float, face: str = GREY, line: str = "") -> Line2D:
        size = float(np.sqrt(area))
        return Line2D([], [], ls=line, marker=marker, c=GREY, mfc=face, ms=size, label=label)

    shapes = []
    for model, marker in markers.items():
        labels = dict.fromkeys(r.model_label for r in report.results if r.model == model)
        shapes.append(grey(" / ".join(labels), marker, 36))
    largest = _largest_mb(report)
    shapes += [grey("Pareto front", "o", 36, line="-"), grey("beaten", "o", 36, "white")]
    for memory in (largest / 4, largest):
        area = _marker_area(memory, largest)
        shapes.append(grey(f"{number(memory, 2)} MB", "o", area, "white"))
    figure.legend(handles=tasks, loc="outside lower left")
    figure.legend(handles=shapes, loc="outside lower right", ncols=2)


@styled
def tradeoff_figure(task: tuple[TaskResult, ...]) -> Figure:
    """The models of one task, in its own unit, against training time and inference time.

    Bars are one standard deviation over folds; a line joins the models that no other beats in both
    error and time.
    """
    first = task[0]
    figure = new_figure(
        (WIDTH_IN, 3.6),
        f"{task_name(first)} · models",
        f"{metric_name(first)} against run time, mean ± sd over {first.folds} folds",
        [first.source],
    )
    percent = first.kind == "classification"
    scale = 100 if percent else 1
    panels = figure.subplots(1, 2, sharey=True)
    for axes, (time, label) in zip(panels, TIMES.items(), strict=True):
        times = np.array([getattr(r.cost, time) for r in task])
        front = pareto_front(times, np.array([r.error.mean for r in task]))
        times = np.maximum(times, SHORTEST)
        score = np.array([r.score.mean for r in task]) * scale
        sd = np.array([r.score.sd for r in task]) * scale
        order = np.flatnonzero(front)[np.argsort(times[front], kind="stable")]
        axes.plot(times[order], score[order], color=GREY, lw=1.1, label="Pareto front")
        axes.axhline(first.chance * scale, color=GREY, ls=":", lw=1.1, label="chance")
        for i, r in enumerate(task):
            colour = COLOURS[i % len(COLOURS)]
            axes.errorbar(
                times[i], score[i], sd[i], color=colour, marker=MARKERS[i % len(MARKERS)],
                mfc=colour if front[i] else "white", ls="", capsize=2.5, label=r.model_label,
            )  # fmt: skip
        axes.set(xscale="log", xlabel=label)
        axes.margins(x=0.12)
        _label_times(axes)
    unit = "%" if percent else first.unit
    panels[0].set_ylabel(f"{metric_name(first)} ({unit})" if unit else metric_name(first))
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower left", ncols=5)
    return figure


@styled
def level_figure(task: tuple[TaskResult, ...]) -> Figure:
    """Headline metric of each model against the level of the recordings that it is tested on."""
    first = task[0]
    figure = new_figure(
        (WIDTH_IN, 3.4),
        f"{task_name(first)} · tested at other levels",
        f"{metric_name(first)}, mean ± sd over {first.folds} folds, never trained there",
        [first.source],
    )
    scale = 100 if first.kind == "classification" else 1
    axes = figure.subplots()
    for i, r in enumerate(task):
        levels = [level.value for level, _ in r.levels()]
        mean = [scale * score.mean for _, score in r.levels()]
        sd = [scale * score.sd for _, score in r.levels()]
        style: dict[str, Any] = {
            "color": COLOURS[i % len(COLOURS)],
            "marker": MARKERS[i % len(MARKERS)],
        }
        axes.errorbar(levels, mean, sd, capsize=2.5, label=r.model_label, **style)
    axes.axhline(first.chance * scale, color=GREY, ls=":", lw=1.1, label="chance")
    level = first.levels()[0][0]
    unit = "%" if scale == 100 else first.unit
    axes.set_xlabel(f"{level.quantity} ({level.unit})" if level.unit else level.quantity)
    axes.set_ylabel(f"{metric_name(first)} ({unit})" if unit else metric_name(first))
    axes.set_ylim(bottom=0)
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


@styled
def split_figure(report: Report) -> Figure:
    """Grouped against random split: two bars per task and model.

    Raises ValueError if no result was evaluated on both.
    """
    compared = report.compared()
    if not compared:
        raise ValueError("no task compares a random with a grouped split: set compare_random")
    figure = new_figure(
        (WIDTH_IN, 1.7 + 0.46 * len(compared)),
        "Random against grouped splits",
        "normalised error, mean ± sd over folds",
        [r.source for r in compared],
    )
    axes = figure.subplots()
    axes.grid(False, axis="y")
    grouped = [r.score for r in compared]
    random = [r.random_split for r in compared if r.random_split]
    _split_bars(axes, compared, grouped, offset=-0.19, colour=COLOURS[0], label="grouped")
    _split_bars(axes, compared, random, offset=0.19, colour=COLOURS[5], label="random")
    if max(r.error.mean for r in compared) >= FAR_BELOW_CHANCE:
        axes.axvline(1, color=GREY, ls=":", lw=1.1)
    labels = [f"{task_name(r)}\n{r.model_label} ({r.source})" for r in compared]
    axes.set_yticks(range(len(compared)), labels)
    axes.tick_params(axis="y", length=0)
    axes.invert_yaxis()
    axes.set_xlabel("error (0 perfect, 1 chance)")
    axes.margins(x=0.18, y=0.03)
    axes.set_xlim(left=0)
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, borderaxespad=0.2)
    return figure


def _split_bars(
    axes: Axes,
    compared: list[TaskResult],
    scores: list[Score],
    *,
    offset: float,
    colour: str,
    label: str,
) -> None:
    """One bar per result; the text at its end is in the unit of the task."""
    place = np.arange(len(compared)) + offset
    errors = [r.normalise(s) for r, s in zip(compared, scores, strict=True)]
    mean, sd = [e.mean for e in errors], [e.sd for e in errors]
    whiskers = {"lw": 1, "capsize": 2, "ecolor": "#333333"}
    axes.barh(place, mean, 0.34, xerr=sd, color=colour, label=label, error_kw=whiskers)
    for y, r, s, e in zip(place, compared, scores, errors, strict=True):
        tip = (e.mean + e.sd, y)
        text = headline(r, s)
        axes.annotate(text, tip, (5, 0), textcoords="offset points", va="center", fontsize=7.5)
