"""Feature store -> a model trained on every recording of a task, for use on new ones."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.evaluate.task_data import TaskData, frequent_classes, task_data
from ajgdata.pipeline.progress import progress_lines
from ajgdata.store.features import Shard, read_store
from ajgdata.store.models import write_about, write_estimator, write_guard, write_network
from ajgdata.store.tables import plain
from ajgdata.types import Kind, NotPossibleError


def train_models(
    store: Path,
    *,
    tasks: Mapping[str, Mapping[str, Any]],
    seed: int,
    folder: Path,
) -> None:
    """Fit every model of every task, see `DatasetSpec.trainings`, and write each into
    `folder`/task/model."""
    shard = read_store(store)
    pairs = [(task, model) for task, declared in tasks.items() for model in declared["models"]]
    advance = progress_lines(f"models of {store.stem}", parts=4)(len(pairs))
    for task, model in pairs:
        print(f"{task}: {model}")
        settings = tasks[task]["settings"]
        train_from_shard(
            shard, **settings, task=task, model=model, seed=seed, folder=folder / task / model
        )
        advance()


def train_model(store: Path, **settings: Any) -> None:
    """Fit one model; `settings` are those of `train_from_shard`."""
    train_from_shard(read_store(store), **settings)


def train_from_shard(
    shard: Shard,
    *,
    target: str,
    kind: Kind,
    unit: str,
    groups: str,
    model: str,
    seed: int,
    folder: Path,
    classes: Sequence[str] = (),
    min_groups: int = 0,
    period_deg: float | None = None,
    most_recordings: Mapping[str, int] | None = None,
    task: str = "",
) -> None:
    """Fit `model` on all recordings of `shard` that have `target` and write it into `folder`, with
    its calibration and what a predictor needs beside.

    How well it will do on new recordings is what the evaluation says, not its fit to these. A model
    that cannot be trained is written as such with the reason; one that cannot be calibrated is
    written whole, and says why.
    """
    from threadpoolctl import threadpool_limits

    from ajgdata.evaluate.in_use import calibration
    from ajgdata.models import chosen, fit_named_model, make_model, network_state
    from ajgdata.models.limits import most_recordings as limit_of

    about: dict[str, Any] = {"target": target, "kind": kind, "unit": unit, "model": model}
    about |= {"period": period_deg, "seed": seed, "task": task, "provenance": dict(shard.attrs)}
    try:
        make_model(model, kind, seed, period_deg)
    except ValueError as error:  # of another package's model, which cannot be imported
        write_about(folder, {**about, "skipped": str(error)})
        return
    try:
        if min_groups:
            classes, _ = frequent_classes(shard, target, groups, classes, min_groups)
        data = task_data(shard, target, kind, groups, classes)
        most = limit_of(model, limits := most_recordings or {})
        used = len(data.name) if most is None else min(most, len(data.name))
        with threadpool_limits(limits=1):
            fitted = fit_named_model(
                model, kind, data.feature, data.value, data.group,
                seed=seed, period=period_deg, limits=limits,
            )  # fmt: skip
            estimator, choice = chosen(fitted)
            found = calibration(
                data.feature, data.value, data.group, grasp := _grasps(shard, data),
                model=model, kind=kind, objects=_column(shard, data, "object"), seed=seed,
                period=period_deg, limits=limits,
            )  # fmt: skip
    except NotPossibleError as error:
        write_about(folder, {**about, "skipped": str(error)})
        return
    about |= json.loads(str(shard.attrs["settings"]))  # audio and features
    about |= {"recordings": len(data.name), "frequency_hz": shard.frequency_hz}
    about |= {"classes": np.unique(data.value).tolist() if kind == "classification" else []}
    about |= {"calibration": found.plain()}
    about |= {"tuning": choice} if choice else {}
    about |= {"trained_on": used} if used < len(data.name) else {}
    write_guard(folder, _guarding(shard, target, kind, data, grasp))
    if state := network_state(estimator):
        arrays, about["network"] = state
        write_network(folder, arrays)
    else:
        write_estimator(folder, estimator)
    write_about(folder, plain(about))


def _grasps(shard: Shard, data: TaskData) -> np.ndarray:
    """Return the grasp (n,) of each recording of a task; never the same in two groups."""
    grasp = _column(shard, data, "grasp_id")
    return np.array([f"{a}\n{b}" for a, b in zip(data.group, grasp, strict=True)])


def _column(shard: Shard, data: TaskData, name: str) -> np.ndarray:
    """Return the text (n,) in a column of the recordings of a task."""
    chosen = np.isin(shard.columns["recording"].values, data.name)
    return shard.columns[name].values[chosen].astype(str)


def _guarding(
    shard: Shard, target: str, kind: Kind, data: TaskData, grasp: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the arrays of the guard by name; references are recordings of no object that have no
    value of the target either: where nothing is a class, it is none of them."""
    from ajgdata.evaluate.novelty import Guard

    values = shard.columns[target].values
    missing = ~np.isfinite(values) if kind == "regression" else values == ""
    empty = missing & (shard.columns["object"].values == "")
    guard = Guard.of(data.feature, grasp).with_references(shard.feature[empty])
    fields = [field.name for field in dataclasses.fields(guard) if field.name != "threshold"]
    return {name: getattr(guard, name) for name in fields}
