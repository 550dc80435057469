"""Tuning: what a scaling and a setting chosen on inner folds are worth beside plain ones, and cost.

Both models are tested on the same folds. The choice of each fold is made within its training part.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from pydantic import Field

from ajgdata.experiments.base import (
    METRIC_NAMES,
    SCORES,
    Experiment,
    Inputs,
    Outcome,
    Result,
    TaskResults,
    fold_scores,
    score_table,
)
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.format import Caption, Score, mean_sd, number
from ajgdata.types import MODELS, FeatureSettings, Kind, ModelName, Strict
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ajgdata.evaluate.paired_fold_test import FoldDifference, Verdict

TUNED, PLAIN = "tuned", "plain"
CHOICES = "choices"
CHOICE_COLUMNS = {
    "fold": "Fold", "choice": "Chosen", "reason": "Why nothing was", "score": "Inner",
    "failed": "Candidates that could not be trained",
}  # fmt: skip
ROW_IN = 0.62


class Settings(Strict):
    """Models that choose their scaling and setting, beside plain ones."""

    models: tuple[ModelName, ...] = Field(
        ("linear", "knn", "svm"),
        min_length=1,
        description="tuned models, each beside its plain one",
    )


def check(settings: Settings, kind: Kind, features: FeatureSettings) -> None:
    """Raise ValueError for a model that chooses nothing."""
    for name in settings.models:
        if not MODELS[name].plain:
            tuned = ", ".join(one for one in MODELS.own if MODELS[one].plain)
            raise ValueError(f"models: {name} chooses nothing; give some of {tuned}")


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return errors and training times of a tuned model and its plain one, and what was chosen."""
    from ajgdata.evaluate.crossval import cross_validate

    data = inputs.data()
    split = inputs.split | {"folds": min(inputs.folds, len(np.unique(data.group)))}
    found = {
        part: cross_validate(data.feature, data.value, data.group, model=name, **split)
        for part, name in ((PLAIN, MODELS[model].plain), (TUNED, model))
    }
    scores = [row for part, one in found.items() for row in fold_scores(model, part, one.scores)]
    choices = (
        {"fold": fold, "choice": one["choice"], "reason": one["reason"]}
        | {"score": one["scores"].get(one["choice"]), "failed": len(one["failed"])}
        for fold, one in enumerate(found[TUNED].choices)
    )
    cost = (
        (model, f"cost of {part}", "train_cpu_s", "measured", one.cost.train_cpu_s)
        for part, one in found.items()
    )
    return Outcome(
        (score_table(scores, "Errors"), table_of(CHOICES, "Choices", choices, **CHOICE_COLUMNS)),
        (score_table(cost, "Cost"),),
    )


class Compared(NamedTuple):
    """A tuned model beside its plain one: scores, by how much it is better (in the metric's unit),
    training time over that of the plain one, the choices with how many folds made each, and how
    many candidates could not be trained, in the fold where most could not."""

    label: str
    plain: Score
    tuned: Score
    gain: FoldDifference
    times: float
    choices: list[tuple[str, int]]
    reasons: list[str]
    failed: int


def compared(results: TaskResults, result: Result) -> Compared:
    """Return what was measured of one model."""
    from ajgdata.evaluate.paired_fold_test import paired_fold_test

    plain, tuned = (_score(result, part, results.metric) for part in (PLAIN, TUNED))
    gain = paired_fold_test(plain.per_fold, tuned.per_fold, metric=results.metric, paired=True)
    spent = {str(row["part"]): float(row["value"] or 0) for row in result.cost[SCORES].rows}
    shortest = max(spent[f"cost of {PLAIN}"], 1e-4)
    table = result.tables[CHOICES]
    counted = Counter(str(row["choice"]) for row in table.rows if not row["reason"])
    reasons = dict.fromkeys(str(row["reason"]) for row in table.rows if row["reason"])
    times = spent[f"cost of {TUNED}"] / shortest
    failed = int(max(table.numbers("failed"), default=0))
    return Compared(
        result.label, plain, tuned, gain, times, counted.most_common(), list(reasons), failed
    )


def _score(result: Result, part: str, metric: str) -> Score:
    table = result.tables[SCORES].where(part=part, metric=metric)
    values = dict(zip(table.column("statistic"), table.numbers("value"), strict=True))
    folds = tuple(float(v) for name, v in values.items() if str(name).startswith("fold "))
    return Score(float(values["mean"]), float(values["sd"]), folds)


def _all(results: TaskResults) -> list[Compared]:
    return [compared(results, result) for result in results.results]


def p_values(results: TaskResults) -> list[float]:
    """Return the p value of each model's gain; NaN if it cannot be tested."""
    return [one.gain.p for one in _all(results)]


def verdicts(results: TaskResults) -> list[Verdict]:
    """Return for each model whether tuning makes it better, corrected for all tests on the page."""
    from ajgdata.evaluate.paired_fold_test import verdict

    corrected = results.corrected(p_values(results))
    return [verdict(one.gain.gain, p) for one, p in zip(_all(results), corrected, strict=True)]


def finding(results: TaskResults) -> str:
    """Return how many models are significantly better, and what tuning costs."""
    models, counts = _all(results), Counter(verdicts(results))
    times = number(float(np.median([m.times for m in models])), 2)
    text = (
        f"Tuning on inner folds lowers the error of {counts['supported']} of {len(models)} models"
    )
    text += f", raises it for {counts['refuted']}" if counts["refuted"] else ""
    return f"{text}; training takes {times} × as long"


def _gain(results: TaskResults, one: Compared) -> str:
    """Return by how much a model is better, with the ends of the interval, in the shown unit."""
    ends = (one.gain.gain, one.gain.low, one.gain.high)
    gain, low, high = (number(results.scale * end, 2) for end in ends)
    interval = f"{low} to {high}" if math.isfinite(one.gain.p) else "not testable"
    return f"{gain} ({interval}) {results.shown_unit}".strip().replace("-", "−")


def figure(results: TaskResults) -> Figure:
    """Return a row for each model: plain and tuned score, joined, and at the right what it is worth
    and costs."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure

    models = _all(results)
    drawn = new_figure(
        (WIDTH_IN, 1.3 + ROW_IN * len(models)),
        finding(results),
        f"{results.title}: {METRIC_NAMES[results.metric]} on the same folds, mean ± sd; at the "
        "right gain with its 95 % interval, and training time over the plain one's",
        [results.source],
    )
    axes = drawn.subplots()
    axes.grid(False, axis="y")
    for row, one in enumerate(models):
        _draw(axes, results, row, one)
    axes.set_yticks(range(len(models)), [one.label for one in models])
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(len(models) - 0.5, -0.7)
    axes.set_xlabel(f"{METRIC_NAMES[results.metric]} ({results.shown_unit})".replace(" ()", ""))
    axes.margins(x=0.06)
    return drawn


def _draw(axes: Axes, results: TaskResults, row: int, one: Compared) -> None:
    from ajgdata.report.canvas import GREY, model_style
    from ajgdata.report.labels import LABEL_PT

    ends = [results.scale * score.mean for score in (one.plain, one.tuned)]
    axes.plot(ends, [row, row], color=GREY, lw=1, zorder=1)
    for place, (name, score) in enumerate(((PLAIN, one.plain), (TUNED, one.tuned))):
        style = {**model_style(place), "ls": "", "ms": 6, "capsize": 2.5}
        style["mfc"] = "white" if name == PLAIN else style["color"]
        sd = results.scale * score.sd
        axes.errorbar(ends[place], row, xerr=sd, label=name if row == 0 else None, **style)
        if row == 0:
            left = ends[place] < ends[1 - place] or (place == 0 and ends[0] == ends[1])
            axes.annotate(name, (ends[place], row), (0, 8), textcoords="offset points",
                          va="bottom", ha="right" if left else "left", fontsize=LABEL_PT,
                          color=style["color"])  # fmt: skip
    told = f"{_gain(results, one)}\n{number(one.times, 2)} × the time"
    axes.annotate(told, (1, row), (6, 0), xycoords=("axes fraction", "data"), va="center",
                  textcoords="offset points", fontsize=LABEL_PT)  # fmt: skip


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    listed = "; ".join(
        f"{one.label}: {mean_sd(one.plain, results.shown_unit, results.scale)} plain, "
        f"{mean_sd(one.tuned, results.shown_unit, results.scale)} tuned"
        for one in _all(results)
    )
    return Caption(
        f"{results.title}, {results.source}. Tuned: scaling and main setting are chosen in each "
        "fold by inner folds of its training part, which divide no group, from a list declared "
        "beforehand. Plain: one scaling and setting for all tasks; k-NN of features as they are "
        "stored. "
        "Folds share training recordings, which the intervals allow for. "
        f"{_correction(results)}",
        f"{finding(results)}. {METRIC_NAMES[results.metric]} of plain and tuned models. {listed}.",
    )


def _correction(results: TaskResults) -> str:
    """Return how verdicts are corrected, in a sentence."""
    from ajgdata.evaluate.paired_fold_test import LEVEL

    count = results.tests_on_page(p_values(results))
    return (
        f"A gain is supported if p < {LEVEL:g}, corrected for the {count} tests on this page "
        "(Holm). It is not testable if all folds differ by the same amount."
    )


def figures(results: TaskResults) -> Sequence[Illustration]:
    """Return the one figure of all models."""
    if not results.results:
        return ()
    return [Illustration(results.named(), caption(results), lambda: figure(results))]


def tables(results: TaskResults) -> Iterator[ShownTable]:
    """Yield score, gain and time of each model, and what was chosen in how many folds."""
    if not results.results:
        return
    heads = ("Model", "Plain|", "Tuned|", "Gain (95 %)|", "Verdict", "p, corrected|",
             "Training time|", "Chosen, folds")  # fmt: skip
    corrected = results.corrected(p_values(results))
    rows = tuple(
        (
            one.label,
            mean_sd(one.plain, results.shown_unit, results.scale),
            mean_sd(one.tuned, results.shown_unit, results.scale),
            _gain(results, one),
            answer,
            number(p, 2),
            f"{number(one.times, 2)} ×",
            "; ".join(_told(one)),
        )
        for one, answer, p in zip(_all(results), verdicts(results), corrected, strict=True)
    )
    caption = (
        "A gain is how much better the tuned model is. Times are CPU time of training. "
        f"{_correction(results)}"
    )
    yield ShownTable(caption, heads, rows)


def _told(one: Compared) -> Iterator[str]:
    """Yield what was chosen, why nothing was, and what could not be."""
    yield from (f"{name}: {count}" for name, count in one.choices)
    yield from one.reasons
    if one.failed:
        yield f"{one.failed} of the candidates could not be trained"


EXPERIMENT = Experiment(
    name="tuning",
    order=12,
    title="Tuning",
    settings=Settings,
    measure=measure,
    figures=figures,
    tables=tables,
    check=check,
    by_model=True,
    p_values=p_values,
)
