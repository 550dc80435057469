"""Figures of all tasks of a report together: error against run time, and under other splits."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation import split_figures
from ajgdata.experiments.cross_validation.figures import SHORTEST, TIMES, label_times
from ajgdata.experiments.cross_validation.findings import cost_finding
from ajgdata.experiments.cross_validation.results import ModelResult, best_of, models_of
from ajgdata.report.blocks import Illustration
from ajgdata.report.canvas import GREY, WIDTH_IN, model_style, new_figure, pareto_front
from ajgdata.report.format import Caption, number
from ajgdata.report.labels import LABEL_PT, REFERENCES, label_end, wrapped

Task = tuple[ModelResult, ...]
COST = "error-against-run-time"
ANSWERS = "error-against-inference-time"
#: Figures of error against time by name: which time of a model, and what is done in it.
COSTS = {
    COST: ("train_s", "trains"),
    ANSWERS: ("inference_ms_per_recording", "answers"),
}
#: Panels side by side, and the height of one (in).
COLUMNS, PANEL_IN = 4, 1.45


def illustrations(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield what other splits say, where they were tried, and error against run time."""
    tasks = [models for models in map(models_of, results) if models]
    yield from split_figures.illustrations(_all(tasks))
    for name in COSTS if tasks else ():
        yield Illustration(name, cost_caption(tasks, name), partial(cost_figure, tasks, name))


def _all(tasks: Sequence[Task]) -> list[ModelResult]:
    return [model for models in tasks for model in models]


def cost_figure(tasks: Sequence[Task], name: str = COST) -> Figure:
    """Return normalised error against a time, a panel for each task, all of one scale."""
    time, doing = COSTS[name]
    columns, rows = min(len(tasks), COLUMNS), math.ceil(len(tasks) / COLUMNS)
    figure = new_figure(
        (WIDTH_IN, 1.3 + max(PANEL_IN * rows, 2.0)),
        cost_finding(tasks, time, doing),
        "error as a share of chance, mean ± sd over folds (of few recordings: 95 % interval); "
        "filled: beaten by none in both",
        [models[0].task.source for models in tasks],
    )
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    panels = grid.ravel().tolist()
    names = list(dict.fromkeys(model.result.model for model in _all(tasks)))
    wide = (WIDTH_IN - 1.4) / columns
    for axes, models in zip(panels, tasks, strict=False):
        _cost_panel(axes, models, time, names)
        axes.set_title("\n".join(wrapped(_task_name(models), wide, LABEL_PT)), fontsize=LABEL_PT)
    for axes in panels[len(tasks) :]:
        axes.set_visible(False)
    for i, axes in enumerate(panels[: len(tasks)]):
        if i + columns >= len(tasks):  # nothing stands below
            axes.tick_params(labelbottom=True)
            axes.set_xlabel("\n".join(wrapped(TIMES[time], wide, LABEL_PT)), fontsize=8)
        axes.axhline(1, **REFERENCES["chance"])
        if i % columns == columns - 1 or i == len(tasks) - 1:
            label_end(axes, None, 1, "chance", GREY)
    panels[0].set(xscale="log", ylim=(0, max(1.1, 1.08 * _highest(tasks))))
    panels[0].margins(x=0.12)
    label_times(panels[0])
    figure.supylabel("error (0 perfect, 1 chance)", fontsize=9)
    _model_legend(figure, tasks, names)
    return figure


def _highest(tasks: Sequence[Task]) -> float:
    """Return the highest error, or the end of its bar where that is not far above it."""
    return max(min(m.error.mean + m.error.bars()[1][0], 1.2 * m.error.mean) for m in _all(tasks))


def _cost_panel(axes: Axes, models: Task, time: str, names: Sequence[str]) -> None:
    """Draw the models of a task, hollow where beaten, and a line through its Pareto front."""
    times = np.array([getattr(m.cost, time) for m in models])
    error = np.array([m.error.mean for m in models])
    front = pareto_front(times, error)
    times = np.maximum(times, SHORTEST)
    order = np.flatnonzero(front)[np.argsort(times[front], kind="stable")]
    axes.plot(times[order], error[order], color=GREY, lw=1, label="Pareto front", zorder=1)
    for model, x, on_front in zip(models, times, front, strict=True):
        style = {**model_style(names.index(model.result.model)), "ls": "", "ms": 5.5}
        style["mfc"] = style["color"] if on_front else "white"
        axes.errorbar(x, model.error.mean, model.error.bars(), elinewidth=0.8, **style)


def _task_name(models: Task) -> str:
    task = models[0].task
    return task.title + (f" ({task.source})" if task.source == "recorded" else "")


def _model_legend(figure: Figure, tasks: Sequence[Task], names: Sequence[str]) -> None:
    """Name the markers, in one or two lines below the panels."""
    shapes = []
    for i, name in enumerate(names):
        labels = dict.fromkeys(m.label for m in _all(tasks) if m.result.model == name)
        style = {**model_style(i), "ls": "", "ms": 5.5}
        shapes.append(Line2D([], [], label=" / ".join(labels), **style))
    hollow: dict[str, Any] = {"marker": "o", "mfc": "white", "color": GREY, "ls": ""}
    shapes.append(Line2D([], [], label="beaten in error and time", **hollow))
    figure.legend(handles=shapes, loc="outside lower center", ncols=5)


def cost_caption(tasks: Sequence[Task], name: str = COST) -> Caption:
    """Return the caption of `cost_figure`."""
    time, doing = COSTS[name]
    unit = "s" if time == "train_s" else "ms"
    listed = "; ".join(
        f"{m.task.title}: {m.label}, {number(m.error.mean, 2)} of chance error "
        f"in {number(getattr(m.cost, time))} {unit}"
        for m in map(best_of, tasks)
    )
    return Caption(
        "Error against run time, a panel for each task. The error is RMSE / chance RMSE or "
        "(1 − accuracy) / (1 − chance accuracy), so that tasks share one axis: 0 is perfect, 1 is "
        "chance. Filled markers joined by a line form the Pareto front of a task, its models which "
        "no other beats in both error and time; hollow ones are beaten. Memory stands in the table "
        "of results. Times belong to the machine that made this page.",
        f"{cost_finding(tasks, time, doing)}. Normalised error against {TIMES[time]}. Lowest "
        f"errors: {listed}.",
    )
