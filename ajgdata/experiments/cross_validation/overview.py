"""Figures of all tasks of a report together: error against run time, random against grouped."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation.figures import SHORTEST, TIMES, label_times
from ajgdata.experiments.cross_validation.results import ModelResult, best_of, models_of
from ajgdata.report.blocks import Illustration
from ajgdata.report.canvas import COLOURS, GREY, MARKERS, WIDTH_IN, new_figure, pareto_front
from ajgdata.report.format import Caption, Score, number

Task = tuple[ModelResult, ...]
COST, SPLITS = "error-against-run-time", "random-against-grouped"
#: Errors below this share of chance would be squeezed together on an axis that reaches it.
FAR_BELOW_CHANCE = 0.5


def illustrations(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield what a random split hides, where it was tried, and error against run time."""
    tasks = [models for models in map(models_of, results) if models]
    if compared := [m for models in tasks for m in models if m.random]:
        yield Illustration(SPLITS, split_caption(compared), partial(split_figure, compared))
    if tasks:
        yield Illustration(COST, cost_caption(tasks), partial(cost_figure, tasks))


def _all(tasks: Sequence[Task]) -> list[ModelResult]:
    return [model for models in tasks for model in models]


def _marker_area(peak_memory_mb: float, largest_mb: float) -> float:
    """Return the area in points², proportional to memory, but never too small to see."""
    return 18 + 110 * peak_memory_mb / (largest_mb or 1)


def cost_figure(tasks: Sequence[Task]) -> Figure:
    """Return normalised error against training and inference time, one colour per task."""
    figure = new_figure(
        (WIDTH_IN, 3.9 + 0.17 * max(len(tasks), 5)),
        "Error against run time",
        "normalised error of every model on every task",
        [models[0].task.source for models in tasks],
    )
    panels = figure.subplots(1, 2, sharey=True)
    names = dict.fromkeys(model.result.model for model in _all(tasks))
    markers = {name: MARKERS[i % len(MARKERS)] for i, name in enumerate(names)}
    for axes, (time, label) in zip(panels, TIMES.items(), strict=True):
        _cost_panel(axes, tasks, time, markers)
        axes.set(xscale="log", xlabel=label)
        axes.margins(x=0.12)
        label_times(axes)
    worst = max((model.error.mean for model in _all(tasks)), default=1.0)
    for axes in panels:
        _mark_chance(axes, worst)
    panels[1].tick_params(axis="y", length=0)
    panels[0].set_ylabel("error (0 perfect, 1 chance)")
    _cost_legends(figure, tasks, markers)
    return figure


def _mark_chance(axes: Axes, worst: float) -> None:
    """Draw a line at chance; an axis that ends far below it says so instead."""
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


def _cost_panel(axes: Axes, tasks: Sequence[Task], time: str, markers: dict[str, str]) -> None:
    """Draw every result as a marker, and a line through the Pareto front of each task."""
    largest = _largest_mb(tasks)
    for i, models in enumerate(tasks):
        colour, line = _task_style(i)
        times = np.array([getattr(m.cost, time) for m in models])
        error = np.array([m.error.mean for m in models])
        front = pareto_front(times, error)
        times = np.maximum(times, SHORTEST)
        order = np.flatnonzero(front)[np.argsort(times[front])]
        axes.plot(times[order], error[order], color=colour, ls=line, lw=1.2, alpha=0.7)
        for model, x, on_front in zip(models, times, front, strict=True):
            axes.scatter(
                x,
                model.error.mean,
                s=_marker_area(model.cost.peak_memory_mb, largest),
                marker=markers[model.result.model],
                facecolor=colour if on_front else "white",
                edgecolor=colour,
                linewidth=1.2,
                zorder=3,
            )


def _task_style(index: int) -> tuple[str, str]:
    """Return colour and line style of a task: the palette once solid, then dashed, then dotted."""
    return COLOURS[index % len(COLOURS)], ("-", "--", ":")[index // len(COLOURS) % 3]


def _largest_mb(tasks: Sequence[Task]) -> float:
    return max((model.cost.peak_memory_mb for model in _all(tasks)), default=0.0)


def _cost_legends(figure: Figure, tasks: Sequence[Task], markers: dict[str, str]) -> None:
    """Draw, below the panels: tasks (colours); models (markers) and memory (areas)."""
    named = []
    for i, models in enumerate(tasks):
        colour, line = _task_style(i)
        label = f"{models[0].task.title} ({models[0].task.source})"
        named.append(Line2D([], [], color=colour, ls=line, lw=2, label=label))

    def grey(label: str, marker: str, area: float, face: str = GREY, line: str = "") -> Line2D:
        size = float(np.sqrt(area))
        return Line2D([], [], ls=line, marker=marker, c=GREY, mfc=face, ms=size, label=label)

    shapes = []
    for name, marker in markers.items():
        labels = dict.fromkeys(m.label for m in _all(tasks) if m.result.model == name)
        shapes.append(grey(" / ".join(labels), marker, 36))
    largest = _largest_mb(tasks)
    shapes += [grey("Pareto front", "o", 36, line="-"), grey("beaten", "o", 36, "white")]
    for memory in (largest / 4, largest):
        area = _marker_area(memory, largest)
        shapes.append(grey(f"{number(memory, 2)} MB", "o", area, "white"))
    figure.legend(handles=named, loc="outside lower left")
    figure.legend(handles=shapes, loc="outside lower right", ncols=2)


def cost_caption(tasks: Sequence[Task]) -> Caption:
    """Return the caption of `cost_figure`."""
    listed = "; ".join(
        f"{m.task.title}: {m.label}, {number(m.error.mean, 2)} of chance error "
        f"in {number(m.cost.train_s)} s"
        for m in map(best_of, tasks)
    )
    return Caption(
        "Error against run time. The error is RMSE / chance RMSE or (1 − accuracy) / "
        "(1 − chance accuracy), so that tasks share one axis: 0 is perfect, 1 is chance. Filled "
        "markers joined by a line form the Pareto front of a task, its models which no other beats "
        "in both error and time; hollow ones are beaten. The area of a marker is peak memory. "
        "Times belong to the machine that made this page.",
        f"Normalised error against training and inference time. Lowest errors: {listed}.",
    )


def split_figure(compared: Sequence[ModelResult]) -> Figure:
    """Return grouped against random split: two bars per task and model."""
    figure = new_figure(
        (WIDTH_IN, 1.7 + 0.46 * len(compared)),
        "Random against grouped splits",
        "normalised error, mean ± sd over folds",
        [m.task.source for m in compared],
    )
    axes = figure.subplots()
    axes.grid(False, axis="y")
    grouped = [m.score() for m in compared]
    random = [m.random for m in compared if m.random]
    _split_bars(axes, compared, grouped, offset=-0.19, colour=COLOURS[0], label="grouped")
    _split_bars(axes, compared, random, offset=0.19, colour=COLOURS[5], label="random")
    if max(m.error.mean for m in compared) >= FAR_BELOW_CHANCE:
        axes.axvline(1, color=GREY, ls=":", lw=1.1)
    labels = [f"{m.task.title}\n{m.label} ({m.task.source})" for m in compared]
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
    compared: Sequence[ModelResult],
    scores: Sequence[Score],
    *,
    offset: float,
    colour: str,
    label: str,
) -> None:
    """Draw one bar per result; the text at its end is in the unit of the task."""
    place = np.arange(len(compared)) + offset
    errors = [m.normalise(s) for m, s in zip(compared, scores, strict=True)]
    mean, sd = [e.mean for e in errors], [e.sd for e in errors]
    whiskers = {"lw": 1, "capsize": 2, "ecolor": "#333333"}
    axes.barh(place, mean, 0.34, xerr=sd, color=colour, label=label, error_kw=whiskers)
    style: dict[str, Any] = {"textcoords": "offset points", "va": "center", "fontsize": 7.5}
    for y, m, s, e in zip(place, compared, scores, errors, strict=True):
        axes.annotate(m.shown(s), (e.mean + e.sd, y), (5, 0), **style)


def split_caption(compared: Sequence[ModelResult]) -> Caption:
    """Return the caption of `split_figure`."""
    listed = "; ".join(
        f"{m.task.title}, {m.label}: {m.shown()} grouped, {m.shown(m.random)} random"
        for m in compared
    )
    gained = [
        f"{m.task.title}, {m.label}: {1 - m.normalise(m.random).mean / m.error.mean:.0%}"
        for m in compared
        if m.random and m.error.mean > 0
    ]
    return Caption(
        "The same models and recordings under two splits. Grouped: no group on both sides (used "
        "everywhere else on this page). Random: groups ignored. Error as a share of chance, mean ± "
        "one standard deviation over folds. Error that the random split hides: "
        f"{'; '.join(gained)}.",
        f"Normalised error of grouped and random splits. {listed}.",
    )
