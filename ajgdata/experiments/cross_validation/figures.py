"""Figures of one task: what was predicted, models against their run time, other levels."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation.findings import level_finding, tradeoff_finding
from ajgdata.experiments.cross_validation.predictions import prediction_caption, prediction_figure
from ajgdata.experiments.cross_validation.results import (
    GROUPED,
    ModelResult,
    best_of,
    elsewhere,
    metric_axis,
    metric_name,
    models_of,
    paper_told,
)
from ajgdata.report.blocks import Illustration
from ajgdata.report.canvas import GREY, WIDTH_IN, model_line, new_figure, pareto_front
from ajgdata.report.format import Caption, number, sentence, with_unit
from ajgdata.report.labels import REFERENCES, label_end, label_point, reference_line

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


def label_times(axes: Axes) -> None:
    """Label decades plainly, and 2 and 5 as well where a log axis spans less than two."""
    low, high = axes.get_xlim()
    if high < 100 * low:
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda t, _: number(t)))
    axes.xaxis.set_minor_formatter(NullFormatter())


def tradeoff_figure(results: TaskResults) -> Figure:
    """Return the models of a task, in its own unit, against training time and inference time.

    Bars are what is given beside the mean; a line joins the models that no other beats in both
    error and time.
    """
    models = models_of(results)
    figure = new_figure(
        (WIDTH_IN, 4.2),
        tradeoff_finding(results),
        f"{results.title}: {metric_name(results)}, {models[0].spread}; "
        "filled, on the line: beaten by none in both error and time",
        [results.source],
    )
    panels = figure.subplots(1, 2, sharey=True)
    for axes, (time, label) in zip(panels, TIMES.items(), strict=True):
        _tradeoff_panel(axes, models, time, named=axes is panels[-1])
        axes.set(xscale="log", xlabel=label)
        axes.margins(x=0.12)
        label_times(axes)
    chance = models[0].chance() * results.scale
    panels[0].axhline(chance, **REFERENCES["chance"])
    reference_line(panels[1], "chance", chance, "chance")
    if told := paper_told(models[0]):
        panels[0].axhline(told[0], **REFERENCES["paper"])
        reference_line(panels[1], "paper", told[0], told[1])
    panels[0].set_ylabel(metric_axis(results))
    return figure


def _tradeoff_panel(axes: Axes, models: tuple[ModelResult, ...], time: str, named: bool) -> None:
    scale = models[0].task.scale
    times = np.array([getattr(m.cost, time) for m in models])
    front = pareto_front(times, np.array([m.error.mean for m in models]))
    times = np.maximum(times, SHORTEST)
    score = np.array([m.score().mean for m in models]) * scale
    order = np.flatnonzero(front)[np.argsort(times[front], kind="stable")]
    axes.plot(times[order], score[order], color=GREY, lw=1.1, label="Pareto front", zorder=1)
    for i, model in enumerate(models):
        style = {**model_line(i), "ls": "", "capsize": 2.5}
        style["mfc"] = style["color"] if front[i] else "white"
        bars = model.score().bars(scale)
        axes.errorbar(times[i], score[i], bars, label=model.label, **style)
        if named:
            label_end(axes, float(times[i]), float(score[i]), model.label, str(style["color"]))


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
        f"as on every other task. Bars: {models[0].spread}. Filled markers joined by "
        "a line form the Pareto front: no other model beats them in both error and time. Times "
        "belong to the machine that made this page.",
        f"{sentence(tradeoff_finding(results))}. {metric_name(results)} against training "
        f"and inference time. {listed}.",
    )


def level_figure(results: TaskResults) -> Figure:
    """Return the metric of each model against the level of the recordings it is tested on."""
    models, scale = models_of(results), results.scale
    figure = new_figure(
        (WIDTH_IN, 3.4),
        level_finding(results),
        f"{results.title}: {metric_name(results)}, {models[0].spread}, "
        "never trained at another level",
        [results.source],
    )
    axes = figure.subplots()
    for i, model in enumerate(models):
        levels = [level.value for level, _ in model.levels()]
        mean = [scale * score.mean for _, score in model.levels()]
        bars = np.hstack([score.bars(scale) for _, score in model.levels()])
        axes.errorbar(levels, mean, bars, capsize=2.5, label=model.label, **model_line(i))
        label_end(axes, levels[-1], mean[-1], model.label, model_line(i)["color"])
    reference_line(axes, "chance", models[0].chance() * scale, "chance")
    for at, told in _paper_levels(models[0]):
        axes.plot(at, told, "*", color="black", ms=9, ls="", label="paper")
        label_point(axes, at, told, "the paper", "black")
    level = models[0].levels()[0][0]
    axes.set_xlabel(f"{level.quantity} ({level.unit})" if level.unit else level.quantity)
    axes.set_ylabel(metric_axis(results))
    axes.set_ylim(bottom=0)
    return figure


def _paper_levels(model: ModelResult) -> Iterator[tuple[float, float]]:
    """Yield level and value of what the paper reports there, in the unit of the figure."""
    named = {GROUPED: model.task.level}
    named |= {elsewhere(name): model.task.others[name].level for name in model.tested_on}
    for part, level in named.items():
        found = paper_told(model, part)
        if found and level is not None:
            yield level.value, found[0]


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
        "other levels: mean ± one standard deviation over folds; stars: the paper's, where it "
        "names one. Of a grasp that was recorded at "
        "several levels, no fold trains on one recording and tests on another.",
        f"{sentence(level_finding(results))}. {metric_name(results)} against level. {listed}.",
    )
