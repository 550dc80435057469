"""Cross-validation: the error of models on held-out grasps of a task.

`measure` returns the tables. `cross_validation_results` makes figures and rows from them, and
`cross_validation_paper` the comparison with the paper.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ajgdata.evaluate.agreement import GRASP_INTERVAL, Interval
from ajgdata.evaluate.crossval import (
    CrossValidation,
    Predictions,
    Tested,
    cross_validate,
    deviation,
    estimate_score,
    overall,
    overall_chance,
    overall_interval,
)
from ajgdata.evaluate.design import Design, recording_design
from ajgdata.evaluate.metrics import METRICS
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
from ajgdata.evaluate.splits import balanced_folds, column_folds, grouped_folds, random_folds
from ajgdata.evaluate.task_data import (
    TaskData,
    TrainingCopies,
    column_labels,
    is_among,
    split_withheld,
)
from ajgdata.experiments import cross_validation_results as shown
from ajgdata.experiments.base import Experiment, Inputs, Outcome
from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.cross_validation_paper import paper_comparison
from ajgdata.experiments.scores import (
    POSITIONS,
    PREDICTIONS,
    ScoreKey,
    ScoreRow,
    axis_column,
    fold_scores,
    fold_statistic,
    score_table,
)
from ajgdata.experiments.surface_map import surface_maps
from ajgdata.models.tuning import Folds
from ajgdata.store.metrics import COST
from ajgdata.types import CrossValidationSettings, NotPossibleError
from ajgdata.types.session import PLACEMENT_COLUMN, SESSION_COLUMN
from ajgdata.types.table import Table, table_of

PREDICTION_TITLES = {
    "recording": "Recording",
    "split": "Split",
    "test_set": "Tested on",
    "target_values": "Target values",
    "fold": "Fold",
    "y_true": "Truth",
    "y_pred": "Prediction",
    "probability": "Probability",
}
#: Columns of predictions that each axis of a vector has.
VALUES = ("y_true", "y_pred")
#: Metrics of a split: training recordings that a model used, and that there were.
TRAINED_ON = ("training_recordings_used", "training_recordings_available")


class SplitResults(NamedTuple):
    """Cross-validations by their part, and the recordings of all parts by name."""

    splits: dict[str, CrossValidation]
    data: dict[str, TaskData]


def evaluate(
    inputs: Inputs, model: str, test_on: Sequence[str] = (), compare_random: bool = False
) -> SplitResults:
    """Cross-validate `model` on a task, with the data sets `test_on` as further test sets.

    No fold trains on recordings whose target is withheld, and each fold predicts them. Recordings
    of the data sets `test_on` are predicted by each fold that does not train on their grasp.
    Withheld values are excluded from `test_on`, so that their errors compare with those of the
    training values. With fewer groups than folds, each group is a fold. Raises ValueError for a
    task that cannot be evaluated, for instance with a single group.
    """
    task = inputs.task_settings
    known, withheld = split_withheld(inputs.all_data(), task.withhold)
    copies = inputs.copies(known)
    data = {WITHHELD: withheld} if task.withhold else {}
    for name in test_on:
        other = inputs.all_data(name)
        data[elsewhere(name)] = other.where(~is_among(other.value, task.withhold))
    splits = {
        GROUPED: cross_validated(
            inputs,
            model,
            known,
            known.group,
            folds=folds_of_task(inputs, known),
            extra_tests=data,
            grasps=known_grasps(inputs),
            copies=copies,
        )
    }
    if compare_random:
        count = inputs.fold_count(known.group)
        splits[RANDOM] = cross_validated(inputs, model, known, None, folds=count, copies=copies)
    return SplitResults(splits, {**dict.fromkeys(splits, known), **data})


def folds_of_task(inputs: Inputs, data: TaskData) -> Folds:
    """Return the folds of a task, which hold out its groups, for the recordings `data`."""
    task = inputs.task_settings
    count = inputs.fold_count(data.group)
    return column_folds(data.value, data.group, task.groups, task.kind, count, inputs.seed)


def cross_validated(
    inputs: Inputs,
    model: str,
    data: TaskData,
    group: np.ndarray | None,
    *,
    folds: int | Folds,
    extra_tests: Mapping[str, TaskData] | None = None,
    grasps: np.ndarray | None = None,
    copies: TrainingCopies | None = None,
) -> CrossValidation:
    """Return the cross-validation of `model` on recordings of a task; see `cross_validate`.

    `group` (n,) is never split; it is None for a random split. The training parts are balanced if
    the task requests this.
    """
    task = inputs.task_settings
    if task.balance:
        if not isinstance(folds, int):
            pairs = folds
        elif group is None:
            pairs = random_folds(data.value, task.kind, folds, inputs.seed)
        else:
            pairs = grouped_folds(data.value, group, task.kind, folds, inputs.seed)
        folds = balanced_folds(pairs, data.value, data.group)
    return cross_validate(
        data.feature,
        data.value,
        group,
        kind=task.kind,
        model=model,
        folds=folds,
        seed=inputs.seed,
        period=task.period_deg,
        extra_tests=extra_tests,
        grasps=grasps,
        copies=copies,
        layout=inputs.layout,
    )


def known_grasps(inputs: Inputs) -> np.ndarray:
    """Return the grasp (n,) of each recording whose value is not withheld."""
    by_grasp = inputs.all_data(groups="grasp_id")
    return split_withheld(by_grasp, inputs.task_settings.withhold)[0].group


def evaluate_sessions(inputs: Inputs, model: str) -> SplitResults | None:
    """Cross-validate `model` with sessions held out; None if it would repeat the task's own split.

    It would, with a single session, if sessions are the groups of the task, and if placements are
    and each class has one per session. Withheld values are tested in the sessions that a fold
    holds out. Settings are chosen by sessions, or by grasps if one session is left to train on.
    """
    task = inputs.task_settings
    known, withheld = split_withheld(inputs.all_data(), task.withhold)
    session = known.by_session().group
    if len(np.unique(session)) < 2 or task.groups == SESSION_COLUMN:
        return None
    if task.groups == PLACEMENT_COLUMN and have_one_placement(known, session):
        return None
    data = {SESSIONS_WITHHELD: withheld} if task.withhold else {}
    result = cross_validated(
        inputs,
        model,
        known,
        session,
        folds=inputs.fold_count(session),
        extra_tests={part: rows.by_session() for part, rows in data.items()},
        grasps=known_grasps(inputs),
        copies=inputs.copies(known),
    )
    return SplitResults({SESSIONS: result}, {SESSIONS: known, **data})


def have_one_placement(data: TaskData, sessions: np.ndarray) -> bool:
    """Return whether each value has one placement, the groups of `data`, in each of its sessions.

    `sessions` (n,) are those of the recordings.
    """
    units = {*zip(data.values(), sessions.tolist(), strict=True)}
    return len(np.unique(data.group)) == len(units)


def evaluate_placebo(
    inputs: Inputs, model: str, settings: CrossValidationSettings
) -> SplitResults | None:
    """Cross-validate `model` on one object under several names, by the splits of the task.

    The recordings are in the data set `settings.placebo`, or else in that of the task; None if
    there are none.
    """
    task = inputs.task_settings
    other = settings.placebo
    data = inputs.placebo_data(other)
    if data is None:
        return None
    copies = inputs.copies(data, other)
    name = other or inputs.dataset
    splits = {
        placebo(name): cross_validated(
            inputs, model, data, data.group, folds=folds_of_task(inputs, data), copies=copies
        )
    }
    if settings.compare_random:
        count = inputs.fold_count(data.group)
        splits[placebo(name, RANDOM)] = cross_validated(
            inputs, model, data, None, folds=count, copies=copies
        )
    session = data.by_session().group
    if len(np.unique(session)) > 1 and task.groups != SESSION_COLUMN:
        splits[placebo(name, SESSION_SPLIT)] = cross_validated(
            inputs,
            model,
            data,
            session,
            folds=inputs.fold_count(session),
            grasps=data.group,
            copies=copies,
        )
    return SplitResults(splits, dict.fromkeys(splits, data))


def evaluate_controls(
    inputs: Inputs, model: str, settings: CrossValidationSettings
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


def measure(inputs: Inputs, settings: CrossValidationSettings, model: str) -> Outcome:
    """Return errors, predictions and cost of `model` on the folds of a task."""
    positions = []
    if inputs.task_settings.map:
        positions = [position_table(inputs, inputs.data(), inputs.task_settings.map)]
    own = evaluate(inputs, model, settings.test_on, settings.compare_random)
    controls, unmeasured = evaluate_controls(inputs, model, settings)
    splits = {**own.splits, **controls.splits}
    data = {**own.data, **controls.data}
    parts: dict[str, CrossValidation | Tested] = {}
    for split, folds in splits.items():
        parts[split] = folds
        parts.update(folds.extra_tests)
    scores: list[ScoreRow] = []
    for part, result in parts.items():
        key = ScoreKey(model, *part_columns(part, inputs.dataset))
        scores += _score_rows(inputs, result, data[part].group, key)
        for number, axis in enumerate(inputs.task_settings.axes):
            of_axis = Tested(result.scores.axes[number], result.predictions.axis(number))
            scores += _score_rows(inputs, of_axis, data[part].group, key._replace(condition=axis))
    for split, folds in splits.items():  # `thinned` is empty if a model used all recordings
        for name, counts in zip(TRAINED_ON, zip(*folds.thinned, strict=True), strict=False):
            count = float(np.mean(counts))
            scores.append(ScoreRow(name, "mean", count, _cost_key(model, split, inputs)))
    for split_parts in (BY_GROUP, BY_SESSION):
        if inputs.task_settings.kind == "regression" and split_parts.withheld in data:
            scores += _overall_scores(model, split_parts, splits, data, inputs)
    predicted = (
        row
        for part, result in parts.items()
        for row in _rows(
            data[part],
            part_columns(part, inputs.dataset),
            result.predictions,
            inputs.task_settings.axes,
        )
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
            table_of(
                PREDICTIONS,
                "Held-out predictions",
                predicted,
                **prediction_titles(inputs.task_settings.axes),
            ),
            *positions,
        ),
        (score_table(costs, "Cost"),),
        {
            "parts": about,
            "classes": list(splits[GROUPED].scores.classes),
            "design": design._asdict(),
            "unmeasured": unmeasured,
        },
    )


def prediction_titles(axes: Sequence[str]) -> dict[str, str]:
    """Return the titles of the columns of predictions; each axis of a vector has its own columns.

    >>> list(prediction_titles(["x_m", "y_m"]))[5:9]
    ['y_true_x_m', 'y_true_y_m', 'y_pred_x_m', 'y_pred_y_m']
    """
    titles: dict[str, str] = {}
    for key, title in PREDICTION_TITLES.items():
        if axes and key in VALUES:
            titles.update({axis_column(key, axis): f"{title} {axis}" for axis in axes})
        else:
            titles[key] = title
    return titles


def position_table(inputs: Inputs, data: TaskData, columns: tuple[str, str]) -> Table:
    """Return the session and the position of each recording, for the map of a task.

    `columns` have the positions; an empty cell is a missing one. Raises NotPossibleError if a
    column does not exist, or has other cells than numbers, and if no recording has a position.
    """
    places = []
    for column in columns:
        if column not in inputs.store.columns:
            raise NotPossibleError(f"map: there is no column {column!r}; add it, or remove `map`")
        texts = column_labels(inputs.store, data, column)
        try:
            places.append(np.where(texts == "", "nan", texts).astype(float).tolist())
        except ValueError:
            raise NotPossibleError(
                f"map: column {column!r} has cells that are not numbers; correct them, or remove "
                "`map`"
            ) from None
    if np.isnan(places).any(axis=0).all():
        raise NotPossibleError(
            f"map: no recording has a position in {' and '.join(columns)}; add some, or "
            "remove `map`"
        )
    keys = ("recording", "session", "x", "y")
    names = data.name.tolist()
    sessions = data.by_session().group.tolist()
    rows = [
        dict(zip(keys, cells, strict=True)) for cells in zip(names, sessions, *places, strict=True)
    ]
    titles = dict(zip(keys, ("Recording", "Session", *columns), strict=True))
    return table_of(POSITIONS, "Positions", rows, **titles)


def design_of(inputs: Inputs, data: TaskData) -> Design:
    """Return the design of the recordings of a task."""
    sessions = data.by_session().group.tolist()
    placements = None
    if PLACEMENT_COLUMN in inputs.store.columns:
        placements = column_labels(inputs.store, data, PLACEMENT_COLUMN).tolist()
    return recording_design(data.values(), sessions, placements)


def _cost_key(model: str, part: str, inputs: Inputs) -> ScoreKey:
    """Return the key of the cost of training on a part. A placebo has its data set in the key."""
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
    result = splits[parts.training]
    known = result.predictions
    withheld = result.extra_tests[parts.withheld].predictions
    chance = overall_chance(known, withheld, inputs.task_settings.period_deg)
    key = ScoreKey(model, *part_columns(parts.overall, inputs.dataset))
    for metric, values in overall(known, withheld, inputs.task_settings.period_deg).items():
        statistics = {fold_statistic(fold): value for fold, value in enumerate(values)}
        statistics["mean"] = float(np.mean(values))
        statistics["sd"] = deviation(values)
        statistics["chance"] = float(np.mean(chance[metric]))
        for statistic, value in statistics.items():
            yield ScoreRow(metric, statistic, value, key)
    interval = overall_interval(
        known,
        withheld,
        data[parts.training].group,
        data[parts.withheld].group,
        period=inputs.task_settings.period_deg,
        seed=inputs.seed,
    )
    yield from _interval_rows(inputs, interval, key)


def _score_rows(
    inputs: Inputs, result: CrossValidation | Tested, groups: np.ndarray, key: ScoreKey
) -> Iterator[ScoreRow]:
    """Yield the scores of a part, and the interval over its `groups` (n,) of the first metric."""
    yield from fold_scores(result.scores, key)
    interval = estimate_score(result, groups, seed=inputs.seed).interval
    yield from _interval_rows(inputs, interval, key)


def _interval_rows(inputs: Inputs, interval: Interval, key: ScoreKey) -> Iterator[ScoreRow]:
    """Yield the ends of the interval over grasps of the first metric of the task."""
    metric = METRICS[inputs.task_settings.kind][0]
    for end, value in zip(GRASP_INTERVAL, interval, strict=True):
        yield ScoreRow(metric, end, value, key)


def _rows(
    data: TaskData, part: PartColumns, predictions: Predictions, axes: Sequence[str]
) -> Iterator[dict[str, Any]]:
    """Yield a row of `prediction_titles` per predicted recording."""
    row = predictions.row
    probability = predictions.probability
    columns = {
        "recording": data.name[row],
        "fold": predictions.fold,
        "probability": [None] * len(row) if probability is None else probability,
    }
    for key, values in zip(VALUES, (predictions.y_true, predictions.y_pred), strict=True):
        if axes:
            columns.update({axis_column(key, axis): values[:, i] for i, axis in enumerate(axes)})
        else:
            columns[key] = values
    for cells in zip(*columns.values(), strict=True):
        yield {**part._asdict(), **dict(zip(columns, cells, strict=True))}


EXPERIMENT = Experiment(
    BUILT_IN["cross_validation"],
    measure=measure,
    plots=shown.PLOTS,
    own_rows=shown.rows,
    own_figures=surface_maps,
    summary=shown.summary,
    advice=shown.advice,
    paper_comparison=paper_comparison,
)
