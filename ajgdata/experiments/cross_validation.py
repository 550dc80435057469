"""Cross-validation: the error of models on held-out grasps of a task.

`measure` makes the tables. Figures, rows and the comparison with the paper are made of them in
`cross_validation_results`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import Field

from ajgdata.evaluate.design import Design, recording_design
from ajgdata.evaluate.parts import (
    BY_GROUP,
    BY_SESSION,
    GROUPED,
    PLACEBO_VALUES,
    RANDOM,
    SESSION_SPLIT,
    SESSIONS,
    SESSIONS_WITHHELD,
    WITHHELD,
    PartColumns,
    ValueParts,
    elsewhere,
    part_columns,
    placebo,
)
from ajgdata.evaluate.task_data import TaskData, is_among, labels_of, split_withheld
from ajgdata.experiments import cross_validation_results as shown
from ajgdata.experiments.base import Experiment, Inputs, Outcome
from ajgdata.experiments.cross_validation_paper import paper_comparison
from ajgdata.experiments.scores import ScoreKey, ScoreRow, fold_scores, score_table
from ajgdata.store.metrics import COST
from ajgdata.types import ModelName, Name, NotPossibleError, Strict
from ajgdata.types.session import PLACEMENT_COLUMN, SESSION_COLUMN
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
    compare_sessions: bool | tuple[ModelName, ...] = Field(
        True,
        description="also evaluate held-out sessions, if there are two or more: all models, none, "
        "or the named ones",
    )
    test_on: tuple[Name, ...] = Field(
        (), description="data sets whose recordings the folds' models are tested on as well"
    )
    placebo: Name | None = Field(
        None, description="data set of one object under the names of the classes"
    )

    def compares_sessions(self, model: str) -> bool:
        """Return whether a model is also evaluated on held-out sessions."""
        if isinstance(self.compare_sessions, bool):
            return self.compare_sessions
        return model in self.compare_sessions


class SplitResults(NamedTuple):
    """Cross-validations by their part, and the recordings of all parts by name."""

    splits: dict[str, CrossValidation]
    data: dict[str, TaskData]


def evaluate(
    inputs: Inputs, model: str, test_on: Sequence[str] = (), compare_random: bool = False
) -> SplitResults:
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
    options = inputs.split_of(known.group) | {"model": model}
    splits = {
        GROUPED: cross_validate(
            known.feature,
            known.value,
            known.group,
            extra_tests=data,
            column=inputs.groups,
            grasps=known_grasps(inputs),
            **options,
        )
    }
    if compare_random:
        splits[RANDOM] = cross_validate(known.feature, known.value, None, **options)
    return SplitResults(splits, {**dict.fromkeys(splits, known), **data})


def known_grasps(inputs: Inputs) -> np.ndarray:
    """Return the grasp (n,) of each recording whose value is not withheld."""
    return split_withheld(inputs.all_data(groups="grasp_id"), inputs.withhold)[0].group


def evaluate_sessions(inputs: Inputs, model: str) -> SplitResults | None:
    """Cross-validate `model` with sessions held out; None if it would repeat the task's own split.

    It would, with a single session, if sessions are the groups of the task, and if placements are
    and each class has one per session. Withheld values are tested in the sessions that a fold
    holds out. Settings are chosen by sessions, or by grasps if one session is left to train on.
    """
    from ajgdata.evaluate.crossval import cross_validate

    known, withheld = split_withheld(inputs.all_data(), inputs.withhold)
    in_sessions = known.by_session()
    if len(np.unique(in_sessions.group)) < 2 or inputs.groups == SESSION_COLUMN:
        return None
    if inputs.groups == PLACEMENT_COLUMN and have_one_placement(known, in_sessions.group):
        return None
    data = {SESSIONS_WITHHELD: withheld} if inputs.withhold else {}
    result = cross_validate(
        known.feature,
        known.value,
        in_sessions.group,
        model=model,
        extra_tests={part: rows.by_session() for part, rows in data.items()},
        grasps=known_grasps(inputs),
        **inputs.split_of(in_sessions.group),
    )
    return SplitResults({SESSIONS: result}, {SESSIONS: known, **data})


def have_one_placement(data: TaskData, sessions: np.ndarray) -> bool:
    """Return whether each value has one placement, the groups of `data`, in each of its sessions.

    `sessions` (n,) are those of the recordings.
    """
    units = {*zip(data.value.tolist(), sessions.tolist(), strict=True)}
    return len(np.unique(data.group)) == len(units)


def evaluate_placebo(inputs: Inputs, model: str, settings: Settings) -> SplitResults | None:
    """Cross-validate `model` on one object under several names, by the splits of the task.

    The recordings are in the data set `settings.placebo`, or else in that of the task: None if it
    has none, and for a regression, because names are no numbers.
    """
    from ajgdata.evaluate.crossval import cross_validate

    other = settings.placebo
    has_own = bool(inputs.placebo_objects) and inputs.kind == "classification"
    if other is None and not has_own:
        return None
    data = inputs.placebo_data(other)
    options = inputs.split_of(data.group) | {"model": model}
    name = other or inputs.dataset
    splits = {
        placebo(name): cross_validate(
            data.feature, data.value, data.group, column=inputs.groups, **options
        )
    }
    if settings.compare_random:
        splits[placebo(name, RANDOM)] = cross_validate(data.feature, data.value, None, **options)
    in_sessions = data.by_session()
    if len(np.unique(in_sessions.group)) > 1 and inputs.groups != SESSION_COLUMN:
        splits[placebo(name, SESSION_SPLIT)] = cross_validate(
            data.feature,
            data.value,
            in_sessions.group,
            model=model,
            grasps=data.group,
            **inputs.split_of(in_sessions.group),
        )
    return SplitResults(splits, dict.fromkeys(splits, data))


def evaluate_controls(
    inputs: Inputs, model: str, settings: Settings
) -> tuple[SplitResults, dict[str, str]]:
    """Return held-out sessions and the placebo, and the reason of each that is not possible.

    For example, a class may be in one session only. The score of the task is possible then.
    """
    controls = {"placebo": partial(evaluate_placebo, inputs, model, settings)}
    if settings.compares_sessions(model):
        controls["held-out sessions"] = partial(evaluate_sessions, inputs, model)
    together = SplitResults({}, {})
    unmeasured: dict[str, str] = {}
    for name, evaluate_control in controls.items():
        try:
            control = evaluate_control()
        except NotPossibleError as error:
            unmeasured[name] = str(error)
            continue
        if control is not None:
            together.splits.update(control.splits)
            together.data.update(control.data)
    return together, unmeasured


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return errors, predictions and cost of `model` on the folds of a task."""
    splits, data = evaluate(inputs, model, settings.test_on, settings.compare_random)
    controls, unmeasured = evaluate_controls(inputs, model, settings)
    splits, data = {**splits, **controls.splits}, {**data, **controls.data}
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
            scores.append(ScoreRow(name, "mean", count, _cost_key(model, split, inputs)))
    for split_parts in (BY_GROUP, BY_SESSION):
        if inputs.kind == "regression" and split_parts.withheld in data:
            scores += _overall_scores(model, split_parts, splits, data, inputs)
    predicted = (
        row
        for part, result in parts.items()
        for row in _rows(data[part], part_columns(part, inputs.dataset), result.predictions)
    )
    costs = (
        ScoreRow(name, COST, value, _cost_key(model, split, inputs))
        for split, folds in splits.items()
        for name, value in dataclasses.asdict(folds.cost).items()
    )
    counts = ("recordings", "groups", "folds")
    about = {part: {c: getattr(r.scores, c) for c in counts} for part, r in parts.items()}
    design = design_of(inputs, data[GROUPED])
    return Outcome(
        (
            score_table(scores, "Errors"),
            table_of(PREDICTIONS, "Held-out predictions", predicted, **PREDICTION_COLUMNS),
        ),
        (score_table(costs, "Cost"),),
        {
            "parts": about,
            "classes": list(splits[GROUPED].scores.classes),
            "design": design._asdict(),
            "unmeasured": unmeasured,
        },
    )


def design_of(inputs: Inputs, data: TaskData) -> Design:
    """Return the design of the recordings of a task."""
    sessions = data.by_session().group.tolist()
    placements = None
    if PLACEMENT_COLUMN in inputs.store.columns:
        placements = labels_of(inputs.store, data, PLACEMENT_COLUMN).tolist()
    return recording_design(data.value.tolist(), sessions, placements)


def _cost_key(model: str, part: str, inputs: Inputs) -> ScoreKey:
    """Return the key of what training on a part cost; a placebo is named by its data set."""
    columns = part_columns(part, inputs.dataset)
    is_placebo = columns.target_values == PLACEBO_VALUES
    return ScoreKey(model, columns.split, columns.test_set if is_placebo else "")


def _overall_scores(
    model: str,
    parts: ValueParts,
    splits: Mapping[str, CrossValidation],
    data: Mapping[str, TaskData],
    inputs: Inputs,
) -> Iterator[ScoreRow]:
    """Yield rows of scores of known and withheld recordings together, for the parts of a split."""
    from ajgdata.evaluate.crossval import deviation, overall, overall_chance

    result = splits[parts.training]
    known, withheld = result.predictions, result.extra_tests[parts.withheld].predictions
    chance = overall_chance(known, withheld, inputs.period_deg)
    key = ScoreKey(model, *part_columns(parts.overall, inputs.dataset))
    for metric, values in overall(known, withheld, inputs.period_deg).items():
        statistics = {f"fold {fold}": value for fold, value in enumerate(values)}
        statistics["mean"] = float(np.mean(values))
        statistics["sd"] = deviation(values)
        statistics["chance"] = float(np.mean(chance[metric]))
        for statistic, value in statistics.items():
            yield ScoreRow(metric, statistic, value, key)
    tests = [(known, data[parts.training]), (withheld, data[parts.withheld])]
    yield from _interval_scores(model, parts.overall, tests, inputs)


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
        y_true,
        y_pred,
        fold,
        group,
        part=parts,
        kind=inputs.kind,
        period=inputs.period_deg,
        seed=inputs.seed,
    )
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
