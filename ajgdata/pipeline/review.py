"""`ajgdata review NAME`: recordings whose label is suspicious, the most suspicious first."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sklearn.preprocessing import StandardScaler

from ajgdata.evaluate.metrics import length, wrapped
from ajgdata.evaluate.parts import GROUPED, TRAINING_VALUES
from ajgdata.evaluate.suspicion import (
    class_outliers,
    class_predictions,
    combined,
    coordinates,
    minority_labels,
    value_outliers,
    value_suspicion,
)
from ajgdata.features import similarity
from ajgdata.paths import Paths
from ajgdata.pipeline.labelling import RecordingState, recording_states
from ajgdata.pipeline.similar_sounds import Sounds
from ajgdata.pipeline.sound_fingerprints import dataset_sounds
from ajgdata.store.features import read_store
from ajgdata.store.labels import parse_label
from ajgdata.store.metrics import read_predictions
from ajgdata.store.sessions import how_to_get_sessions, read_dataset
from ajgdata.types import DataError, DatasetSpec, Target, many
from ajgdata.types.change import OBJECT

#: Suspicion from which a part is a reason.
NOTABLE = 0.5


@dataclass(frozen=True)
class ReviewItem:
    """One recording of a review list.

    `predicted` is "" and `confidence` None without predictions; `confidence` is the mean
    probability over the models that predict `predicted`. `task` is the task with the largest
    suspicion, which is between 0 and 1.
    """

    rank: int
    recording: str
    task: str
    label: str
    predicted: str
    confidence: float | None
    suspicion: float
    reasons: tuple[str, ...]
    is_reviewed: bool


@dataclass(frozen=True)
class Review:
    """A review list, and remarks on what it is based on."""

    items: tuple[ReviewItem, ...]
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class _Predictions:
    """Held-out predictions of one model: value and probability (None: none) by recording."""

    model: str
    values: Mapping[str, tuple[str, float | None]]


@dataclass
class _Votes:
    """Suspicion (n,) of predictions, NaN without predictions, with texts for each recording.

    `phrases` are the reasons, "" for a prediction that is not suspicious.
    """

    suspicion: NDArray[np.float64]
    predicted: list[str] = field(default_factory=list)
    confidence: list[float | None] = field(default_factory=list)
    phrases: list[str] = field(default_factory=list)

    def add(self, predicted: str, confidence: float | None, phrase: str) -> None:
        """Add the texts of the next recording."""
        self.predicted.append(predicted)
        self.confidence.append(confidence)
        self.phrases.append(phrase)


@dataclass(frozen=True)
class _TaskReview:
    """Suspicion (n,) of recordings for a task, with the label, predictions and reasons of each."""

    suspicion: NDArray[np.float64]
    labels: Sequence[str] = ()
    predicted: Sequence[str] = ()
    confidence: Sequence[float | None] = ()
    reasons: Sequence[Sequence[str]] = ()


def review_list(paths: Paths, dataset: str, *, task: str = "") -> Review:
    """Return the recordings of a data set, the most suspicious first (see `evaluate.suspicion`).

    Recordings that a person accepted are at the end, and rejected recordings are omitted. Without
    a `task`, each recording has the suspicion of its most suspicious task; tasks without
    predictions are omitted if other tasks have predictions. Predictions are those of the last run
    with this data set. Raises DataError without such a task or a usable recording.
    """
    spec = read_dataset(paths, dataset)
    if task and task not in spec.tasks:
        fix = f"use {', '.join(spec.tasks)}" if spec.tasks else "add it to `tasks`"
        raise DataError(paths.dataset(dataset), f"there is no task {task!r}", fix)
    states = recording_states(paths, dataset)
    if spec.features.needs_waveform:
        sounds = dataset_sounds(paths, dataset)
        if sounds is None:
            fix = how_to_get_sessions(paths, dataset)
            if states:
                fix = f"see the reasons with `ajgdata check {dataset}`"
            raise DataError(paths.sessions(dataset), "there is no usable recording", fix)
        pairs, remarks = _similar(sounds)
    else:
        sounds = _stored_rows(paths, dataset, states)
        pairs = []
        remarks = ["near-duplicates are not searched in tables of features"]
    file, predictions = _last_predictions(paths, dataset)
    best: dict[str, tuple[float, str, int]] = {}
    reviews: dict[str, tuple[_TaskReview, list[str]]] = {}
    misfits = _remove_misfits(spec, states, predictions)
    names_of_tasks = [task] if task else [name for name in spec.tasks if predictions[name]]
    for name in names_of_tasks or spec.tasks:
        review, names = _task_review(spec, name, sounds, states, predictions[name], pairs)
        reviews[name] = review, names
        for row, recording in enumerate(names):
            candidate = (float(review.suspicion[row]), name, row)
            if recording not in best or candidate[0] > best[recording][0]:
                best[recording] = candidate
    order = sorted(best, key=lambda name: (states[name].is_reviewed, -best[name][0], name))
    items = []
    for rank, recording in enumerate(order, start=1):
        suspicion, name, row = best[recording]
        review, _ = reviews[name]
        items.append(
            ReviewItem(
                rank=rank,
                recording=recording,
                task=name,
                label=review.labels[row],
                predicted=review.predicted[row],
                confidence=review.confidence[row],
                suspicion=suspicion,
                reasons=tuple(review.reasons[row]),
                is_reviewed=states[recording].is_reviewed,
            )
        )
    used = {name: predictions[name] for name in reviews}
    omitted = [name for name in spec.tasks if name not in reviews]
    if omitted and not task:
        remarks.append(f"tasks without predictions are omitted (--task): {', '.join(omitted)}")
    return Review(tuple(items), (*_prediction_remarks(dataset, file, used, misfits), *remarks))


def _stored_rows(paths: Paths, dataset: str, states: Collection[str]) -> Sounds:
    """Return the rows of the feature file of a data set without waveforms.

    The fingerprints are the features with the standard deviation 1. `states` are the recordings
    that still exist. Raises DataError without a feature file.
    """
    file = paths.features(dataset)
    if not file.is_file():
        raise DataError(file, "does not exist yet", f"run `ajgdata run {dataset}` first")
    table = read_store(file)
    names = [str(name) for name in table.columns["recording"].values]
    rows = [row for row, name in enumerate(names) if name in states]
    if not rows:
        raise DataError(file, "has no usable recording", f"run `ajgdata run {dataset}` again")
    points = StandardScaler().fit_transform(table.flat).astype(np.float32)
    grasps = [str(name) for name in table.columns["grasp_id"].values]
    sounds = Sounds(names, grasps, [()] * len(names), points, [""] * len(names))
    return sounds.select(rows)


def _last_predictions(
    paths: Paths, dataset: str
) -> tuple[Path | None, defaultdict[str, list[_Predictions]]]:
    """Return the newest file with predictions of a data set, and its predictions by task.

    They are those of recordings in held-out groups. The file is None without predictions.
    """
    by_task: defaultdict[str, list[_Predictions]] = defaultdict(list)
    files = [paths.predictions, *paths.results.glob(f"runs/*/{paths.predictions.name}")]
    present = [file for file in files if file.is_file()]
    for file in sorted(present, key=lambda file: file.stat().st_mtime, reverse=True):
        values: defaultdict[tuple[str, str], dict[str, tuple[str, float | None]]]
        values = defaultdict(dict)
        for row in read_predictions(file):
            is_own = row["dataset"] == dataset and row["test_set"] == dataset
            if is_own and row["split"] == GROUPED and row["target_values"] == TRAINING_VALUES:
                probability = float(row["probability"]) if row["probability"] else None
                key = row["task"], row["model"]
                values[key][row["recording"]] = _predicted_text(row), probability
        if values:
            for (name, model), of_model in sorted(values.items()):
                by_task[name].append(_Predictions(model, of_model))
            return file, by_task
    return None, by_task


def _remove_misfits(
    spec: DatasetSpec,
    states: Mapping[str, RecordingState],
    predictions: dict[str, list[_Predictions]],
) -> list[str]:
    """Remove predictions that are no values of their target, and return them as `<task>/<model>`.

    The kind of a target, or its columns, can change after a run.
    """
    misfits = []
    for task, of_task in predictions.items():
        if task not in spec.tasks:
            continue
        name = spec.tasks[task].target
        target = spec.targets[name]
        labels = {state.labels.get(name, "") for state in states.values()}
        fitting = [of_model for of_model in of_task if _fits(of_model, target, labels)]
        misfits += [f"{task}/{of_model.model}" for of_model in of_task if of_model not in fitting]
        predictions[task] = fitting
    return misfits


def _fits(predictions: _Predictions, target: Target, labels: Collection[str]) -> bool:
    """Return whether a model predicts labels of a class target, or as many numbers as a target has.

    `labels` are the present labels of a class target.
    """
    texts = {text for text, _ in predictions.values.values()}
    if target.kind == "classification":
        return not texts.isdisjoint(labels)
    n_numbers = max(1, len(target.columns))
    try:
        return all(len([float(cell) for cell in text.split()]) == n_numbers for text in texts)
    except ValueError:
        return False


def _predicted_text(row: Mapping[str, str]) -> str:
    """Return the prediction in a row; the values of a vector are separated by blanks."""
    if row["y_pred"]:
        return row["y_pred"]
    return " ".join(row[name] for name in row if name.startswith("y_pred_") and row[name])


def _prediction_remarks(
    dataset: str,
    file: Path | None,
    predictions: Mapping[str, Sequence[_Predictions]],
    misfits: Sequence[str],
) -> list[str]:
    """Return remarks on the predictions that a list is based on, and on those that do not fit."""
    unused = []
    if misfits:
        unused.append(
            f"predictions that do not fit the target are not used: {', '.join(misfits)}; "
            f"`ajgdata run {dataset}` computes new ones"
        )
    models = sorted({item.model for of_task in predictions.values() for item in of_task})
    if file is None or not models:
        return [
            "no held-out predictions yet, so the list has only outliers and near-duplicates; "
            f"`ajgdata run {dataset}` adds predictions",
            *unused,
        ]
    return [f"held-out predictions of {', '.join(models)} ({file})", *unused]


def _similar(sounds: Sounds) -> tuple[list[tuple[int, int]], list[str]]:
    """Return pairs of rows of different grasps with nearly the same sound, and remarks."""
    if sounds.is_simulated:
        return [], ["near-duplicates are not searched in simulated recordings"]
    if sounds.fingerprints.shape[1] < similarity.FEWEST_BANDS:
        return [], ["near-duplicates are not searched, because the features have too few bands"]
    limit = similarity.tolerance(sounds.fingerprints, sounds.grasps)
    pairs = similarity.similar_pairs(sounds.fingerprints, sounds.copy_groups, limit)
    return list(zip(pairs.first.tolist(), pairs.second.tolist(), strict=True)), []


def _task_review(
    spec: DatasetSpec,
    task: str,
    sounds: Sounds,
    states: Mapping[str, RecordingState],
    predictions: Sequence[_Predictions],
    pairs: Sequence[tuple[int, int]],
) -> tuple[_TaskReview, list[str]]:
    """Return the suspicion of the recordings with a label of a task, and their names."""
    settings = spec.tasks[task]
    target = spec.targets[settings.target]
    columns = target.columns or (settings.target,)
    targets = [spec.label_targets[column] for column in columns]
    rows = []
    texts = []
    for row, name in enumerate(sounds.recordings):
        state = states[name]
        cells = [state.labels.get(column, "") for column in columns]
        if state.is_rejected or state.labels[OBJECT] in spec.placebo:
            continue
        if settings.classes and cells[0] not in settings.classes:
            continue
        if all(map(_has_value, cells, targets)):
            rows.append(row)
            texts.append(" ".join(cells))
    used = sounds.select(rows)
    place = {row: number for number, row in enumerate(rows)}
    used_pairs = [(place[a], place[b]) for a, b in pairs if a in place and b in place]
    if not rows:
        return _TaskReview(np.zeros(0)), []
    if target.kind == "classification":
        review = _review_classes(used, np.asarray(texts), predictions, used_pairs)
    else:
        values = np.asarray([[float(text) for text in cells.split()] for cells in texts])
        if not target.columns:
            values = values[:, 0]
        review = _review_values(
            used, texts, values, settings.period_deg, target.unit, predictions, used_pairs
        )
    return review, [*used.recordings]


def _has_value(text: str, target: Target) -> bool:
    """Return whether a cell is a value of its target, and not missing."""
    try:
        value = parse_label(text, target)
    except ValueError:
        return False
    return bool(value) if isinstance(value, str) else not math.isnan(value)


def _review_classes(
    sounds: Sounds,
    label: NDArray[np.str_],
    predictions: Sequence[_Predictions],
    pairs: Sequence[tuple[int, int]],
) -> _TaskReview:
    """Return the suspicion of class labels (n,)."""
    grasp = np.asarray(sounds.grasps)
    names = sounds.recordings
    votes = _class_votes(sounds, label, predictions)
    outlier, nearest = class_outliers(coordinates(sounds.fingerprints, grasp), label, grasp)
    contradicting: defaultdict[int, list[str]] = defaultdict(list)
    for row, other in enumerate(minority_labels(label, grasp).tolist()):
        if other >= 0:
            phrase = f"{names[other]} of the same grasp has the label {label[other]}"
            contradicting[row].append(phrase)
    for row, other in _both_ways(pairs):
        if label[row] != label[other]:
            phrase = f"nearly the same sound as {names[other]}, which is {label[other]}"
            contradicting[row].append(phrase)
    nearer = [
        f"sound unlike other {own}, similar to {n}" for n, own in zip(nearest, label, strict=True)
    ]
    reasons = _joined_reasons(votes.phrases, contradicting, outlier, nearer)
    is_contradicted = np.asarray([bool(contradicting[row]) for row in range(len(label))])
    suspicion = combined(votes.suspicion, outlier, is_contradicted)
    return _TaskReview(suspicion, label.tolist(), votes.predicted, votes.confidence, reasons)


def _joined_reasons(
    predictions: Sequence[str],
    contradicting: Mapping[int, Sequence[str]],
    outlier: NDArray[np.float64],
    outlier_phrases: Sequence[str],
) -> list[list[str]]:
    """Return the reasons of each recording: predictions, contradictions, and a notable outlier.

    `outlier` (n,) are numbers between 0 and 1, and `outlier_phrases` (n,) their descriptions.
    """
    reasons = []
    for row, phrase in enumerate(predictions):
        own = [phrase, *contradicting.get(row, ())]
        if outlier[row] > NOTABLE:
            own.append(outlier_phrases[row])
        reasons.append([text for text in own if text])
    return reasons


def _both_ways(pairs: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return each pair of rows in both orders."""
    return [*pairs, *((second, first) for first, second in pairs)]


def _class_votes(
    sounds: Sounds, label: NDArray[np.str_], predictions: Sequence[_Predictions]
) -> _Votes:
    """Return the predictions of classes of all models together."""
    names = sounds.recordings
    parts = np.full((max(1, len(predictions)), len(label)), np.nan)
    probabilities: list[defaultdict[str, list[float]]] = [defaultdict(list) for _ in names]
    has_probability = all(
        probability is not None
        for of_model in predictions
        for _, probability in of_model.values.values()
    )
    for number, of_model in enumerate(predictions):
        known = [row for row, name in enumerate(names) if name in of_model.values]
        if not known:
            continue
        of_known = [of_model.values[names[row]] for row in known]
        predicted = np.asarray([text for text, _ in of_known])
        probability = np.asarray([1.0 if p is None else p for _, p in of_known])
        parts[number, known] = class_predictions(label[known], predicted, probability)
        for row, text, p in zip(known, predicted.tolist(), probability.tolist(), strict=True):
            probabilities[row][text].append(p)
    votes = _Votes(_mean_known(parts))
    for row, of_classes in enumerate(probabilities):
        text = max(of_classes, key=lambda name: sum(of_classes[name]), default="")
        confidence = float(np.mean(of_classes[text])) if text and has_probability else None
        phrase = ""
        if text and text != label[row]:
            stated = "" if confidence is None else f" with confidence {confidence:.2f}"
            count = len(of_classes[text])
            phrase = f"predicted {text}{stated} by {count} of {many(len(predictions), 'model')}"
        votes.add(text, confidence, phrase)
    return votes


def _review_values(
    sounds: Sounds,
    texts: list[str],
    value: NDArray[np.float64],
    period: float | None,
    unit: str,
    predictions: Sequence[_Predictions],
    pairs: Sequence[tuple[int, int]],
) -> _TaskReview:
    """Return the suspicion of numbers (n,) or vectors (n, k), whose cells are `texts`."""
    names = sounds.recordings
    grasp = np.asarray(sounds.grasps)
    votes = _value_votes(sounds, value, period, unit, predictions)
    outlier, expected = value_outliers(
        coordinates(sounds.fingerprints, grasp), value, grasp, period
    )
    spread = float(np.linalg.norm(np.std(value, axis=0)))
    contradicting: defaultdict[int, list[str]] = defaultdict(list)
    for row, other in _both_ways(pairs):
        if length(wrapped(value[[row]] - value[[other]], period))[0] > spread:
            phrase = f"nearly the same sound as {names[other]}, with {texts[other]} {unit}"
            contradicting[row].append(phrase)
    similar = [f"similar sounds have {_number_text(number)} {unit}" for number in expected]
    reasons = _joined_reasons(votes.phrases, contradicting, outlier, similar)
    is_contradicted = np.asarray([bool(contradicting[row]) for row in range(len(texts))])
    suspicion = combined(votes.suspicion, outlier, is_contradicted)
    return _TaskReview(suspicion, texts, votes.predicted, votes.confidence, reasons)


def _value_votes(
    sounds: Sounds,
    value: NDArray[np.float64],
    period: float | None,
    unit: str,
    predictions: Sequence[_Predictions],
) -> _Votes:
    """Return the predictions of numbers or vectors of all models together."""
    shape = (max(1, len(predictions)), *value.shape)
    predicted = np.full(shape, np.nan)
    for number, of_model in enumerate(predictions):
        for row, name in enumerate(sounds.recordings):
            if name in of_model.values:
                cells = [float(text) for text in of_model.values[name][0].split()]
                predicted[number, row] = cells if value.ndim > 1 else cells[0]
    residuals = np.asarray([length(wrapped(rows - value, period)) for rows in predicted])
    votes = _Votes(_mean_known(np.asarray([value_suspicion(rows) for rows in residuals])))
    known = residuals[np.isfinite(residuals)]
    typical = float(np.median(known)) if len(known) else math.nan
    for row in range(len(value)):
        errors = residuals[:, row]
        text = ""
        phrase = ""
        if np.isfinite(errors).any():
            best = int(np.nanargmin(errors))
            text = _number_text(predicted[best, row])
            if votes.suspicion[row] > NOTABLE:
                phrase = (
                    f"predicted {text} {unit}: error {errors[best]:.3g} {unit}, "
                    f"typical {typical:.3g} {unit}"
                )
        votes.add(text, None, phrase)
    return votes


def _number_text(value: np.ndarray) -> str:
    """Return a number, or the numbers of a vector, with three digits."""
    return " ".join(f"{number:.3g}" for number in np.atleast_1d(value).tolist())


def _mean_known(parts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean (n,) of the known values of parts (m, n); NaN without a known value."""
    is_known = ~np.isnan(parts)
    count = is_known.sum(axis=0)
    total = np.where(is_known, parts, 0).sum(axis=0)
    return np.divide(total, count, out=np.full(parts.shape[1], np.nan), where=count > 0)


def summary_line(review: Review) -> str:
    """Return the numbers of recordings of a list."""
    reviewed = sum(item.is_reviewed for item in review.items)
    return f"{many(len(review.items), 'recording')}, {reviewed} of them accepted"
