"""The columns of the table of recordings: labels, predictions, issues, and values of features."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ajgdata.browse.predictions import HeldOutPredictions
from ajgdata.browse.query import Column, NumberColumn, TextColumn
from ajgdata.browse.recordings import RecordingTable
from ajgdata.store.labels import parse_label
from ajgdata.types import DatasetSpec, Target
from ajgdata.types.session import SESSION_COLUMNS

#: Columns of `label_rows` that have another name in the table, or none.
_RENAMED = {"recording_id", "grasp_id", "placement_id", "session_id", "object", "quality"}
#: Labels that are checksums, which people do not read.
_CHECKSUM = "sha256"


def target_of(spec: DatasetSpec, task: str) -> tuple[str, Target | None]:
    """Return name and description of the target of a task; the object if there is no task."""
    if task not in spec.tasks:
        return "object", None
    name = spec.tasks[task].target
    return name, spec.targets[name]


def label_texts(recordings: RecordingTable, task: str) -> list[str]:
    """Return the class (n,) of each recording: the target of a task, else its object.

    A number is no class, so recordings of a regression have the class of their object.
    """
    name, target = target_of(recordings.spec, task)
    if target is None or target.kind != "classification":
        return recordings.texts("object")
    return ["" if text in target.missing else text for text in recordings.texts(name)]


def table_columns(
    recordings: RecordingTable, task: str, predictions: HeldOutPredictions
) -> dict[str, Column]:
    """Return the columns of all recordings by name, in the order in which they are shown.

    `label` is the target of the task. A label with the name of another column gets the prefix
    `label_`.
    """
    columns: dict[str, Column] = {"recording": TextColumn(recordings.names)}
    columns |= _prediction_columns(recordings, task, predictions)
    codes = [
        " ".join(dict.fromkeys(issue.code for issue in recordings.issues.get(name, ())))
        for name in recordings.names
    ]
    columns["issue"] = TextColumn(codes, has_words=True)
    columns["quality"] = TextColumn(recordings.texts("quality"))
    if recordings.spec.recipe is None:  # people cannot change the labels of a simulation
        columns["decision"] = TextColumn([item.state for item in recordings.decisions])
        columns["notes"] = TextColumn([item.note for item in recordings.decisions])
    columns["session"] = TextColumn(recordings.texts("session_id"))
    placements = recordings.placements()
    if any(placements):
        columns["placement"] = TextColumn(placements)
    columns["grasp"] = TextColumn(recordings.grasps())
    columns["object"] = TextColumn(recordings.texts("object"))
    for name, column in _label_columns(recordings).items():
        columns[f"label_{name}" if name in columns else name] = column
    return columns


def with_feature_columns(
    columns: Mapping[str, Column], added: Mapping[str, Column]
) -> dict[str, Column]:
    """Return the columns of recordings with those of features, which come before `wrong` and
    before the issues."""
    names = list(columns)
    place = names.index("wrong" if "wrong" in columns else "issue")
    ordered = (*names[:place], *added, *names[place:])
    both = {**columns, **added}
    return {name: both[name] for name in ordered}


def _prediction_columns(
    recordings: RecordingTable, task: str, predictions: HeldOutPredictions
) -> dict[str, Column]:
    """Return the labels of a task, and the predictions if there are any."""
    name, target = target_of(recordings.spec, task)
    if target is None:
        return {"label": TextColumn(recordings.texts(name))}
    names = recordings.names
    verdicts: dict[str, Column] = {}
    if target.kind == "classification":
        labels = label_texts(recordings, task)
        columns: dict[str, Column] = {"label": TextColumn(labels)}
        if predictions.predicted:
            predicted = [_predicted_class(predictions.predicted.get(name)) for name in names]
            wrong = [_verdict(*pair) for pair in zip(labels, predicted, strict=True)]
            columns["predicted"] = TextColumn(predicted)
            verdicts["wrong"] = TextColumn(wrong)
    else:
        axes = target.columns or (name,)
        values = np.column_stack([_numbers(recordings.texts(a), target.axis) for a in axes])
        columns = {"label": _vector_column(values, target)}
        if predictions.predicted:
            predicted_values = np.array(
                [_predicted_numbers(predictions.predicted.get(n), len(axes)) for n in names], float
            ).reshape(len(names), len(axes))
            errors = [
                predictions.error(n, row) for n, row in zip(names, values.tolist(), strict=True)
            ]
            columns["predicted"] = _vector_column(predicted_values, target)
            verdicts["error"] = NumberColumn(np.array(errors, float), target.unit)
    if predictions.confidence:
        confidence = [predictions.confidence.get(name, math.nan) for name in names]
        columns["confidence"] = NumberColumn(np.array(confidence, float))
    return columns | verdicts


def _predicted_class(value: str | float | tuple[float, ...] | None) -> str:
    """Return a predicted class; "" without one, and for a number of an earlier kind of target."""
    return value if isinstance(value, str) else ""


def _predicted_numbers(
    value: str | float | tuple[float, ...] | None, count: int
) -> tuple[float, ...]:
    """Return a prediction of `count` numbers.

    They are NaN without a prediction, and for a class or another count of an earlier target.
    """
    if isinstance(value, tuple) and len(value) == count:
        return value
    if isinstance(value, float) and count == 1:
        return (value,)
    return (math.nan,) * count


def _verdict(label: str, predicted: str) -> str:
    """Return whether a prediction is wrong; "" without a label or without a prediction."""
    if not label or not predicted:
        return ""
    return "no" if label == predicted else "yes"


def _vector_column(values: np.ndarray, target: Target) -> Column:
    """Return numbers (n, 1) as numbers, and vectors (n, k) as texts."""
    if values.shape[1] == 1:
        return NumberColumn(values[:, 0], target.unit)
    texts = ["" if np.isnan(row).any() else ", ".join(f"{v:.4g}" for v in row) for row in values]
    return TextColumn(texts)


def _numbers(texts: Sequence[str], target: Target) -> np.ndarray:
    """Return labels (n,) as numbers; a missing or wrong value is NaN."""
    numbers = []
    for text in texts:
        try:
            numbers.append(float(parse_label(text, target)))
        except ValueError:
            numbers.append(math.nan)
    return np.array(numbers, float)


def _label_columns(recordings: RecordingTable) -> dict[str, Column]:
    """Return all labels that have no column of their own, without checksums.

    Properties of sessions are included only if the sessions differ.
    """
    names = dict.fromkeys(name for row in recordings.rows for name in row)
    columns: dict[str, Column] = {}
    for name in names:
        if name in _RENAMED or _CHECKSUM in name:
            continue
        texts = recordings.texts(name)
        if name in SESSION_COLUMNS and len(set(texts)) == 1:
            continue
        target = recordings.spec.label_targets.get(name)
        if target is not None and target.kind == "regression":
            columns[name] = NumberColumn(_numbers(texts, target), target.unit)
        elif target is None and _are_numbers(texts):
            columns[name] = NumberColumn(np.array([float(t) if t else math.nan for t in texts]))
        else:
            columns[name] = TextColumn(texts)
    return columns


def _are_numbers(texts: Sequence[str]) -> bool:
    """Return whether all texts that are not empty are finite numbers, and whether there are any."""
    distinct = set(texts) - {""}
    try:
        return bool(distinct) and all(math.isfinite(float(text)) for text in distinct)
    except ValueError:
        return False


def cells(columns: Mapping[str, Column], row: int) -> dict[str, str | float | None]:
    """Return the cells of a recording by column."""
    return {name: column.cell(row) for name, column in columns.items()}
