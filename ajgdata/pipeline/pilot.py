"""Held-out scores of a run with the labels of their recordings, to plan a data set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ajgdata.evaluate.parts import GROUPED, SESSION_SPLIT, TRAINING_VALUES
from ajgdata.evaluate.planning import DesignLevel, design_units, recording_scores
from ajgdata.paths import Paths
from ajgdata.store.features import open_store
from ajgdata.store.metrics import read_predictions
from ajgdata.store.sessions import read_dataset
from ajgdata.types import DataError, Kind
from ajgdata.types.session import PLACEMENT_COLUMN


class Pilot(NamedTuple):
    """Scores of n held-out recordings of one model on one task, and the units of the recordings."""

    score: np.ndarray  #: (n,), see `evaluate.planning.recording_scores`
    units: Mapping[DesignLevel, np.ndarray]  #: each (n,), see `evaluate.planning.design_units`
    kind: Kind
    unit: str  #: of the score and of a half width
    split: str  #: grouped, random or session
    groups: str  #: column whose values a grouped split holds out
    source: str  #: simulated or recorded
    file: Path  #: of the predictions
    has_placements: bool  #: whether the placement of each recording is known
    has_one_object_per_class: bool

    @property
    def summary(self) -> str:
        """Return the metric over all recordings, with its name and unit."""
        mean = float(np.mean(self.score))
        if self.kind == "classification":
            return f"accuracy {mean:.1f} %"
        return f"RMSE {2 * mean:.3g} {self.unit}".rstrip()  # the mean score is half the RMSE


def read_pilot(
    paths: Paths, dataset: str, task: str, model: str, split: str | None = None
) -> Pilot:
    """Return the held-out scores of a data set, for its recordings with training values.

    The predictions are those of the run of all data sets, or else of the only run with this data
    set. Without a `split`, they are those of held-out sessions, or else of the task's own split.
    The score of a recording that several folds predicted is the mean over these folds. Raises
    DataError if there is no such data set or task, without predictions, and if several runs of
    selected data sets have predictions.
    """
    spec = read_dataset(paths, dataset)
    if task not in spec.tasks:
        fix = f"use {', '.join(spec.tasks)}" if spec.tasks else "add it to `tasks`"
        raise DataError(paths.dataset(dataset), f"there is no task {task!r}", fix)
    settings = spec.tasks[task]
    target = spec.targets[settings.target]
    if target.columns:
        fix = "plan with a task whose target is one of its columns"
        raise DataError(paths.dataset(dataset), f"the target of {task!r} is a vector", fix)
    is_class = target.kind == "classification"

    file, all_rows = _predictions_of_run(paths, dataset)
    if not split:
        splits = {row["split"] for row in all_rows if (row["task"], row["model"]) == (task, model)}
        split = SESSION_SPLIT if SESSION_SPLIT in splits else GROUPED
    rows = _predictions_of_split(all_rows, file, task, model, split)
    value_type = str if is_class else float
    y_true = np.array([value_type(row["y_true"]) for row in rows])
    y_pred = np.array([value_type(row["y_pred"]) for row in rows])
    scores = recording_scores(y_true, y_pred, target.kind, settings.period_deg)
    names, first, member = np.unique(
        [row["recording"] for row in rows], return_index=True, return_inverse=True
    )
    score = np.bincount(member, weights=scores) / np.bincount(member)

    labels, source = _read_labels(paths, dataset, names)
    pairs = set(zip(y_true[first].tolist(), labels["object"].tolist(), strict=True))
    return Pilot(
        score=score,
        units=design_units(
            session=labels["session_id"],
            object_name=labels["object"],
            placement=labels[PLACEMENT_COLUMN],
            grasp=labels["grasp_id"],
        ),
        kind=target.kind,
        unit="%" if is_class else target.unit,
        split=split,
        groups=settings.groups,
        source=source,
        file=file,
        has_placements=bool((labels[PLACEMENT_COLUMN] != "").all()),
        has_one_object_per_class=is_class and len(pairs) == len(np.unique(y_true)),
    )


def _predictions_of_run(paths: Paths, dataset: str) -> tuple[Path, list[dict[str, str]]]:
    """Return the file with predictions for a data set, and its rows for this data set.

    The file is that of the run of all data sets, or else of a run of selected data sets. Raises
    DataError if no run has predictions for the data set, or if several runs of selected data sets
    have some.
    """
    all_rows = _rows_of(paths.predictions, dataset)
    if all_rows:
        return paths.predictions, all_rows
    selected = {}
    for file in sorted(paths.results.glob(f"runs/*/{paths.predictions.name}")):
        rows = _rows_of(file, dataset)
        if rows:
            selected[file] = rows
    if not selected:
        problem = f"there are no predictions for {dataset}"
        raise DataError(paths.predictions, problem, f"run `ajgdata run {dataset}` first")
    if len(selected) > 1:
        runs = ", ".join(file.parent.name for file in selected)
        problem = f"several runs have predictions for {dataset}: {runs}"
        fix = "run `snakemake` for all data sets, or delete the folders of outdated runs"
        raise DataError(paths.results / "runs", problem, fix)
    return next(iter(selected.items()))


def _rows_of(file: Path, dataset: str) -> list[dict[str, str]]:
    """Return the rows of a data set in a file of predictions; none if there is no file."""
    if not file.is_file():
        return []
    return [row for row in read_predictions(file) if row["dataset"] == dataset]


def _predictions_of_split(
    rows: Sequence[dict[str, str]], file: Path, task: str, model: str, split: str
) -> list[dict[str, str]]:
    """Return the rows of a task, model and split.

    Raises DataError with the existing combinations if there are no such rows.
    """
    tested = [
        row
        for row in rows
        if row["test_set"] == row["dataset"] and row["target_values"] == TRAINING_VALUES
    ]
    columns = ("task", "model", "split")
    requested = (task, model, split)
    chosen = [row for row in tested if tuple(row[name] for name in columns) == requested]
    if not chosen:
        combinations = sorted({" ".join(row[name] for name in columns) for row in tested})
        problem = f"there are no predictions of task, model and split {' '.join(requested)!r}"
        raise DataError(file, problem, f"use one of: {', '.join(combinations)}")
    return chosen


def _read_labels(
    paths: Paths, dataset: str, recordings: np.ndarray
) -> tuple[dict[str, np.ndarray], str]:
    """Return the labels (n,) of `recordings` (n,) by column, and their source.

    The labels of a missing column are "". The source is `simulated` or `recorded`. Raises DataError
    if a recording is not in the feature file.
    """
    file = paths.features(dataset)
    columns = ("session_id", "object", PLACEMENT_COLUMN, "grasp_id")
    with open_store(file) as features:
        row_of = {name: row for row, name in enumerate(features["recording"].values.tolist())}
        missing = [name for name in recordings.tolist() if name not in row_of]
        if missing:
            problem = f"has no recording {missing[0]!r}, which the run predicted"
            raise DataError(file, problem, f"run `ajgdata run {dataset}` again")
        rows = [row_of[name] for name in recordings.tolist()]
        labels = {}
        for name in columns:
            if name in features.coords:
                labels[name] = features[name].values[rows].astype(str)
            else:
                labels[name] = np.full(len(rows), "")
        return labels, str(features.attrs["source"])
