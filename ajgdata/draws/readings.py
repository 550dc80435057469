"""Recordings of one gripper -> how well each row of the paper is read from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ajgdata.draws.recordings import Recorded
from ajgdata.draws.rows import BY_NAME, CHEAP, CNN, NEIGHBOURS, Row
from ajgdata.evaluate.crossval import (
    CrossValidation,
    ExtraTestSet,
    Predictions,
    Scores,
    cross_validate,
)
from ajgdata.evaluate.energy import RelativeEnergy, band_energy, relative_energies
from ajgdata.evaluate.task_data import TaskData, split_withheld
from ajgdata.types import Kind, NotPossibleError, Task

FOLDS = 3
#: What a medium's energy counts in; as the data set media declares it.
MEDIA_BAND_HZ = (100.0, 12_000.0)


@dataclass(frozen=True)
class Reading:
    """A row as a model reads it, in the row's unit.

    `sd` is the standard deviation over folds, or the standard error over grasps if that is greater
    (of energies the deviation over grasps), NaN of one; `chance` the value of a model that ignores
    its input; `step` what one recording more or less changes. `group` and `loss` (g,) are the
    grasps and their mean squared error, or share of errors, for the bootstrap; empty for energies.
    """

    row: str
    model: str
    value: float
    sd: float
    chance: float
    step: float
    group: tuple[str, ...] = ()
    loss: tuple[float, ...] = ()


def models_for(quick: bool) -> tuple[str, ...]:
    """Return the models that read every row; k-NN reads that of its own, too."""
    return (CHEAP,) if quick else (CNN, CHEAP)


def size_like(
    recorded: Recorded, task: Task, rows: tuple[Row, ...], model: str, seed: int
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
            found.append(_error(row, model, known, by_recording.scores, by_recording.predictions))
        elif row.part == "known":
            found.append(_error(row, model, known, by_grasp.scores, by_grasp.predictions))
        elif row.part in by_grasp.extra_tests:
            tested = by_grasp.extra_tests[row.part]
            of = held if row.part == "withheld" else recorded.noisy
            assert of is not None
            found.append(_error(row, model, of, tested.scores, tested.predictions))
    return found


def classes(recorded: Recorded, row: Row, model: str, seed: int) -> list[Reading]:
    """Return the reading of a class, by grasp."""
    found = _validated(recorded.rows, "classification", model, seed)
    loss = (found.predictions.y_pred != found.predictions.y_true).astype(float)
    scores = found.scores
    tested = len(recorded.rows.value) / scores.folds
    by_group = _by_group(recorded.rows.group[found.predictions.row], loss)
    spread = max(scores.sd["accuracy"], _standard_error(by_group[1]))
    return [
        Reading(
            row.name, model, 100 * scores.mean["accuracy"], 100 * spread,
            100 * scores.chance["accuracy"], 100 / tested, *by_group,
        )
    ]  # fmt: skip


def energies(recorded: Recorded, rows: tuple[Row, ...]) -> list[Reading]:
    """Return how much energy coffee loses against air, and that of metal against plastic, in %."""
    energy = band_energy(recorded.rows.feature, recorded.frequency_hz, MEDIA_BAND_HZ)

    def against(reference: str, label: str) -> RelativeEnergy:
        found = relative_energies(
            energy, recorded.variant, recorded.rows.group, recorded.held, reference
        )
        return next(one for one in found if one.label == label)

    readings = []
    for row in rows:
        base = "air" if row.part == "coffee" else "plastic"
        one = against(base, row.part)
        value = 100 * (1 - one.mean if row.part == "coffee" else one.mean)
        readings.append(Reading(row.name, "", value, 100 * one.sd, float("nan"), 0.0))
    return readings


def readings_of(
    dataset: str,
    recorded: Recorded,
    task: Task,
    models: tuple[str, ...],
    seed: int = 0,
    wanted: Iterable[str] = BY_NAME,
) -> list[Reading]:
    """Return the readings of all rows of a data set by `models`.

    Raises NotPossibleError for recordings that cannot be split.
    """
    rows = tuple(BY_NAME[name] for name in wanted if BY_NAME[name].dataset == dataset)
    if dataset == "media":
        return energies(recorded, rows)
    found: list[Reading] = []
    numbers = tuple(row for row in rows if row.unit != "%")
    for model in models if numbers else ():
        found += size_like(recorded, task, numbers, model, seed)
    for row in (row for row in rows if row.unit == "%"):
        for model in (row.model,) if row.model == NEIGHBOURS else models:
            found += classes(recorded, row, model, seed)
    return found


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


def _error(row: Row, model: str, data: TaskData, scores: Scores, found: Predictions) -> Reading:
    by_group = _by_group(data.group[found.row], np.square(found.y_pred - found.y_true))
    value = scores.mean["rmse"]
    # That of a root is half that of the mean, both relative.
    of_grasps = _standard_error(by_group[1]) / (2 * value) if value else 0.0
    spread = max(scores.sd["rmse"], of_grasps)
    return Reading(row.name, model, value, spread, scores.chance["rmse"], 0.0, *by_group)


def _standard_error(loss: tuple[float, ...]) -> float:
    return float(np.std(loss, ddof=1) / np.sqrt(len(loss))) if len(loss) > 1 else 0.0


def _by_group(group: np.ndarray, loss: np.ndarray) -> tuple[tuple[str, ...], tuple[float, ...]]:
    names = np.unique(group)
    means = tuple(float(loss[group == name].mean()) for name in names)
    return tuple(names.tolist()), means
