"""Figures of cross-validation: predictions, models over their run time, levels and splits.

Each is a picture of one of the shared marks, made of the scores of the models.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation.results import (
    GROUPED,
    RANDOM,
    WITHHELD,
    ModelResult,
    Predictions,
    best_of,
    elsewhere,
    metric_name,
    models_of,
    paper_told,
    quantity,
)
from ajgdata.report.blocks import Illustration
from ajgdata.report.format import Score, number, sentence, with_unit, words
from ajgdata.report.marks import MarkName, Picture, Point, illustration

#: Fewer models are compared in the figure of all tasks only; fewer levels are no curve.
MANY_MODELS, MANY_LEVELS = 4, 3
#: More true values than this are put into bins.
MAX_VALUES = 30
#: Times (s) by panel; a time that is measured as zero has no place on a logarithmic axis.
TIMES = {"training, all folds": "train_s", "inference, one recording": "inference_s"}
SHORTEST_S = 1e-7
NORMALISED = ("error (0 perfect, 1 chance)", "")
#: Splits that are compared: name of the figure, splits with their names, and what is compared.
SPLITS: tuple[tuple[str, dict[str, str], str], ...] = (
    (
        "random-against-grouped",
        {RANDOM: "random", GROUPED: "grouped"},
        "Grouped: no group on both sides of the split (used everywhere else). Random: groups "
        "ignored.",
    ),
)


def illustrations(results: TaskResults) -> Iterator[Illustration]:
    """Yield the figures of a task: predictions (of the best model open), levels, times."""
    models = models_of(results)
    if not models:
        return
    top = best_of(models)
    for model in (top, *(one for one in models if one is not top)):
        folded = "" if model is top else f"{model.label}: {metric_name(results)} {model.shown()}"
        yield _predictions(model)._replace(folded=folded)
    if len(top.levels()) >= MANY_LEVELS:
        yield _levels(results, models)
    if len(models) >= MANY_MODELS:
        yield _run_time(results, models)


def across(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the figures of all tasks: splits that were compared, and error against run time."""
    tasks = [models for models in map(models_of, results) if models]
    every = [model for models in tasks for model in models]
    for name, parts, text in SPLITS:
        first, *_, last = parts
        if compared := [model for model in every if model.has(first) and model.has(last)]:
            yield _split(name, parts, text, compared)
    for panel in TIMES if tasks else ():
        yield _all_run_times(panel, tasks)


def _scaled(model: ModelResult, score: Score) -> Score:
    """Return a score of the metric that is read first as it is shown."""
    scale = model.task.scale
    ends = scale * score.low, scale * score.high
    return Score(scale * score.mean, scale * score.sd, (), *ends)


# One task


def model_finding(model: ModelResult) -> str:
    """Return the score of a model with chance."""
    verdict = "" if model.beats_chance() else ", not better than chance"
    score = f"{metric_name(model.task)} {model.shown()}{verdict}"
    return f"{model.label}: {score} (chance {model.shown_chance})"


def most_confused(model: ModelResult) -> tuple[str, str, int] | None:
    """Return the true class that is most often taken for another, the other, and the count.

    Of equals the first in the alphabet; None if there are no mistakes.
    """
    held_out = model.predictions()
    pairs = zip(map(str, held_out.y_true), map(str, held_out.y_pred), strict=True)
    confusions = Counter(sorted((true, other) for true, other in pairs if true != other))
    if not confusions:
        return None
    ((true, other), count) = confusions.most_common(1)[0]
    return true, other, count


def _predictions(model: ModelResult) -> Illustration:
    """Return predicted against true values, or the confusion matrix."""
    task = model.task
    regression = task.kind == "regression"
    title, text = model_finding(model), _predictions_text(model)
    if not regression and (pair := most_confused(model)):
        title += f"; {words(pair[0])} is taken for {words(pair[1])} {pair[2]} times"
    unit = task.unit if regression else ""
    name = quantity(task) if regression else "class"
    told = paper_told(model)
    paper = f"; {told[1]}: {with_unit(number(told[0]), task.shown_unit)}" if told else ""
    picture = Picture(
        title=title,
        subtitle=f"{task.title}: {model.count('folds')} folds{paper}",
        sources=(task.source,),
        points=tuple(_value_points(model) if regression else _class_points(model)),
        axis=(f"predicted {name}", unit),
        place=(f"true {name}", unit),
        chance=(("", float(model.predictions().y_true.mean())),) if regression else (),
        ideal=regression,
    )
    mark: MarkName = "lines" if regression else "matrix"
    return illustration(task.named("predictions", model.result.model), mark, picture, text, unit)


def _predictions_text(model: ModelResult) -> str:
    task = model.task
    count = f"{len(model.predictions().y_true):,} held-out predictions"
    text = f"{model.label} on {task.dataset_title}, {task.source}: {count}, no "
    text += f"{words(task.groups)} on both sides of a split. "
    if task.kind == "classification":
        return f"{text}Numbers: per cent of the recordings of the true class."
    text += "Mean ± one standard deviation per true value; dashed: perfect; dotted: the mean."
    if task.period_deg is not None:
        text += f" The target repeats after {with_unit(number(task.period_deg), task.unit)}: "
        text += "predictions are drawn at their repetition nearest to the truth."
    return text


def _value_points(model: ModelResult) -> Iterator[Point]:
    parts = {"known values": GROUPED, "withheld values": WITHHELD}
    for name, part in parts.items():
        if model.has(part):
            for true, mean, sd in by_true_value(model.predictions(part)):
                yield Point("", name, true, Score(mean, sd))


def by_true_value(
    predictions: Predictions, max_values: int = MAX_VALUES
) -> Iterator[tuple[float, float, float]]:
    """Yield mean true value, mean and standard deviation (n - 1) of predictions per true value.

    More than `max_values` distinct values are put into as many bins of equal width. The
    deviation of a single prediction is 0.
    """
    y_true, y_pred = predictions.y_true, predictions.y_pred
    values, index = np.unique(y_true, return_inverse=True)
    if len(values) > max_values:
        edges = np.linspace(values[0], values[-1], max_values + 1)[1:-1]
        index = np.digitize(y_true, edges)
    for at in np.unique(index):
        predicted = y_pred[index == at]
        sd = float(predicted.std(ddof=1)) if len(predicted) > 1 else 0.0
        yield float(y_true[index == at].mean()), float(predicted.mean()), sd


def _class_points(model: ModelResult) -> Iterator[Point]:
    from ajgdata.evaluate.metrics import confusion

    held_out, classes = model.predictions(), model.classes
    counts = confusion(held_out.y_true, held_out.y_pred, np.array(classes))
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    for true, row in zip(classes, shares, strict=True):
        for predicted, share in zip(classes, row, strict=True):
            yield Point("", words(predicted), words(true), Score(float(share), 0.0))


def _levels(results: TaskResults, models: Sequence[ModelResult]) -> Illustration:
    """Return the metric of each model against the level of the recordings it is tested on."""
    points = [
        Point("", model.label, level.value, _scaled(model, score))
        for model in models
        for level, score in model.levels()
    ]
    top = best_of(tuple(models))
    (first, low), (last, high) = top.levels()[0], top.levels()[-1]
    ends = (
        f"{top.shown(score)} at {with_unit(number(level.value), level.unit)}"
        for level, score in ((first, low), (last, high))
    )
    named = {GROUPED: results.level}
    named |= {elsewhere(name): results.others[name].level for name in top.tested_on}
    published = [
        (level.value, told[0])
        for part, level in named.items()
        if level is not None and (told := paper_told(top, part))
    ]
    picture = Picture(
        title=f"{top.label}: {', '.join(ends)}; chance is {top.shown_chance}",
        subtitle=f"{results.title}: {top.spread}, never trained at another level",
        sources=(results.source,),
        points=tuple(points),
        axis=(metric_name(results), results.shown_unit),
        place=(first.quantity, first.unit),
        chance=(("", results.scale * top.chance()),),
        published=tuple(value for pair in published for value in pair),
    )
    text = f"The models of {results.title}, tested on the same task at other levels. Stars: the "
    text += "paper. No fold trains on one recording of a grasp and tests on another."
    return illustration(results.named("levels"), "lines", picture, text, results.shown_unit)


def _run_time(results: TaskResults, models: Sequence[ModelResult]) -> Illustration:
    """Return the error of the models of a task, in its unit, against training and inference."""
    top = best_of(tuple(models))
    wrong = results.kind == "classification"
    points = [
        Point(panel, model.label, max(getattr(model.cost, time), SHORTEST_S), _wrong(model))
        for panel, time in TIMES.items()
        for model in models
    ]
    chance = 100 * (1 - top.chance()) if wrong else results.scale * top.chance()
    picture = Picture(
        title=f"{top.label} has the lowest error of {len(models)} models ({top.shown()})",
        subtitle=f"{results.title}: {top.spread}; filled: no model is better in error and time",
        sources=(results.source,),
        points=tuple(points),
        axis=("wrong", "%") if wrong else (metric_name(results), results.shown_unit),
        place=("time", "s"),
        chance=tuple((panel, chance) for panel in TIMES),
    )
    text = f"{len(models)} models on the same folds. A line joins the Pareto front. Times belong "
    text += "to the machine that made this page."
    unit = "%" if wrong else results.shown_unit
    return illustration(results.named("models"), "scatter", picture, text, unit)


def _wrong(model: ModelResult) -> Score:
    """Return the error as it is shown: of classes, the share that is wrong."""
    score = _scaled(model, model.score())
    if model.task.kind == "regression":
        return score
    return Score(100 - score.mean, score.sd, (), 100 - score.high, 100 - score.low)


# All tasks


def _split(
    name: str, parts: dict[str, str], text: str, compared: Sequence[ModelResult]
) -> Illustration:
    """Return the normalised error of models under several splits."""
    points = [
        Point("", title, f"{m.task.title}: {m.label}", m.normalise(m.score(part)))
        for m in compared
        for part, title in parts.items()
        if m.has(part)
    ]
    first, second, *_ = parts
    last = [second if model.has(second) else list(parts)[-1] for model in compared]
    pairs = [(_error(m, first), _error(m, at)) for m, at in zip(compared, last, strict=True)]
    hidden = [100 * (1 - shown / true) for shown, true in pairs if true > 0] or [0.0]
    low, high = (f"{end:.0f}".replace("-", "−") for end in (min(hidden), max(hidden)))
    worse = sum(share > 0 for share in hidden)
    picture = Picture(
        title=f"{sentence(parts[first])} folds hide {low} to {high} % of the error "
        f"({worse} of {len(hidden)} cases above 0)",
        subtitle="error as a share of chance, mean ± sd over folds",
        sources=tuple(model.task.source for model in compared),
        points=tuple(points),
        axis=NORMALISED,
    )
    return illustration(name, "rows", picture, f"The same models and recordings. {text}")


def _error(model: ModelResult, part: str) -> float:
    return model.normalise(model.score(part)).mean


def _all_run_times(panel: str, tasks: Sequence[tuple[ModelResult, ...]]) -> Illustration:
    """Return the normalised error of all models of all tasks against a time."""
    time = TIMES[panel]
    every = [model for models in tasks for model in models]
    labels = {
        name: " / ".join(dict.fromkeys(m.label for m in every if m.result.model == name))
        for name in dict.fromkeys(model.result.model for model in every)
    }
    points = [
        Point(m.task.title, labels[m.result.model], max(getattr(m.cost, time), SHORTEST_S), m.error)
        for m in every
    ]
    best = _most(labels, (best_of(models) for models in tasks))
    fast = _most(
        labels, (min(models, key=lambda m: float(getattr(m.cost, time))) for models in tasks)
    )
    picture = Picture(
        title=f"Lowest error: {best} tasks; shortest time: {fast} tasks",
        subtitle="error as a share of chance; filled: no model is better in error and time",
        sources=tuple(model.task.source for model in every),
        points=tuple(points),
        axis=NORMALISED,
        place=(panel, "s"),
        chance=tuple((models[0].task.title, 1.0) for models in tasks),
    )
    text = "Error against run time, a panel for each task: RMSE / chance RMSE, or (1 − accuracy) / "
    text += "(1 − chance accuracy). A line joins the Pareto front of a task. Times belong to the "
    text += "machine that made this page."
    name = "error-against-run-time" if time == "train_s" else "error-against-inference-time"
    return illustration(name, "scatter", picture, text)


def _most(labels: dict[str, str], found: Iterable[ModelResult]) -> str:
    """Return the model that occurs most often, with its count: `k-NN on 3 of 5`."""
    names = [model.result.model for model in found]
    ((name, count),) = Counter(names).most_common(1)
    return f"{labels[name]} on {count} of {len(names)}"
