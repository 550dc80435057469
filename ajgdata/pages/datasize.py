"""Number of training grasps: accuracy of each model, with the published number marked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from ajgdata.experiments.base import TaskResults
from ajgdata.pages.direct_labels import LineLabel, label_right
from ajgdata.pages.selection import alternative, first_on, paper_sentence
from ajgdata.report.canvas import GREY, WIDTH_IN, line_style, new_figure
from ajgdata.report.format import Caption, column_title, number, with_unit
from ajgdata.report.report_data import Illustration
from ajgdata.types.table import Table, table_of

PAGE = "datasize"


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the learning curves of all models, if they were measured."""
    task = first_on(results, PAGE, "learning_curve")
    if task is None:
        return
    table = curve_table(task)
    title = conclusion(task, table)
    text = (
        f"{task.dataset_title}, {task.source}. Lines: {task.metric_title} on the same held-out"
        " grasps, with the standard deviation over draws of the training grasps and seeds."
        f" {paper_sentence([task.paper])}"
    )
    listed = [
        f"{row['model']} with {row['grasps']}: {with_unit(number(row['value']), task.shown_unit)}"
        for row in table.rows
    ]
    yield Illustration(
        f"{task.dataset}--accuracy-against-grasps",
        Caption(text, alternative(title, listed)),
        partial(draw_figure, task, table, title),
        title,
        table,
        replaces=(task.named(),),
    )


def curve_table(task: TaskResults) -> Table:
    """Return mean and standard deviation over draws, as shown, by model and number of grasps."""
    rows = []
    for result in task.results:
        curve = result.tables["curve"].where(metric=task.metric)
        for grasps, draws in sorted(curve.split_by("groups").items()):
            values = task.scale * draws.numbers("value")
            rows.append(
                {
                    "model": result.label,
                    "grasps": grasps,
                    "value": values.mean(),
                    "sd": values.std(ddof=1) if len(values) > 1 else np.nan,
                    "draws": len(values),
                    "chance": task.scale * draws.numbers("chance").mean(),
                }
            )
    unit = task.shown_unit
    columns = {
        "model": "Model",
        "grasps": "Training grasps per class",
        "value": column_title(f"Mean {task.metric_title}", unit),
        "sd": column_title("Standard deviation over draws", unit),
        "draws": "Draws",
        "chance": column_title("Chance level", unit),
    }
    return table_of("accuracy-against-grasps", "Learning curves", rows, **columns)


def first_reaching(curve: Table, accuracy: float) -> int | None:
    """Return the smallest number of grasps whose mean reaches an accuracy; None if none does."""
    return next((row["grasps"] for row in curve.rows if row["value"] >= accuracy), None)


def conclusion(task: TaskResults, table: Table) -> str:
    """Return how many grasps the first model needs for the published accuracy.

    Without a published value, the accuracy with the most grasps is returned.
    """
    label = task.results[0].label
    curve = table.where(model=label)
    paper = task.paper
    if paper is None or paper.value is None or paper.reached is None:
        last = curve.rows[-1]
        value = with_unit(number(last["value"]), task.shown_unit)
        return f"{label}: {task.metric_title} {value} with {last['grasps']} training grasps"
    needed = first_reaching(curve, paper.reached)
    count = f"{needed}" if needed is not None else f"more than {curve.rows[-1]['grasps']}"
    text = (
        f"{label}: {number(paper.reached)} % requires {count} grasps (published {paper.published})"
    )
    at_published = curve.where(grasps=int(paper.value)).rows
    if at_published and needed != int(paper.value):
        reached = with_unit(number(at_published[0]["value"]), task.shown_unit)
        return f"{text}; {reached} with {number(paper.value)}"
    return text


def draw_figure(task: TaskResults, table: Table, title: str) -> Figure:
    """Draw a line for each model, the published point, and lines through this point."""
    figure = new_figure((WIDTH_IN, 3.8), title, task.dataset_title, [task.source])
    axes = figure.subplots()
    labels = []
    chance = float(np.nanmean(table.numbers("chance")))
    for index, (model, curve) in enumerate(table.split_by("model").items()):
        style = line_style(index)
        grasps = curve.numbers("grasps")
        values = curve.numbers("value")
        axes.errorbar(grasps, values, curve.numbers("sd"), capsize=2, elinewidth=0.7, **style)
        labels.append(LineLabel(model, float(values[-1]), style["color"]))
    axes.axhline(chance, color=GREY, ls=":", lw=1.0)
    labels.append(LineLabel("chance", chance, GREY))
    paper = task.paper
    if paper is not None and paper.value is not None and paper.reached is not None:
        axes.axhline(paper.reached, color="black", ls="--", lw=0.8)
        axes.axvline(paper.value, color="black", ls="--", lw=0.8)
        axes.plot([paper.value], [paper.reached], "*", color="black", ms=12)
        axes.annotate(
            f"published: {number(paper.value)} {paper.unit}\nfor {number(paper.reached)} %",
            (paper.value, paper.reached),
            (-6, 5),
            textcoords="offset points",
            fontsize=8,
            ha="right",
            va="bottom",
        )
    if task.task_settings.kind == "classification":
        axes.set_ylim(0, 100)
    places = sorted({*table.column("grasps")})
    axes.set_xticks(places, [str(place) for place in places])
    unit = f" ({task.shown_unit})" if task.shown_unit else ""
    axes.set(xlabel="training grasps per class", ylabel=f"{task.metric_title}{unit}")
    label_right(axes, labels)
    return figure
