"""Model comparison: error of every model on every task against its time to train and to predict."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation_results import SHORTEST_S, models_of
from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, plain_ticks
from ajgdata.report.format import Caption, Source
from ajgdata.report.marks import pareto_front
from ajgdata.report.report_data import Illustration
from ajgdata.types import CROSS_VALIDATION
from ajgdata.types.table import Table, table_of

FIGURE_NAME = "models--error-against-time"
TEXT = (
    "Each mark is a model on a task: its error on held-out groups, divided by that of a guess."
    " Colours are tasks, shapes are models. A line is the Pareto front of a task: no model of the"
    " task has a lower error in the same time or less. Tasks with the same target and split are"
    " shown once, with the task that has most models."
)
COLUMNS = {
    "task": "Task",
    "model": "Model",
    "error": "Error over that of a guess",
    "train_cpu_s": "CPU time to train all folds, s",
    "prediction_ms": "Time to predict a recording, ms",
    "on_training_front": "On the front of error and training time",
    "on_prediction_front": "On the front of error and prediction time",
}
PANEL_IN = 4.2
#: Shapes of models; the tasks of the paper compare eleven.
SHAPES = "os^DvPX*<>ph8d"


@dataclass(frozen=True)
class ModelCost:
    """Error of a model on a task, over that of a guess, and its times."""

    task: str
    model: str
    error: float
    train_cpu_s: float
    prediction_ms: float


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the error against training and prediction time, if a task has two models or more."""
    tasks = compared_tasks(results)
    costs = [cost for task in tasks for cost in model_costs(task)]
    if not costs:
        return
    table = cost_table(costs)
    finding = conclusion(table)
    listed = "; ".join(
        f"{row['task']}, {row['model']}: {float(row['error']):.3g} in"
        f" {float(row['train_cpu_s']):.3g} s"
        for row in table.rows
    )
    sources = tuple(sorted({task.source for task in tasks}))
    yield Illustration(
        FIGURE_NAME,
        Caption(TEXT, f"{finding}. {listed}."),
        partial(draw_figure, table, finding, sources),
        finding,
        table,
    )


def compared_tasks(results: Sequence[TaskResults]) -> list[TaskResults]:
    """Return the tasks with two models or more; of equal targets and splits, the one with most."""
    by_question: dict[tuple[str, str, str], TaskResults] = {}
    for task in results:
        if task.experiment != CROSS_VALIDATION or len(task.results) < 2:
            continue
        question = task.dataset, task.task_settings.target, task.task_settings.groups
        known = by_question.get(question)
        if known is None or len(task.results) > len(known.results):
            by_question[question] = task
    return list(by_question.values())


def model_costs(task: TaskResults) -> list[ModelCost]:
    """Return error and times of each model of a task whose chance level is known."""
    costs = []
    target = task.task_settings.target.replace("_", " ")
    for model in models_of(task):
        guess = abs(model.chance() - model.perfect)
        if guess > 0:
            costs.append(
                ModelCost(
                    task=f"{task.dataset_title}, {target}, {split(task)}",
                    model=model.label,
                    error=model.error() / guess,
                    train_cpu_s=max(model.cost.train_cpu_s, SHORTEST_S),
                    prediction_ms=model.cost.prediction_ms,
                )
            )
    return costs


def split(task: TaskResults) -> str:
    """Return what a task holds out, for people."""
    return f"held-out {task.task_settings.groups.removesuffix('_id')}s"


def cost_table(costs: Sequence[ModelCost]) -> Table:
    """Return a row for each model and task, and whether it is on the Pareto fronts of its task."""
    rows = []
    for task in dict.fromkeys(cost.task for cost in costs):
        own = [cost for cost in costs if cost.task == task]
        error = np.array([cost.error for cost in own])
        training = pareto_front(np.array([cost.train_cpu_s for cost in own]), error)
        prediction = pareto_front(np.array([cost.prediction_ms for cost in own]), error)
        for cost, is_cheap_to_train, is_cheap_to_use in zip(own, training, prediction, strict=True):
            fronts = {
                "on_training_front": bool(is_cheap_to_train),
                "on_prediction_front": bool(is_cheap_to_use),
            }
            rows.append({**vars(cost), **fronts})
    return table_of("error-against-time", "Error against time", rows, **COLUMNS)


def conclusion(table: Table) -> str:
    """Return which model has the lowest error most often, and which is most often on the front."""
    tasks = list(table.split_by("task").values())
    best = Counter(min(task.rows, key=lambda row: row["error"])["model"] for task in tasks)
    front = Counter(row["model"] for task in tasks for row in task.rows if row["on_training_front"])
    accurate, wins = best.most_common(1)[0]
    frequent, times = front.most_common(1)[0]
    count = len(tasks)
    return (
        f"Lowest error: {accurate} ({wins} of {count} tasks);"
        f" on the Pareto front of error and time: {frequent} ({times})"
    )


def draw_figure(table: Table, title: str, sources: Sequence[Source]) -> Figure:
    """Draw the error over the training time, and over the prediction time."""
    tasks = list(table.split_by("task"))
    models = list(table.split_by("model"))
    colours = {task: COLOURS[index % len(COLOURS)] for index, task in enumerate(tasks)}
    markers = {model: SHAPES[index % len(SHAPES)] for index, model in enumerate(models)}
    legend_in = 0.2 * (len(tasks) + -(-len(models) // 3))
    figure = new_figure(
        (WIDTH_IN, PANEL_IN + legend_in),
        title,
        f"{len(tasks)} tasks, {len(models)} models",
        sources,
    )
    left, right = figure.subplots(1, 2, sharey=True)
    _draw_panel(left, table, "train_cpu_s", "on_training_front", colours, markers)
    _draw_panel(right, table, "prediction_ms", "on_prediction_front", colours, markers)
    left.set_ylabel("error over that of a guess")
    handles = [*_task_handles(colours), *_model_handles(markers)]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _draw_panel(
    axes: Axes,
    table: Table,
    time: str,
    front: str,
    colours: dict[str, str],
    markers: dict[str, str],
) -> None:
    """Draw the models of each task over a column of times, with the Pareto front of the task."""
    for task, rows in table.split_by("task").items():
        on_front = rows.where(**{front: True})
        order = np.argsort(on_front.numbers(time), kind="stable")
        axes.plot(
            on_front.numbers(time)[order],
            on_front.numbers("error")[order],
            color=colours[task],
            lw=0.9,
            zorder=1,
        )
        for row in rows.rows:
            face = colours[task] if row[front] else "white"
            axes.plot(
                float(row[time] or 0),
                float(row["error"] or 0),
                marker=markers[str(row["model"])],
                mfc=face,
                mec=colours[task],
                ms=5,
                ls="",
            )
    axes.axhline(1.0, color=GREY, ls=":", lw=1.0)
    axes.set(xscale="log", yscale="log", xlabel=COLUMNS[time])
    plain_ticks(axes.xaxis, (0.01, 0.1, 0.2, 0.5, 1, 2, 5, 10, 100))
    plain_ticks(axes.yaxis, (0.02, 0.05, 0.1, 0.2, 0.5, 1))


def _task_handles(colours: dict[str, str]) -> list[Line2D]:

    return [Line2D([], [], color=colour, label=task) for task, colour in colours.items()]


def _model_handles(markers: dict[str, str]) -> list[Line2D]:

    return [
        Line2D([], [], marker=marker, label=model, color=GREY, ls="")
        for model, marker in markers.items()
    ]
