"""Cross-validation: the error of models on held-out grasps of a task.

`measure` makes the tables. Figures, rows and the comparison with the paper are made of them in
`cross_validation_results`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import Field

from ajgdata.evaluate.parts import (
    GROUPED,
    OVERALL,
    RANDOM,
    WITHHELD,
    PartColumns,
    elsewhere,
    part_columns,
)
from ajgdata.evaluate.task_data import TaskData, is_among, split_withheld
from ajgdata.experiments import cross_validation_results as shown
from ajgdata.experiments.base import Experiment, Inputs, Outcome
from ajgdata.experiments.cross_validation_paper import paper_comparison
from ajgdata.experiments.scores import ScoreKey, ScoreRow, fold_scores, score_table
from ajgdata.store.metrics import COST
from ajgdata.types import ModelName, Name, Strict
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    from ajgdata.evaluate.crossval import CrossValidation, Predictions, Tested

PREDICTIONS = "predictions"  #: name of the table of predictions
PREDICTION_COLUMNS = {
    "recording": "Recording",
    "split": "Split",
    "test_set": "Tested on",
    "target_values": "Target values",
    "fold": "Fold",
    "y_true": "Truth",
    "y_pred": "Prediction",
    "probability": "Probability",
}
#: Metrics of a split: training recordings that a model used, and that there were.
TRAINED_ON = ("training_recordings_used", "training_recordings_available")


class Settings(Strict):
    """Cross-validation of models on a task; they stand in the task itself."""

    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear", "knn"), description="models that are trained and evaluated"
    )
    compare_random: bool = Field(
        False, description="also evaluate a split that ignores groups, to show its optimistic bias"
    )
    test_on: tuple[Name, ...] = Field(
        (), description="data sets whose recordings the folds' models are tested on as well"
    )


class Evaluation(NamedTuple):
    """Cross-validations by split, and the recordings of their parts by name."""

    splits: dict[str, CrossValidation]
    data: dict[str, TaskData]


def evaluate(
    inputs: Inputs, model: str, test_on: Sequence[str] = (), compare_random: bool = False
) -> Evaluation:
    """Cross-validate `model` on a task, with the data sets `test_on` as further test sets.

    Recordings whose target is withheld are trained on by no fold and predicted by all. So are those
    of the data sets `test_on` whose grasp is not of the task's own, too; of a grasp that is, only
    the fold that holds it out predicts. Withheld values are excluded from `test_on`, so that
    their errors compare with those of the known ones. With fewer groups than folds each group is a
    fold. Raises ValueError for a task that cannot be evaluated, for instance with a single group.
    """
    from ajgdata.evaluate.crossval import cross_validate

    known, withheld = split_withheld(inputs.all_data(), inputs.withhold)
    data = {WITHHELD: withheld} if inputs.withhold else {}
    for name in test_on:
        other = inputs.all_data(name)
        data[elsewhere(name)] = other.where(~is_among(other.value, inputs.withhold))
    options = inputs.split | {"folds": min(inputs.folds, len(np.unique(known.group)))}
    splits = {}
    for split in (GROUPED, RANDOM) if compare_random else (GROUPED,):
        grouped = split == GROUPED
        splits[split] = cross_validate(
            known.feature, known.value, known.group if grouped else None,
            model=model, extra_tests=data if grouped else None, **options,
        )  # fmt: skip
    return Evaluation(splits, {**dict.fromkeys(splits, known), **data})


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return errors, predictions and cost of `model` on the folds of a task."""
    splits, data = evaluate(inputs, model, settings.test_on, settings.compare_random)
    parts: dict[str, CrossValidation | Tested] = {}
    for split, folds in splits.items():
        parts |= {split: folds, **folds.extra_tests}
    scores: list[ScoreRow] = []
    for part, result in parts.items():
        key = ScoreKey(model, *part_columns(part, inputs.dataset))
        scores += fold_scores(result.scores, key)
        scores += _interval_scores(model, part, [(result.predictions, data[part])], inputs)
    for split, folds in splits.items():  # empty if a model learned from all recordings
        for name, counts in zip(TRAINED_ON, zip(*folds.thinned, strict=True), strict=False):
            count = float(np.mean(counts))
            scores.append(ScoreRow(name, "mean", count, ScoreKey(model, split)))
    if inputs.kind == "regression" and WITHHELD in data:
        scores += _overall_scores(model, splits[GROUPED], data, inputs)
    predicted = (
        row
        for part, result in parts.items()
        for row in _rows(data[part], part_columns(part, inputs.dataset), result.predictions)
    )
    costs = (
        ScoreRow(name, COST, value, ScoreKey(model, split))
        for split, folds in splits.items()
        for name, value in dataclasses.asdict(folds.cost).items()
    )
    counts = ("recordings", "groups", "folds")
    about = {part: {c: getattr(r.scores, c) for c in counts} for part, r in parts.items()}
    return Outcome(
        (
            score_table(scores, "Errors"),
            table_of(PREDICTIONS, "Held-out predictions", predicted, **PREDICTION_COLUMNS),
        ),
        (score_table(costs, "Cost"),),
        {"parts": about, "classes": list(splits[GROUPED].scores.classes)},
    )


def _overall_scores(
    model: str, result: CrossValidation, data: Mapping[str, TaskData], inputs: Inputs
) -> Iterator[ScoreRow]:
    """Yield rows of scores of known and withheld recordings together."""
    from ajgdata.evaluate.crossval import deviation, overall, overall_chance

    known, withheld = result.predictions, result.extra_tests[WITHHELD].predictions
    chance = overall_chance(known, withheld, inputs.period_deg)
    key = ScoreKey(model, *part_columns(OVERALL, inputs.dataset))
    for metric, values in overall(known, withheld, inputs.period_deg).items():
        statistics = {f"fold {fold}": value for fold, value in enumerate(values)}
        statistics["mean"] = float(np.mean(values))
        statistics["sd"] = deviation(values)
        statistics["chance"] = float(np.mean(chance[metric]))
        for statistic, value in statistics.items():
            yield ScoreRow(metric, statistic, value, key)
    tests = [(known, data[GROUPED]), (withheld, data[WITHHELD])]
    yield from _interval_scores(model, OVERALL, tests, inputs)


def _interval_scores(
    model: str, part: str, tests: Sequence[tuple[Predictions, TaskData]], inputs: Inputs
) -> Iterator[ScoreRow]:
    """Yield the ends of the interval over grasps of the metric that is read first.

    `tests` are predictions, and the recordings that their rows count in: of known and withheld
    values together there are two.
    """
    from ajgdata.evaluate.agreement import GRASP_INTERVAL
    from ajgdata.evaluate.intervals import metric_interval
    from ajgdata.evaluate.metrics import METRICS

    y_true, y_pred, fold = (
        np.concatenate([getattr(predictions, key) for predictions, _ in tests])
        for key in ("y_true", "y_pred", "fold")
    )
    group = np.concatenate([data.group[predictions.row] for predictions, data in tests])
    parts = np.repeat(np.arange(len(tests)), [len(p.row) for p, _ in tests])
    interval = metric_interval(
        y_true, y_pred, fold, group, part=parts, kind=inputs.kind, period=inputs.period_deg,
        seed=inputs.seed,
    )  # fmt: skip
    metric = METRICS[inputs.kind][0]
    key = ScoreKey(model, *part_columns(part, inputs.dataset))
    for end, value in zip(GRASP_INTERVAL, interval, strict=True):
        yield ScoreRow(metric, end, value, key)


def _rows(data: TaskData, part: PartColumns, predictions: Predictions) -> Iterator[dict[str, Any]]:
    """Yield a row of `PREDICTION_COLUMNS` per predicted recording."""
    row, probability = predictions.row, predictions.probability
    columns = {
        "recording": data.name[row],
        "fold": predictions.fold,
        "y_true": predictions.y_true,
        "y_pred": predictions.y_pred,
        "probability": [None] * len(row) if probability is None else probability,
    }
    for values in zip(*columns.values(), strict=True):
        yield {**part._asdict(), **dict(zip(columns, values, strict=True))}


EXPERIMENT = Experiment(
    name="cross_validation",
    title="Cross-validation",
    settings=Settings,
    measure=measure,
    plots=shown.PLOTS,
    own_rows=shown.rows,
    summary=shown.summary,
    advice=shown.advice,
    paper_comparison=paper_comparison,
    order=1,
    by_model=True,
)
