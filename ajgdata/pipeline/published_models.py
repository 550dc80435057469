"""Final models of a data set as files of its published folder, each with its description."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ajgdata.evaluate.agreement import GRASP_INTERVAL
from ajgdata.experiments.requests import requests_for
from ajgdata.experiments.scores import SCORES
from ajgdata.paths import Paths, Tree
from ajgdata.pipeline.collect import IN_UNITS
from ajgdata.pipeline.task_results import Measurement, measurements
from ajgdata.report.model_card import ModelScore, render_model_card
from ajgdata.store.features import read_store
from ajgdata.store.models import ABOUT_FILE, ESTIMATOR_FILE, GUARD_FILE, read_description
from ajgdata.store.sessions import read_dataset
from ajgdata.types import CROSS_VALIDATION, DataError, DatasetSpec
from ajgdata.types.registry import model_label

#: Files of a final model.
MODEL_FILES = (ABOUT_FILE, ESTIMATOR_FILE, GUARD_FILE)
#: Attributes of a feature file that differ if a model or a score is of other features.
_SAME_FEATURES = ("inputs_sha256", "settings_digest")


def model_files(paths: Paths, dataset: str) -> dict[str, bytes]:
    """Return the files of all final models of a data set and their descriptions, by published name.

    A model that could not be trained is left out. Raises DataError if there is no model, and if a
    model or its scores are missing or of other features than those of the feature file.
    """
    spec = read_dataset(paths, dataset)
    attrs = read_store(paths.features(dataset)).attrs
    tasks = [(dataset, task) for task in spec.tasks]
    scored, _ = measurements(paths, requests_for({dataset: spec}, tasks))
    files: dict[str, bytes] = {}
    for task, model in spec.trained_models():
        folder = paths.model(dataset, task, model)
        if not (folder / ABOUT_FILE).is_file():
            raise _outdated(folder, "is not trained yet", dataset)
        about = read_description(folder)
        if "skipped" in about:
            continue
        _check_features(folder, about["provenance"], attrs, dataset)
        measurement = scored.get((dataset, task, CROSS_VALIDATION, model))
        if measurement is None:
            raise _outdated(folder, "has no scores of cross-validation", dataset)
        where = paths.experiment(dataset, task, CROSS_VALIDATION, model)
        _check_features(where, measurement.about["provenance"], attrs, dataset)
        for file in MODEL_FILES:
            files[Tree.model(task, model, file)] = (folder / file).read_bytes()
        label = model_label(model, about["kind"])
        text = render_model_card(
            about, list(_scores(measurement)), _facts_of_dataset(spec), label, paths
        )
        files[Tree.model(task, model, Tree.README)] = text.encode()
    if not files:
        fix = "publish without --with-models, or set `final_models` and `models` of a task"
        raise DataError(paths.dataset(dataset), "has no final model", fix)
    return files


def _facts_of_dataset(spec: DatasetSpec) -> dict[str, str]:
    """Return facts of the data set that the description of a model states, by topic."""
    facts = {
        "data set": f"{spec.name}, version {spec.version}",
        "DOI": spec.doi,
        "licence": spec.licence,
    }
    return {topic: text for topic, text in facts.items() if text}


def _check_features(
    where: Path, provenance: Mapping[str, Any], attrs: Mapping[str, Any], dataset: str
) -> None:
    """Raise DataError if a result was computed with other features than the feature file."""
    if any(provenance.get(key) != attrs.get(key) for key in _SAME_FEATURES):
        raise _outdated(where, "is of other features than the feature file", dataset)


def _outdated(where: Path, problem: str, dataset: str) -> DataError:
    """Return the error of a result that a run computes."""
    return DataError(where, problem, f"run `ajgdata run {dataset}`, then publish again")


def _scores(measurement: Measurement) -> Iterator[ModelScore]:
    """Yield the scores of a cross-validation: one per split, test recordings and metric."""
    about = measurement.about
    unit = about["unit"]
    for table in measurement.tables:
        if table.name == SCORES:
            for key, values in _by_metric(table.rows).items():
                split, test_set, target_values, metric = key
                low, high = (values.get(end, math.nan) for end in GRASP_INTERVAL)
                yield ModelScore(
                    split=split,
                    test_set=test_set,
                    target_values=target_values,
                    metric=metric,
                    unit=unit if metric in IN_UNITS else "",
                    mean=values["mean"],
                    sd=values.get("sd", math.nan),
                    low=low,
                    high=high,
                    chance=values.get("chance", math.nan),
                )


def _by_metric(
    rows: Iterable[Mapping[str, Any]],
) -> dict[tuple[str, str, str, str], dict[str, float]]:
    """Return the values by statistic of each split, test set, type of values and metric.

    Rows of one class or of a comparison are left out, and values that are not defined.
    """
    found: dict[tuple[str, str, str, str], dict[str, float]] = {}
    for row in rows:
        if row["condition"] or row["comparison"] or row["value"] is None:
            continue
        key = row["split"], row["test_set"], row["target_values"], row["metric"]
        found.setdefault(key, {})[row["statistic"]] = row["value"]
    return {key: values for key, values in found.items() if "mean" in values}
