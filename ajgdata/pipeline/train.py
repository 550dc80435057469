"""Feature file -> trained models of tasks, for new recordings, and encoders of embeddings."""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from shutil import copytree
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from ajgdata.evaluate.embedding_data import (
    EmbeddingData,
    embedding_data,
    fold_of,
    train_on,
    validation_folds,
)
from ajgdata.evaluate.in_use import calibration
from ajgdata.evaluate.novelty import NoveltyGuard
from ajgdata.evaluate.splits import Folds
from ajgdata.evaluate.task_data import (
    TaskData,
    frequent_classes,
    grasps_of,
    labels_of,
    task_data,
)
from ajgdata.models import chosen, fit_named_model
from ajgdata.models.device import device_facts
from ajgdata.store.features import FeatureRows, Latents, read_store, write_latents
from ajgdata.store.files import json_bytes, read_json, write_bytes
from ajgdata.store.models import ABOUT_FILE, write_about, write_estimator, write_guard
from ajgdata.store.tables import plain
from ajgdata.types import (
    MODELS,
    Embedding,
    Kind,
    NotPossibleError,
    TaskTraining,
    TrainingSettings,
)


def train_models(
    store: Path, *, tasks: Mapping[str, TaskTraining], seed: int, folder: Path
) -> None:
    """Fit every model of every task, see `DatasetSpec.trainings`, and write each into
    `folder`/task/model. Tasks with equal settings share a training."""
    table = read_store(store)
    trained: dict[tuple[str, str], Path] = {}
    pairs = [(task, model) for task, training in tasks.items() for model in training.models]
    for task, model in pairs:
        print(f"{task}: {model}")
        settings = tasks[task].settings
        own = folder / task / model
        key = settings.model_dump_json(), model
        if key in trained:
            copytree(trained[key], own)
            write_about(own, read_json(own / ABOUT_FILE) | {"task": task})
        else:
            train_model(table, settings, task=task, model=model, seed=seed, folder=own)
            trained[key] = own


def train_model(
    table: FeatureRows,
    settings: TrainingSettings,
    *,
    model: str,
    seed: int,
    folder: Path,
    task: str = "",
) -> None:
    """Fit `model` on all recordings of `table` that have the target and write it into `folder`,
    with its calibration and the arrays that a predictor needs.

    If the model cannot be trained, the reason is written instead; if it cannot be calibrated, the
    model is written with the reason.
    """
    about: dict[str, Any] = {
        "target": settings.target,
        "kind": settings.kind,
        "unit": settings.unit,
        "model": model,
        "period": settings.period_deg,
        "seed": seed,
        "task": task,
        "provenance": dict(table.attrs),
        **device_facts(),
    }
    classes: Sequence[str] = settings.classes
    try:
        if settings.min_groups:
            classes, _ = frequent_classes(
                table,
                settings.target,
                settings.groups,
                classes,
                settings.min_groups,
                settings.placebo_objects,
            )
        data = task_data(
            table,
            settings.target,
            settings.kind,
            settings.groups,
            classes,
            settings.placebo_objects,
        )
        about |= _train(table, data, about, folder)
    except NotPossibleError as error:
        about["skipped"] = str(error)
    write_about(folder, plain(about))


def _train(
    table: FeatureRows,
    data: TaskData,
    about: Mapping[str, Any],
    folder: Path,
) -> dict[str, Any]:
    """Train and calibrate the model that `about` describes, and write its arrays into `folder`.

    Returns the rest of its description. Raises NotPossibleError if it cannot be trained.
    """
    model, kind, seed = about["model"], about["kind"], about["seed"]
    options: dict[str, Any] = {"seed": seed, "period": about["period"]}
    arrays, grasp = (data.feature, data.value, data.group), grasps_of(table, data)
    with threadpool_limits(limits=1):
        estimator, choice = chosen(fit_named_model(model, kind, *arrays, **options))
        objects = labels_of(table, data, "object")
        calibrated = calibration(*arrays, grasp, model=model, kind=kind, objects=objects, **options)
    description = json.loads(str(table.attrs["settings"]))  # audio and features
    description |= {"recordings": len(data.name), "frequency_hz": table.frequency_hz}
    description["classes"] = np.unique(data.value).tolist() if kind == "classification" else []
    description["calibration"] = calibrated.plain()
    description |= {"tuning": choice} if choice else {}
    used = min(MODELS[model].most_recordings, len(data.name))
    description |= {"trained_on": used} if used < len(data.name) else {}
    write_guard(folder, _guard_arrays(table, about["target"], kind, data, grasp, objects))
    write_estimator(folder, estimator)
    return description


def _guard_arrays(
    table: FeatureRows,
    target: str,
    kind: Kind,
    data: TaskData,
    grasp: np.ndarray,
    objects: np.ndarray,
) -> dict[str, np.ndarray]:
    """Return the arrays of the guard by name; references are recordings of no object that have no
    value of the target either: if an empty gripper is a class, there are no references."""
    values = table.columns[target].values
    missing = ~np.isfinite(values) if kind == "regression" else values == ""
    empty = missing & (table.columns["object"].values == "")
    guard = NoveltyGuard.of(data.feature, grasp, objects).with_references(table.feature[empty])
    names = [field.name for field in dataclasses.fields(guard)]
    return {name: getattr(guard, name) for name in names if not name.endswith("threshold")}


def train_embedding(
    store: Path, *, settings: Embedding, seed: int, latents: Path, cost: Path
) -> None:
    """Train an encoder for each dimension, fold and initialisation, and write the latents of every
    recording by each; apart from that (`cost`) what the training took.

    If training is impossible, for instance because objects were grasped once, the reason is written
    instead.
    """
    table = read_store(store)
    text = json.dumps(settings.model_dump(mode="json"), sort_keys=True)
    attrs: dict[str, str | float | int] = {**table.attrs, "embedding": text, "seed": seed}
    attrs |= device_facts()
    spent: dict[str, Any] = {}
    try:
        data = embedding_data(table, settings)
        folds = validation_folds(data, settings, seed)
        wall, cpu = time.perf_counter(), time.process_time()
        latent, encoding = _latents(data, folds, settings, seed)
    except NotPossibleError as error:
        skipped = {**attrs, "skipped": str(error)}
        write_latents(latents, Latents({}, np.zeros(0, np.int32), {}, skipped))
    else:
        spent = {
            "networks": len(folds) * len(settings.dimensions) * settings.inits,
            "wall_s": time.perf_counter() - wall,
            "cpu_s": time.process_time() - cpu - sum(encoding),
            "encode_s_per_recording": float(np.median(encoding)) / len(data.feature),
        }
        write_latents(latents, Latents(latent, fold_of(folds), data.columns, attrs))
    write_bytes(cost, json_bytes(spent))


def _latents(
    data: EmbeddingData, folds: Folds, settings: Embedding, seed: int
) -> tuple[dict[int, np.ndarray], list[float]]:
    """Return latents (fold, init, n, d) of all recordings by dimension, and the CPU time in s that
    each network took to encode them."""
    shape, encoding = (len(folds), settings.inits, len(data.feature)), []
    latent = {d: np.empty((*shape, d), np.float32) for d in settings.dimensions}
    for fold, (train, _) in enumerate(folds):
        for init in range(settings.inits):
            encoders = train_on(data, train, settings, settings.dimensions, (seed, fold, init))
            for dimension, encoder in zip(settings.dimensions, encoders, strict=True):
                began = time.process_time()
                latent[dimension][fold, init] = encoder.encode(data.feature)
                encoding.append(time.process_time() - began)
    return latent, encoding
