"""A small task, and results of experiments made by hand or measured on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ajgdata.experiments.base import Inputs, Other, Outcome, Result, TaskResults
from ajgdata.experiments.registry import EXPERIMENTS, load_experiment
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import FeatureColumn, FeatureRows, text_column
from ajgdata.types import Kind, TaskSettings
from ajgdata.types.registry import model_label
from ajgdata.types.table import Table

OBJECTS = ("ball", "box", "rod")


def small_store(seed: int = 0) -> FeatureRows:
    """30 grasps of three objects, two recordings each; the first bins tell the object."""
    rng = np.random.default_rng(seed)
    grasp = np.repeat(np.arange(30), 2)
    kind = grasp % 3
    feature = np.exp(rng.normal(size=(30, 60))[grasp] + 0.01 * rng.normal(size=(60, 60)))
    feature[:, :20] *= np.exp(2 * kind[:, np.newaxis] * np.linspace(-1, 1, 20))
    columns = {
        "recording": text_column([f"s/{n}" for n in range(60)]),
        "grasp_id": text_column([f"s/g{n}" for n in grasp]),
        "object": text_column([OBJECTS[k] for k in kind]),
        "size": FeatureColumn(10.0 * kind, {"units": "mm"}),
    }
    attrs = {"data_set": "d", "source": "simulated", "git_commit": "", "settings": "{}"}
    return FeatureRows(
        feature.astype(np.float32), (frequency_axis(np.arange(60.0)),), columns, attrs
    )


def small_inputs(kind: Kind = "classification", **changes) -> Inputs:
    """The object (or its size in mm) from `small_store`, five folds by grasp."""
    numeric = kind == "regression"
    settings = {
        "target": "size" if numeric else "object",
        "kind": kind,
        "unit": "mm" if numeric else "",
        "groups": "grasp_id",
        "folds": 5,
    }
    values = {"dataset": "d", "task": "t", "seed": 0, "store": small_store()}
    return Inputs(**with_task_settings({**values, **settings, **changes}))


def with_task_settings(values: Mapping) -> dict:
    """Arguments of `Inputs` or `TaskResults`: the fields of `TaskSettings` become one argument."""
    fields = TaskSettings.model_fields
    settings = TaskSettings(**{key: value for key, value in values.items() if key in fields})
    return {key: v for key, v in values.items() if key not in fields} | {"task_settings": settings}


def measured(name: str, inputs: Inputs, model: str = "", **settings) -> Outcome:
    """What an experiment measures."""
    experiment = load_experiment(name)
    return experiment.measure(inputs, experiment.spec.settings.model_validate(settings), model)


def task_results(
    name: str,
    outcomes: Mapping[str, Outcome],
    kind: Kind = "classification",
    settings: Mapping | None = None,
    **changes,
) -> TaskResults:
    """Results of an experiment by model, as a report gets them."""
    results = tuple(
        Result(
            model,
            model_label(model, kind) if model else "",
            outcome.about,
            {t.name: t for t in outcome.tables},
            {t.name: t for t in outcome.cost},
        )
        for model, outcome in outcomes.items()
    )
    values = {
        "experiment": name,
        "dataset": "size",
        "dataset_title": "Cube size",
        "task": "edge",
        "kind": kind,
        "target": "edge_mm",
        "unit": "mm" if kind == "regression" else "",
        "groups": "grasp_id",
        "folds": 5,
        "source": "simulated",
        "settings": EXPERIMENTS[name].settings.model_validate(settings or {}),
        "results": results,
        "other_sets": {n: Other(f"Gripper {n}") for n in ("b", "c")},
    } | changes
    return TaskResults(**with_task_settings(values))


def numbers(tables: Sequence[Table], **wanted) -> list[float]:
    """Values of the rows of the table of scores that have the wanted cells."""
    scores = next(table for table in tables if table.name == "scores")
    return scores.where(**wanted).numbers("value").tolist()
