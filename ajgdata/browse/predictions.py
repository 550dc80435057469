"""Held-out predictions of a data set, and its recordings in a plane, from the results of a run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ajgdata.evaluate.metrics import wrapped
from ajgdata.evaluate.parts import GROUPED
from ajgdata.experiments.requests import requested_experiments
from ajgdata.experiments.scores import PREDICTIONS
from ajgdata.paths import Paths
from ajgdata.store.tables import read_measurements
from ajgdata.types import CROSS_VALIDATION, DatasetSpec
from ajgdata.types.table import Table

#: Experiment with the coordinates of recordings in planes.
PROJECTIONS = "embedding_projections"


class PredictionChoice(NamedTuple):
    """Predictions that can be shown: a task and a model; the file exists."""

    task: str
    model: str
    file: Path

    @property
    def name(self) -> str:
        """The name for addresses and people."""
        return f"{self.task}/{self.model}"


@dataclass(frozen=True)
class HeldOutPredictions:
    """Held-out predictions of a model, by recording.

    A predicted class is a text, a number is the mean over the folds, and a vector is a tuple of
    numbers. `confidence` is the probability of the predicted class, for models that have one.
    """

    predicted: Mapping[str, str | float | tuple[float, ...]]
    confidence: Mapping[str, float]
    period: float | None = None

    def error(self, recording: str, truth: Sequence[float]) -> float:
        """Return the distance of a predicted number or vector to the truth; NaN without one."""
        value = self.predicted.get(recording, ())
        numbers = value if isinstance(value, tuple) else (value,)
        if isinstance(value, str) or len(numbers) != len(truth):
            return math.nan
        difference = np.subtract(numbers, truth)
        return float(np.linalg.norm(wrapped(difference, self.period)))


def prediction_choices(paths: Paths, spec: DatasetSpec) -> list[PredictionChoice]:
    """Return the tasks and models of a data set whose predictions exist, in their order."""
    choices = []
    for task in spec.tasks:
        for request in requested_experiments(spec, task):
            if request.experiment.name != CROSS_VALIDATION:
                continue
            for part in request.parts:
                file = paths.experiment(spec.name, task, CROSS_VALIDATION, part.job)
                if file.is_file():
                    choices.append(PredictionChoice(task, part.name, file))
    return choices


def read_model_predictions(choice: PredictionChoice, dataset: str) -> HeldOutPredictions:
    """Return the predictions for held-out groups of the task, also those of withheld values.

    They are empty if the task was skipped. Raises DataError for a file of another version.
    """
    for about, tables in read_measurements(choice.file):
        if about["model"] == choice.model and "skipped" not in about:
            table = next(table for table in tables if table.name == PREDICTIONS)
            own = table.where(split=GROUPED, test_set=dataset)
            return _by_recording(own, about.get("period_deg"))
    return HeldOutPredictions({}, {})


def _by_recording(table: Table, period: float | None) -> HeldOutPredictions:
    """Return the predictions of a table, one per recording."""
    axes = [c.key for c in table.columns if c.key.startswith("y_pred_")] or ["y_pred"]
    values: dict[str, list[Any]] = {}
    confidence: dict[str, float] = {}
    for row in table.rows:
        name = row["recording"]
        predicted = [row[axis] for axis in axes]
        values.setdefault(name, []).append(predicted)
        if row["probability"] is not None:
            confidence.setdefault(name, row["probability"])
    return HeldOutPredictions(
        {name: _one(folds, period) for name, folds in values.items()}, confidence, period
    )


def _one(folds: Sequence[Sequence[Any]], period: float | None) -> str | float | tuple[float, ...]:
    """Return the prediction of a recording from those of its folds.

    Only recordings with withheld values have several folds. A class and an angle are those of the
    first fold.
    """
    first = folds[0]
    if isinstance(first[0], str):
        return first[0]
    mean = first if period else np.mean(np.array(folds, float), axis=0).tolist()
    return float(mean[0]) if len(mean) == 1 else tuple(map(float, mean))


class EmbeddingPlane(NamedTuple):
    """Coordinates of recordings in two dimensions, by recording."""

    title: str
    points: Mapping[str, tuple[float, float]]


def read_planes(paths: Paths, spec: DatasetSpec) -> dict[str, EmbeddingPlane]:
    """Return the planes of the embeddings of a data set that a run computed, by name.

    Planes of embeddings come before those of features. Raises DataError for a file of another
    version.
    """
    planes = {}
    for embedding in spec.embeddings:
        for request in requested_experiments(spec, embedding):
            if request.experiment.name != PROJECTIONS:
                continue
            file = paths.experiment(*request.jobs[0])
            if not file.is_file():
                continue
            for about, tables in read_measurements(file):
                if "skipped" not in about:
                    planes.update(_planes(embedding, {table.name: table for table in tables}))
    return dict(sorted(planes.items(), key=lambda item: "raw" in item[0]))


def _planes(embedding: str, tables: Mapping[str, Table]) -> dict[str, EmbeddingPlane]:
    """Return the planes of one embedding."""
    recordings = tables["recordings"].column("recording")
    planes = {}
    for space, methods in tables["points"].split_by("space").items():
        for method, plane in methods.split_by("method").items():
            points = zip(plane.column("x"), plane.column("y"), strict=True)
            title = f"{embedding}, {'features' if space == 'raw' else 'embedding'}, {method}"
            name = f"{embedding}-{space}-{method}"
            planes[name] = EmbeddingPlane(title, dict(zip(recordings, points, strict=True)))
    return planes
