"""Figures of one task: what was predicted, models against their run time, other levels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, PercentFormatter

from ajgdata.evaluate.metrics import confusion
from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation.results import (
    WITHHELD,
    ModelResult,
    best_of,
    metric_axis,
    metric_name,
    models_of,
    quantity,
)
from ajgdata.report.blocks import Illustration
from ajgdata.report.canvas import (
    COLOURS,
    GREY,
    MARKERS,
    MAX_VECTOR_POINTS,
    WIDTH_IN,
    new_figure,
    pareto_front,
)
from ajgdata.report.format import Caption, number, with_unit, words

#: Fewer models of a task can be told apart in the figure of all tasks.
MANY_MODELS = 4
#: Fewer levels, the task's own included, are no curve.
MANY_LEVELS = 3
TIMES = {
    "train_s": "training, all folds (s)",
    "inference_ms_per_recording": "inference, one recording alone (ms)",
}
# A time measured as zero has no place on a log axis.
SHORTEST = 1e-4


def illustrations(results: TaskResults) -> Iterator[Illustration]:
    """Yield predictions of each model, those beside the best folded; models together; levels."""
    models = models_of(results)
    if not models:
        return
    top = best_of(models)
    for model in (top, *(m for m in models if m is not top)):
        folded = "" if model is top else f"{model.label}: {metric_name(results)} {model.shown()}"
        name = results.named("predictions", model.result.model)
        draw = partial(prediction_figure, model)
        yield Illustration(name, prediction_caption(model), draw, folded)
    if len(top.levels()) >= MANY_LEVELS:
        draw = partial(level_figure, results)
        yield Illustration(results.named("levels"), level_caption(results), draw)
    if len(models) >= MANY_MODELS:
        draw = partial(tradeoff_figure, results)
        yield Illustration(results.named("models"), tradeoff_caption(results), draw)


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


def _model_figure(model: ModelResult, size_in: tuple[float, float]) -> Figure:
    title = f"{model.task.title} · {model.label}"
    subtitle = f"{metric_name(model.task)} {model.shown()}   (chance {model.shown_chance})"
    return new_figure(size_in, title, subtitle, [model.task.source])


def regression_figure(model: ModelResult) -> Figure:
    """Return predicted against true value: all predictions, mean ± sd per true value, identity."""
    held_out = model.predictions()
    unseen = model.predictions(WITHHELD) if model.has(WITHHELD) else None
    y_true, y_pred = held_out.y_true, held_out.y_pred
    figure = _model_figure(model, (6.2, 5.0))
    axes = figure.subplots()
    drawn = [y_true, y_pred, *([unseen.y_true, unseen.y_pred] if unseen else [])]
    low, high = min(y.min() for y in drawn), max(y.max() for y in drawn)
    ends = np.array([low, high]) + 0.04 * (high - low or 1) * np.array([-1, 1])
    axes.plot(ends, ends, color=GREY, ls=(0, (5, 3)), lw=1.1, label="perfect")
    axes.axhline(y_true.mean(), color=GREY, ls=":", lw=1.1, label="chance: the mean")
    many = len(y_true) > MAX_VECTOR_POINTS
    points: dict[str, Any] = {"ms": 3, "mew": 0, "color": COLOURS[4]}
    points["alpha"] = 0.25 if many else 0.5
    axes.plot(y_true, y_pred, "o", rasterized=many, label="one recording", **points)
    bars: dict[str, Any] = {"ms": 5.5, "mec": "white", "mew": 0.8, "capsize": 2.5}
    bars["elinewidth"] = 1.2
    true, mean, sd = group_by_true_value(y_true, y_pred)
    axes.errorbar(true, mean, sd, fmt="o", color=COLOURS[0], label="mean ± sd", **bars)
    if unseen:
        grouped = group_by_true_value(unseen.y_true, unseen.y_pred)
        axes.errorbar(*grouped, fmt="s", color=COLOURS[1], label="withheld values", **bars)
    label = quantity(model.task) + (f" ({model.task.unit})" if model.task.unit else "")
    axes.set(xlabel=f"true {label}", ylabel=f"predicted {label}")
    axes.set(xlim=ends, ylim=ends, aspect="equal")
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


def confusion_figure(model: ModelResult) -> Figure:
    """Return the confusion matrix: colour is the share of the true class, numbers are counts."""
    held_out, classes = model.predictions(), model.classes
    counts = confusion(held_out.y_true, held_out.y_pred, np.array(classes))
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    n = len(classes)
    side = n * (0.62 if n <= 8 else 0.34)
    label = 0.075 * max(map(len, classes))
    below = 0.75 * label if n > 4 else 0.15
    figure = _model_figure(model, (max(side + label + 1.7, 4.8), side + below + 1.15))
    axes = figure.subplots()
    image = axes.imshow(share, cmap="Blues", vmin=0, vmax=1)
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.set_xticks(range(n), classes, rotation=45 if n > 4 else 0, rotation_mode="xtick")
    axes.set_yticks(range(n), classes)
    axes.set(xlabel="predicted", ylabel="true")
    style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8 if n <= 8 else 7}
    for row, column in np.argwhere(counts):
        fraction, text = share[row, column], f"{counts[row, column]}"
        text = f"{100 * fraction:.0f} %\n{text}" if n <= 8 else text
        axes.text(column, row, text, color="white" if fraction > 0.55 else "#222222", **style)
    bar = figure.colorbar(
        image, ax=axes, format=PercentFormatter(1, symbol=" %"), shrink=0.8, pad=0.02
    )
    bar.set_label("share of the true class; line: chance")
    bar.ax.axhline(model.chance(), color=COLOURS[1], lw=2)
    bar.outline.set_visible(False)
    return figure


def prediction_caption(model: ModelResult) -> Caption:
    """Return the caption of `prediction_figure`."""
    task = model.task
    head = (
        f"{model.label} on {task.dataset_title}, {task.source}: "
        f"{metric_name(task)} {model.shown()} (chance {model.shown_chance}), "
        f"{model.count('folds')} folds, no {words(task.groups)} on both sides of a split."
    )
    count = f"{len(model.predictions().y_true):,} held-out predictions"
    if task.kind == "regression":
        more = " Orange: values withheld from all training." if model.has(WITHHELD) else ""
        if task.period_deg is not None:
            more += (
                f" The target repeats after {with_unit(number(task.period_deg), task.unit)}: each "
                "prediction is drawn at its repetition nearest to the truth."
            )
        return Caption(
            f"{head} Small dots: {count}; large dots: mean ± one standard deviation per true "
            "value (or per bin, where there are more than 30 values); dashed: perfect; dotted: "
            f"always predicting the mean.{more}",
            f"Predicted against true {quantity(task)} with the identity line. {head}",
        )
    return Caption(
        f"{head} Rows are true classes and sum to one: colour is the share of a row, numbers "
        f"count the {count}. The mark on the colour scale is chance.",
        f"Confusion matrix, {len(model.classes)} classes. {head} {_mistakes(model)}",
    )


def _mistakes(model: ModelResult) -> str:
    """Return the most frequent confusion, in words."""
    held_out = model.predictions()
    pairs = zip(map(str, held_out.y_true), map(str, held_out.y_pred), strict=True)
    confusions = Counter(sorted((true, taken) for true, taken in pairs if true != taken))
    if not confusions:
        return "There are no confusions."
    ((true, taken), count) = confusions.most_common(1)[0]
    return f"Most frequent confusion: {true} taken for {taken}, {count} times."


def label_times(axes: Axes) -> None:
    """Label decades plainly, and 2 and 5 as well where a log axis spans less than two."""
    low, high = axes.get_xlim()
    if high < 100 * low:
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda t, _: number(t)))
    axes.xaxis.set_minor_formatter(NullFormatter())


def tradeoff_figure(results: TaskResults) -> Figure:
    """Return the models of a task, in its own unit, against training time and inference time.

    Bars are one standard deviation over folds; a line joins the models that no other beats in both
    error and time.
    """
    models, scale = models_of(results), results.scale
    figure = new_figure(
        (WIDTH_IN, 3.6),
        f"{results.title} · models",
        f"{metric_name(results)} against run time, mean ± sd over {models[0].count('folds')} folds",
        [results.source],
    )
    panels = figure.subplots(1, 2, sharey=True)
    for axes, (time, label) in zip(panels, TIMES.items(), strict=True):
        times = np.array([getattr(m.cost, time) for m in models])
        front = pareto_front(times, np.array([m.error.mean for m in models]))
        times = np.maximum(times, SHORTEST)
        score = np.array([m.score().mean for m in models]) * scale
        sd = np.array([m.score().sd for m in models]) * scale
        order = np.flatnonzero(front)[np.argsort(times[front], kind="stable")]
        axes.plot(times[order], score[order], color=GREY, lw=1.1, label="Pareto front")
        axes.axhline(models[0].chance() * scale, color=GREY, ls=":", lw=1.1, label="chance")
        for i, model in enumerate(models):
            colour = COLOURS[i % len(COLOURS)]
            axes.errorbar(
                times[i], score[i], sd[i], color=colour, marker=MARKERS[i % len(MARKERS)],
                mfc=colour if front[i] else "white", ls="", capsize=2.5, label=model.label,
            )  # fmt: skip
        axes.set(xscale="log", xlabel=label)
        axes.margins(x=0.12)
        label_times(axes)
    panels[0].set_ylabel(metric_axis(results))
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower left", ncols=5)
    return figure


def tradeoff_caption(results: TaskResults) -> Caption:
    """Return the caption of `tradeoff_figure`."""
    models = models_of(results)
    listed = "; ".join(
        f"{m.label}: {m.shown()}, training {number(m.cost.train_s)} s, "
        f"inference {number(m.cost.inference_ms_per_recording)} ms"
        for m in models
    )
    return Caption(
        f"{metric_name(results)} of {len(models)} models on the same folds, with the same settings "
        "as on every other task. Bars: one standard deviation over folds. Filled markers joined by "
        "a line form the Pareto front: no other model beats them in both error and time. Times "
        "belong to the machine that made this page.",
        f"{metric_name(results)} against training and inference time. {listed}.",
    )


def level_figure(results: TaskResults) -> Figure:
    """Return the metric of each model against the level of the recordings it is tested on."""
    models, scale = models_of(results), results.scale
    figure = new_figure(
        (WIDTH_IN, 3.4),
        f"{results.title} · tested at other levels",
        f"{metric_name(results)}, mean ± sd over {models[0].count('folds')} folds, "
        "never trained there",
        [results.source],
    )
    axes = figure.subplots()
    for i, model in enumerate(models):
        levels = [level.value for level, _ in model.levels()]
        mean = [scale * score.mean for _, score in model.levels()]
        sd = [scale * score.sd for _, score in model.levels()]
        style: dict[str, Any] = {"color": COLOURS[i % len(COLOURS)]}
        style["marker"] = MARKERS[i % len(MARKERS)]
        axes.errorbar(levels, mean, sd, capsize=2.5, label=model.label, **style)
    axes.axhline(models[0].chance() * scale, color=GREY, ls=":", lw=1.1, label="chance")
    level = models[0].levels()[0][0]
    axes.set_xlabel(f"{level.quantity} ({level.unit})" if level.unit else level.quantity)
    axes.set_ylabel(metric_axis(results))
    axes.set_ylim(bottom=0)
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


def level_caption(results: TaskResults) -> Caption:
    """Return the caption of `level_figure`."""
    listed = "; ".join(
        f"{model.label}: "
        + ", ".join(
            f"{model.shown(score)} at {with_unit(number(level.value), level.unit)}"
            for level, score in model.levels()
        )
        for model in models_of(results)
    )
    return Caption(
        f"The models of {results.title}, trained there only and tested on the same task at "
        "other levels: mean ± one standard deviation over folds. Of a grasp that was recorded at "
        "several levels, no fold trains on one recording and tests on another.",
        f"{metric_name(results)} against level. {listed}.",
    )
