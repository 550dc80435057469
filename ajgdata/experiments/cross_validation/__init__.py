"""Cross-validation: how well a model reads a target from grasps that it has never heard.

`measure` makes the tables; `results` reads them back; what is drawn and shown of them stands in the
other modules of this package, which are imported when a page is made.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import Field

from ajgdata.evaluate.task_data import TaskData, is_among, split_withheld
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Outcome,
    ScoreRow,
    TaskResults,
    fold_scores,
    score_table,
)
from ajgdata.experiments.cross_validation import shown
from ajgdata.experiments.cross_validation.results import (
    GROUPED,
    OVERALL,
    RANDOM,
    TRAINED_ON,
    WITHHELD,
    elsewhere,
    training_cost,
)
from ajgdata.report.blocks import Illustration
from ajgdata.types import ModelName, Name, NotPossibleError, Strict
from ajgdata.types.table import Table, table_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ajgdata.evaluate.crossval import CrossValidation, Predictions, Tested

PREDICTION_COLUMNS = {
    "recording": "Recording", "split": "Split", "fold": "Fold", "y_true": "Truth",
    "y_pred": "Prediction", "probability": "Probability",
}  # fmt: skip


class Settings(Strict):
    """Cross-validation of models on a task; they stand in the task itself."""

    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear", "knn"), description="models that are trained and evaluated"
    )
    compare_random: bool = Field(
        False, description="also evaluate a split that ignores the groups, to show what it flatters"
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
    the fold that holds it out predicts. Withheld values are left out of these data sets, so that
    their errors compare with those of the known ones. With fewer groups than folds each group is a
    fold. Raises ValueError for a task that cannot be evaluated, for instance with a single group.
    """
    from ajgdata.evaluate.crossval import ExtraTestSet, cross_validate

    known, held = split_withheld(inputs.all_data(), inputs.withhold)
    _check_magnitude(known.value, inputs.target)
    data = {WITHHELD: held} if inputs.withhold else {}
    for name in test_on:
        other = inputs.all_data(name)
        data[elsewhere(name)] = other.where(~is_among(other.value, inputs.withhold))
    extra = {part: ExtraTestSet(d.feature, d.value, d.group) for part, d in data.items()}
    named = inputs.split | {"folds": min(inputs.folds, len(np.unique(known.group)))}
    splits = {}
    for split in (GROUPED, RANDOM) if compare_random else (GROUPED,):
        grouped = split == GROUPED
        splits[split] = cross_validate(
            known.feature, known.value, known.group if grouped else None,
            model=model, extra_tests=extra if grouped else None, **named,
        )  # fmt: skip
    return Evaluation(splits, {**dict.fromkeys(splits, known), **data})


def _check_magnitude(value: NDArray[Any], target: str) -> None:
    """Raise NotPossibleError for numbers whose squares leave float32, in which models compute."""
    if value.dtype.kind == "U":
        return
    spread, limits = float(np.ptp(value)), np.finfo(np.float32)
    if not math.sqrt(limits.tiny) < spread < math.sqrt(limits.max):
        problem = f"errors of {target!r} are too large or too small to compute with"
        raise NotPossibleError(f"{problem}: give it in another unit")


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return errors, predictions and cost of `model` on the folds of a task."""
    found = evaluate(inputs, model, settings.test_on, settings.compare_random)
    parts: dict[str, CrossValidation | Tested] = {}
    for split, result in found.splits.items():
        parts |= {split: result, **result.extra_tests}
    known, grouped = found.data[GROUPED], found.splits[GROUPED].scores
    scores = _scores(model, parts, found.data, inputs)
    scores += _thinned_scores(model, found.splits)
    if inputs.kind == "regression":
        scores += _overall_scores(model, found.splits[GROUPED], found.data, inputs)
    predicted = (
        row
        for part, one in parts.items()
        for row in _rows(found.data.get(part, known), part, one.predictions)
    )
    counts = ("recordings", "groups", "folds")
    about = {part: {c: getattr(one.scores, c) for c in counts} for part, one in parts.items()}
    return Outcome(
        (
            score_table(scores, "Errors"),
            table_of("predictions", "Held-out predictions", predicted, **PREDICTION_COLUMNS),
        ),
        (_cost_table(model, found.splits),),
        {"parts": about, "classes": list(grouped.classes)},
    )


def _thinned_scores(model: str, splits: Mapping[str, CrossValidation]) -> Iterator[ScoreRow]:
    """Yield on how many recordings a fold's model was trained, of how many, where not on all."""
    for split, found in splits.items():
        for name, counts in zip(TRAINED_ON, zip(*found.thinned, strict=True), strict=False):
            yield model, f"training of {split}", name, "mean", float(np.mean(counts))


def _scores(
    model: str,
    parts: Mapping[str, CrossValidation | Tested],
    data: Mapping[str, TaskData],
    inputs: Inputs,
) -> list[ScoreRow]:
    """Return errors of each part by fold, and their intervals over grasps.

    Parts without recordings of their own are other splits of the known ones.
    """
    rows: list[ScoreRow] = []
    for part, one in parts.items():
        tests = [(one.predictions, data.get(part, data[GROUPED]))]
        rows += fold_scores(model, part, one.scores)
        rows += grasp_interval_scores(model, part, tests, inputs)
    return rows


def _overall_scores(
    model: str, found: CrossValidation, data: Mapping[str, TaskData], inputs: Inputs
) -> Iterator[ScoreRow]:
    """Yield rows of scores of known and withheld recordings together, if some are withheld."""
    from ajgdata.evaluate.crossval import deviation
    from ajgdata.evaluate.withheld import overall, overall_chance

    if WITHHELD not in found.extra_tests:
        return
    known, held = found.predictions, found.extra_tests[WITHHELD].predictions
    chance = overall_chance(known, held, inputs.period_deg)
    for metric, values in overall(known, held, inputs.period_deg).items():
        for fold, value in enumerate(values):
            yield model, OVERALL, metric, f"fold {fold}", value
        yield model, OVERALL, metric, "mean", float(np.mean(values))
        yield model, OVERALL, metric, "sd", deviation(values)
        yield model, OVERALL, metric, "chance", float(np.mean(chance[metric]))
    tests = [(known, data[GROUPED]), (held, data[WITHHELD])]
    yield from grasp_interval_scores(model, OVERALL, tests, inputs)


def grasp_interval_scores(
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
        np.concatenate([getattr(one, key) for one, _ in tests])
        for key in ("y_true", "y_pred", "fold")
    )
    group = np.concatenate([data.group[one.row] for one, data in tests])
    parts = np.repeat(np.arange(len(tests)), [len(one.row) for one, _ in tests])
    interval = metric_interval(
        y_true, y_pred, fold, group, part=parts, kind=inputs.kind, period=inputs.period_deg,
        seed=inputs.seed,
    )  # fmt: skip
    for end, value in zip(GRASP_INTERVAL, interval, strict=True):
        yield model, part, METRICS[inputs.kind][0], end, value


def _rows(data: TaskData, part: str, found: Predictions) -> Iterator[dict[str, Any]]:
    probability = [None] * len(found.row) if found.probability is None else found.probability
    columns = (data.name[found.row], found.fold, found.y_true, found.y_pred, probability)
    for name, fold, true, predicted, p in zip(*columns, strict=True):
        row = {"recording": name, "split": part, "fold": fold}
        yield row | {"y_true": true, "y_pred": predicted, "probability": p}


def _cost_table(model: str, splits: Mapping[str, CrossValidation]) -> Table:
    """Return what training and predicting took."""
    measured = (
        (model, f"cost of {split}", name, "measured", value)
        for split, result in splits.items()
        for name, value in dataclasses.asdict(result.cost).items()
    )
    return score_table(measured, "Cost")


def _figures(results: TaskResults) -> Iterable[Illustration]:
    """Return the figures of one task."""
    from ajgdata.experiments.cross_validation.figures import illustrations  # matplotlib

    return illustrations(results)


def _across(results: Sequence[TaskResults]) -> Iterable[Illustration]:
    """Return the figures of all tasks together."""
    from ajgdata.experiments.cross_validation.figures import across  # matplotlib

    return across(results)


EXPERIMENT = Experiment(
    name="cross_validation",
    title="Cross-validation",
    settings=Settings,
    measure=measure,
    figures=_figures,
    rows=shown.rows,
    summary=shown.summary,
    paper_comparison=shown.paper_comparison,
    across=_across,
    training_cost=training_cost,
    order=1,
    by_model=True,
)
