"""A small figure of all tasks: error against training time, for the first screen of a report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation.figures import SHORTEST
from ajgdata.experiments.cross_validation.results import ModelResult, best_of, models_of
from ajgdata.report.blocks import Illustration
from ajgdata.report.canvas import GREY, model_style, pareto_front, plain_ticks
from ajgdata.report.cost_panels import LABEL_PT, NEAR, ONE_TWO_FIVE, draw_front, panel_figure
from ajgdata.report.format import Caption, number, words

Task = tuple[ModelResult, ...]
PANEL = "cost-of-models"
#: As many tasks can be named beside the axes; the others are drawn.
MOST_NAMES = 13
FRONT = "#b5b5b5"


def cost_panel(results: Sequence[TaskResults]) -> Illustration | None:
    """Return error over training time of every model on every task; None where there is none."""
    tasks = different([models for models in map(models_of, results) if models])
    if not tasks:
        return None
    return Illustration(PANEL, _caption(tasks), partial(panel, tasks))


def different(tasks: Sequence[Task]) -> list[Task]:
    """Return the tasks that are no repetition of another.

    One whose models all err to the last digit as they do on another task of its data set tells
    nothing of its own: it asks the same question again, of other test sets or of fewer models.
    """
    told = [{(m.result.model, m.error.mean) for m in models} for models in tasks]
    named = [models[0].task.dataset for models in tasks]

    def repeats(i: int, j: int) -> bool:
        same = named[i] == named[j]
        return same and (told[i] < told[j] or (told[i] == told[j] and j < i))

    each = range(len(tasks))
    return [tasks[i] for i in each if not any(repeats(i, j) for j in each)]


def task_names(tasks: Sequence[Task]) -> list[str]:
    """Return the shortest name of each task: its data set's, where it has no other."""
    count = Counter(models[0].task.dataset for models in tasks)
    named = []
    for task in (models[0].task for models in tasks):
        both = f"{task.dataset} {task.task}" if task.task != task.dataset else task.dataset
        named.append(words(both if count[task.dataset] > 1 else task.dataset))
    return named


def _finding(tasks: Sequence[Task]) -> str:
    """Return which model errs least most often, and what its training costs beside the fastest."""
    best = [best_of(models) for models in tasks]
    (name, won), *_ = Counter(model.result.model for model in best).most_common()
    label = _label(tasks, name)
    tried = sum(any(m.result.model == name for m in models) for models in tasks)
    ratios = [
        m.cost.train_s / max(SHORTEST, min(other.cost.train_s for other in models))
        for models in tasks
        for m in models
        if m.result.model == name
    ]
    ratio = float(np.median(ratios))
    cost = f"trains {number(ratio, 2)} × as long as the fastest" if ratio > 1 else "trains fastest"
    return f"{label} errs least on {won} of {tried} tasks; it {cost}"


def _label(tasks: Sequence[Task], name: str) -> str:
    """Return a model's name for people: of both kinds of task where they share one."""
    labels = {m.label for models in tasks for m in models if m.result.model == name}
    return labels.pop() if len(labels) == 1 else words(name)


def panel(tasks: Sequence[Task]) -> Figure:
    """Return every model as a marker, the Pareto front of each task, and names beside them."""
    sources = [models[0].task.source for models in tasks]
    figure = panel_figure(_finding(tasks), "models × tasks", sources)
    axes = figure.subplots()
    usual = _usual(tasks)
    for models in tasks:
        _draw_task(axes, models, usual)
    axes.grid(False)
    worst = max(m.error.mean for models in tasks for m in models)
    axes.set(xscale="log", ylim=(0, max(1.12, 1.05 * worst)), ylabel="error (1 is chance)")
    axes.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axes.set_xlabel("training, all folds (s)")
    axes.axhline(1, color=GREY, ls=":", lw=1.0)
    axes.margins(x=0.06)
    axes.set_xlim(axes.get_xlim())  # lines to the right end shall not move it
    plain_ticks(axes.xaxis, [tick for tick in ONE_TWO_FIVE if str(tick).strip("0.")[0] == "1"])
    _name_models(axes, tasks, usual)
    _name_tasks(axes, tasks)
    return figure


def _usual(tasks: Sequence[Task]) -> dict[str, dict[str, Any]]:
    """Return colour and marker of the models of several tasks, by name."""
    count = Counter(m.result.model for models in tasks for m in models)
    least = min(2, len(tasks))
    names = [name for name in count if count[name] >= least]
    return {name: model_style(index) for index, name in enumerate(names)}


def _draw_task(axes: Axes, models: Task, usual: dict[str, dict[str, Any]]) -> None:
    """Draw the models of a task, and their front; name those on it that no other task has."""
    times, errors = _times(models), np.array([m.error.mean for m in models])
    front = draw_front(axes, times, errors, color=FRONT, lw=0.9)
    for index, model in enumerate(models):
        style = usual.get(model.result.model, {"color": "#555555", "marker": "D"})
        face = style["color"] if index in front else "white"
        axes.plot(
            times[index], errors[index], **style, ls="", ms=4, mfc=face, mew=0.9, zorder=3,
            label=model.label,
        )  # fmt: skip
        if index in front and model.result.model not in usual:
            where = (times[index], errors[index]), (0, 5)
            axes.annotate(model.label, *where, color="#555555", ha="center", **NEAR)


def _times(models: Task) -> np.ndarray:
    return np.maximum([m.cost.train_s for m in models], SHORTEST)


def _name_models(axes: Axes, tasks: Sequence[Task], usual: dict[str, dict[str, Any]]) -> None:
    """Write the models of several tasks above their markers, each at its median time."""
    place: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "ha": "center"}
    for row, (name, style) in enumerate(usual.items()):
        times = [m.cost.train_s for models in tasks for m in models if m.result.model == name]
        at = max(float(np.median(times)), SHORTEST), 1
        bold = {"color": style["color"], "fontweight": "bold"}
        axes.annotate(_label(tasks, name), at, (0, 2 + 9 * (row % 2)), **bold, **place, **NEAR)


def _name_tasks(axes: Axes, tasks: Sequence[Task]) -> None:
    """Write each task beside the axes; its front goes on to the right at its least error."""
    least = [best_of(models).error.mean for models in tasks]
    names, (high, right) = task_names(tasks), (axes.get_ylim()[1], axes.get_xlim()[1])
    for models, error in zip(tasks, least, strict=True):
        begin = max(best_of(models).cost.train_s, SHORTEST)
        axes.plot([begin, right], [error, error], color=FRONT, lw=0.9, ls=(0, (1, 1)), zorder=1)
    shown = np.argsort(least, kind="stable")[:MOST_NAMES]
    for i, height in zip(shown, np.linspace(0, 1, len(shown)), strict=True):
        line = {"arrowstyle": "-", "color": FRONT, "lw": 0.9, "shrinkA": 1, "shrinkB": 0}
        axes.annotate(
            names[i],
            (1, least[i] / high),
            (1.05, height),
            xycoords="axes fraction",
            va="center",
            fontsize=LABEL_PT - 0.5,
            color="#444444",
            annotation_clip=False,
            arrowprops={**line, "relpos": (0, 0.5)},
        )


def _caption(tasks: Sequence[Task]) -> Caption:
    listed = "; ".join(
        f"{name}: {best.label}, {number(best.error.mean, 2)} of chance error in "
        f"{number(best.cost.train_s, 2)} s"
        for name, best in zip(task_names(tasks), map(best_of, tasks), strict=True)
    )
    beaten = sum(int(np.sum(~_on_front(models))) for models in tasks)
    return Caption(
        "Normalised error of held-out grasps (RMSE / chance RMSE, or (1 − accuracy) / (1 − chance "
        "accuracy)) over the time to train all folds. Filled markers and lines: Pareto front of "
        f"each task; hollow: the {beaten} that another model of the task beats in both. A task "
        "that repeats another is left out. Times belong to the machine that made this page.",
        f"{_finding(tasks)}. Least error of each task: {listed}.",
    )


def _on_front(models: Task) -> np.ndarray:
    return pareto_front(_times(models), np.array([m.error.mean for m in models]))
