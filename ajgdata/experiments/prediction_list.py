"""List of predictions to look at and to hear: wrong classes, or the largest errors of numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation_results import ModelResult, shown_model
from ajgdata.report.format import number, with_unit
from ajgdata.report.predictions import (
    ListedPrediction,
    MatrixCell,
    MatrixRow,
    PredictionList,
)
from ajgdata.types.browse_command import browse_command, filter_word

#: Longest list of wrong predictions, the most certain of which are listed.
MAX_WRONG = 200
#: Number of listed predictions of numbers: those with the largest errors.
LARGEST_ERRORS = 20
#: Largest number of classes of a matrix in a table.
MAX_CLASSES = 24


def prediction_list(results: TaskResults, link: Callable[[str], str]) -> PredictionList | None:
    """Return the predictions of a cross-validation that a page lists.

    The predictions are those of the model that the page is about, on held-out grasps. `link`
    returns the link to the sound of a recording, or "". A vector has no list.
    """
    model = shown_model(results)
    if results.task_settings.axes:
        return None
    if results.task_settings.kind == "classification":
        return _classes(model, link)
    return _numbers(model, link)


def _classes(model: ModelResult, link: Callable[[str], str]) -> PredictionList:
    """Return all wrong predictions of classes, and the most certain correct one of each class."""
    true, predicted = model.predictions()
    recordings = model.recordings()
    probability = model.confidence()
    wrong = np.flatnonzero(true != predicted)
    wrong = wrong[np.argsort(-probability[wrong], kind="stable")]
    name = _name(model)
    classes = model.classes
    chosen = [*wrong[:MAX_WRONG], *_clearest(true, predicted, probability)]
    rows = tuple(
        ListedPrediction(
            recordings[index],
            link(recordings[index]),
            str(true[index]),
            str(predicted[index]),
            f"{number(100 * probability[index])} %" if np.isfinite(probability[index]) else "",
            _anchor(name, classes, true[index], predicted[index]),
            bool(true[index] != predicted[index]),
        )
        for index in chosen
    )
    title = f"{len(wrong)} of {len(true)} recordings are predicted wrongly ({model.label})"
    note = "Each class also has its most certain correct prediction, for comparison."
    if len(wrong) > MAX_WRONG:
        note = f"The {MAX_WRONG} most certain wrong predictions are listed. {note}"
    command = _command(model, [filter_word("wrong", "yes")], "-confidence")
    if len(classes) > MAX_CLASSES:
        return PredictionList(name, title, note, "Probability", command, rows)
    listed = {row.pair for row in rows}
    matrix = []
    for own in classes:
        cells = []
        for other in classes:
            count = int(np.sum((true == own) & (predicted == other)))
            anchor = _anchor(name, classes, own, other)
            link_target = anchor if anchor in listed else ""
            words = [filter_word("label", own), filter_word("predicted", other)]
            cell_command = _command(model, words) if count else ""
            cells.append(MatrixCell(str(count or ""), link_target, own == other, cell_command))
        matrix.append(MatrixRow(own, tuple(cells)))
    return PredictionList(
        name, title, note, "Probability", command, rows, tuple(classes), tuple(matrix)
    )


def _clearest(true: np.ndarray, predicted: np.ndarray, probability: np.ndarray) -> list[int]:
    """Return the row of the most certain correct prediction of each class that has one."""
    rows = []
    for name in np.unique(true):
        correct = np.flatnonzero((true == name) & (predicted == name))
        if len(correct):
            certainty = np.nan_to_num(probability[correct], nan=-1.0)
            rows.append(int(correct[np.argmax(certainty)]))
    return rows


def _numbers(model: ModelResult, link: Callable[[str], str]) -> PredictionList:
    """Return the predictions of numbers with the largest errors."""
    true, predicted = model.predictions()
    recordings = model.recordings()
    unit = model.task.task_settings.unit
    error = predicted - true
    largest = np.argsort(-np.abs(error), kind="stable")[:LARGEST_ERRORS]
    name = _name(model)
    rows = tuple(
        ListedPrediction(
            recordings[index],
            link(recordings[index]),
            with_unit(number(float(true[index])), unit),
            with_unit(number(float(predicted[index])), unit),
            with_unit(f"{error[index]:+.3g}", unit),
            f"{name}-{index}",
            True,
        )
        for index in largest
    )
    title = f"The {len(rows)} largest errors of {len(true)} predictions ({model.label})"
    return PredictionList(name, title, "", "Error", _command(model, [], "-error"), rows)


def _command(model: ModelResult, words: Sequence[str], sort: str = "") -> str:
    """Return the command that shows recordings with the predictions of a model."""
    predictions = f"{model.task.task}/{model.result.model}"
    return browse_command(model.task.dataset, words, predictions=predictions, sort=sort)


def _name(model: ModelResult) -> str:
    """Return the anchor of the list of a task."""
    return f"predictions-{model.task.dataset}-{model.task.task}"


def _anchor(name: str, classes: Sequence[str], true: str, predicted: str) -> str:
    """Return the anchor of a pair of classes: their positions in the order of the model."""
    return f"{name}-{classes.index(str(true))}-{classes.index(str(predicted))}"
