"""Repeated fits: the score on other data sets over many fits, as a median with an interval.

The fits differ by their folds and by the random state of the model. The models are trained on the
task's own data set only.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from ajgdata.evaluate.agreement import Estimate, Interval
from ajgdata.evaluate.crossval import cross_validate
from ajgdata.evaluate.fold_tests import grasp_errors, repeat_seed, robust_score
from ajgdata.evaluate.metrics import METRICS, perfect_value
from ajgdata.evaluate.parts import elsewhere, part_columns
from ajgdata.evaluate.splits import balanced_folds, column_folds
from ajgdata.experiments.base import Experiment, Inputs, Lookup, Outcome, Result, TaskResults
from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.plots import Plot
from ajgdata.experiments.scores import SCORES, ScoreKey, ScoreRow, score_table
from ajgdata.experiments.settings import RepeatedFitsSettings
from ajgdata.report.comparison import Mark, PaperComparison, judged, mark_of
from ajgdata.report.format import Score, mean_sd
from ajgdata.store.metrics import COST
from ajgdata.types.table import Table, table_of


def measure(inputs: Inputs, settings: RepeatedFitsSettings, model: str) -> Outcome:
    """Return the score of `model` on each data set: each fit, the median, and its interval."""
    own = inputs.data()
    tests = {name: inputs.data(name) for name in settings.test_on}
    errors: dict[str, list[np.ndarray]] = {name: [] for name in tests}
    chance: dict[str, list[float]] = {name: [] for name in tests}
    task = inputs.task_settings
    metric = METRICS[task.kind][0]
    begun = time.process_time()
    count = inputs.fold_count(own.group)
    for repeat in range(settings.repeats):
        seed = repeat_seed(inputs.seed, repeat)
        folds = column_folds(own.value, own.group, task.groups, task.kind, count, seed)
        if task.balance:
            folds = balanced_folds(folds, own.value, own.group)
        result = cross_validate(
            own.feature,
            own.value,
            own.group,
            model=model,
            extra_tests=tests,
            kind=task.kind,
            folds=folds,
            seed=seed,
            period=task.period_deg,
        )
        for name, rows in errors.items():
            predictions = result.extra_tests[name].predictions
            rows.append(grasp_errors(predictions, tests[name].group, task.period_deg))
            chance[name].append(result.extra_tests[name].scores.chance[metric])
    spent = time.process_time() - begun
    scores: list[ScoreRow] = []
    for name, rows in errors.items():
        score = robust_score(np.array(rows), task.kind, inputs.seed)
        statistics = {
            **{f"fit {number}": value for number, value in enumerate(score.per_fit)},
            "median": score.median,
            "low": score.low,
            "high": score.high,
            "chance": float(np.mean(chance[name])),
        }
        key = ScoreKey(model, *part_columns(elsewhere(name), inputs.dataset))
        scores += [
            ScoreRow(metric, statistic, value, key) for statistic, value in statistics.items()
        ]
    counts = {name: [len(np.unique(d.group)), len(d.group)] for name, d in tests.items()}
    cost = [ScoreRow("train_and_predict_s", COST, spent, ScoreKey(model))]
    title = "Repeated fits"
    return Outcome((score_table(scores, title),), (score_table(cost, title),), {"counts": counts})


def statistics(result: Result, name: str) -> dict[str, float]:
    """Return median, ends of the interval and chance level of the score on a data set, by name."""
    rows = result.tables[SCORES].where(test_set=name).rows
    return {str(row["statistic"]): float(row["value"]) for row in rows}


def medians(results: TaskResults) -> Table:
    """Return the median of all fits with its interval, per model and data set."""
    rows = []
    for name in results.settings.test_on:
        for result in results.results:
            values = statistics(result, name)
            row = {"model": result.label, "dataset": name, "metric": results.metric}
            rows.append(row | values | {"value": values["median"]})
    columns = {"model": "Model", "dataset": "Tested on", "metric": "Metric"}
    title = results.metric_title
    return table_of("errors", "Errors", rows, **columns, value=title, low="From", high="To")


FITS_PLOT = Plot(
    "rows",
    medians,
    "median over repeated cross-validations with other folds and seeds, of models that are "
    "trained on the data set of the task only; bootstrap over grasps and fits",
    x="dataset",
    cells={"model": "label", "dataset": "data set"},
    metric="metric",
    interval=("low", "high"),
    published="value",
)


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield the median over fits of the first model on the first data set, and other models."""
    paper = results.paper
    if paper is None or paper.value is None:
        return
    name = results.settings.test_on[0]
    first, *further = results.results
    median, low, high, chance = (
        statistics(first, name)[key] for key in ("median", "low", "high", "chance")
    )
    points = FITS_PLOT.bind(results).points_with(dataset=name)
    shown = [mean_sd(point.score, results.shown_unit) for point in points]
    text = [shown[0]]
    text += [f"{other.label}: {said}" for other, said in zip(further, shown[1:], strict=True)]
    score = Estimate(median, Interval(low, high), chance, perfect_value(results.metric))
    verdict, remark = judged(paper, score, paper.value / results.scale, scale=results.scale)
    scale = results.scale
    own = Mark("ours", scale * median, scale * low, scale * high)
    marks = own, mark_of("chance", Score(chance, 0.0), scale)
    yield results.compared(paper, "; ".join(text), first.label, verdict, remark=remark, marks=marks)


EXPERIMENT = Experiment(
    BUILT_IN["repeated_fits"],
    measure=measure,
    plots=(FITS_PLOT,),
    paper_comparison=paper_comparison,
)
