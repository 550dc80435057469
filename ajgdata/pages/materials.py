"""Materials: confusion matrices of spheres and plates, with the accuracy of their placebos."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.evaluate.parts import GROUPED
from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation_results import TASK_PARTS, shown_model
from ajgdata.pages.confusions import draw_matrix, share_matrix
from ajgdata.pages.selection import alternative, paper_sentence, shown_value, tasks_on
from ajgdata.report.canvas import WIDTH_IN, new_figure
from ajgdata.report.comparison import PaperFigure
from ajgdata.report.format import Caption, number, words
from ajgdata.report.report_data import Illustration
from ajgdata.types import CROSS_VALIDATION
from ajgdata.types.table import Table, table_of

PAGE = "materials"
#: Published results in the order of the panels.
ORDER = ("materials-sphere80", "materials-plate", "materials-sphere30")
COLUMNS = {
    "shape": "Objects",
    "true": "True material",
    "predicted": "Predicted material",
    "share": "Share",
    "accuracy": "Accuracy, %",
    "placebo": "Accuracy of the placebo, %",
    "chance": "Chance level, %",
}


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the confusion matrices of the paper's model, if materials were classified."""
    tasks = compared_tasks(results)
    if not tasks:
        return
    placebos = [placebo_accuracy(task) for task in tasks]
    table = share_table(tasks, placebos)
    title = conclusion(tasks)
    label = shown_model(tasks[0]).label
    is_controlled = any(placebo is not None for placebo in placebos)
    placebo_text = (
        " Placebo: accuracy for identical objects with the names of the materials, which is the"
        " real chance level."
        if is_controlled
        else ""
    )
    text = (
        f"Predictions of the {label} on held-out grasps, {tasks[0].source}: share of the recordings"
        f" of each true material, in per cent.{placebo_text}"
        f" {paper_sentence([paper_of(task) for task in tasks])}"
    )
    listed = [
        f"{shape_of(task)}: {', '.join(_accuracies(task, placebo))}"
        for task, placebo in zip(tasks, placebos, strict=True)
    ]
    shares = [
        f"{row['shape']}, {row['true']} as {row['predicted']}: {number(100 * row['share'], 2)} %"
        for row in table.rows
        if row["share"] > 0
    ]
    yield Illustration(
        "materials--confusions",
        Caption(text, alternative(title, [*listed, *shares])),
        partial(draw_figure, tasks, placebos, title),
        title,
        table,
        replaces=tuple(task.named("predictions") for task in tasks),
    )


def compared_tasks(results: Sequence[TaskResults]) -> list[TaskResults]:
    """Return the classifications that are compared with the paper, in the paper's order."""
    tasks = [
        task
        for task in tasks_on(results, PAGE, CROSS_VALIDATION)
        if task.task_settings.kind == "classification" and paper_of(task) is not None
    ]
    return sorted(tasks, key=_place)


def _place(task: TaskResults) -> int:
    """Return the place of the panel of a task."""
    paper = paper_of(task)
    return ORDER.index(paper.id) if paper is not None and paper.id in ORDER else len(ORDER)


def paper_of(task: TaskResults) -> PaperFigure | None:
    """Return the published accuracy for held-out grasps."""
    return task.papers.get(TASK_PARTS[GROUPED][0])


def placebo_accuracy(task: TaskResults) -> float | None:
    """Return the accuracy, as shown, for identical objects under the names of the classes.

    None if the model was not evaluated on a placebo.
    """
    score = shown_model(task).placebo()
    return task.scale * score.mean if score is not None else None


def shape_of(task: TaskResults) -> str:
    """Return the objects of a task: `80 mm spheres`."""
    paper = paper_of(task)
    return paper.row if paper is not None and paper.row else task.dataset_title


def share_table(tasks: Sequence[TaskResults], placebos: Sequence[float | None]) -> Table:
    """Return the share of each predicted class in each true class, with the accuracies."""
    rows = []
    for task, placebo in zip(tasks, placebos, strict=True):
        model = shown_model(task)
        classes = model.classes
        shares = share_matrix(task, classes)
        for i, true in enumerate(classes):
            for j, predicted in enumerate(classes):
                rows.append(
                    {
                        "shape": shape_of(task),
                        "true": words(true),
                        "predicted": words(predicted),
                        "share": shares[i, j],
                        "accuracy": task.scale * model.score().mean,
                        "placebo": placebo,
                        "chance": task.scale * model.chance(),
                    }
                )
    return table_of("confusions", "Predicted materials", rows, **COLUMNS)


def conclusion(tasks: Sequence[TaskResults]) -> str:
    """Return the accuracy for each shape, and the chance level."""
    listed = [
        f"{shown_value(task, shown_model(task).score().mean)} for {shape_of(task)}"
        for task in tasks
    ]
    chance = shown_value(tasks[0], shown_model(tasks[0]).chance())
    return f"{shown_model(tasks[0]).label}: {', '.join(listed)} (chance {chance})"


def _accuracies(task: TaskResults, placebo: float | None) -> list[str]:
    """Return our accuracy, the published accuracy, and that of the placebo, if it is known."""
    lines = [f"accuracy {shown_value(task, shown_model(task).score().mean)}"]
    paper = paper_of(task)
    if paper is not None:
        known = f"{number(paper.value)} %" if paper.value is not None else paper.published
        lines.append(f"published {known}")
    if placebo is not None:
        lines.append(f"placebo {number(placebo)} %")
    return lines


def draw_figure(
    tasks: Sequence[TaskResults], placebos: Sequence[float | None], title: str
) -> Figure:
    """Draw a matrix for each task, side by side."""
    label = shown_model(tasks[0]).label
    figure = new_figure(
        (WIDTH_IN, 3.95),
        title,
        f"{label}, share of the recordings of each true material in %",
        sorted({task.source for task in tasks}),
    )
    is_equal = len({tuple(shown_model(task).classes) for task in tasks}) == 1
    grid = figure.subplots(1, len(tasks), sharey=is_equal, squeeze=False)[0]
    for axes, task, placebo in zip(grid, tasks, placebos, strict=True):
        _draw_panel(axes, task, placebo)
    grid[0].set_ylabel("true material")
    return figure


def _draw_panel(axes: Axes, task: TaskResults, placebo: float | None) -> None:
    """Draw the matrix of a task under its accuracies."""
    classes = shown_model(task).classes
    draw_matrix(axes, share_matrix(task, classes), classes, rotation=45)
    axes.set_title("\n".join([shape_of(task), *_accuracies(task, placebo)]), fontsize=8.5)
    axes.set_xlabel("predicted material")
