"""Cube size: predicted against true edge, and the error of each size, trained and withheld."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.evaluate.parts import GROUPED, OVERALL, WITHHELD
from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation_results import TASK_PARTS, ModelResult, shown_model
from ajgdata.pages.selection import (
    alternative,
    first_on,
    paper_sentence,
    shown_value,
)
from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure
from ajgdata.report.format import Caption, column_title, number, with_unit
from ajgdata.report.report_data import Illustration
from ajgdata.types import CROSS_VALIDATION
from ajgdata.types.table import Table, table_of

PAGE = "size"
#: Parts of the task that are drawn, and their names.
SHOWN_PARTS = {GROUPED: "training sizes", WITHHELD: "withheld sizes"}


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield predictions and errors of the paper's model, if sizes were predicted."""
    task = first_on(results, PAGE, CROSS_VALIDATION)
    if task is None or task.task_settings.kind != "regression":
        return
    model = shown_model(task)
    table = error_table(model)
    title = conclusion(model)
    text = (
        f"{task.dataset_title}, {task.source}, {model.label}. Left: mean prediction of each size on"
        f" held-out grasps, with its standard deviation. Right: {task.metric_title} of each size."
        f" {paper_sentence([*task.papers.values()])}"
    )
    unit = task.task_settings.unit
    listed = [
        f"{row['values']}, {number(row['true'])} {unit}: mean prediction"
        f" {number(row['mean'])} {unit}, {task.metric_title} {number(row['rmse'])} {unit}"
        for row in table.rows
    ]
    yield Illustration(
        f"{task.dataset}--predicted-sizes",
        Caption(text, alternative(title, listed)),
        partial(draw_figure, model, table, title),
        title,
        table,
    )


def published_errors(task: TaskResults) -> Mapping[str, float]:
    """Return the published error of each part of the task that the paper reports."""
    errors = {}
    for part in (*SHOWN_PARTS, OVERALL):
        key, _ = TASK_PARTS[part]
        paper = task.papers.get(key)
        if paper is not None and paper.value is not None:
            errors[part] = float(paper.value)
    return errors


def target_title(task: TaskResults) -> str:
    """Return the target of a task with its unit: `edge (mm)`."""
    unit = task.task_settings.unit
    return f"{task.target_title} ({unit})" if unit else task.target_title


def error_table(model: ModelResult) -> Table:
    """Return mean, standard deviation and error of the predictions of each true size."""
    unit = model.task.task_settings.unit
    rows = []
    for part, name in SHOWN_PARTS.items():
        if not model.has(part):
            continue
        true, predicted = model.predictions(part)
        for size in np.unique(true):
            own = predicted[true == size]
            rows.append(
                {
                    "values": name,
                    "true": size,
                    "count": len(own),
                    "mean": own.mean(),
                    "sd": own.std(ddof=1) if len(own) > 1 else np.nan,
                    "rmse": np.sqrt(np.mean((own - size) ** 2)),
                }
            )
    columns = {
        "values": "Values",
        "true": column_title("True value", unit),
        "count": "Predictions",
        "mean": column_title("Mean prediction", unit),
        "sd": column_title("Standard deviation of the predictions", unit),
        "rmse": column_title("RMSE", unit),
    }
    return table_of("predicted-sizes", "Predicted sizes", rows, **columns)


def conclusion(model: ModelResult) -> str:
    """Return the error on training and on withheld sizes, with the published values."""
    task = model.task
    parts = [part for part in SHOWN_PARTS if model.has(part)]
    errors = ", ".join(
        f"{shown_value(task, model.score(part).mean)} ({SHOWN_PARTS[part]})" for part in parts
    )
    known = published_errors(task)
    numbers = [number(known[part]) for part in parts if part in known]
    text = f"{model.label}: {task.metric_title} {errors}"
    if not numbers:
        return text
    return f"{text}; published {with_unit(', '.join(numbers), task.task_settings.unit)}"


def draw_figure(model: ModelResult, table: Table, title: str) -> Figure:
    """Draw the predictions of each size (left), and their error (right)."""
    task = model.task
    figure = new_figure(
        (WIDTH_IN, 3.9), title, f"{task.dataset_title}: {model.label}", [task.source]
    )
    left, right = figure.subplots(1, 2, width_ratios=(1.15, 1))
    _draw_predictions(left, task, table)
    _draw_errors(right, task, table)
    return figure


def _draw_predictions(axes: Axes, task: TaskResults, table: Table) -> None:
    """Draw the mean prediction of each size, with a band of the published error."""
    ends = np.array([min(table.column("true")), max(table.column("true"))])
    overall = published_errors(task).get(OVERALL)
    if overall is not None:
        axes.fill_between(ends, ends - overall, ends + overall, color="#e9e4d8", lw=0)
        note = f"band: published RMSE\n± {number(overall)} {task.task_settings.unit}"
        axes.text(0.98, 0.03, note, transform=axes.transAxes, fontsize=8, ha="right", va="bottom")
    axes.plot(ends, ends, color=GREY, lw=0.9)
    for (name, rows), look in zip(table.split_by("values").items(), _looks(), strict=False):
        axes.errorbar(
            rows.numbers("true"),
            rows.numbers("mean"),
            rows.numbers("sd"),
            ls="",
            capsize=2,
            elinewidth=0.8,
            label=name,
            **look,
        )
    title = target_title(task)
    axes.set(xlabel=f"true {title}", ylabel=f"predicted {title}")
    axes.locator_params(nbins=6)
    axes.legend(loc="upper left", handletextpad=0.2)


def _draw_errors(axes: Axes, task: TaskResults, table: Table) -> None:
    """Draw the error of each size, with the published errors as lines."""
    known = published_errors(task)
    for (name, rows), look in zip(table.split_by("values").items(), _looks(), strict=False):
        axes.plot(rows.numbers("true"), rows.numbers("rmse"), ls="", **look)
        part = next(part for part, shown in SHOWN_PARTS.items() if shown == name)
        if part not in known:
            continue
        axes.axhline(known[part], color=look["color"], ls="--", lw=1.1)
        is_upper = known[part] == max(known.values())
        axes.annotate(
            f"published, {name}: {number(known[part])} {task.task_settings.unit}",
            (float(np.mean(table.numbers("true"))), known[part]),
            (0, 3 if is_upper else -3),
            textcoords="offset points",
            color=look["color"],
            fontsize=8,
            ha="center",
            va="bottom" if is_upper else "top",
        )
    highest = max([*known.values(), *table.column("rmse")])
    axes.set_ylim(0, 1.15 * highest)
    unit = task.task_settings.unit
    axes.set(xlabel=f"true {target_title(task)}", ylabel=f"RMSE of this size ({unit})")


def _looks() -> list[dict[str, Any]]:
    """Return colour and marker of training and of withheld sizes."""
    return [
        {"color": COLOURS[0], "marker": "o", "ms": 4.5},
        {"color": COLOURS[1], "marker": "s", "ms": 5, "mfc": "white", "mew": 1.4},
    ]
