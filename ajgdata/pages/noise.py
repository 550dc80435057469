"""Cube size in noise: error of each model against the noise level, trained in quiet."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from ajgdata.evaluate.parts import GROUPED, elsewhere
from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation_results import TASK_PARTS, ModelResult, models_of
from ajgdata.experiments.repeated_fits import statistics
from ajgdata.pages.direct_labels import LineLabel, label_right
from ajgdata.pages.selection import alternative, paper_sentence
from ajgdata.report.canvas import GREY, WIDTH_IN, line_style, new_figure
from ajgdata.report.comparison import PaperFigure
from ajgdata.report.format import Caption, Score, column_title, mean_sd, number, with_unit
from ajgdata.report.report_data import Illustration
from ajgdata.types import CROSS_VALIDATION
from ajgdata.types.table import Table, table_of

PAGE = "noise"
REPEATED_FITS = "repeated_fits"
#: Published value of the same models in quiet: that on training values.
IN_QUIET, _ = TASK_PARTS[GROUPED]


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the error against the noise level, if models of the page were tested at two levels."""
    own = [task for task in results if task.page == PAGE]
    models = [model for task in own for model in models_in_noise(task)]
    if not models:
        return
    first = models[0].task
    models = [model for model in models if model.task.shown_unit == first.shown_unit]
    known = published_values(results)
    fits = fitted_medians(own)
    title = conclusion(models[0], known, fits)
    listed = [
        f"{model.label} at {number(level)} {unit_of(first)}: {mean_sd(score, first.shown_unit)}"
        for model in models
        for level, score in scores(model).items()
    ]
    listed += [
        f"{fit.label}, median of repeated fits at {number(fit.level)} {unit_of(first)}:"
        f" {mean_sd(fit.score, first.shown_unit)}"
        for fit in fits
    ]
    text = (
        f"{first.dataset_title}, {first.source}. {trained(first)}. Lines: {first.metric_title} on"
        f" held-out grasps with its 95 % interval over grasps, of one cross-validation."
        f" {repeated_fits_sentence(fits)}{paper_sentence([paper_of(task) for task in own])}"
    )
    yield Illustration(
        f"{first.dataset}--against-noise",
        Caption(text, alternative(title, listed)),
        partial(draw_figure, models, fits, known, title),
        title,
        score_table(models),
    )


@dataclass(frozen=True)
class FittedMedian:
    """Median error of repeated fits of a model at a noise level, with its interval, as shown."""

    model: str
    label: str
    level: float
    score: Score


def fitted_medians(results: Sequence[TaskResults]) -> list[FittedMedian]:
    """Return the median of repeated fits of each model at the level that the paper reports."""
    medians = []
    for task in results:
        if task.experiment != REPEATED_FITS:
            continue
        name = task.settings.test_on[0]
        level = task.other_sets[name].level
        if level is None:
            continue
        for result in task.results:
            values = statistics(result, name)
            if not {"median", "low", "high"} <= values.keys():
                continue
            score = Score(values["median"], math.nan, (), values["low"], values["high"])
            medians.append(FittedMedian(result.model, result.label, level.value, score))
    return medians


def score_table(models: Sequence[ModelResult]) -> Table:
    """Return the values of the figure: a row for each model and noise level."""
    first = models[0].task
    unit = first.shown_unit
    rows = [
        {
            "model": model.label,
            "level": level,
            "value": score.mean,
            "sd": score.sd,
            "low": score.low,
            "high": score.high,
        }
        for model in models
        for level, score in scores(model).items()
    ]
    columns = {
        "model": "Model",
        "level": column_title("Noise level", unit_of(first)),
        "value": column_title(first.metric_title, unit),
        "sd": column_title("Standard deviation over folds", unit),
        "low": column_title("Low end of the 95 % interval", unit),
        "high": column_title("High end of the 95 % interval", unit),
    }
    return table_of(
        "against-noise", f"{first.metric_title} against the noise level", rows, **columns
    )


def repeated_fits_sentence(fits: Sequence[FittedMedian]) -> str:
    """Return why the error of repeated fits differs; empty if models were fitted once."""
    if not fits:
        return ""
    return (
        "Open diamonds: median of several fits with other initial weights, which is compared with"
        " the paper. "
    )


def models_in_noise(task: TaskResults) -> list[ModelResult]:
    """Return the models of a task that were tested at two noise levels or more."""
    if task.experiment != CROSS_VALIDATION or task.level is None:
        return []
    return [model for model in models_of(task) if len(scores(model)) > 1]


def trained(task: TaskResults) -> str:
    """Return the level at which the models of a task are trained, as a sentence without a stop."""
    level = levels(task)[GROUPED]
    return f"Models are trained at {number(level)} {unit_of(task)}"


def levels(task: TaskResults) -> Mapping[str, float]:
    """Return the noise level of each part of a task whose level is known, the lowest first.

    Of several parts at one level, the first is used, which is that of the training data.
    """
    parts = {
        GROUPED: task.level,
        **{elsewhere(name): other.level for name, other in task.other_sets.items()},
    }
    known: dict[float, str] = {}
    for part, level in parts.items():
        if level is not None:
            known.setdefault(level.value, part)
    return {known[level]: level for level in sorted(known)}


def unit_of(task: TaskResults) -> str:
    """Return the unit of noise levels for people."""
    return "dB(A)" if task.level is not None and task.level.unit == "dBA" else "dB"


def scores(model: ModelResult) -> Mapping[float, Score]:
    """Return the values of a model with their intervals, as shown, by noise level."""
    scale = model.task.scale
    errors = {}
    for part, level in levels(model.task).items():
        if model.has(part):
            score = model.with_interval(part)
            errors[level] = Score(
                scale * score.mean, scale * score.sd, (), scale * score.low, scale * score.high
            )
    return errors


def conclusion(
    model: ModelResult, known: Mapping[float, float], fits: Sequence[FittedMedian] = ()
) -> str:
    """Return the error of a model at the published levels, else at the lowest and the highest.

    At a level with repeated fits of the model, the error is their median.
    """
    unit = model.task.shown_unit
    errors = {level: score.mean for level, score in scores(model).items()}
    for fit in fits:
        if fit.model == model.result.model:
            errors[fit.level] = fit.score.mean
    levels_shown = [level for level in known if level in errors]
    if len(levels_shown) < 2:
        levels_shown = [min(errors), max(errors)]
    listed = ", ".join(
        f"{with_unit(number(errors[level]), unit)} at {number(level)} {unit_of(model.task)}"
        for level in levels_shown
    )
    text = f"{model.label}: {model.task.metric_title} {listed}"
    published = [number(known[level]) for level in levels_shown if level in known]
    if published:
        return f"{text} (published {with_unit(', '.join(published), unit)})"
    chance = with_unit(number(model.task.scale * model.chance()), unit)
    return f"{text} (chance {chance})"


def published_values(results: Sequence[TaskResults]) -> dict[float, float]:
    """Return the published error by noise level, the lowest level first.

    The error in noise is that of repeated fits. The error in quiet is published for the same models
    on the training values of the same data set.
    """
    known: dict[float, float] = {}
    for task in results:
        paper = paper_of(task)
        if task.page != PAGE or paper is None or paper.value is None:
            continue
        level = task.other_sets[task.settings.test_on[0]].level
        if level is not None:
            known[level.value] = float(paper.value)
        quiet = [
            other.papers[IN_QUIET].value
            for other in results
            if other.dataset == task.dataset and IN_QUIET in other.papers
        ]
        if task.level is not None and quiet and quiet[0] is not None:
            known[task.level.value] = float(quiet[0])
    return dict(sorted(known.items()))


def paper_of(task: TaskResults) -> PaperFigure | None:
    """Return the published error in noise, which is compared with repeated fits."""
    return task.paper if task.experiment == REPEATED_FITS else None


def draw_figure(
    models: Sequence[ModelResult],
    fits: Sequence[FittedMedian],
    known: Mapping[float, float],
    title: str,
) -> Figure:
    """Draw a line per model over the noise level, the medians of fits and the published values."""
    task = models[0].task
    subtitle = f"{task.dataset_title}. {trained(task)}"
    figure = new_figure((WIDTH_IN, 3.9), title, subtitle, [task.source])
    axes = figure.subplots()
    labels = []
    colours = {}
    for index, model in enumerate(models):
        by_level = scores(model)
        values = [score.mean for score in by_level.values()]
        bars = np.hstack([score.bars() for score in by_level.values()])
        style = line_style(index)
        axes.errorbar([*by_level], values, bars, capsize=2, elinewidth=0.7, **style)
        labels.append(LineLabel(model.label, values[-1], style["color"]))
        colours[model.result.model] = style["color"]
    chance = task.scale * models[0].chance()
    axes.axhline(chance, color=GREY, ls=":", lw=1.0)
    labels.append(LineLabel("chance", chance, GREY))
    for fit in fits:
        look = {"color": colours.get(fit.model, "black"), "marker": "D", "mfc": "white", "ms": 6}
        axes.errorbar([fit.level], [fit.score.mean], fit.score.bars(), capsize=3, **look)
        axes.annotate(
            f"{fit.label}, median\nof repeated fits",
            (fit.level, fit.score.mean),
            (-8, 0),
            textcoords="offset points",
            color=look["color"],
            fontsize=8,
            ha="right",
            va="center",
        )
    axes.plot([*known], [*known.values()], "*", color="black", ms=11, ls="")
    for level, value in known.items():
        axes.annotate(
            f"published {number(value)}",
            (level, value),
            (0, 8),
            textcoords="offset points",
            fontsize=8,
            ha="left" if level == min(scores(models[0])) else "center",
        )
    places = sorted({level for model in models for level in scores(model)} | {*known})
    axes.set_xticks(places, [number(level) for level in places])
    axes.set_ylim(bottom=0)
    unit = f" ({task.shown_unit})" if task.shown_unit else ""
    axes.set(
        xlabel=f"noise level ({unit_of(task)})",
        ylabel=f"{task.metric_title}{unit}",
    )
    label_right(axes, labels)
    return figure
