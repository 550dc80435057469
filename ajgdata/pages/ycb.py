"""Household objects: confusion matrix, with the pairs that the paper's network confuses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import permutations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from ajgdata.evaluate.parts import GROUPED
from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation_paper import MIN_ACCURACY
from ajgdata.experiments.cross_validation_results import TASK_PARTS, shown_model
from ajgdata.pages.confusions import draw_matrix, share_matrix
from ajgdata.pages.selection import alternative, first_on, paper_sentence, shown_value
from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure
from ajgdata.report.format import Caption, number, words
from ajgdata.report.report_data import Illustration
from ajgdata.types import CROSS_VALIDATION
from ajgdata.types.table import Table, table_of

PAGE = "ycb"
#: Objects by the paper's categories; the matrix has them in this order.
CATEGORIES = {
    "spherical": ("orange", "baseball", "tennis_ball", "racquetball", "golf_ball", "strawberry"),
    "cylindrical": ("screw", "spoon", "glasses_case", "marker", "screwdriver", "banana"),
}
#: Confusions that the paper names.
PUBLISHED_PAIRS = (("strawberry", "golf_ball"), ("baseball", "orange"))
COLUMNS = {
    "true": "True object",
    "predicted": "Predicted object",
    "share": "Share",
    "published_confusion": "The paper names this confusion",
}


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the confusion matrix of the paper's model, if objects were classified."""
    task = first_on(results, PAGE, CROSS_VALIDATION)
    if task is None or task.task_settings.kind != "classification":
        return
    classes = ordered_classes(task)
    shares = share_matrix(task, classes)
    title = conclusion(task, shares)
    pairs = pair_shares(classes, shares)
    listed = [f"{pair}: {number(100 * share, 2)} %" for pair, share in pairs.items()]
    listed += [
        f"{words(true)} as {words(predicted)}: {number(100 * shares[i, j], 2)} %"
        for i, true in enumerate(classes)
        for j, predicted in enumerate(classes)
        if shares[i, j] > 0
    ]
    marked = " Outlined: confusions that the paper names." if pairs else ""
    text = (
        f"{task.dataset_title}, {task.source}. Predictions of the {shown_model(task).label} on"
        " held-out grasps: share of the recordings of each true object, in per"
        f" cent.{marked} {paper_sentence([*task.papers.values()])}"
    )
    yield Illustration(
        f"{task.dataset}--confusions",
        Caption(text, alternative(title, listed)),
        partial(draw_figure, task, classes, shares, title),
        title,
        share_table(classes, shares),
        replaces=(task.named("predictions"),),
    )


def ordered_classes(task: TaskResults) -> list[str]:
    """Return the classes of a task by category; classes without a category come last."""
    classes = shown_model(task).classes
    known = [name for names in CATEGORIES.values() for name in names if name in classes]
    return [*known, *(name for name in classes if name not in known)]


def published_cells(classes: Sequence[str]) -> list[tuple[int, int]]:
    """Return row and column of each confusion that the paper names, in both directions."""
    return [
        (classes.index(true), classes.index(predicted))
        for pair in PUBLISHED_PAIRS
        if set(pair) <= set(classes)
        for true, predicted in permutations(pair)
    ]


def pair_shares(classes: Sequence[str], shares: np.ndarray) -> Mapping[str, float]:
    """Return the mean share of each confusion that the paper names, over both directions."""
    means = {}
    for first, second in PUBLISHED_PAIRS:
        if {first, second} <= set(classes):
            i = classes.index(first)
            j = classes.index(second)
            means[f"{words(first)}–{words(second)}"] = float((shares[i, j] + shares[j, i]) / 2)
    return means


def share_table(classes: Sequence[str], shares: np.ndarray) -> Table:
    """Return a row for each true and predicted class."""
    named = published_cells(classes)
    rows = [
        {
            "true": words(true),
            "predicted": words(predicted),
            "share": shares[i, j],
            "published_confusion": (i, j) in named,
        }
        for i, true in enumerate(classes)
        for j, predicted in enumerate(classes)
    ]
    return table_of("confusions", "Predicted objects", rows, **COLUMNS)


def conclusion(task: TaskResults, shares: np.ndarray) -> str:
    """Return the accuracy with the published value, and the number of classes of high accuracy."""
    model = shown_model(task)
    paper = task.papers.get(TASK_PARTS[GROUPED][0])
    known = f" (published {paper.published})" if paper else ""
    count = int(np.sum(np.diag(shares) >= MIN_ACCURACY))
    return (
        f"{model.label}: accuracy {shown_value(task, model.score().mean)}{known};"
        f" {count} of {len(shares)} objects at {number(100 * MIN_ACCURACY)} % or more"
    )


def draw_figure(
    task: TaskResults, classes: Sequence[str], shares: np.ndarray, title: str
) -> Figure:
    """Draw the matrix with the outlined confusions of the paper."""
    pairs = [f"{pair} {number(100 * v, 2)} %" for pair, v in pair_shares(classes, shares).items()]
    subtitle = f"{task.dataset_title}: share of the recordings of each true object in %"
    if pairs:
        subtitle += f". Outlined: confusions that the paper names (here {', '.join(pairs)})"
    height = 2.0 + min(0.27 * len(classes), 5.0)
    figure = new_figure((WIDTH_IN, height), title, subtitle, [task.source])
    axes = figure.subplots()
    draw_matrix(axes, shares, classes, rotation=45)
    axes.set(xlabel="predicted object", ylabel="true object")
    _draw_categories(axes, classes)
    _outline(axes, published_cells(classes))
    return figure


def _draw_categories(axes: Axes, classes: Sequence[str]) -> None:
    """Draw thin lines between the categories, and their names at the right."""
    known = {name: category for category, names in CATEGORIES.items() for name in names}
    categories = [known.get(name, "other") for name in classes]
    for category in dict.fromkeys(categories):
        places = [place for place, own in enumerate(categories) if own == category]
        middle = (places[0] + places[-1]) / 2
        axes.text(
            len(classes) - 0.3, middle, category, rotation=-90, va="center", color=GREY, fontsize=8
        )
        if places[0] > 0:
            axes.axhline(places[0] - 0.5, color=GREY, lw=0.8)
            axes.axvline(places[0] - 0.5, color=GREY, lw=0.8)


def _outline(axes: Axes, cells: Sequence[tuple[int, int]]) -> None:
    """Outline cells of a matrix, given by row and column."""
    for row, column in cells:
        corner = (column - 0.5, row - 0.5)
        axes.add_patch(Rectangle(corner, 1, 1, fill=False, ec=COLOURS[1], lw=1.8, zorder=3))
