"""Figures of cross-validation: predictions, levels, splits, and error against run time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation.results import (
    GROUPED,
    RANDOM,
    WITHHELD,
    ModelResult,
    best_of,
    elsewhere,
    models_of,
    paper_told,
    quantity,
)
from ajgdata.experiments.plots import Plot, value_range
from ajgdata.experiments.plots import illustrations as illustrations_of
from ajgdata.report.blocks import Illustration
from ajgdata.report.format import column_title, number, sentence, with_unit, words
from ajgdata.report.marks import Picture, Point, illustration
from ajgdata.types.table import Table, table_of

#: Fewer levels are no curve.
MANY_LEVELS = 3
#: More true values than this are put into bins.
MAX_VALUES = 30
#: Names of figures against a time (s) with their axes, by field of `ModelCost`.
TIMES = {
    "train_s": ("error-against-run-time", "training, all folds"),
    "inference_s": ("error-against-inference-time", "inference, one recording"),
}
#: A time that is measured as zero has no place on a logarithmic axis.
SHORTEST_S = 1e-7
NORMALISED = ("error (0 perfect, 1 chance)", "")


def illustrations(results: TaskResults) -> Iterator[Illustration]:
    """Yield the figures of a task: predictions (of the best model open) and levels."""
    models = models_of(results)
    if not models:
        return
    top = best_of(models)
    plots = [_predictions(top, "")]
    for model in (one for one in models if one is not top):
        plots.append(_predictions(model, f"{model.label}: {results.metric_title} {model.shown()}"))
    if len(top.levels()) >= MANY_LEVELS:
        plots.append(LEVELS)
    yield from illustrations_of(results, plots)


# Predictions


def _predictions(model: ModelResult, folded: str) -> Plot:
    """Return the confusion matrix of a model, or predicted against true values."""
    task = model.task
    about = f"{len(model.predictions().y_true):,} held-out predictions of {model.label} in "
    about += f"{model.count('folds')} folds, no {words(task.groups)} on both sides of a split"
    if published := paper_told(model):
        value = with_unit(number(published[0]), task.shown_unit)
        about += f"; {published[1]}: {value}"
    shares = Plot(
        "matrix",
        partial(class_shares, model),
        about,
        value="share",
        x="true",
        series=("predicted",),
        over="recordings of a true class",
        title=partial(finding, model),
        name=f"predictions--{model.result.model}",
        folded=folded,
    )
    if task.kind == "classification":
        return shares
    if task.period_deg is not None:
        shares = replace(
            shares, about=f"{about}; predictions at the repetition nearest to the truth"
        )
    return replace(
        shares, mark="lines", table=partial(numbers, model), value="predicted", series=("part",),
        over="predictions of a true value", chance="mean", ideal=True,
    )  # fmt: skip


def finding(model: ModelResult, _: TaskResults | None = None) -> str:
    """Return the score of a model with chance, and the most frequent confusion."""
    verdict = "" if model.beats_chance() else ", not better than chance"
    score = f"{model.task.metric_title} {model.shown()}{verdict}"
    text = f"{model.label}: {score} (chance {model.shown_chance})"
    if model.task.kind == "classification" and (pair := most_confused(model)):
        text += f"; {words(pair[0])} is taken for {words(pair[1])} {pair[2]} times"
    return text


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


def class_shares(model: ModelResult, _: TaskResults) -> Table:
    """Return the share of each predicted class in the recordings of each true class."""
    from ajgdata.evaluate.metrics import confusion

    held_out, classes = model.predictions(), model.classes
    counts = confusion(held_out.y_true, held_out.y_pred, np.array(classes))
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    rows = (
        {"true": true, "predicted": predicted, "share": shares[i, j]}
        for i, true in enumerate(classes)
        for j, predicted in enumerate(classes)
    )
    columns = {"true": "True class", "predicted": "Predicted class", "share": "Share"}
    return table_of("shares", "Predictions", rows, **columns)


def numbers(model: ModelResult, _: TaskResults) -> Table:
    """Return true and predicted values, known and withheld; `mean` is of the known true values."""
    parts = {"known values": GROUPED, "withheld values": WITHHELD}
    rows, mean = [], float(model.predictions().y_true.mean())
    for name, part in parts.items():
        if model.has(part):
            held_out = model.predictions(part)
            pairs = zip(binned(held_out.y_true), held_out.y_pred, strict=True)
            rows += [{"part": name, "true": t, "predicted": y, "mean": mean} for t, y in pairs]
    name = column_title(quantity(model.task), model.task.unit)
    columns = {"part": "Values", "true": f"True {name}", "predicted": f"Predicted {name}"}
    return table_of("values", "Predictions", rows, **columns, mean="Mean")


def binned(y_true: np.ndarray, max_values: int = MAX_VALUES) -> np.ndarray:
    """Return true values (n,); more than `max_values` distinct ones are put into as many bins of
    equal width, and each becomes the mean of its bin."""
    values = np.unique(y_true)
    if len(values) <= max_values:
        return y_true
    index = np.digitize(y_true, np.linspace(values[0], values[-1], max_values + 1)[1:-1])
    sums, counts = np.bincount(index, y_true), np.bincount(index)
    return (sums / np.maximum(counts, 1))[index]


# Levels


def at_levels(results: TaskResults) -> Table:
    """Return the metric of each model and fold by the level of the recordings it is tested on."""
    models = models_of(results)
    rows = [
        {"model": model.label, "level": level.value, "metric": results.metric, "value": value}
        | {"chance": model.chance()}
        for model in models
        for level, score in model.levels()
        for value in score.per_fold
    ]
    first = models[0].levels()[0][0]
    columns = {"model": "Model", "level": column_title(sentence(first.quantity), first.unit)}
    return table_of("levels", "Levels", rows, **columns, metric="Metric", value="Value", chance="")


def published_levels(results: TaskResults) -> tuple[float, ...]:
    """Return level and published value of each level that the paper has."""
    top = best_of(models_of(results))
    levels = {GROUPED: results.level}
    levels |= {elsewhere(name): results.others[name].level for name in results.settings.test_on}
    return tuple(
        number
        for part, level in levels.items()
        if level is not None and (published := paper_told(top, part))
        for number in (level.value, published[0])
    )


LEVELS = Plot(
    "lines",
    at_levels,
    "the same models, never trained at another level, on the same task at several levels",
    x="level",
    chance="chance",
    headline="trend",
    published=published_levels,
    name="levels",
)

# All tasks


def across(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the figures of all tasks: random and grouped splits, and error against run time."""
    tasks = [models for models in map(models_of, results) if models]
    if compared := [model for models in tasks for model in models if model.has(RANDOM)]:
        yield _splits(compared)
    for time in TIMES if tasks else ():
        yield _run_times(time, tasks)


def _splits(compared: Sequence[ModelResult]) -> Illustration:
    """Return the normalised error of models under a random and the grouped split."""
    points, hidden = [], []
    for model in compared:
        scores = {"random": model.normalise(model.score(RANDOM)), "grouped": model.error}
        place = f"{model.task.title}: {model.label}"
        points += [Point("", split, place, score) for split, score in scores.items()]
        if model.error.mean > 0:
            hidden.append(100 * (1 - scores["random"].mean / model.error.mean))
    hidden = hidden or [0.0]
    spread = value_range([round(share) for share in hidden], "%").replace("-", "−")
    worse = sum(share > 0 for share in hidden)
    picture = Picture(
        title=f"Random folds hide {spread} of the error ({worse} of {len(hidden)} cases above 0)",
        subtitle="error as a share of chance, mean ± sd over folds",
        sources=tuple(model.task.source for model in compared),
        points=tuple(points),
        axis=NORMALISED,
    )
    text = "The same models and recordings. Grouped: no group on both sides of the split (used "
    text += "everywhere else). Random: groups ignored."
    return illustration("random-against-grouped", "rows", picture, text)


def _run_times(time: str, tasks: Sequence[tuple[ModelResult, ...]]) -> Illustration:
    """Return the normalised error of all models of all tasks against a time."""
    name, axis = TIMES[time]
    every = [model for models in tasks for model in models]
    labels = {
        name: " / ".join(dict.fromkeys(m.label for m in every if m.result.model == name))
        for name in dict.fromkeys(model.result.model for model in every)
    }

    def seconds(model: ModelResult) -> float:
        return max(getattr(model.cost, time), SHORTEST_S)

    best = _most(labels, (best_of(models) for models in tasks))
    fast = _most(labels, (min(models, key=seconds) for models in tasks))
    picture = Picture(
        title=f"Lowest error: {best}; shortest {axis.partition(',')[0]}: {fast}",
        subtitle="error as a share of chance; filled: no model is better in error and time",
        sources=tuple(model.task.source for model in every),
        points=tuple(
            Point(m.task.title, labels[m.result.model], seconds(m), m.error) for m in every
        ),
        axis=NORMALISED,
        place=(axis, "s"),
        chance=tuple((models[0].task.title, 1.0) for models in tasks),
    )
    text = "Error against run time, a panel for each task: RMSE / chance RMSE, or (1 − accuracy) / "
    text += "(1 − chance accuracy). A line joins the Pareto front of a task. Times belong to the "
    text += "machine that made this page."
    return illustration(name, "scatter", picture, text)


def _most(labels: dict[str, str], found: Iterable[ModelResult]) -> str:
    """Return the most frequent model; of several tasks with its count: `k-NN on 3 of 5 tasks`."""
    names = [model.result.model for model in found]
    ((name, count),) = Counter(names).most_common(1)
    return labels[name] if len(names) == 1 else f"{labels[name]} on {count} of {len(names)} tasks"
