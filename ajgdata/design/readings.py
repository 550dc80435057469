"""Recordings of one design -> how well each row of the paper is predicted from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ajgdata.design.recordings import Recorded
from ajgdata.design.rows import BY_NAME, Row
from ajgdata.evaluate.crossval import (
    CrossValidation,
    ExtraTestSet,
    Predictions,
    Scores,
    cross_validate,
)
from ajgdata.evaluate.task_data import TaskData, split_withheld
from ajgdata.types import Kind, NotPossibleError, Task

FOLDS = 3


@dataclass(frozen=True)
class Reading:
    """The result of one model on a row, in the row's unit.

    `chance` is the result of a model that ignores its input. `group` and `loss` (g,) are the grasps
    and their mean squared error, or share of errors, for the bootstrap.
    """

    row: str
    value: float
    chance: float
    group: tuple[str, ...]
    loss: tuple[float, ...]


def readings_of(
    dataset: str, recorded: Recorded, task: Task, model: str, rows: Iterable[str], seed: int = 0
) -> list[Reading]:
    """Return the readings of those of `rows` that are measured on `dataset`.

    Raises NotPossibleError for recordings that cannot be split.
    """
    wanted = [BY_NAME[name] for name in rows if BY_NAME[name].dataset == dataset]
    numbers = [row for row in wanted if row.unit != "%"]
    found = size_like(recorded, task, numbers, model, seed) if numbers else []
    for row in (row for row in wanted if row.unit == "%"):
        found.append(classes(recorded, row, row.model or model, seed))
    return found


def size_like(
    recorded: Recorded, task: Task, rows: Iterable[Row], model: str, seed: int
) -> list[Reading]:
    """Return readings of a number some of whose values are withheld: known by grasp and by
    recording, withheld, and under other noise, whichever of them `rows` ask for by their part."""
    withhold = [value for value in task.withhold if np.isclose(recorded.rows.value, value).any()]
    known, held = split_withheld(recorded.rows, withhold)
    extra = {"withheld": _extra(held)} if len(held.value) else {}
    if recorded.noisy is not None:
        extra["noise"] = _extra(recorded.noisy)
    by_grasp = _validated(known, "regression", model, seed, task.period_deg, extra)
    found = []
    for row in rows:
        if row.part == "copies":
            by_recording = _validated(known, "regression", model, seed, task.period_deg, alike=True)
            found.append(_error(row, known, by_recording.scores, by_recording.predictions))
        elif row.part == "known":
            found.append(_error(row, known, by_grasp.scores, by_grasp.predictions))
        elif row.part in by_grasp.extra_tests:
            tested = by_grasp.extra_tests[row.part]
            of = held if row.part == "withheld" else recorded.noisy
            assert of is not None
            found.append(_error(row, of, tested.scores, tested.predictions))
    return found


def classes(recorded: Recorded, row: Row, model: str, seed: int) -> Reading:
    """Return the reading of a class, by grasp."""
    found = _validated(recorded.rows, "classification", model, seed)
    loss = (found.predictions.y_pred != found.predictions.y_true).astype(float)
    by_group = _by_group(recorded.rows.group[found.predictions.row], loss)
    mean, chance = found.scores.mean["accuracy"], found.scores.chance["accuracy"]
    return Reading(row.name, 100 * mean, 100 * chance, *by_group)


def value_of(loss: np.ndarray, unit: str) -> np.ndarray:
    """Return root mean square errors, or accuracies in %, of losses (…, groups)."""
    mean = loss.mean(axis=-1)
    return 100 * (1 - mean) if unit == "%" else np.sqrt(mean)


def _extra(rows: TaskData) -> ExtraTestSet:
    return ExtraTestSet(rows.feature, rows.value.astype(float), rows.group)


def _validated(
    rows: TaskData,
    kind: Kind,
    model: str,
    seed: int,
    period: float | None = None,
    extra: Mapping[str, ExtraTestSet] | None = None,
    alike: bool = False,
) -> CrossValidation:
    """Cross-validate by grasps, or `alike`, by recordings."""
    if len(rows.value) < FOLDS:
        raise NotPossibleError(f"{len(rows.value)} recordings are too few")
    return cross_validate(
        rows.feature, rows.value, None if alike else rows.group, kind=kind, model=model,
        folds=FOLDS, seed=seed, period=period, extra_tests=extra,
    )  # fmt: skip


def _error(row: Row, data: TaskData, scores: Scores, found: Predictions) -> Reading:
    by_group = _by_group(data.group[found.row], np.square(found.y_pred - found.y_true))
    return Reading(row.name, scores.mean["rmse"], scores.chance["rmse"], *by_group)


def _by_group(group: np.ndarray, loss: np.ndarray) -> tuple[tuple[str, ...], tuple[float, ...]]:
    names = np.unique(group)
    means = tuple(float(loss[group == name].mean()) for name in names)
    return tuple(names.tolist()), means
