"""Figures of what a model predicted: against the truth, or which class was taken for which."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.evaluate.metrics import confusion
from ajgdata.experiments.cross_validation.findings import (
    confusion_finding,
    model_finding,
    most_confused,
)
from ajgdata.experiments.cross_validation.results import (
    WITHHELD,
    ModelResult,
    metric_name,
    paper_told,
    quantity,
)
from ajgdata.report.canvas import COLOURS, MAX_VECTOR_POINTS, WIDTH_IN, new_figure
from ajgdata.report.format import Caption, number, sentence, with_unit, words
from ajgdata.report.labels import LABEL_PT, REFERENCES, label_end, reference_line, width_in

#: Cells (in) no larger than this, and no smaller than one that holds a label; numbers need more.
CELL_IN, LEAST_IN, NUMBER_IN, SHARE_IN = 0.62, 0.15, 0.27, 0.5
#: Shares above this are dark: numbers on them are white.
DARK = 0.55


def group_by_true_value(
    y_true: np.ndarray, y_pred: np.ndarray, max_groups: int = 30
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mean true value, mean and standard deviation (n - 1) of predictions per true value.

    More than `max_groups` distinct values are put into `max_groups` bins of equal width. The
    deviation of a single prediction is 0.
    """
    values, index = np.unique(y_true, return_inverse=True)
    if len(values) > max_groups:
        edges = np.linspace(values[0], values[-1], max_groups + 1)[1:-1]
        index = np.unique(np.digitize(y_true, edges), return_inverse=True)[1]
    count = np.bincount(index)
    true = np.bincount(index, y_true) / count
    mean = np.bincount(index, y_pred) / count
    squares = np.bincount(index, (y_pred - mean[index]) ** 2)
    return true, mean, np.sqrt(squares / np.maximum(count - 1, 1))


def prediction_figure(model: ModelResult) -> Figure:
    """Return what was predicted against what is true, for either kind of task."""
    return (regression_figure if model.task.kind == "regression" else confusion_figure)(model)


def _subtitle(model: ModelResult) -> str:
    """Return the task, and the paper's number for it if there is one."""
    told = f"{model.task.title}: {metric_name(model.task)} over {model.count('folds')} folds"
    if paper := paper_told(model):
        value, whose = paper
        told += f"; {whose}: {with_unit(number(value), model.task.shown_unit)}"
    return told


def regression_figure(model: ModelResult) -> Figure:
    """Return predicted against true value: all predictions, mean ± sd per true value, identity."""
    held_out = model.predictions()
    unseen = model.predictions(WITHHELD) if model.has(WITHHELD) else None
    y_true, y_pred = held_out.y_true, held_out.y_pred
    figure = new_figure((6.2, 4.9), model_finding(model), _subtitle(model), [model.task.source])
    axes = figure.subplots()
    drawn = [y_true, y_pred, *([unseen.y_true, unseen.y_pred] if unseen else [])]
    low, high = min(y.min() for y in drawn), max(y.max() for y in drawn)
    ends = np.array([low, high]) + 0.04 * (high - low or 1) * np.array([-1, 1])
    axes.plot(ends, ends, label="perfect", **REFERENCES["ideal"])
    reference_line(axes, "chance", float(y_true.mean()), "chance: the mean")
    label_end(axes, None, float(ends[1]), "perfect", REFERENCES["ideal"]["color"])
    many = len(y_true) > MAX_VECTOR_POINTS
    points: dict[str, Any] = {"ms": 3, "mew": 0, "color": COLOURS[4]}
    points["alpha"] = 0.25 if many else 0.5
    axes.plot(y_true, y_pred, "o", rasterized=many, label="one recording", **points)
    _means(axes, y_true, y_pred, "o", COLOURS[0], "mean ± sd of known values")
    if unseen:
        _means(axes, unseen.y_true, unseen.y_pred, "s", COLOURS[1], "mean ± sd of withheld values")
    label = quantity(model.task) + (f" ({model.task.unit})" if model.task.unit else "")
    axes.set(xlabel=f"true {label}", ylabel=f"predicted {label}")
    axes.set(xlim=ends, ylim=ends, aspect="equal")
    axes.locator_params(nbins=7)
    return figure


def _means(
    axes: Axes, y_true: np.ndarray, y_pred: np.ndarray, marker: str, colour: str, name: str
) -> None:
    """Draw mean and deviation per true value, named at the end."""
    bars: dict[str, Any] = {"ms": 5.5, "mec": "white", "mew": 0.8, "capsize": 2.5}
    bars["elinewidth"] = 1.2
    true, mean, sd = group_by_true_value(y_true, y_pred)
    if marker == "s":  # told apart without colour as well
        bars |= {"mfc": "white", "mec": colour, "mew": 1.3}
    axes.errorbar(true, mean, sd, fmt=marker, color=colour, label=name, **bars)
    label_end(axes, float(true[-1]), float(mean[-1]), name.replace(" of ", "\nof "), colour)


def confusion_figure(model: ModelResult) -> Figure:
    """Return the confusion matrix: colour is the share of the true class, numbers are counts.

    At the end of a row stands the share that is right.
    """
    held_out, classes = model.predictions(), model.classes
    counts = confusion(held_out.y_true, held_out.y_pred, np.array(classes))
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    n, names = len(classes), [words(name) for name in classes]
    label = max(width_in(name, LABEL_PT) for name in names)
    cell = float(np.clip((WIDTH_IN - label - 1.2) / n, LEAST_IN, CELL_IN))
    below = 0.75 * label if n > 4 else 0.15
    size_in = max(n * cell + label + 1.2, 4.8), n * cell + below + 1.15
    figure = new_figure(
        size_in,
        confusion_finding(model),
        f"{_subtitle(model)}. Colour: share of a row; numbers: recordings",
        [model.task.source],
    )
    axes = figure.subplots()
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1)
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.set_xticks(range(n), names, rotation=45 if n > 4 else 0, rotation_mode="xtick")
    axes.set_yticks(range(n), names)
    axes.tick_params(length=0)
    axes.set(xlabel="predicted", ylabel="true")
    _cells(axes, counts, share, cell)
    for row in range(n):
        axes.annotate(f"{100 * share[row, row]:.0f} %", (1, row), (4, 0), va="center",
                      xycoords=("axes fraction", "data"), textcoords="offset points",
                      fontsize=LABEL_PT)  # fmt: skip
    axes.annotate("right", (1, 1), (4, 2), xycoords="axes fraction", textcoords="offset points",
                  fontsize=LABEL_PT)  # fmt: skip
    return figure


def _cells(axes: Axes, counts: np.ndarray, share: np.ndarray, cell_in: float) -> None:
    """Write the counts that are not 0 into cells (c, c) that have room, and outline the diagonal
    and the largest mistake of all."""
    from matplotlib.patches import Rectangle

    style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": LABEL_PT}
    for row, column in np.argwhere(counts) if cell_in >= NUMBER_IN else ():
        fraction, text = share[row, column], f"{counts[row, column]}"
        text = f"{100 * fraction:.0f} %\n{text}" if cell_in >= SHARE_IN else text
        axes.text(column, row, text, color="white" if fraction > DARK else "#222222", **style)
    wrong = np.where(np.eye(len(counts), dtype=bool), 0, counts)
    if wrong.any():
        row, column = np.unravel_index(int(np.argmax(wrong)), wrong.shape)
        frame: dict[str, Any] = {"fill": False, "ec": COLOURS[1], "lw": 1.5}
        axes.add_patch(Rectangle((float(column) - 0.5, float(row) - 0.5), 1, 1, **frame))


def prediction_caption(model: ModelResult) -> Caption:
    """Return the caption of `prediction_figure`."""
    task = model.task
    spread = model.spread if model.score().has_interval else f"{model.count('folds')} folds"
    head = (
        f"{model.label} on {task.dataset_title}, {task.source}: "
        f"{metric_name(task)} {model.shown()} (chance {model.shown_chance}), "
        f"{spread}, no {words(task.groups)} on both sides of a split."
    )
    count = f"{len(model.predictions().y_true):,} held-out predictions"
    if task.kind == "regression":
        more = " Squares: values withheld from all training." if model.has(WITHHELD) else ""
        if task.period_deg is not None:
            more += (
                f" The target repeats after {with_unit(number(task.period_deg), task.unit)}: each "
                "prediction is drawn at its repetition nearest to the truth."
            )
        return Caption(
            f"{head} Small dots: {count}; large markers: mean ± one standard deviation per true "
            "value (or per bin, where there are more than 30 values); dashed: perfect; dotted: "
            f"always predicting the mean.{more}",
            f"{sentence(model_finding(model))}. Predicted against true {quantity(task)} "
            f"with the identity line. {head}",
        )
    return Caption(
        f"{head} Rows are true classes and sum to one: colour is the share of a row, numbers "
        f"count the {count}; at the right the share that is right. Framed: the most frequent "
        "confusion.",
        f"{sentence(model_finding(model))}. Confusion matrix, {len(model.classes)} classes. {head} "
        f"{_mistakes(model)}",
    )


def _mistakes(model: ModelResult) -> str:
    """Return the most frequent confusion, in words."""
    found = most_confused(model)
    if found is None:
        return "There are no confusions."
    true, taken, count = found
    return f"Most frequent confusion: {true} taken for {taken}, {count} times."
